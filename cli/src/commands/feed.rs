//! `feed`: a sequence of pictures to a co-processor, and what it answers.
mod line;
mod mavlink;
mod session;

use crate::{
    commands::progress,
    commands::results,
    commands::slam::{Inputs, add_truth, new_run},
    outputs::Outputs,
    sequence::Sequence,
};
use clap::Args;
use line::Line;
use mavlink::Mavlink;
use monorange_core::{
    geometry::Pose,
    pipeline::{Carrier, Config},
    slam::{Decision, Health, Outcome},
};
use monorange_formats::{
    Error, Result,
    files::{MapPoint, Stamped},
    report::{OUTPUTS, Observation, Run},
};
use monorange_protocol::{
    client::Answer,
    conversion,
    message::{self, Attitude},
};
use nalgebra::{Matrix2, Matrix3, Vector2};
use session::{Failure, Saved, Session};
use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

/// Plays a sequence to a co-processor and collects what it answers, in the same files as `slam`.
///
/// The device gets the rig's settings, the odometry and the pictures; pose, map and observations are its own. Now and then its
/// state is asked for: when the line is lost or the device restarts, that state is given back and the pictures since then are
/// played again, so that the files are those of a run without the interruption. Start an emulated device with
/// `cargo xtask firmware run`.
#[derive(Args, Debug)]
#[command(after_help = "\
Example, with `cargo xtask firmware run` in another terminal:
  monorange simulate --scene corridor --frames 30 --out corridor-30
  monorange feed --rig corridor-30/rig.toml --frames corridor-30/frames \\
    --odometry corridor-30/odometry.csv --unix target/firmware.sock --out corridor-30/feed")]
pub struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    line: Line,
    /// Send what comes of each picture to a flight controller or a ground station as MAVLink 2: ODOMETRY with covariance, and
    /// DISTANCE_SENSOR (straight ahead) and OBSTACLE_DISTANCE from the virtual scan of the same picture, made on this computer.
    #[arg(long, value_name = "udp:HOST:PORT")]
    mavlink: Option<mavlink::Address>,
    /// Frames between two states that are kept for a resumption.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..))]
    save_every: u16,
    /// Give up when nothing has come of the device for so long, s.
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    patience: f64,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "monorange-feed")]
    out: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When a file is missing, malformed or does not fit the others, the device refuses the configuration or does not answer, or
/// nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.inputs.only_one();
    let patience =
        Duration::try_from_secs_f64(arguments.patience).ok().filter(|patience| !patience.is_zero());
    let patience =
        patience.ok_or_else(|| Error::new("--patience is no time").help("give seconds above 0"))?;
    let (rig, sequence) = arguments.inputs.read()?;
    check_settings(&rig.settings).map_err(|error| error.at(arguments.inputs.rig_place()))?;
    if sequence.odometry.is_none() {
        eprintln!("warning: without --odometry the device takes the robot to stand still");
    }
    let mut outputs = Outputs::of_a_run(&arguments.out, &OUTPUTS, "report.json")?;
    let mut drive = Drive {
        sequence: &sequence,
        session: Session::new(&arguments.line, &rig, patience),
        run: new_run(&arguments.inputs, &rig, &sequence),
        health: Health::default(),
        gate: rig.settings.filter.gate_nis[1],
        start: sequence.times.first().copied().unwrap_or_default(),
        mavlink: arguments.mavlink.as_ref().map(|address| Mavlink::new(address, &rig)).transpose()?,
    };
    drive.all_frames(usize::from(arguments.save_every), patience)?;
    let Drive { mut run, health, start, .. } = drive;
    run.stages.clear(); // the device's times are not the host's
    run.verdict = health.verdict();
    run.reason = health.reason();
    run.mean_nis = health.mean_nis();
    add_truth(&mut run, &arguments.inputs, &sequence, start, None)?;
    results::write(&mut outputs, &mut run)?;
    outputs.commit()?;
    results::print(&run, &arguments.out, arguments.json)
}

/// What `slam` does with the rig must be what the device does with it.
fn check_settings(settings: &Config) -> Result<()> {
    let told = conversion::config_from_message(&conversion::message_from_config(settings, session::ANSWERS));
    match settings.carrier == Carrier::Map && told.is_ok_and(|told| told == *settings) {
        true => Ok(()),
        false => Err(Error::new("the rig has a setting that a co-processor cannot be told")
            .help("it associates in the map: leave `carrier` at \"map\" under [association]")),
    }
}

/// The device on its way through the sequence, and what it has answered.
struct Drive<'a> {
    sequence: &'a Sequence,
    session: Session<'a>,
    run: Run,
    health: Health<f32>,
    gate: f32,
    /// Time of the first frame: the device's clock begins there.
    start: f64,
    /// Whom else it is told.
    mavlink: Option<Mavlink>,
}

/// How far the drive was when the device's state was saved.
struct Mark {
    frame: usize,
    used: usize,
    observations: usize,
    left_out: usize,
    health: Health<f32>,
    reached: f64,
    state: Option<Saved>,
}

