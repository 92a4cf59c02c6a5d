//! Camera files of other programs.
//!
//! | form | what it is known by |
//! |---|---|
//! | ROS camera_info, `ros2 topic echo`, OpenCV's FileStorage (YAML, XML), Autoware | `camera_matrix`, `K`, `CameraMat` |
//! | ROS `.ini` (`ost.txt`) | `[image]` |
//! | Kalibr camchain | `cam0:` with `intrinsics` |
//! | EuRoC `sensor.yaml` | `intrinsics` of four numbers |
//! | ORB-SLAM settings | `Camera.fx` |
//! | camodocal (VINS) | `projection_parameters` |
//! | KITTI `calib.txt`, `calib_cam_to_cam.txt` | `P0`, `P_rect_00` (rectified pictures) |
//!
//! All become one tree of values, and differ only in the names of their entries. Kalibr, ROS and OpenCV put pixel
//! (0, 0) at the centre of the top-left pixel as we do: nothing is shifted. A file is understood whole or refused:
//! an entry that bears on lens or picture and is not read is an error, any other one that is not known a warning.
mod entries;
mod forms;
mod lens;
mod tree;

use crate::{Error, Result, plausibility};
use monorange_core::geometry::Lens;
use std::path::Path;

/// A pinhole camera's numbers, not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Intrinsics {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// (f_u, f_v), px.
    pub focal: [f64; 2],
    /// (u₀, v₀), px.
    pub principal: [f64; 2],
    /// Factor of y' in u.
    pub skew: f64,
    /// The lens model.
    pub lens: Lens<f64>,
}

/// The camera in a file of another program; of several, the first, with a warning.
///
/// # Errors
/// Names the file, the entry, and what is wrong: missing, not known, not numbers, a lens model that is not known, a
/// crop or binning, or numbers that no camera has.
pub fn read_camera_info(path: &Path) -> Result<Intrinsics> {
    read_camera_of(path, None, None)
}

/// As [`read_camera_info`]: camera `number` of those in the file, counted from 0; `size` (width, height) for files that
/// do not give it.
///
/// # Errors
/// As [`read_camera_info`], and when there is no camera of this number.
pub fn read_camera_of(path: &Path, number: Option<usize>, size: Option<[usize; 2]>) -> Result<Intrinsics> {
    let text = super::read_text(path)?;
    let read = || {
        let trees = tree::trees(&text)?;
        let cameras =
            trees.iter().map(|tree| forms::camera(tree, path, number, size)).collect::<Result<Vec<_>>>()?;
        let camera = cameras.first().ok_or_else(|| Error::new("is empty").help(tree::FORMS))?;
        if cameras.iter().any(|other| other != camera) {
            let cause = format!("holds {} messages with different cameras", cameras.len());
            return Err(Error::new(cause).help("keep the one that belongs to the pictures"));
        }
        plausibility::check_camera(camera)?;
        Ok(camera.clone())
    };
    read().map_err(|error: Error| error.at(path))
}
