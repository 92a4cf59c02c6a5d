//! A recorded drive: pictures, their times, odometry and truth, checked against each other.
use monorange_formats::{
    Error, Result,
    files::{Odometry, Rig, Stamped, read_times, read_trajectory},
    pictures,
};
use std::path::{Path, PathBuf};

/// Where the parts of a drive are.
#[derive(Clone, Copy, Debug)]
pub struct SequenceFiles<'a> {
    /// The folder of pictures.
    pub frames: &'a Path,
    /// One time a line; `times.txt` beside the folder without it.
    pub times: Option<&'a Path>,
    /// Wheel odometry.
    pub odometry: Option<&'a Path>,
    /// True trajectory.
    pub truth: Option<&'a Path>,
}

/// The parts of a drive that fit each other.
#[derive(Debug)]
pub struct Sequence {
    /// The pictures in natural order of their names.
    pub images: Vec<PathBuf>,
    /// When each was taken, s.
    pub times: Vec<f64>,
    /// Wheel odometry, which covers the pictures' times.
    pub odometry: Option<Odometry>,
    /// True poses; none without a file.
    pub truth: Vec<Stamped>,
}

impl Sequence {
    /// Reads everything but the pictures themselves, whose sizes are looked at.
    ///
    /// # Errors
    /// When a file is missing or malformed, a picture has another size than the rig's, there are more or fewer times
    /// than pictures, or the odometry does not cover them.
    pub fn read(files: SequenceFiles<'_>, rig: &Rig) -> Result<Self> {
        let images = pictures::in_folder(files.frames)?;
        let camera = rig.finder.camera();
        for image in &images {
            pictures::check_size(image, camera.width(), camera.height())?;
        }
        let times = times(files, images.len())?;
        let odometry = files.odometry.map(Odometry::read).transpose()?;
        if let (Some(odometry), Some(path)) = (&odometry, files.odometry) {
            odometry.check_cover(path, &times)?;
        }
        let truth = files.truth.map(read_trajectory).transpose()?.unwrap_or_default();
        Ok(Self { images, times, odometry, truth })
    }
}

fn times(files: SequenceFiles<'_>, frames: usize) -> Result<Vec<f64>> {
    let found = beside(files.frames, "times.txt");
    let path = files.times.or(found.as_deref()).ok_or_else(|| {
        Error::new("the frames have no times").at(files.frames).help("give --times with one time a line, s")
    })?;
    let times = read_times(path)?;
    if times.len() == frames {
        return Ok(times);
    }
    let cause = format!("has {} times for {frames} pictures", times.len());
    Err(Error::new(cause).at(path).help("give one time for every picture of the folder"))
}

/// A file of this name beside the folder, if there is one.
pub fn beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = folder.components().as_path().parent()?.join(name);
    path.is_file().then_some(path)
}
