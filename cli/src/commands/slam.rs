//! `slam`: a sequence of pictures → trajectory, map, and a report about both.
use crate::{
    Error, Result,
    commands::{progress, results},
    draw::{GREEN, LegendItem, Mark, ORANGE, Overlay, SKY, Shape, VERMILLION},
    evaluation::{Align, Truth, trajectory_errors},
    files::{self, Control, MapPoint, Odometry, Outputs, Rig, Stamped, Table},
    pictures::{self, Picture},
    report::{Observation, Run, Setup, Shot, Stage, Subject},
};
use clap::Args;
use monorange_core::{
    geometry::Pose,
    pipeline::{self, Memory, OnHeap, Pipeline, Report, VisualConfig, VisualMotion},
    slam::{Decision, Status},
};
use nalgebra::Vector2;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Trajectory and map of a robot from its camera's pictures.
///
/// Frames are taken in the natural order of their names. Without odometry the motion comes from the pictures: turns
/// from all that stands still, lengths from the floor. Writes `trajectory.tum`, `trajectory.csv`, `map.csv`,
/// `map.ply`, `observations.csv`, `report.json` and `report.html`. The world is the robot's first pose; truth, laser
/// and true landmarks are moved there by the first true pose, which is all that is used of the truth but for the
/// report. `times.txt`, `laser.csv` and (with --truth) `landmarks.csv` beside the folder of frames are found by
/// their names.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 30 --out corridor-30
  monorange slam --rig corridor-30/rig.toml --frames corridor-30/frames \\
    --odometry corridor-30/odometry.csv --truth corridor-30/truth.tum --out corridor-30/slam")]
pub struct Arguments {
    /// Camera, mount and settings (TOML).
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// The folder of pictures.
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,
    /// Times of the frames, one a line, s.
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Odometry (CSV `t,v,omega` or `t,dx,dy,dtheta`); from the pictures without it.
    #[arg(long, value_name = "FILE")]
    odometry: Option<PathBuf>,
    /// True trajectory (TUM or CSV), for the report.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Landmarks that there is room for.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u16).range(1..=4096))]
    max_landmarks: u16,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "monorange-slam")]
    out: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Frames shown in the report.
const SHOTS: usize = 6;

/// Runs the command.
///
/// # Errors
/// When a file is missing, malformed or does not fit the others, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = Rig::read(&arguments.rig)?;
    let sequence = Sequence::read(arguments, &rig)?;
    let mut outputs = Outputs::into_folder(&arguments.out)?;
    let mut drive = Drive::new(arguments, &rig, &sequence)?;
    drive.all_frames()?;
    let run = drive.finish(arguments)?;
    results::write(&mut outputs, &run)?;
    outputs.commit()?;
    results::print(&run, &arguments.out, arguments.json)
}

/// The inputs, checked against each other.
struct Sequence {
    images: Vec<PathBuf>,
    times: Vec<f64>,
    odometry: Option<Odometry>,
    truth: Vec<Stamped>,
}

impl Sequence {
    fn read(arguments: &Arguments, rig: &Rig) -> Result<Self> {
        let images = pictures::in_folder(&arguments.frames)?;
        let camera = rig.finder.camera();
        for image in &images {
            pictures::check_size(image, camera.width(), camera.height())?;
        }
        let times = times(arguments, images.len())?;
        let odometry = arguments.odometry.as_deref().map(Odometry::read).transpose()?;
        if let (Some(odometry), Some(path)) = (&odometry, &arguments.odometry) {
            odometry.check_cover(path, &times)?;
        }
        let truth = arguments.truth.as_deref().map(files::read_trajectory).transpose()?.unwrap_or_default();
        Ok(Self { images, times, odometry, truth })
    }
}

