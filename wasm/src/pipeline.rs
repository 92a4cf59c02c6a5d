//! The whole pipeline, as JavaScript drives it: odometry, then a picture in three timed steps.
//!
//! ```text
//! pipeline.velocity(t, v, omega, seconds)      or increment(…): any number of readings
//! pipeline.rows(pixels)                        smoothing, gradients, edge points
//! pipeline.lines()                             Hough, line fits, corners
//! const report = pipeline.finish(t)            association, filter, map
//! ```
//!
//! It is [`monorange_core::pipeline`] and nothing besides, so the numbers are those of the host and of the robot.
use crate::RangeFinder;
use crate::report::{self, Report};
use monorange_core::Result;
use monorange_core::image::Grey;
use monorange_core::pipeline::{self, Config, Memory, Odometry, OnHeap};
use wasm_bindgen::prelude::*;

/// Landmarks that the map has room for.
pub const LANDMARKS: usize = 256;

/// One camera's pictures and a robot's odometry in, pose and map out.
#[wasm_bindgen]
pub struct Pipeline {
    inner: pipeline::Pipeline<OnHeap>,
}

type Answer<T> = core::result::Result<T, JsError>;

fn sentence(error: monorange_core::Error) -> JsError {
    JsError::new(&error.to_string())
}

#[wasm_bindgen]
impl Pipeline {
    /// A pipeline with default settings for the rig of these [`PARAMETERS`](crate::range_finder::PARAMETERS)
    /// numbers.
    ///
    /// # Errors
    /// A sentence that names the parameter at fault.
    #[wasm_bindgen(constructor)]
    pub fn from_parameters(parameters: &[f32]) -> Answer<Pipeline> {
        Self::new(parameters).map_err(sentence)
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

    /// Takes a grey picture of the rig's size, row by row.
    ///
    /// # Errors
    /// A sentence with both sizes where they differ.
    pub fn rows(&mut self, pixels: &[u8]) -> Answer<()> {
        self.push(pixels).map_err(sentence)
    }

    /// Takes a picture of red, green, blue, alpha.
    ///
    /// # Errors
    /// As [`rows`](Self::rows).
    #[wasm_bindgen(js_name = rowsRgba)]
    pub fn rows_rgba(&mut self, pixels: &[u8]) -> Answer<()> {
        let grey: Vec<u8> = pixels.chunks_exact(4).map(luma).collect();
        self.push(&grey).map_err(sentence)
    }

    /// Finds lines and corners in the rows.
    ///
    /// # Errors
    /// A sentence, where rows are missing.
    pub fn lines(&mut self) -> Answer<()> {
        self.inner.extraction().map(|_| ()).map_err(sentence)
    }

    /// The map as rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time.
    pub fn map(&self) -> Vec<f64> {
        let filter = self.inner.filter();
        filter.landmarks().iter().filter_map(|known| report::map_row(filter, known)).flatten().collect()
    }

    /// Corrects pose and map by the picture's corners.
    ///
    /// # Errors
    /// A sentence, where rows are missing or time goes back.
    pub fn finish(&mut self, time: f64) -> Answer<Report> {
        self.observe(time).map_err(sentence)
    }
}

impl Pipeline {
    /// As [`from_parameters`](Self::from_parameters), for Rust.
    ///
    /// # Errors
    /// As [`pipeline::Pipeline::new`].
    pub fn new(parameters: &[f32]) -> Result<Self> {
        let rig = RangeFinder::new(parameters)?;
        let camera = *rig.finder().camera();
        let config = Config { mount_std: rig.angles_and_height_std(), ..Config::new(*rig.finder()) };
        let memory = Memory::on_heap(camera.width(), camera.height(), LANDMARKS);
        Ok(Self { inner: pipeline::Pipeline::new(config, memory)? })
    }

    fn push(&mut self, pixels: &[u8]) -> Result<()> {
        let camera = self.inner.config().finder;
        let (width, height) = (camera.camera().width(), camera.camera().height());
        let picture = Grey::new(pixels, width, height)?;
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
        Pipeline::new(&parameters).unwrap()
    }

    #[test]
    fn a_corner_comes_out_with_its_range_and_lines() {
        let mut pipeline = small_rig();
        pipeline.push(&corner_picture()).unwrap();
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
