//! A rolling shutter's pictures: corners and keypoints are put to where the middle row's time would have them.
use super::{Config, Odometry, Pipeline, Storage};
use crate::geometry::RangeFinder;
use crate::setting::settings;
use nalgebra::Vector2;

settings! { SHUTTER, SHUTTER_REFERENCES, Config, "shutter" {
    65 readout: Number [readout] (0, 1, "s"), "Seconds from the first row's exposure to the last one's, of a rolling shutter; 0 of a global one. A picture's time is then that of its middle row.", "0 is a global shutter; the data sheet says it, many small cameras take 0.02 to 0.035.";
}}

/// Speed (m/s) and turn rate (rad/s) of a reading; `None` of one that takes no time.
pub(super) fn velocity(odometry: &Odometry) -> Option<Vector2<f32>> {
    match *odometry {
        Odometry::Velocity { v, omega, .. } => Some(Vector2::new(v, omega)),
        Odometry::Increment { forward, turn, seconds, .. } => {
            (seconds > 0.0).then(|| Vector2::new(forward, turn) / seconds)
        }
    }
}

impl<S: Storage> Pipeline<S> {
    /// Where the middle row's time has a pixel; the pixel itself of a global shutter, or where the motion is not known.
    pub(super) fn with_middle_row(&self, finder: &RangeFinder<f32>, pixel: Vector2<f32>) -> Vector2<f32> {
        let readout = self.config.readout;
        let moving = self.velocity.filter(|_| readout > 0.0);
        moving.and_then(|velocity| finder.with_middle_row(pixel, readout, velocity)).unwrap_or(pixel)
    }
}