fn times(arguments: &Arguments, frames: usize) -> Result<Vec<f64>> {
    let found = beside(&arguments.frames, "times.txt");
    let path = arguments.times.as_ref().or(found.as_ref()).ok_or_else(|| {
        Error::new("the frames have no times")
            .at(&arguments.frames)
            .help("give --times with one time a line, s")
    })?;
    let times = files::read_times(path)?;
    if times.len() == frames {
        return Ok(times);
    }
    let cause = format!("has {} times for {frames} pictures", times.len());
    Err(Error::new(cause).at(path).help("give one time for every picture of the folder"))
}

/// A file of this name beside the folder, if there is one.
fn beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = folder.components().as_path().parent()?.join(name);
    path.is_file().then_some(path)
}

/// The pipeline on its way through the sequence, and what it has gathered.
struct Drive<'a> {
    sequence: &'a Sequence,
    rig: &'a Rig,
    pipeline: Pipeline<OnHeap>,
    /// Motion from the pictures, where there is no odometry.
    visual: Option<VisualMotion>,
    /// Time of the first frame: the pipeline's clock begins there.
    start: f64,
    reached: f64,
    run: Run,
    /// The best frame of every part of the drive, with its number of corners.
    shots: Vec<Option<(usize, Shot)>>,
}

impl<'a> Drive<'a> {
    fn new(arguments: &Arguments, rig: &'a Rig, sequence: &'a Sequence) -> Result<Self> {
        let camera = rig.finder.camera();
        let memory = Memory::on_heap(camera.width(), camera.height(), usize::from(arguments.max_landmarks));
        let refused =
            |error| Error::new(error).at(&arguments.rig).help("correct the setting in the rig file");
        let pipeline = Pipeline::new(rig.settings, memory).map_err(refused)?;
        let start = sequence.times.first().copied().unwrap_or_default();
        let folder = std::path::absolute(&arguments.frames).unwrap_or_else(|_| arguments.frames.clone());
        // `corridor/frames` says more than `frames`.
        let names: Vec<_> =
            folder.components().rev().take(2).map(|part| part.as_os_str().to_string_lossy()).collect();
        let stages = ["read the picture", "edges", "lines and corners", "motion", "association and filter"];
        let run = Run {
            title: names.into_iter().rev().collect::<Vec<_>>().join("/"),
            command: std::env::args().collect::<Vec<_>>().join(" "),
            subject: Subject::FloorCorners,
            setup: Setup::of_rig(rig),
            frames: sequence.images.len(),
            frames_used: 0,
            left_out: Vec::new(),
            trajectory: Vec::new(),
            pairs: Vec::new(),
            errors: None,
            map_errors: None,
            map: Vec::new(),
            true_map: Vec::new(),
            laser: Vec::new(),
            observations: Vec::new(),
            without_range: 0,
            no_room: 0,
            unmeasured: sequence.odometry.is_none().then_some(0),
            verdict: "",
            mean_nis: 1.0,
            stages: stages.map(|name| Stage { name, times_ms: Vec::new() }).into(),
            shots: Vec::new(),
        };
        let visual = match sequence.odometry {
            Some(_) => None,
            None => Some(VisualMotion::new(VisualConfig::default()).map_err(Error::new)?),
        };
        Ok(Self { sequence, rig, pipeline, visual, start, reached: start, run, shots: vec![None; SHOTS] })
    }

    fn all_frames(&mut self) -> Result<()> {
        let bar = progress::bar(self.sequence.images.len(), "frames");
        for (frame, (image, time)) in self.sequence.images.iter().zip(&self.sequence.times).enumerate() {
            let clock = Instant::now();
            match Picture::read(image) {
                Ok(picture) => {
                    let read_ms = milliseconds(clock);
                    self.frame(frame, *time, &picture, read_ms).map_err(|error| error.at(image))?;
                }
                Err(error) => {
                    bar.suspend(|| eprintln!("warning: left out: {error}"));
                    let first_line = error.to_string().lines().next().unwrap_or_default().to_owned();
                    self.run.left_out.push(first_line);
                }
            }
            bar.set_message(format!("{} landmarks", self.pipeline.filter().landmarks().len()));
            bar.inc(1);
        }
        bar.finish_and_clear();
        if self.run.trajectory.is_empty() {
            return Err(
                Error::new("none of the pictures could be read").help("give PNG, JPEG or PNM pictures")
            );
        }
        Ok(())
    }

