//! A camera that was knocked between two pictures: its change of pitch and roll, where no step over the floor explains the matches.
//!
//! Matches of a floor and of what stands on it follow one arc, whatever the arc is. A camera that pitches by a degree meanwhile moves them all by
//! six pixels more at a focal length of 365: then the best arc explains a few of them, and badly, while an arc with a pitch and a roll explains
//! nearly all to the noise of keypoints, and says both angles to a hundredth of a degree.
//!
//! On `dev_home` and `dev_office` (rendered), which the bounds were chosen on, no step of a stiff camera passes them, while ones whose camera is knocked by a degree of pitch do.
//! An angle need not be sure: it is taken with its covariance.
//!
//! *Limits.* A knock about the vertical looks as a turn of the robot does.
use super::motion_likelihood::Track;
use super::{GroundMotion, GroundMotionConfig, Match, MotionPrior, NoMotion, ground_motion};
use crate::Real;
use crate::geometry::RangeFinder;
use nalgebra::{Matrix2, Vector2};

/// The body's pitch and roll at the second picture less those at the first, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jolt<T> {
    /// Pitch (down is positive) and roll (right is positive).
    pub angles: Vector2<T>,
    /// Their covariance.
    pub covariance: Matrix2<T>,
}

/// Variance factor of a step above which it is asked whether the camera was knocked.
const BENT: f64 = 4.0;
/// How far a camera may be knocked, rad: so little is known of it that the matches alone say.
const FREE: f64 = 0.1;
/// The least angle that is taken for a knock, rad, in deviations, and by how much it must make matches fit better that a rigid camera explains at
/// all, in variance.
const LEAST: f64 = 0.3 * core::f64::consts::PI / 180.0;
const SURE: f64 = 2.0;
const BETTER: f64 = 2.0;
/// Matches on the floor that tell it, at least.
const ON_FLOOR: f64 = 6.0;

/// The motion with a jolt, where that explains the matches of a motion that was sought without one.
pub(super) fn jolted<T: Real>(
    rigid: &Result<GroundMotion<T>, NoMotion>,
    config: &GroundMotionConfig<T>,
    finder: &RangeFinder<T>,
    matches: &[Match<T>],
    prior: Option<&MotionPrior<T>>,
    tracks: &mut [Track<T>],
) -> Option<(GroundMotion<T>, Jolt<T>)> {
    let is_stiff = config.pitch_std == T::zero() && config.roll_std == T::zero();
    let rest = rigid.as_ref().ok().map(|motion| motion.variance_factor);
    if !is_stiff || rest.is_some_and(|rest| rest < T::lit(BENT)) {
        return None;
    }
    let free = GroundMotionConfig { pitch_std: T::lit(FREE), roll_std: T::lit(FREE), ..*config };
    let motion = ground_motion(&free, finder, matches, prior, tracks).ok()?;
    let jolt = motion.attitude;
    let variances = jolt.covariance.diagonal();
    let is_sure = |(angle, variance): (&T, &T)| {
        angle.abs() > T::lit(LEAST) && *angle * *angle > *variance * T::lit(SURE * SURE)
    };
    let explains = rest.is_none_or(|rest| motion.variance_factor * T::lit(BETTER) < rest);
    let told = explains && motion.floor > T::lit(ON_FLOOR);
    (told && jolt.angles.iter().zip(variances.iter()).any(is_sure)).then_some((motion, jolt))
}
