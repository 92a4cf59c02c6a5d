//! A mount whose angles change from picture to picture: the robot pitches and rolls, or the camera gives way.
//!
//! ```text
//! θ ← s θ,   P_θ· ← s P_θ·,   s = min(1, σ₀/√P_θθ)      no more is unknown of the mount than in the beginning
//! P_θθ ← P_θθ + σ²                                      and what has changed since the last picture
//! ```
//!
//! θ is the error of tilt, roll or yaw, σ₀ its standard deviation in the beginning, σ that of its change. The corners of a picture share it, so
//! that those of mapped landmarks measure it, and the others are ranged with it.
use super::knock::ANGLES;
use super::{Covariance, Filter};
use crate::Real;
use crate::slam::landmark::Landmark;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Lets tilt and roll change by `sway` (rad) from the last picture to the next, and each angle by what the configuration says of
    /// the mount. For a mount that is estimated, and a packed covariance; others stay as they are.
    pub(crate) fn sway(&mut self, sway: T) {
        let (sway, walk) = (sway * sway, self.config.mount_walk * self.config.mount_walk);
        self.change_angles([sway + walk, sway + walk, walk]);
    }

    /// Lets the yaw change by this standard deviation, rad.
    pub(crate) fn change_yaw(&mut self, std: T) {
        self.change_angles([T::zero(), T::zero(), std * std]);
    }

    /// Lets tilt, roll and yaw change by these variances.
    fn change_angles(&mut self, changes: [T; 3]) {
        let Some(first) = self.config.mount_std else { return };
        if self.config.covariance != Covariance::Packed {
            return;
        }
        let size = self.size;
        let parts = self.parts();
        let mut p = parts.p;
        let [_, first @ ..] = first;
        for ((at, change), first) in ANGLES.into_iter().zip(changes).zip(first) {
            if change == T::zero() {
                continue;
            }
            let known = p.at(at, at);
            let most = first * first;
            if known > most {
                let share = (most / known).sqrt();
                for other in (0..size).filter(|other| *other != at) {
                    p.set(at, other, p.at(at, other) * share);
                }
                for value in [&mut *parts.x, &mut *parts.rounding] {
                    value.iter_mut().skip(at).take(1).for_each(|value| *value *= share);
                }
            }
            p.set(at, at, known.min(most) + change);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::{Camera, Mount, Pose, RangeFinder};
    use crate::slam::{Filter, FilterConfig, Measurement};
    use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

    const TILT: usize = 4;
    /// The landmark's x.
    const AHEAD: usize = 7;

    fn filter() -> Filter<f64, std::vec::Vec<f64>, std::vec::Vec<crate::slam::Landmark<f64>>> {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let mount_std = Some([0.005, 0.02, 0.02, 0.02]);
        let config = FilterConfig { finder: Some(finder), mount_std, ..FilterConfig::default() };
        let mut filter = Filter::on_heap(1, Pose::default(), Matrix3::zeros(), config).unwrap();
        let pixel = Measurement::Pixel { pixel: Vector2::new(200.0, 130.0), covariance: Matrix2::identity() };
        filter.birth(0.0, 1, &pixel).unwrap();
        filter
    }

    #[test]
    fn a_stiff_mount_stays_as_it_is() {
        let (before, mut after) = (filter(), filter());
        after.sway(0.0);
        assert_eq!(before.into_storage().0, after.into_storage().0);
    }

    #[test]
    fn what_is_unknown_of_tilt_grows_by_its_change_and_to_a_bound_and_the_covariance_stays_positive() {
        let (mut filter, first, sway) = (filter(), 0.02 * 0.02, 0.03 * 0.03);
        let shared = filter.covariance_at(TILT, AHEAD).abs();
        assert!(shared > 0.0);
        for _ in 0..3 {
            filter.sway(0.03);
            assert!((filter.covariance_at(TILT, TILT) - first - sway).abs() < 1e-12);
        }
        // The landmark was ranged with the tilt of its own picture, of which less and less is left.
        assert!(filter.covariance_at(TILT, AHEAD).abs() < 0.5 * shared);
        let covariance = SMatrix::<f64, 9, 9>::from_fn(|row, column| filter.covariance_at(row, column));
        let least = covariance.symmetric_eigenvalues().min();
        assert!(least > -1e-12, "{least}");
    }

    #[test]
    fn sway_wants_a_mount_that_is_estimated() {
        let exact = FilterConfig { sway: 0.01, ..FilterConfig::<f64>::default() };
        let error = exact.validated().unwrap_err();
        assert!(std::format!("{error}").contains("filter.sway"), "{error}");
    }
}