    fn frame(&mut self, frame: usize, time: f64, picture: &Picture, read_ms: f64) -> Result<()> {
        let clock = Instant::now();
        self.move_to(time, picture)?;
        let odometry_ms = milliseconds(clock);
        let clock = Instant::now();
        self.pipeline.begin();
        for row in picture.grey()?.rows() {
            self.pipeline.push_row(row).map_err(Error::new)?;
        }
        let edges_ms = milliseconds(clock);
        let clock = Instant::now();
        self.pipeline.extraction().map_err(Error::new)?;
        let lines_ms = milliseconds(clock);
        let clock = Instant::now();
        let report = self.pipeline.finish(time - self.start).map_err(Error::new)?;
        let filter_ms = milliseconds(clock);
        let spent = [read_ms, edges_ms, lines_ms, odometry_ms, filter_ms];
        for (stage, spent) in self.run.stages.iter_mut().zip(spent) {
            stage.times_ms.push(spent);
        }
        self.note(frame, time, &report);
        self.shoot(frame, time, &report, picture)
    }

    /// Moves the robot to the time of a picture: by its wheels, or by what the picture shows.
    fn move_to(&mut self, time: f64, picture: &Picture) -> Result<()> {
        if let Some(visual) = &mut self.visual {
            let finder = self.pipeline.finder();
            let step = visual.step(&finder, time - self.start, picture.grey()?).map_err(Error::new)?;
            if let (Some(step), Some(unmeasured)) = (step, &mut self.run.unmeasured) {
                *unmeasured += usize::from(!step.measured);
                self.pipeline.motion(time - self.start, &step.increment).map_err(Error::new)?;
            }
        }
        let controls = self.sequence.odometry.as_ref().map(|odometry| odometry.between(self.reached, time));
        for control in controls.unwrap_or_default() {
            self.reached += control.duration;
            self.pipeline.odometry(self.reached - self.start, &reading(&control)).map_err(Error::new)?;
        }
        self.reached = time;
        Ok(())
    }

    fn note(&mut self, frame: usize, time: f64, report: &Report) {
        let Pose { x, y, heading } = report.pose;
        let pose = Pose { x: x.into(), y: y.into(), heading: heading.into() };
        self.run.frames_used += 1;
        self.run.trajectory.push(Stamped { time, pose, covariance: Some(report.pose_covariance.cast()) });
        self.run.without_range += report.without_range;
        self.run.no_room += report.map.no_room;
        self.run.observations.extend(report.corners.iter().map(|corner| Observation {
            time,
            frame,
            pixel: Some(corner.pixel),
            range: Some(corner.range),
            bearing: Some(corner.bearing),
            landmark: corner.outcome.landmark,
            decision: corner.outcome.decision.as_str(),
            nis: corner.outcome.nis,
        }));
    }

    /// Draws the frame if it shows more than the others of its part of the drive.
    fn shoot(&mut self, frame: usize, time: f64, report: &Report, picture: &Picture) -> Result<()> {
        let part = frame * SHOTS / self.sequence.images.len();
        let Some(best) = self.shots.get_mut(part) else { return Ok(()) };
        if best.as_ref().is_some_and(|(corners, _)| *corners >= report.corners.len()) {
            return Ok(());
        }
        let extraction = self.pipeline.extraction().map_err(Error::new)?.clone();
        let mut overlay = Overlay::new(self.rig, &picture.pixels, 640)?;
        overlay.floor();
        overlay.lines(&extraction, &[]);
        overlay.explain(&[
            LegendItem::Mark("matched", ORANGE, Shape::Dot),
            LegendItem::Mark("new", GREEN, Shape::Plus),
            LegendItem::Mark("refused", VERMILLION, Shape::Cross),
        ]);
        overlay.marks(&marks(report));
        let corners = report.corners.len();
        let jpeg = overlay.finish(&format!("frame {frame}   t = {:.2} s", time - self.start)).jpeg(82)?;
        let matched = report.map.updates;
        let caption =
            format!("Frame {frame}, {:.1} s: {corners} floor corners, {matched} matched.", time - self.start);
        *best = Some((corners, Shot { caption, jpeg }));
        Ok(())
    }

