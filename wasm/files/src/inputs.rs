//! The text files that come with pictures, read by the command line's own readers.
use core::fmt::Display;
use monorange_core::geometry::{Lens, Pose};
use monorange_core::pipeline;
use monorange_formats::evaluation::{MAX_TRUTH_GAP, Truth};
use monorange_formats::files::{
    self, Control, Odometry, Rig, Table, changed_settings, memory, read_camera_info, read_times,
    read_trajectory,
};
use monorange_protocol::{conversion::message_from_config, message::Answers};
use nalgebra::Vector2;
use serde_json::json;
use std::path::Path;
use wasm_bindgen::prelude::*;

type Answer<T> = Result<T, JsError>;

fn sentence(error: impl Display) -> JsError {
    JsError::new(&error.to_string().replace("\n  help: ", ". To mend it: "))
}

/// Makes a file readable by the functions of this module under its path.
#[wasm_bindgen]
pub fn offer(path: &str, content: Vec<u8>) {
    memory::offer(path, content);
}

/// Forgets every file that was offered.
#[wasm_bindgen]
pub fn forget_all() {
    memory::withdraw_all();
}

/// The rig in a TOML file, as JSON: `width`, `height`, `focal`, `principal`, `skew`, `distortion`, `pixelStd`,
/// `mount` and `mountStd` with six numbers each (m, rad), and the pipeline's settings twice: `settings`, the bytes of
/// a `Configure` message as the pipeline's constructor takes them, and `settingsToml`, those that differ from their
/// defaults, as the rig file has them.
///
/// # Errors
/// A sentence with the file, the line and the key.
#[wasm_bindgen]
pub fn rig(path: &str) -> Answer<String> {
    let Rig { finder, pixel_std, mount_std, settings, .. } = Rig::read(Path::new(path)).map_err(sentence)?;
    let mut buffer = [0; 1024];
    let message = message_from_config(&settings, NO_ANSWERS);
    let message: &[u8] = postcard::to_slice(&message, &mut buffer).map_err(sentence)?;
    let camera = finder.camera();
    Ok(json!({
        "width": camera.width(),
        "height": camera.height(),
        "focal": [camera.focal().x, camera.focal().y],
        "principal": [camera.principal().x, camera.principal().y],
        "skew": camera.skew(),
        "distortion": five(path, camera.lens())?,
        "pixelStd": pixel_std,
        "mount": finder.mount().parameters(),
        "mountStd": mount_std,
        "settings": message,
        "settingsToml": changed_settings(&settings),
    })
    .to_string())
}

/// The coefficients of a lens that the page can take: five, of Brown and Conrady.
fn five(path: &str, lens: &Lens<f64>) -> Answer<Vec<f64>> {
    match lens {
        Lens::BrownConrady(_) => Ok(lens.coefficients().to_vec()),
        _ => Err(sentence(format!(
            "{path}: the page takes plumb_bob lenses only; undistort the pictures, or use the command line"
        ))),
    }
}

/// What a device would send of its own accord; here there is none.
const NO_ANSWERS: Answers = Answers { observations: false, map_every: 0, statistics_every: 0 };

/// The camera in a file of ROS, OpenCV or Kalibr, as JSON with the names of [`rig`] but for the mount's.
///
/// # Errors
/// A sentence with the file and the entry.
#[wasm_bindgen]
pub fn camera(path: &str) -> Answer<String> {
    let camera = read_camera_info(Path::new(path)).map_err(sentence)?;
    Ok(json!({
        "width": camera.width,
        "height": camera.height,
        "focal": camera.focal,
        "principal": camera.principal,
        "skew": camera.skew,
        "distortion": five(path, &camera.lens)?,
    })
    .to_string())
}

/// The frames' times in seconds.
///
/// # Errors
/// A sentence with the file and the line.
#[wasm_bindgen]
pub fn times(path: &str) -> Answer<Vec<f64>> {
    read_times(Path::new(path)).map_err(sentence)
}

