//! A recorded drive: pictures, their times, odometry and truth, checked against each other.
use crate::warnings;
use monorange_formats::{
    Error, Result,
    bags::{self, Recording},
    evaluation::{MAX_TRUTH_GAP, Truth},
    files::{Attitudes, Odometry, Rig, Stamped, read_trajectory},
    pictures::{self, Frames, Picture},
    plausibility,
};
use std::path::{Path, PathBuf};

/// Where the parts of a drive are.
#[derive(Clone, Copy, Debug)]
pub struct SequenceFiles<'a> {
    /// The folder of pictures, or of a known dataset.
    pub frames: &'a Path,
    /// One time a line; `times.txt` beside the folder without it.
    pub times: Option<&'a Path>,
    /// Wheel odometry.
    pub odometry: Option<&'a Path>,
    /// How the robot leans.
    pub attitude: Option<&'a Path>,
    /// True trajectory.
    pub truth: Option<&'a Path>,
}

/// The parts of a drive that fit each other.
#[derive(Debug)]
pub struct Sequence {
    /// The pictures in the order of time.
    pub images: Vec<Frame>,
    /// When each was taken, s.
    pub times: Vec<f64>,
    /// Wheel odometry, which covers the pictures' times.
    pub odometry: Option<Odometry>,
    /// How the robot leans.
    pub attitudes: Option<Attitudes>,
    /// True poses; none without a file.
    pub truth: Vec<Stamped>,
    /// The folder of the pictures, or the recording.
    pub folder: PathBuf,
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub enum Frame {
    /// A file of its own.
    File(PathBuf),
    /// A message of a recording.
    Message(bags::Frame),
}

impl Frame {
    /// Decodes the picture.
    ///
    /// # Errors
    /// When it cannot be read, or is damaged.
    pub fn read(&self) -> Result<Picture> {
        match self {
            Self::File(path) => Picture::read(path),
            Self::Message(frame) => frame.read(),
        }
    }

    /// What messages call it.
    pub fn name(&self) -> &Path {
        match self {
            Self::File(path) => path,
            Self::Message(frame) => frame.name(),
        }
    }
}

impl Sequence {
    /// Reads everything but the pictures themselves, whose sizes are looked at.
    ///
    /// # Errors
    /// When a file is missing or malformed, a picture has another size than the rig's, there are more or fewer times
    /// than pictures, or the odometry does not cover them.
    pub fn read(files: SequenceFiles<'_>, rig: &Rig) -> Result<Self> {
        let Frames { images, times, folder } = pictures::frames(files.frames, files.times)?;
        let camera = rig.finder.camera();
        for image in &images {
            pictures::check_size(image, camera.width(), camera.height())?;
        }
        plausibility::check_steps(files.times.unwrap_or(&folder), &times)?;
        let odometry = files.odometry.map(Odometry::read).transpose()?;
        if let (Some(odometry), Some(path)) = (&odometry, files.odometry) {
            odometry.check_cover(path, &times)?;
        }
        let attitudes = attitudes(files.attitude, &times)?;
        let truth = true_poses(files.truth, &times)?;
        warnings::say();
        let images = images.into_iter().map(Frame::File).collect();
        Ok(Self { images, times, odometry, attitudes, truth, folder })
    }

    /// The parts of a recording, with odometry and truth from files where these are given.
    ///
    /// # Errors
    /// When the pictures have another size than the rig's, or a file is malformed or does not cover them.
    pub fn of_recording(recording: Recording, files: SequenceFiles<'_>, rig: &Rig) -> Result<Self> {
        let Recording { frames, times, mut odometry, .. } = recording;
        let camera = rig.finder.camera();
        if let Some((frame, size)) = frames.first().and_then(|frame| Some((frame, frame.size()?))) {
            plausibility::check_picture(frame.name(), size, [camera.width(), camera.height()])?;
        }
        plausibility::check_steps(files.frames, &times)?;
        if let Some(path) = files.odometry {
            let read = Odometry::read(path)?;
            read.check_cover(path, &times)?;
            odometry = Some(read);
        }
        let attitudes = attitudes(files.attitude, &times)?;
        let truth = true_poses(files.truth, &times)?;
        warnings::say();
        let images = frames.into_iter().map(Frame::Message).collect();
        Ok(Self { images, times, odometry, attitudes, truth, folder: files.frames.to_owned() })
    }

    /// Pitch, roll and their standard deviation when a picture is taken, rad, if an IMU tells it.
    pub fn lean(&self, time: f64) -> Option<[f32; 3]> {
        let lean = self.attitudes.as_ref()?.at(time)?;
        Some(lean.map(|angle| angle as f32))
    }
}

/// How the robot leans, by a file.
fn attitudes(path: Option<&Path>, times: &[f64]) -> Result<Option<Attitudes>> {
    let Some(path) = path else { return Ok(None) };
    let attitudes = Attitudes::read(path)?;
    attitudes.check_cover(path, times)?;
    Ok(Some(attitudes))
}

/// The true poses of a file; none without one.
fn true_poses(path: Option<&Path>, times: &[f64]) -> Result<Vec<Stamped>> {
    let truth = path.map(read_trajectory).transpose()?.unwrap_or_default();
    if let Some(path) = path {
        check_truth(path, &truth, times)?;
    }
    Ok(truth)
}

/// Fails before the work when nothing of it can be compared.
fn check_truth(path: &Path, truth: &[Stamped], times: &[f64]) -> Result<()> {
    let known = Truth::new(truth, MAX_TRUTH_GAP);
    if times.iter().any(|time| known.at(*time).is_some()) {
        return Ok(());
    }
    let ends = |first: Option<f64>, last: Option<f64>| {
        format!("{} s to {} s", first.unwrap_or(0.0), last.unwrap_or(0.0))
    };
    let truth = ends(truth.first().map(|pose| pose.time), truth.last().map(|pose| pose.time));
    let frames = ends(times.first().copied(), times.last().copied());
    Err(Error::new(format!("covers {truth}, the frames {frames}: no pose to compare"))
        .at(path)
        .help("give the truth on the frames' clock, without gaps of more than a second"))
}
