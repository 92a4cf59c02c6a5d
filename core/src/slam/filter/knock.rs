//! The mount's angles after a knock: let go, or turned as pictures saw it.
//!
//! ```text
//! (tilt, roll) ← (tilt, roll) + (pitch, roll),   P += A Σ Aᵀ,   yaw ← yaw + κ,   heading ← heading − κ
//! ```
//!
//! Nobody sees κ, how far the camera was turned about the vertical: the pictures took it for a turn of the robot. It has the size of what they
//! saw of the other two.
use super::{Covariance, Filter, ROBOT};
use crate::Real;
use crate::geometry::MOUNT_STD_BY_HAND;
use crate::slam::landmark::Landmark;
use nalgebra::{Matrix2, Vector2};

/// Where tilt, roll and yaw of the mount stand in the state.
pub(super) const ANGLES: [usize; 3] = [ROBOT + 1, ROBOT + 2, ROBOT + 3];

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Adds to the variances of tilt, roll and yaw what a mount set by hand has, and returns what they were. For a mount that
    /// is estimated, and a packed covariance.
    pub(in crate::slam) fn let_mount_go(&mut self) -> [T; 3] {
        let mut p = self.parts().p;
        let before = ANGLES.map(|at| p.at(at, at));
        for ((at, variance), let_go) in ANGLES.into_iter().zip(before).zip(let_go().into_iter().skip(1)) {
            p.set(at, at, variance + let_go);
        }
        before
    }

    /// Turns the mount by the pitch and roll that pictures saw, of this covariance. For a mount that is estimated, and a packed covariance; elsewhere nothing happens.
    pub(in crate::slam) fn turn_mount(&mut self, angles: &Vector2<T>, covariance: &Matrix2<T>) {
        if self.config.mount_std.is_none() || self.config.covariance != Covariance::Packed {
            return;
        }
        let [tilt, roll, yaw] = ANGLES;
        let (heading, seen, unseen) = (ROBOT - 1, covariance, angles.norm_squared());
        let mut parts = self.parts();
        for (at, angle) in [tilt, roll].into_iter().zip(angles.iter()) {
            parts.add(at, *angle);
        }
        let mut grown =
            |row: usize, column: usize, by: T| parts.p.set(row, column, parts.p.at(row, column) + by);
        for (row, column, by) in [(tilt, tilt, seen.m11), (roll, tilt, seen.m12), (roll, roll, seen.m22)] {
            grown(row, column, by);
        }
        for (row, column, by) in [(heading, heading, unseen), (yaw, heading, -unseen), (yaw, yaw, unseen)] {
            grown(row, column, by);
        }
    }

    /// Takes that back.
    pub(in crate::slam) fn hold_mount(&mut self, variances: [T; 3]) {
        let mut p = self.parts().p;
        for (at, variance) in ANGLES.into_iter().zip(variances) {
            p.set(at, at, variance);
        }
    }
}

/// Variances that letting go adds to height, tilt, roll and yaw.
pub(super) fn let_go<T: Real>() -> [T; 4] {
    let [_, tilt, roll, yaw, ..] = MOUNT_STD_BY_HAND.map(|std| T::lit(std * std));
    [T::zero(), tilt, roll, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::slam::FilterConfig;
    use nalgebra::Matrix3;

    #[test]
    fn a_turned_mount_is_known_where_it_was_seen_and_its_yaw_is_the_heading_the_other_way() {
        let config = FilterConfig { mount_std: Some([0.005, 0.01, 0.01, 0.01]), ..FilterConfig::default() };
        let mut filter = Filter::on_heap(1, Pose::default(), Matrix3::zeros(), config).unwrap();
        let (angles, seen) = (Vector2::new(0.02, -0.01), Matrix2::new(1e-6, 1e-7, 1e-7, 2e-6));
        filter.turn_mount(&angles, &seen);
        assert_eq!(filter.mount_error().unwrap().fixed_rows::<2>(1), angles);
        let [tilt, roll, yaw] = ANGLES;
        let (heading, at) = (ROBOT - 1, |row: usize, column: usize| filter.covariance_at(row, column));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} {b}");
        near(at(tilt, tilt), 1e-4 + seen.m11);
        near(at(roll, roll), 1e-4 + seen.m22);
        near(at(tilt, roll), seen.m12);
        // What a corner's bearing in the world hangs on is as certain as before.
        near(at(heading, heading) + 2.0 * at(heading, yaw) + at(yaw, yaw), 1e-4);
        near(at(heading, heading), angles.norm_squared());
    }
}
