//! The whole pipeline, as JavaScript drives it: a picture and the odometry up to it, in timed steps.
//!
//! ```text
//! pipeline.load(pixels)                        a grey picture, one byte a pixel
//! pipeline.velocity(t, v, omega, seconds)      or increment(…): any number of readings
//! pipeline.rows()                              smoothing, gradients, edge points
//! pipeline.lines()                             Hough, line fits, corners
//! const report = pipeline.finish(t)            the motion where pictures tell it, association, filter, map
//! ```
//!
//! It is [`monorange_core::pipeline`] and nothing besides, so the numbers are those of the host and of the robot.
use crate::report::{self, Report};
use crate::sentence;
use monorange_core::geometry::RangeFinder;
use monorange_core::image::Grey;
use monorange_core::pipeline::{Carrier, Config, MotionFrom, Odometry, Stage};
use monorange_core::slam::{Reason, Status};
use monorange_core::{Error, Result};
use monorange_protocol::{conversion::config_from_message, message::Configure};
use monorange_wasm_drive::Drive;
use monorange_wasm_record::Verdict;
use monorange_wasm_rig::{JsRig, Rig};
use wasm_bindgen::prelude::*;

/// Landmarks that the map has room for, as on the command line.
pub const LANDMARKS: usize = 512;

/// One camera's pictures and a robot's odometry in, pose and map out.
#[wasm_bindgen]
pub struct Pipeline {
    inner: Drive,
    picture: Vec<u8>,
    mount_std: [f32; 6],
}

type Answer<T> = core::result::Result<T, JsError>;

#[wasm_bindgen]
impl Pipeline {
    /// A pipeline for a rig, with the rig's settings; `by_pictures`: there is no odometry, the pictures tell the motion.
    ///
    /// # Errors
    /// A sentence that names the entry at fault.
    #[wasm_bindgen(constructor)]
    pub fn of_rig(rig: &JsRig, by_pictures: bool) -> Answer<Pipeline> {
        Rig::read(rig).and_then(|rig| Self::new(&rig, by_pictures)).map_err(sentence)
    }

    /// Takes a grey picture of the rig's size.
    ///
    /// # Errors
    /// A sentence with both sizes where they differ.
    pub fn load(&mut self, pixels: &[u8]) -> Answer<()> {
        self.take(pixels).map_err(sentence)
    }

    /// Moves the robot: speed (m/s) and turn rate (rad/s) that held for so many seconds, up to `time`.
    ///
    /// # Errors
    /// A sentence, where time goes back or a number is not finite.
    pub fn velocity(&mut self, time: f64, v: f32, omega: f32, seconds: f32) -> Answer<()> {
        self.odometry(time, &Odometry::Velocity { v, omega, seconds }).map_err(sentence)
    }

    /// Moves the robot by a step in its own frame, up to `time`.
    ///
    /// # Errors
    /// As [`velocity`](Self::velocity).
    pub fn increment(&mut self, time: f64, forward: f32, left: f32, turn: f32, seconds: f32) -> Answer<()> {
        self.odometry(time, &Odometry::Increment { forward, left, turn, seconds }).map_err(sentence)
    }

    /// Runs the picture's rows through the extractor.
    ///
    /// # Errors
    /// A sentence, where there is no picture.
    pub fn rows(&mut self) -> Answer<()> {
        self.push().map_err(sentence)
    }

    /// Finds lines and corners in the rows.
    ///
    /// # Errors
    /// A sentence, where rows are missing.
    pub fn lines(&mut self) -> Answer<()> {
        self.find().map_err(sentence)
    }

    /// The edge points in the picture's rows, as rows u, v.
    pub fn edges(&self) -> Vec<f32> {
        report::edges(self.inner.config().finder.camera(), self.inner.edge_points())
    }

    /// Corrects pose and map by the picture's corners. `ended` is called with 0, 1 and 2 when corners, motion and map are
    /// done, for a clock.
    ///
    /// # Errors
    /// A sentence, where rows are missing or time goes back.
    pub fn finish(&mut self, time: f64, ended: Option<js_sys::Function>) -> Answer<Report> {
        let mut tell = |stage: Stage| {
            let number = match stage {
                Stage::Rows | Stage::Corners => 0,
                Stage::Motion => 1,
                _ => 2,
            };
            if let Some(ended) = &ended {
                // A clock that fails is no reason to lose the picture.
                let _ = ended.call1(&JsValue::NULL, &number.into());
            }
        };
        self.observe(time, &mut tell).map_err(sentence)
    }

