//! The mount's angles let go, as after a knock.
use super::{Filter, ROBOT};
use crate::Real;
use crate::geometry::MOUNT_STD_BY_HAND;
use crate::slam::landmark::Landmark;

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