impl Drive<'_> {
    fn all_frames(&mut self, save_every: usize, patience: Duration) -> Result<()> {
        let frames = self.sequence.images.len();
        let bar = progress::bar(frames, "frames");
        let mut mark = self.mark(0, self.start, None);
        let (mut next, mut reached, mut farthest) = (0, self.start, 0);
        let mut advanced = Instant::now();
        let mut said = String::new();
        loop {
            match self.advance(next, frames, save_every, &mut reached, &mut mark) {
                Ok(()) if next == frames => break,
                Ok(()) => next += 1,
                Err(Failure::Refused(error)) => return Err(error),
                Err(Failure::Line(error)) => {
                    // Once for each cause: a device that is not there is not there five times a second.
                    let words = format!("{}: {error}; again from frame {}", self.session.line(), mark.frame);
                    if said != words {
                        bar.suspend(|| eprintln!("warning: {words}"));
                        said = words;
                    }
                    if advanced.elapsed() > patience {
                        let line = self.session.line();
                        return Err(Error::new(format!("{line}: {error}"))
                            .help("check that the device runs and that nothing else uses its line"));
                    }
                    std::thread::sleep(Duration::from_millis(200));
                    self.back_to(&mark);
                    (next, reached) = (mark.frame, mark.reached);
                }
            }
            if next > farthest {
                (farthest, advanced) = (next, Instant::now());
            }
            bar.set_position(next as u64);
        }
        bar.finish_and_clear();
        if self.run.trajectory.is_empty() {
            return Err(
                Error::new("none of the pictures could be read").help("give PNG, JPEG or PNM pictures")
            );
        }
        Ok(())
    }

    /// Plays a frame, or asks for the map after the last one; saves the state before every `save_every`th frame.
    fn advance(
        &mut self,
        frame: usize,
        frames: usize,
        save_every: usize,
        reached: &mut f64,
        mark: &mut Mark,
    ) -> std::result::Result<(), Failure> {
        self.session.connect(mark.state.as_ref())?;
        if frame == frames {
            self.run.map = map_points(&self.session.map()?, self.start);
            return Ok(());
        }
        if frame == mark.frame + save_every {
            let state = self.session.save()?;
            *mark = self.mark(frame, *reached, Some(state));
        }
        self.frame(frame, reached)
    }

    fn mark(&self, frame: usize, reached: f64, state: Option<Saved>) -> Mark {
        Mark {
            frame,
            used: self.run.trajectory.len(),
            observations: self.run.observations.len(),
            left_out: self.run.left_out.len(),
            health: self.health,
            reached,
            state,
        }
    }

    fn back_to(&mut self, mark: &Mark) {
        self.run.trajectory.truncate(mark.used);
        self.run.frames_used = mark.used;
        self.run.observations.truncate(mark.observations);
        self.run.left_out.truncate(mark.left_out);
        self.health = mark.health;
    }

    /// Plays one frame with the motion before it.
    fn frame(&mut self, frame: usize, reached: &mut f64) -> std::result::Result<(), Failure> {
        let (Some(image), Some(time)) = (self.sequence.images.get(frame), self.sequence.times.get(frame))
        else {
            return Ok(());
        };
        let picture = match image.read() {
            Ok(picture) => picture,
            Err(error) => {
                self.run.left_out.push(error.to_string().lines().next().unwrap_or_default().to_owned());
                return Ok(());
            }
        };
        let controls = self.sequence.odometry.as_ref().map(|odometry| odometry.between(*reached, *time));
        let motion = controls.unwrap_or_default().into_iter().map(|control| {
            *reached += control.duration;
            conversion::message_from_odometry(
                &control.reading(),
                conversion::us_from_seconds(*reached - self.start),
            )
        });
        let motion: Vec<_> = motion.collect();
        *reached = *time;
        let time_us = conversion::us_from_seconds(time - self.start);
        let lean = self.sequence.lean(*time).map(|[pitch, roll, std]| Attitude { pitch, roll, std });
        let answer = self.session.frame(frame as u32, time_us, (&motion, lean), &picture)?;
        self.note(frame, *time, &answer);
        if let (Some(mavlink), Some(pose)) = (&mut self.mavlink, &answer.pose) {
            let told = mavlink.frame(frame, *time, pose, &picture, self.sequence.odometry.as_ref());
            told.map_err(|error| Failure::Refused(error.at(image.name())))?;
        }
        Ok(())
    }

    fn note(&mut self, frame: usize, time: f64, answer: &Answer) {
        let Some(pose) = answer.pose else { return };
        if pose.predicted_only {
            self.run
                .left_out
                .push(format!("frame {frame} came incomplete over the line: its pose is predicted only"));
        }
        let [x, y] = pose.position.map(f64::from);
        let [xx, xy, xh, yy, yh, hh] = pose.covariance.map(f64::from);
        let covariance = Some(Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh));
        self.run.frames_used += 1;
        self.run.trajectory.push(Stamped {
            time,
            pose: Pose { x, y, heading: pose.heading.into() },
            covariance,
        });
        for seen in &answer.observations {
            let decision = Decision::from(seen.decision);
            let outcome =
                Outcome { decision, nis: seen.nis, dof: 2, landmark: seen.landmark, ..Outcome::default() };
            self.health.note(&outcome, self.gate);
            self.run.observations.push(Observation {
                time,
                frame,
                pixel: Some(seen.pixel.into()),
                pixel_covariance: None,
                range: Some(seen.range),
                bearing: Some(seen.bearing),
                landmark: seen.landmark,
                decision,
                nis: seen.nis,
            });
        }
    }
}

/// The confirmed landmarks of a device whose clock began at `start`.
fn map_points(map: &[message::Landmark], start: f64) -> Vec<MapPoint> {
    let confirmed = map.iter().filter(|landmark| landmark.confirmed);
    let point = |landmark: &message::Landmark| {
        let [x, y] = landmark.position.map(f64::from);
        let [xx, xy, yy] = landmark.covariance.map(f64::from);
        let times = [landmark.first_us, landmark.last_us];
        MapPoint {
            id: landmark.id.into(),
            position: Vector2::new(x, y),
            covariance: Some(Matrix2::new(xx, xy, xy, yy)),
            seen: landmark.seen.into(),
            first_and_last: Some(times.map(|time| conversion::seconds_from_us(time) + start)),
        }
    };
    confirmed.map(point).collect()
}
