//! The whole pipeline, as JavaScript drives it: a picture and the odometry up to it, in timed steps.
//!
//! ```text
//! pipeline.load(pixels)                        a grey picture (loadRgba: a coloured one)
//! pipeline.velocity(t, v, omega, seconds)      or increment(…): any number of readings
//! pipeline.rows()                              smoothing, gradients, edge points
//! pipeline.lines()                             Hough, line fits, corners
//! const report = pipeline.finish(t)            the motion where pictures tell it, association, filter, map
//! ```
//!
//! It is [`monorange_core::pipeline`] and nothing besides, so the numbers are those of the host and of the robot.
use crate::RangeFinder;
use crate::report::{self, Report};
use monorange_core::Result;
use monorange_core::image::Grey;
use monorange_core::pipeline::{self, Config, Memory, MotionFrom, Odometry, OnHeap};
use monorange_core::slam::Status;
use monorange_protocol::{conversion::config_from_message, message::Configure};
use wasm_bindgen::prelude::*;

/// Landmarks that the map has room for, as on the command line.
pub const LANDMARKS: usize = 512;

/// One camera's pictures and a robot's odometry in, pose and map out.
#[wasm_bindgen]
pub struct Pipeline {
    inner: pipeline::Pipeline<OnHeap>,
    picture: Vec<u8>,
}

const FOREIGN_SETTINGS: &str = "the settings are no Configure message of this version";

type Answer<T> = core::result::Result<T, JsError>;

fn sentence(error: monorange_core::Error) -> JsError {
    JsError::new(&error.to_string())
}

#[wasm_bindgen]
impl Pipeline {
    /// A pipeline for the rig of these [`PARAMETERS`](crate::range_finder::PARAMETERS) numbers. `settings` is a
    /// `Configure` message of the co-processor's protocol, of which everything but the rig counts; empty for the
    /// default settings. `by_pictures`: there is no odometry, the motion comes from the pictures.
    ///
    /// # Errors
    /// A sentence that names the parameter at fault.
    #[wasm_bindgen(constructor)]
    pub fn from_parameters(parameters: &[f32], settings: &[u8], by_pictures: bool) -> Answer<Pipeline> {
        let settings = match settings {
            [] => None,
            message => Some(postcard::from_bytes(message).map_err(|_| JsError::new(FOREIGN_SETTINGS))?),
        };
        Self::new(parameters, settings.as_ref(), by_pictures).map_err(sentence)
    }

    /// Takes a grey picture of the rig's size.
    ///
    /// # Errors
    /// A sentence with both sizes where they differ.
    pub fn load(&mut self, pixels: &[u8]) -> Answer<()> {
        self.take(pixels.len(), pixels.iter().copied()).map_err(sentence)
    }

    /// Takes a picture of red, green, blue, alpha.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    #[wasm_bindgen(js_name = loadRgba)]
    pub fn load_rgba(&mut self, pixels: &[u8]) -> Answer<()> {
        self.take(pixels.len() / 4, pixels.chunks_exact(4).map(luma)).map_err(sentence)
    }

    /// Moves the robot: speed (m/s) and turn rate (rad/s) that held for so many seconds, up to `time`.
    ///
    /// # Errors
    /// A sentence, where time goes back or a number is not finite.
    pub fn velocity(&mut self, time: f64, v: f32, omega: f32, seconds: f32) -> Answer<()> {
        self.inner.odometry(time, &Odometry::Velocity { v, omega, seconds }).map_err(sentence)
    }

    /// Moves the robot by a step in its own frame, up to `time`.
    ///
    /// # Errors
    /// As [`velocity`](Self::velocity).
    pub fn increment(&mut self, time: f64, forward: f32, left: f32, turn: f32, seconds: f32) -> Answer<()> {
        self.inner.odometry(time, &Odometry::Increment { forward, left, turn, seconds }).map_err(sentence)
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
        self.inner.extraction().map(|_| ()).map_err(sentence)
    }

    /// The edge points in the picture's rows, as rows u, v.
    pub fn edges(&self) -> Vec<f32> {
        report::edges(self.inner.config().finder.camera(), self.inner.edge_points())
    }

