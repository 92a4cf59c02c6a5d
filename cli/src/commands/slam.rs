//! `slam`: a sequence of pictures → trajectory, map, and a report about both.
mod carried;
mod inputs;
mod placed;
mod saved;
mod scanned;
mod several;

use crate::{
    commands::{progress, results},
    mcap_output::McapOutput,
    outputs::{Outputs, to_file_or_stdout},
    sequence::Sequence,
};
use clap::Args;
use indicatif::ProgressBar;
pub(super) use inputs::Inputs;
use inputs::wrong;
use monorange_core::{
    geometry::Pose,
    lines::Extraction,
    pipeline::{Carrier, Memory, MovedBy, OnHeap, Pipeline, Recovery, Report},
    slam::Verdict,
};
use monorange_formats::{
    Error, Result,
    draw::Overlay,
    files::{MapFile, Rig, Stamped, Table, confirmed_map},
    pictures::{Picture, beside},
    plausibility::FrozenCamera,
    report::{self, Carried, OUTPUTS, Observation, Run, SHOTS, Shot},
};
use nalgebra::Vector2;
use saved::Saved;
use scanned::Scanned;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Trajectory and map of a robot from its camera's pictures.
///
/// Frames are taken in the natural order of their names. Without odometry the motion comes from the pictures:
/// turns from all that stands still, lengths from the floor; with odometry the floor's is added where the rig says
/// `carrier = "floor"` under `[association]`. Writes `trajectory.tum`, `trajectory.csv`, `map.csv`, `map.ply`,
/// `observations.csv`, `report.json` and `report.html`. The world is the robot's first pose; truth, laser and true
/// landmarks are moved there by the first true pose, which is all that is used of the truth but for the report.
/// `times.txt`, `laser.csv` and (with --truth) `landmarks.csv` beside the folder of frames are found by their
/// names.
///
/// `--map map.bin` begins in the map of an earlier run, of which every one writes its own: the place in it need not be known, and is
/// recognised by its landmarks after some metres; what was driven before is put there too, and the world is that map's. The run goes
/// on mapping, or with --localise-only leaves the map as it is. A run that does not find its place says "lost".
///
/// `--bag drive.mcap` takes a recording of ROS 2 instead of a folder (MCAP or rosbag2: pictures raw or packed, odometry, camera_info,
/// tf); without --rig its camera_info and transforms say what the camera is and how it sits.
///
/// Several folders of frames, or recordings, are several drives: they are done side by side on all cores, each into a folder
/// of its own in --out, named by what tells the folders apart. --rig, --times, --odometry and --truth are then given once for
/// all drives, or once for each in the same order.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 30 --out corridor-30
  monorange slam --rig corridor-30/rig.toml --frames corridor-30/frames \\
    --odometry corridor-30/odometry.csv --truth corridor-30/truth.tum --scan --out corridor-30/slam

  # another drive there, in that map
  monorange simulate --scene corridor --frames 60 --out corridor-60
  monorange slam --rig corridor-60/rig.toml --frames corridor-60/frames \
    --odometry corridor-60/odometry.csv --map corridor-30/slam/map.bin --out corridor-60/slam

  # several drives at once
  monorange simulate --scene corridor --frames 30 --seed 1 --out drives/first
  monorange simulate --scene corridor --frames 30 --seed 2 --out drives/second
  monorange slam --rig drives/*/rig.toml --frames drives/*/frames --odometry drives/*/odometry.csv --out maps")]
pub struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// Landmarks that there is room for.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u16).range(1..=4096))]
    max_landmarks: u16,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "monorange-slam")]
    out: PathBuf,
    /// Begin in this map of an earlier run (`map.bin`), wherever in it the robot is.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Leave the map of --map as it is: new landmarks are not taken, and known ones not corrected.
    #[arg(long, requires = "map")]
    localise_only: bool,
    /// Also scan the floor in every picture (`monorange scan`): `scan.csv`, and the grid of all scans along the path as map servers of ROS
    /// and Nav2 read it, `map.pgm` with `map.yaml`.
    #[arg(long)]
    scan: bool,
    /// Also write the run as a recording of ROS 2 (MCAP), for Foxglove, rerun and `ros2 bag`: Odometry, PoseWithCovarianceStamped,
    /// PointCloud2 (the map), LaserScan (the virtual scan, as --scan's), CompressedImage (overlays), CameraInfo and tf. With --map it
    /// begins where the place is found.
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When a file is missing, malformed or does not fit the others, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let drives = arguments.inputs.each();
    if drives.len() > 1 {
        if arguments.mcap.is_some() {
            wrong("--mcap takes one drive: a recording holds one");
        }
        return several::run(arguments, &drives);
    }
    let (rig, sequence) = arguments.inputs.read()?;
    let map = arguments.saved()?;
    let mut outputs = arguments.outputs(&arguments.out)?;
    let mut drive = Drive::new(arguments, &arguments.inputs, &rig, &sequence, map.as_ref())?;
    let bar = progress::bar(sequence.images.len(), "frames");
    drive.all_frames(&bar)?;
    bar.finish_and_clear();
    let (mut run, mcap, scanned) = drive.finish(&arguments.inputs, &mut outputs)?;
    results::write(&mut outputs, &mut run)?;
    if arguments.scan {
        scanned.iter().try_for_each(|scanned| scanned.write(&mut outputs))?;
    }
    outputs.commit()?;
    if let Some(mut mcap) = mcap {
        to_file_or_stdout(arguments.mcap.as_deref(), |out| std::io::copy(&mut mcap, out).map(drop))?;
    }
    results::print(&run, &arguments.out, arguments.json)
}

impl Arguments {
    /// The folder of one drive's results.
    fn outputs(&self, folder: &Path) -> Result<Outputs> {
        let scans: &[&str] = if self.scan { &scanned::OUTPUTS } else { &[] };
        Outputs::of_a_run(folder, &[&OUTPUTS, &[saved::OUTPUT][..], scans].concat(), "report.json")
    }

    /// The map to begin in.
    fn saved(&self) -> Result<Option<MapFile>> {
        self.map.as_deref().map(MapFile::read).transpose()
    }
}

/// The pipeline on its way through the sequence, and what it has gathered.
struct Drive<'a> {
    sequence: &'a Sequence,
    rig: &'a Rig,
    pipeline: Pipeline<OnHeap>,
    /// Time of the first frame: the pipeline's clock begins there.
    start: f64,
    reached: f64,
    /// Whether the camera shows anything new.
    frozen: FrozenCamera,
    run: Run,
    /// Of each of the run's poses.
    frames: Vec<usize>,
    /// Whether the robot is where its map has it.
    recovery: Recovery,
    /// The best frame of every part of the drive, with its number of corners.
    shots: Vec<Option<(usize, Shot)>>,
    /// The run as a recording, where one is wanted.
    mcap: Option<McapOutput>,
    /// Its scans, where they are wanted, for files or for the recording.
    scanned: Option<Scanned>,
    /// The map that it begins in.
    saved: Option<Saved<'a>>,
}

impl<'a> Drive<'a> {
    fn new(
        arguments: &Arguments,
        inputs: &Inputs,
        rig: &'a Rig,
        sequence: &'a Sequence,
        map: Option<&'a MapFile>,
    ) -> Result<Self> {
        let camera = rig.finder.camera();
        let known = map.map(|file| Ok(file.map()?.landmarks().count())).transpose()?;
        let room = usize::from(arguments.max_landmarks) + known.unwrap_or(0);
        let memory = Memory::on_heap(camera.width(), camera.height(), room);
        let refused =
            |error| Error::new(error).at(inputs.rig_place()).help("correct the setting in the rig file");
        let config = rig.on_a_host(sequence.odometry.is_some());
        let mut pipeline = Pipeline::new(config, memory).map_err(refused)?;
        let start = sequence.times.first().copied().unwrap_or_default();
        let mut run = new_run(inputs, rig, sequence);
        run.unmeasured = sequence.odometry.is_none().then_some(0);
        run.carried = (config.carrier != Carrier::Map).then(Carried::default);
        let (frozen, shots) = (FrozenCamera::default(), vec![None; SHOTS]);
        let mcap = arguments.mcap.as_ref().map(|_| McapOutput::new(rig)).transpose()?;
        let scanned = match (arguments.scan, &arguments.mcap) {
            (true, _) => Some(Scanned::new(rig)?),
            // A recording may lack scans, as of a camera that sees no floor.
            (false, Some(_)) => Scanned::new(rig).map_err(|error| error.warn()).ok(),
            (false, None) => None,
        };
        let saved = map.map(|file| Saved::new(file, arguments.localise_only, &mut pipeline)).transpose()?;
        let (frames, recovery, reached) = (Vec::new(), Recovery::new(&config, room), start);
        Ok(Self {
            sequence,
            rig,
            pipeline,
            start,
            reached,
            frozen,
            run,
            frames,
            recovery,
            shots,
            mcap,
            scanned,
            saved,
        })
    }

    fn all_frames(&mut self, bar: &ProgressBar) -> Result<()> {
        for (frame, (image, time)) in self.sequence.images.iter().zip(&self.sequence.times).enumerate() {
            let clock = Instant::now();
            match image.read() {
                Ok(picture) => {
                    let read_ms = milliseconds(clock);
                    self.frame(frame, *time, &picture, read_ms).map_err(|error| error.at(image.name()))?;
                }
                Err(error) => {
                    bar.suspend(|| crate::warnings::left_out(&error));
                    let first_line = error.to_string().lines().next().unwrap_or_default().to_owned();
                    self.run.left_out.push(first_line);
                }
            }
            bar.set_message(format!("{} landmarks", self.pipeline.filter().landmarks().len()));
            bar.inc(1);
        }
        if self.run.trajectory.is_empty() {
            return Err(
                Error::new("none of the pictures could be read").help("give PNG, JPEG or PNM pictures")
            );
        }
        Ok(())
    }

    fn frame(&mut self, frame: usize, time: f64, picture: &Picture, read_ms: f64) -> Result<()> {
        let controls = self.sequence.odometry.as_ref().map(|odometry| odometry.between(self.reached, time));
        let mut way = 0.0;
        for control in controls.unwrap_or_default() {
            self.reached += control.duration;
            let (until, reading) = (self.reached - self.start, control.reading());
            self.pipeline.odometry(until, &reading).map_err(Error::new)?;
            self.recovery.odometry(until, &reading).map_err(Error::new)?;
            way += control.way();
        }
        self.reached = time;
        if let Some([pitch, roll, std]) = self.sequence.lean(time) {
            self.pipeline.attitude(pitch, roll, std).map_err(Error::new)?;
            self.recovery.attitude(pitch, roll, std).map_err(Error::new)?;
        }
        self.frozen.look(&picture.pixels, way);
        let (mut spent, mut clock) = (vec![read_ms], Instant::now());
        let ended = |_| {
            spent.push(milliseconds(clock));
            clock = Instant::now();
        };
        let seen = self.pipeline.step_timed(time - self.start, picture.grey()?, ended);
        let mut report = seen.map_err(Error::new)?;
        for (stage, spent) in self.run.stages.iter_mut().zip(spent) {
            stage.times_ms.push(spent);
        }
        self.note(frame, time, &report);
        let (pipeline, run) = (&mut self.pipeline, &mut self.run);
        let look = |saved: &mut Saved<'_>| saved.look(pipeline, self.start, &report, run);
        let moved = self.saved.as_mut().map(look).transpose()?.flatten();
        if let Some(moved) = moved {
            report.pose = self.pipeline.filter().pose();
            self.scanned.iter_mut().for_each(|scanned| scanned.put(&moved));
        }
        self.recover(&mut report, picture)?;
        if let Some(scanned) = &mut self.scanned {
            scanned.look(time, picture.grey()?, self.sequence.odometry.as_ref(), &report)?;
        }
        self.shoot(frame, time, &report, picture)
    }

    /// Looks whether the robot was carried away, and puts it to where it is found.
    fn recover(&mut self, report: &mut Report, picture: &Picture) -> Result<()> {
        if !self.saved.as_ref().is_none_or(Saved::is_found) {
            return Ok(());
        }
        let fixed = self.saved.as_ref().is_some_and(Saved::is_fixed);
        let found = self.recovery.look(&mut self.pipeline, report, picture.grey()?, fixed);
        let Some(found) = found.map_err(Error::new)? else { return Ok(()) };
        let poses = carried::put_back(&found, &self.pipeline, &self.frames, &mut self.run);
        if let Some(last) = found.reports.last() {
            let filter = self.pipeline.filter();
            let (pose, pose_covariance) = (filter.pose(), filter.pose_covariance());
            *report = Report { pose, pose_covariance, ..last.clone() };
        }
        if let Some((_, before)) = poses.split_last() {
            self.scanned.iter_mut().for_each(|scanned| scanned.put_last(before));
        }
        Ok(())
    }

    fn note(&mut self, frame: usize, time: f64, report: &Report) {
        let Pose { x, y, heading } = report.pose;
        let pose = Pose { x: x.into(), y: y.into(), heading: heading.into() };
        self.run.frames_used += 1;
        self.frames.push(frame);
        self.run.trajectory.push(Stamped { time, pose, covariance: Some(report.pose_covariance.cast()) });
        self.run.without_range += report.without_range;
        self.run.no_room += report.map.no_room;
        self.run.knocked.extend(report.map.knocked.then_some(time));
        if let Some(unmeasured) = &mut self.run.unmeasured {
            *unmeasured += usize::from(report.moved_by == MovedBy::Held);
        }
        // Nothing can be carried into the first picture.
        if let Some(carried) = self.run.carried.as_mut().filter(|_| report.frame > 0) {
            carried.count(report.carried_by);
        }
        let observations = report.corners.iter().map(|corner| Observation::of_corner(time, frame, corner));
        self.run.observations.extend(observations);
    }

    /// Draws the frame if it shows more than the others of its part of the drive.
    fn shoot(&mut self, frame: usize, time: f64, report: &Report, picture: &Picture) -> Result<()> {
        let part = frame * SHOTS / self.sequence.images.len();
        let Some(best) = self.shots.get_mut(part) else { return Ok(()) };
        let is_best = best.as_ref().is_none_or(|(corners, _)| *corners < report.corners.len());
        if !is_best && self.mcap.is_none() {
            return Ok(());
        }
        let lines = match self.pipeline.proposer() {
            Some(_) => Extraction::default(),
            None => self.pipeline.extraction().map_err(Error::new)?.clone(),
        };
        let draw = |overlay: &mut Overlay<'_>| match self.pipeline.proposer() {
            Some(proposer) => {
                overlay.proposals(proposer.extraction(), proposer.edge_points().map(|(place, _)| place));
            }
            None => overlay.lines(&lines),
        };
        let corners = report.corners.len();
        let seen = self.run.observations.len() - corners;
        let seen = self.run.observations.get(seen..).unwrap_or_default();
        let shot = report::shot(self.rig, &picture.pixels, draw, seen, frame, time - self.start)?;
        // A place that is not known has none in the recording's frame.
        let placed = self.saved.as_ref().is_none_or(Saved::is_found);
        if let (Some(mcap), Some(pose), true) = (&mut self.mcap, self.run.trajectory.last(), placed) {
            let scan = self.scanned.as_ref().map_or(&[][..], Scanned::last);
            mcap.frame(pose, &shot.jpeg, scan, || confirmed_map(self.pipeline.filter(), self.start))?;
        }
        if is_best {
            *best = Some((corners, shot));
        }
        Ok(())
    }

    /// What the run found, its recording and its scans where they are wanted.
    fn finish(
        mut self,
        arguments: &Inputs,
        outputs: &mut Outputs,
    ) -> Result<(Run, Option<std::fs::File>, Option<Scanned>)> {
        self.run.map = confirmed_map(self.pipeline.filter(), self.start);
        let health = self.pipeline.health();
        (self.run.verdict, self.run.reason) = match self.frozen.judge() {
            true => (Verdict::Unchecked, None),
            false => (health.verdict(), health.reason()),
        };
        self.run.mean_nis = self.pipeline.health().mean_nis();
        self.run.shots = self.shots.into_iter().flatten().map(|(_, shot)| shot).collect();
        let known = self.saved.as_ref().and_then(|saved| saved.finish(&mut self.run));
        let truth = add_truth(&mut self.run, arguments, self.sequence, self.start, known)?;
        saved::write(outputs, &mut self.pipeline, self.start, truth.or(known))?;
        let end = self.run.trajectory.last().map_or(self.start, |pose| pose.time);
        let mcap = self.mcap.map(|mcap| mcap.finish(end, &self.run.map)).transpose()?;
        Ok((self.run, mcap, self.scanned))
    }
}

/// A run of a sequence before its first frame.
pub(super) fn new_run(arguments: &Inputs, rig: &Rig, sequence: &Sequence) -> Run {
    let command = std::env::args().collect::<Vec<_>>().join(" ");
    Run::of_pictures(arguments.title(), command, rig, sequence.images.len())
}

/// Adds what is true, and how far the run is off; the truth's world in the run's map, which may be `known`.
pub(super) fn add_truth(
    run: &mut Run,
    arguments: &Inputs,
    sequence: &Sequence,
    start: f64,
    known: Option<Pose<f64>>,
) -> Result<Option<Pose<f64>>> {
    let points = |name| match beside(&sequence.folder, name) {
        None => Ok(Vec::new()),
        Some(path) => points(&path),
    };
    let laser = points("laser.csv")?;
    let Some(path) = arguments.truth.first() else {
        run.laser = laser;
        return Ok(None);
    };
    match run.compare(start, known, &sequence.truth, &laser, &points("landmarks.csv")?) {
        Some(known) => Ok(Some(known)),
        None => Err(results::no_common_pose(start).at(path)),
    }
}

fn points(path: &Path) -> Result<Vec<Vector2<f64>>> {
    Ok(Table::read(path)?.numbers(["x", "y"])?.into_iter().map(Vector2::from).collect())
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