/// The true pose at each of the frames' times as x, y, heading, relative to the first one; not a number where
/// the truth is silent.
///
/// # Errors
/// A sentence with the file and the line.
#[wasm_bindgen]
pub fn truth(path: &str, times: &[f64]) -> Answer<Vec<f64>> {
    let poses = read_trajectory(Path::new(path)).map_err(sentence)?;
    let truth = Truth::new(&poses, MAX_TRUTH_GAP);
    let poses: Vec<_> = times.iter().map(|time| truth.at(*time)).collect();
    let first_from_world = poses.iter().flatten().next().copied().unwrap_or_default().inverse();
    let row = |pose: Option<Pose<f64>>| match pose.map(|pose| first_from_world.compose(&pose)) {
        Some(Pose { x, y, heading }) => [x, y, heading],
        None => [f64::NAN; 3],
    };
    Ok(poses.into_iter().flat_map(row).collect())
}

/// Points of a laser as x, y, every so many of them that at most `most` are left. Where there is a true
/// trajectory they are relative to its pose at the time `start`, as [`truth`] is.
///
/// # Errors
/// A sentence with the file and the line.
#[wasm_bindgen]
pub fn laser(path: &str, truth_path: Option<String>, start: f64, most: usize) -> Answer<Vec<f32>> {
    let points =
        Table::read(Path::new(path)).and_then(|table| table.numbers(["x", "y"])).map_err(sentence)?;
    let truth = truth_path.map(|path| read_trajectory(Path::new(&path))).transpose().map_err(sentence)?;
    let first = truth.and_then(|poses| Truth::new(&poses, MAX_TRUTH_GAP).at(start)).unwrap_or_default();
    let kept = points.iter().step_by(points.len().div_ceil(most.max(1)).max(1));
    let rows = kept.flat_map(|[x, y]| {
        let point = first.inverse_transform(Vector2::new(*x, *y));
        [point.x as f32, point.y as f32]
    });
    Ok(rows.collect())
}

/// What the wheels say.
#[wasm_bindgen]
pub struct Wheels {
    odometry: Odometry,
}

#[wasm_bindgen]
impl Wheels {
    /// The odometry in a CSV, `t,v,omega` or `t,dx,dy,dtheta`, over the frames' times.
    ///
    /// # Errors
    /// A sentence with the file and the line, or what the odometry does not cover.
    #[wasm_bindgen(constructor)]
    pub fn read(path: &str, times: &[f64]) -> Answer<Wheels> {
        let path = Path::new(path);
        let odometry = Odometry::read(path).map_err(sentence)?;
        odometry.check_cover(path, times).map_err(sentence)?;
        Ok(Self { odometry })
    }

    /// The readings from one time to a later one, as rows: duration (s); 0 for a speed ahead (m/s) and a turn rate
    /// (rad/s) and another 0, or 1 for a step ahead, to the left (m), and its turn (rad).
    pub fn between(&self, from: f64, to: f64) -> Vec<f64> {
        let row = |motion: &Control| match motion.reading() {
            pipeline::Odometry::Velocity { v, omega, .. } => {
                [motion.duration, 0.0, v.into(), omega.into(), 0.0]
            }
            pipeline::Odometry::Increment { forward, left, turn, .. } => {
                [motion.duration, 1.0, forward.into(), left.into(), turn.into()]
            }
        };
        self.odometry.between(from, to).iter().flat_map(row).collect()
    }
}

/// Fails when a picture's file is cut short where browsers decode it all the same: a JPEG without its end.
///
/// # Errors
/// A sentence with the file.
#[wasm_bindgen]
pub fn check_whole(path: &str, file: &[u8]) -> Answer<()> {
    monorange_formats::pictures::check_whole(Path::new(path), file).map_err(sentence)
}

/// The warnings about the files read that this has not returned before, a line each.
#[wasm_bindgen]
pub fn warnings() -> Vec<String> {
    monorange_formats::warnings::fresh()
}

/// The places of names in the order of the command line's frames: natural, or by value where all are numbers.
#[wasm_bindgen]
pub fn frame_order(names: Vec<String>) -> Vec<usize> {
    let mut order: Vec<_> = names.into_iter().enumerate().collect();
    files::sort_names(&mut order, |(_, name)| name.clone());
    order.into_iter().map(|(place, _)| place).collect()
}

/// Whether `a` comes before (negative) or after (positive) `b` in the order of the command line's frames.
#[wasm_bindgen]
pub fn natural_order(a: &str, b: &str) -> i32 {
    files::natural_order(a, b) as i32
}