    /// Corrects pose and map by the picture's corners.
    ///
    /// # Errors
    /// A sentence, where rows are missing or time goes back.
    pub fn finish(&mut self, time: f64) -> Answer<Report> {
        self.observe(time).map_err(sentence)
    }

    /// The confirmed landmarks as rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time.
    pub fn map(&self) -> Vec<f64> {
        let filter = self.inner.filter();
        let confirmed = filter.landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
        confirmed.filter_map(|known| report::map_row(filter, known)).flatten().collect()
    }

    /// The filter's verdict on itself.
    pub fn verdict(&self) -> String {
        self.inner.health().verdict().as_str().to_owned()
    }

    /// Mean normalised innovation squared a degree of freedom, over the last measurements; 1 is right.
    #[wasm_bindgen(js_name = meanNis)]
    pub fn mean_nis(&self) -> f32 {
        self.inner.health().mean_nis()
    }
}

impl Pipeline {
    /// As [`from_parameters`](Self::from_parameters), for Rust.
    ///
    /// # Errors
    /// As [`pipeline::Pipeline::new`].
    pub fn new(parameters: &[f32], settings: Option<&Configure>, by_pictures: bool) -> Result<Self> {
        let rig = RangeFinder::new(parameters)?;
        let finder = *rig.finder();
        let config = settings.map_or(Ok(Config::new(finder)), config_from_message)?;
        let motion_from = if by_pictures { MotionFrom::Pictures } else { config.motion_from };
        let config = Config { finder, mount_std: rig.angles_and_height_std(), motion_from, ..config };
        let memory = Memory::on_heap(finder.camera().width(), finder.camera().height(), LANDMARKS);
        let picture = Vec::new();
        Ok(Self { inner: pipeline::Pipeline::new(config, memory)?, picture })
    }

    fn size(&self) -> (usize, usize) {
        let camera = self.inner.config().finder;
        (camera.camera().width(), camera.camera().height())
    }

    fn take(&mut self, count: usize, pixels: impl Iterator<Item = u8>) -> Result<()> {
        let (width, height) = self.size();
        let expected = width * height;
        if count != expected {
            return Err(monorange_core::Error::Size { name: "picture", got: count, expected });
        }
        self.picture.clear();
        self.picture.extend(pixels);
        Ok(())
    }

    fn push(&mut self) -> Result<()> {
        let (width, height) = self.size();
        let picture = Grey::new(&self.picture, width, height)?;
        self.inner.begin();
        picture.rows().try_for_each(|row| self.inner.push_row(row))
    }

    fn observe(&mut self, time: f64) -> Result<Report> {
        let predicted = report::predictions(self.inner.filter(), &self.inner.finder());
        let lines = report::lines(self.inner.extraction()?);
        let seen = self.inner.finish(time)?;
        Ok(Report::new(&seen, self.inner.filter(), predicted, lines))
    }
}

/// Rec. 709 luma in whole numbers, as the host reads coloured pictures.
fn luma(pixel: &[u8]) -> u8 {
    let [red, green, blue, ..] = *pixel else { return 0 };
    ((2126 * u32::from(red) + 7152 * u32::from(green) + 722 * u32::from(blue)) / 10_000) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut parameters = [0.0; crate::range_finder::PARAMETERS];
        parameters[..6].copy_from_slice(&[160.0, 120.0, 180.0, 180.0, 80.0, 60.0]);
        parameters[12..16].copy_from_slice(&[0.1, 0.1, 0.4, 0.1]);
        Pipeline::new(&parameters, None, false).unwrap()
    }

    #[test]
    fn a_corner_comes_out_with_its_range_and_lines() {
        let mut pipeline = small_rig();
        pipeline.take(160 * 120, corner_picture().into_iter()).unwrap();
        pipeline.push().unwrap();
        let report = pipeline.observe(0.1).unwrap();
        let corners = report.corners();
        assert_eq!(corners.len(), report::CORNER_COLUMNS);
        assert!((corners[5] - 2.5).abs() < 0.1, "{corners:?}");
        assert_eq!(report.lines().len(), 2 * report::LINE_COLUMNS);
    }

    #[test]
    fn grey_in_colour_is_the_same_grey() {
        for grey in 0..=255 {
            assert_eq!(luma(&[grey, grey, grey, 255]), grey);
        }
    }
}
