//! Pixels as a robot that stands level sees them by a global shutter: those of a rolling one are put to where the middle row's time
//! would have them, and those of a robot that leans to where it would see them if it did not.
use super::{Odometry, Pipeline, Storage};
use crate::geometry::RangeFinder;
use crate::{Error, Result};
use nalgebra::Vector2;

/// What is known of the moment of a picture.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moment {
    /// Last known, m/s and rad/s.
    pub(super) velocity: Option<Vector2<f32>>,
    /// In the picture at hand, or the next one.
    pub(super) lean: Option<Lean>,
    /// Whether that picture has been seen.
    pub(super) seen: bool,
}

/// How a robot leans.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lean {
    pitch: f32,
    roll: f32,
    pub(super) std: f32,
}

/// Beyond this no robot leans that still drives, rad.
const MOST: f32 = 0.8;

impl Moment {
    /// Forgets how the robot leaned in the picture before.
    pub(super) fn begin(&mut self) {
        if self.seen {
            self.lean = None;
        }
    }

    /// Notes the speed of a reading; one that takes no time has none.
    pub(super) fn note(&mut self, odometry: &Odometry) {
        self.velocity = match *odometry {
            Odometry::Velocity { v, omega, .. } => Some(Vector2::new(v, omega)),
            Odometry::Increment { forward, turn, seconds, .. } => {
                (seconds > 0.0).then(|| Vector2::new(forward, turn) / seconds)
            }
        };
    }
}

impl<S: Storage> Pipeline<S> {
    /// Takes how the robot leans when the next picture is taken, as an IMU tells it: `pitch` about its y axis (nose down is
    /// positive) and `roll` about its x axis (left side up is positive), rad, as ROS has them (REP 103), and the standard deviation of
    /// each. Corners and keypoints of that picture are put to where a level robot would see them. What is left is a state of the filter, for
    /// that picture in the place of [`Config::sway`](super::Config::sway), where the mount's errors are estimated and the covariance is packed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an angle of more than 0.8, a standard deviation below 0 or above that, or a number that is not finite.
    pub fn attitude(&mut self, pitch: f32, roll: f32, std: f32) -> Result<()> {
        for (name, angle, least) in
            [("attitude.pitch", pitch, -MOST), ("attitude.roll", roll, -MOST), ("attitude.std", std, 0.0)]
        {
            if !(least..=MOST).contains(&angle) {
                let expected = "an angle in rad, of at most 0.8";
                return Err(Error::OutOfRange { name, value: angle.into(), expected });
            }
        }
        (self.moment.lean, self.moment.seen) = (Some(Lean { pitch, roll, std }), false);
        Ok(())
    }

    /// Whether this picture's pixels are where they were found.
    #[cfg(all(feature = "alloc", feature = "sift"))]
    pub(super) fn is_steady(&self) -> bool {
        self.config.readout == 0.0 && self.moment.lean.is_none()
    }

    /// Where a level robot's global shutter has a pixel; the pixel itself where the motion is not known.
    pub(super) fn steady(&self, finder: &RangeFinder<f32>, pixel: Vector2<f32>) -> Vector2<f32> {
        let (Moment { velocity, lean, .. }, readout) = (self.moment, self.config.readout);
        let moving = velocity.filter(|_| readout > 0.0);
        let still =
            moving.and_then(|velocity| finder.with_middle_row(pixel, readout, velocity)).unwrap_or(pixel);
        lean.and_then(|lean| finder.levelled(still, lean.pitch, lean.roll)).unwrap_or(still)
    }
}