    fn finish(mut self, arguments: &Arguments) -> Result<Run> {
        let filter = self.pipeline.filter();
        let confirmed = filter.landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
        self.run.map = confirmed
            .filter_map(|landmark| {
                Some(MapPoint {
                    id: landmark.id.into(),
                    position: filter.position(landmark)?.cast(),
                    covariance: filter.position_covariance(landmark).map(|covariance| covariance.cast()),
                    seen: landmark.seen.into(),
                    first_and_last: Some([landmark.first_time + self.start, landmark.last_time + self.start]),
                })
            })
            .collect();
        self.run.verdict = match self.pipeline.health().measurements {
            0 => "unchecked",
            _ => self.pipeline.health().verdict().as_str(),
        };
        self.run.mean_nis = self.pipeline.health().mean_nis();
        self.run.shots = self.shots.into_iter().flatten().map(|(_, shot)| shot).collect();
        let truth = Truth::new(&self.sequence.truth, results::MAX_TRUTH_GAP);
        let map_from_world = match &arguments.truth {
            None => Pose::default(),
            Some(path) => results::map_from_world(&truth, self.start).map_err(|error| error.at(path))?,
        };
        let move_points = |path: Option<PathBuf>| -> Result<Vec<Vector2<f64>>> {
            let Some(path) = path else { return Ok(Vec::new()) };
            let points = Table::read(&path)?.numbers(["x", "y"])?;
            Ok(points.into_iter().map(|[x, y]| map_from_world.transform(Vector2::new(x, y))).collect())
        };
        self.run.laser = move_points(beside(&arguments.frames, "laser.csv"))?;
        if arguments.truth.is_some() {
            self.run.true_map = move_points(beside(&arguments.frames, "landmarks.csv"))?;
            self.run.pairs = truth.pairs(&self.run.trajectory);
            for pair in &mut self.run.pairs {
                pair.truth = map_from_world.compose(&pair.truth);
            }
            self.run.errors = Some(trajectory_errors(&self.run.pairs, Align::None, 1.0));
        }
        Ok(self.run)
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The pipeline's reading for a constant motion.
fn reading(control: &Control) -> pipeline::Odometry {
    let seconds = control.duration as f32;
    if control.velocity.y == 0.0 {
        return pipeline::Odometry::Velocity {
            v: control.velocity.x as f32,
            omega: control.turn_rate as f32,
            seconds,
        };
    }
    let (step, turn) = control.step();
    pipeline::Odometry::Increment { forward: step.x as f32, left: step.y as f32, turn: turn as f32, seconds }
}

/// The corners of a frame by what became of them, the nearest first.
fn marks(report: &Report) -> Vec<Mark> {
    let mut corners: Vec<_> = report.corners.iter().collect();
    corners.sort_by(|a, b| a.range.total_cmp(&b.range));
    let mark = |corner: &&pipeline::CornerReport| {
        let (colour, shape) = match corner.outcome.decision {
            Decision::Update => (ORANGE, Shape::Dot),
            Decision::Tentative => (SKY, Shape::Dot),
            Decision::Birth => (GREEN, Shape::Plus),
            Decision::Gated | Decision::Rejected => (VERMILLION, Shape::Cross),
        };
        let range = format!("{:.2} m", corner.range);
        let named = corner.outcome.landmark.map(|id| format!("#{id} {range}"));
        Mark {
            pixel: corner.pixel,
            covariance: corner.pixel_covariance,
            colour,
            shape,
            labels: named.into_iter().chain([range]).collect(),
        }
    };
    corners.iter().map(mark).collect()
}