    /// Pixels in a row of its pictures.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.size().0
    }

    /// Rows of its pictures.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.size().1
    }

    /// Whether a homography is to carry corners from picture to picture.
    #[wasm_bindgen(getter)]
    pub fn carries(&self) -> bool {
        self.inner.config().carrier != Carrier::Map
    }

    /// The confirmed landmarks as rows id, x, y, var_x, cov_xy, var_y, sightings, first and last time.
    pub fn confirmed(&self) -> Vec<f64> {
        let filter = self.inner.filter();
        let confirmed = filter.landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
        confirmed.filter_map(|known| report::confirmed_row(filter, known)).flatten().collect()
    }

    /// The filter's verdict on itself.
    pub fn verdict(&self) -> Verdict {
        self.inner.health().verdict().into()
    }

    /// What speaks against the filter, in words; empty where nothing does.
    pub fn reason(&self) -> String {
        self.inner.health().reason().map_or("", Reason::as_str).to_owned()
    }

    /// Mean normalised innovation squared a degree of freedom, over the last measurements; 1 is right.
    #[wasm_bindgen(js_name = meanNis)]
    pub fn mean_nis(&self) -> f32 {
        self.inner.health().mean_nis()
    }
}

impl Pipeline {
    /// As the constructor, for Rust.
    ///
    /// # Errors
    /// As [`Drive::new`].
    pub fn new(rig: &Rig, by_pictures: bool) -> Result<Self> {
        let finder: RangeFinder<f32> = rig.finder.cast()?;
        let config = match rig.settings.as_slice() {
            [] => {
                let plain = Config::new(finder);
                Config { motion: plain.motion.with_scales(), ..plain }
            }
            message => {
                let name = "settings, which are no Configure message of this version,";
                let foreign = Error::Size { name, got: message.len(), expected: 0 };
                let message: Configure = postcard::from_bytes(message).map_err(|_| foreign)?;
                config_from_message(&message)?
            }
        };
        let mount_std = rig.mount_std.map(|std| std as f32);
        let [height, tilt, roll, yaw, ..] = mount_std;
        let (motion_from, motion) = match by_pictures {
            true => (MotionFrom::Pictures, config.motion.without_scales()),
            false => (config.motion_from, config.motion),
        };
        let config = Config { finder, mount_std: [height, tilt, roll, yaw], motion_from, motion, ..config };
        Ok(Self { inner: Drive::new(config, LANDMARKS)?, mount_std, picture: Vec::new() })
    }

    /// Width and height of its pictures.
    pub(crate) fn size(&self) -> (usize, usize) {
        let camera = self.inner.config().finder;
        (camera.camera().width(), camera.camera().height())
    }

    pub(crate) fn take(&mut self, pixels: &[u8]) -> Result<()> {
        let (width, height) = self.size();
        let expected = width * height;
        if pixels.len() != expected {
            return Err(Error::Size { name: "picture", got: pixels.len(), expected });
        }
        self.picture.clear();
        self.picture.extend_from_slice(pixels);
        Ok(())
    }

    pub(crate) fn odometry(&mut self, time: f64, reading: &Odometry) -> Result<()> {
        self.inner.odometry(time, reading)
    }

    pub(crate) fn push(&mut self) -> Result<()> {
        let (width, height) = self.size();
        self.inner.rows(Grey::new(&self.picture, width, height)?)
    }

    pub(crate) fn find(&mut self) -> Result<()> {
        self.inner.extraction().map(|_| ())
    }

    /// `ended` is called at the end of each stage.
    pub(crate) fn observe(&mut self, time: f64, ended: &mut dyn FnMut(Stage)) -> Result<Report> {
        let predicted = report::predictions(self.inner.filter(), &self.inner.finder());
        let lines = report::lines(self.inner.extraction()?);
        let seen = self.inner.finish_timed(time, ended)?;
        Ok(Report::new(&seen, self.inner.filter(), &self.inner.finder(), &self.mount_std, predicted, lines))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount};
    use monorange_wasm_record::{Corner, Line};

    /// A wall's edge at u = 80 comes down to the floor at v = 70.
    fn corner_picture() -> Vec<u8> {
        (0..160 * 120)
            .map(|k| {
                if k / 160 > 70 {
                    60
                } else if k % 160 > 80 {
                    180
                } else {
                    120
                }
            })
            .collect()
    }

    fn small_rig() -> Pipeline {
        let camera = Camera::new(160, 120, [180.0; 2], [80.0, 60.0], 0.0, Default::default()).unwrap();
        let mount = Mount::new([0.4, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let finder = RangeFinder::new(camera, mount);
        let rig = Rig { finder, pixel_std: [0.1; 2], mount_std: [0.0; 6], settings: Vec::new() };
        Pipeline::new(&rig, false).unwrap()
    }

    #[test]
    fn a_corner_comes_out_with_its_range_and_lines() {
        let mut pipeline = small_rig();
        pipeline.take(&corner_picture()).unwrap();
        pipeline.push().unwrap();
        let report = pipeline.observe(0.1, &mut |_| ()).unwrap();
        let corners = report.corners();
        assert_eq!(corners.len(), Corner::WIDTH);
        assert!((corners[5] - 2.5).abs() < 0.1, "{corners:?}");
        assert_eq!(report.lines().len(), 2 * Line::WIDTH);
    }
}
