//! The sample sequence: a drive along a simulated corridor, as files.
//!
//! Pictures are drawn when they are asked for, so that a long drive takes no memory; everything has the names
//! and the columns of `monorange simulate`, and goes the way of files that someone drops.
use core::fmt::Write;
use monorange_core::Result;
use monorange_core::geometry::Pose;
use monorange_sim::{MOUNT_STD, PIXEL_STD, Scene, SceneConfig, SimConfig, Simulation, default_rig};
use wasm_bindgen::prelude::*;

/// A simulated drive.
#[wasm_bindgen]
pub struct Sample {
    simulation: Simulation,
}

#[wasm_bindgen]
impl Sample {
    /// A drive of so many pictures along the corridor with so many people about.
    ///
    /// # Errors
    /// A sentence that names the setting at fault.
    #[wasm_bindgen(constructor)]
    pub fn from_settings(frames: usize, walkers: usize, seed: u32) -> core::result::Result<Sample, JsError> {
        Self::new(frames, walkers, seed).map_err(|error| JsError::new(&error.to_string()))
    }

    /// Number of pictures.
    pub fn frames(&self) -> usize {
        self.simulation.len()
    }

    /// The picture as a PGM file.
    pub fn picture(&self, frame: usize) -> Vec<u8> {
        let camera = self.simulation.rig().camera();
        let (width, height) = (camera.width(), camera.height());
        let mut file = format!("P5\n{width} {height}\n255\n").into_bytes();
        let head = file.len();
        file.resize(head + width * height, 0);
        if let Some(pixels) = file.get_mut(head..) {
            // The buffer has the camera's size, the one thing that can be wrong.
            let _ = self.simulation.render(frame, pixels);
        }
        file
    }

    /// `rig.toml`.
    pub fn rig(&self) -> String {
        let camera = self.simulation.rig().camera();
        let [height, tilt, roll, yaw, forward, left] = self.simulation.rig().mount().parameters();
        let lens = camera.lens().coefficients();
        let [height_std, tilt_std, roll_std, yaw_std, ..] = MOUNT_STD;
        format!(
            "[camera]\nwidth = {}\nheight = {}\nfocal = [{}, {}]\nprincipal = [{}, {}]\nskew = {:?}\n\
             distortion = {:?}\npixel_std = {PIXEL_STD:?}\n\n\
             [mount]\nheight = {height:?}\ntilt_deg = {:?}\nroll_deg = {:?}\nyaw_deg = {:?}\n\
             forward = {forward:?}\nleft = {left:?}\nheight_std = {height_std:?}\ntilt_std_deg = {:?}\n\
             roll_std_deg = {:?}\nyaw_std_deg = {:?}\n",
            camera.width(),
            camera.height(),
            camera.focal().x,
            camera.focal().y,
            camera.principal().x,
            camera.principal().y,
            camera.skew(),
            lens,
            tilt.to_degrees(),
            roll.to_degrees(),
            yaw.to_degrees(),
            tilt_std.to_degrees(),
            roll_std.to_degrees(),
            yaw_std.to_degrees(),
        )
    }

    /// `times.txt`.
    pub fn times(&self) -> String {
        self.lines("", |line, frame| writeln!(line, "{}", self.simulation.time(frame)))
    }

    /// `odometry.csv`: speed and turn rate, each until the next line.
    pub fn odometry(&self) -> String {
        self.lines("t,v,omega\n", |line, frame| {
            let twist = self.simulation.odometry(frame);
            writeln!(line, "{},{},{}", self.simulation.time(frame), twist.speed, twist.turn)
        })
    }

    /// `truth.tum`: the true robot in the world.
    pub fn truth(&self) -> String {
        self.lines("", |line, frame| {
            let Pose { x, y, heading } = self.simulation.true_pose(frame);
            let (sin, cos) = (heading / 2.0).sin_cos();
            writeln!(line, "{} {x} {y} 0 0 0 {sin} {cos}", self.simulation.time(frame))
        })
    }
}

impl Sample {
    /// As [`from_settings`](Self::from_settings), for Rust.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(frames: usize, walkers: usize, seed: u32) -> Result<Self> {
        let seed = u64::from(seed);
        let scene = Scene::corridor(&SceneConfig { seed, ..SceneConfig::default() });
        // Half as many pictures a metre as `monorange simulate` takes: the way round the corridor, and into it again,
        // is seen in a few seconds.
        let interval = 2.0 * SimConfig::default().interval;
        let config = SimConfig { frames, walkers, seed, interval, ..SimConfig::default() };
        Ok(Self { simulation: Simulation::new(scene, default_rig()?, config)? })
    }

    fn lines(&self, head: &str, line: impl Fn(&mut String, usize) -> core::fmt::Result) -> String {
        let mut text = head.to_owned();
        for frame in 0..self.simulation.len() {
            // Writing to a string cannot fail.
            let _ = line(&mut text, frame);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_a_pgm_file_of_the_cameras_size() {
        let sample = Sample::new(2, 1, 1).unwrap();
        let file = sample.picture(1);
        assert!(file.starts_with(b"P5\n320 240\n255\n"));
        assert_eq!(file.len(), 15 + 320 * 240);
        assert_ne!(file[15..], sample.picture(0)[15..]);
    }

    #[test]
    fn text_files_have_a_line_a_frame() {
        let sample = Sample::new(3, 0, 1).unwrap();
        assert_eq!(sample.times().lines().count(), 3);
        assert_eq!(sample.odometry().lines().count(), 4);
        assert!(sample.truth().lines().all(|line| line.split(' ').count() == 8));
        assert!(sample.rig().contains("height = 0.4\n"), "{}", sample.rig());
    }
}
