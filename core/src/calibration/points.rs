//! From floor points whose place is known.
//!
//! ```text
//! r = (range, bearing)_measured − f(pixel, m),    W⁻¹ = J_u σ_px² J_uᵀ + diag((ε r)², σ_φ²)
//! ```
//!
//! ε and σ_φ are the tape's: measured by hand, a range is good to about 1 % and a bearing, which comes from two
//! sides of a triangle, to about 0.01 rad. With Table 2's five points they decide, not the pixel's 0.1 px.
use super::{Fitted, MountFit, Normal, solve};
use crate::geometry::{Camera, Mount, RangeFinder, wrap_angle};
use crate::{Error, Result};
use nalgebra::{Matrix2, SMatrix, Vector2};

/// A pixel, and where the floor point that it sees was measured to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPoint {
    /// (u, v), px.
    pub pixel: Vector2<f64>,
    /// (range in m, bearing in rad) from the robot's origin.
    pub range_bearing: Vector2<f64>,
}

impl KnownPoint {
    /// A point known by its place (X, Y) in the robot's frame, m.
    pub fn from_place(pixel: Vector2<f64>, point_in_robot: Vector2<f64>) -> Self {
        let (range, bearing) = crate::geometry::range_bearing_from_floor(point_in_robot);
        Self { pixel, range_bearing: Vector2::new(range, bearing) }
    }
}

/// How well pixels and places are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointNoise {
    /// Standard deviation of a pixel in either direction, px.
    pub pixel_std_px: f64,
    /// Standard deviation of a measured range, as a share of it.
    pub range_std_share: f64,
    /// Standard deviation of a measured bearing, rad.
    pub bearing_std: f64,
}

impl Default for PointNoise {
    /// A click, and a tape measure: 1 px, 1 %, 0.01 rad.
    fn default() -> Self {
        Self { pixel_std_px: 1.0, range_std_share: 0.01, bearing_std: 0.01 }
    }
}

/// The mount that sees the points where they were measured, from a first guess.
///
/// # Errors
/// [`Error::OutOfRange`] where the points do not determine what is fitted, or one is above the first guess's
/// horizon.
///
/// ```
/// use monorange_core::geometry::{Camera, Mount, RangeFinder};
/// use monorange_core::calibration::{Fitted, KnownPoint, PointNoise, fit_points};
/// use nalgebra::Vector2;
/// let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default())?;
/// let truth = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.01, 0.02, 0.0, 0.0])?);
/// let points = [[40.0, 230.0], [280.0, 225.0], [60.0, 120.0], [250.0, 110.0]].map(|[u, v]| {
///     let pixel = Vector2::new(u, v);
///     KnownPoint::from_place(pixel, truth.floor_from_pixel(pixel).expect("below the horizon"))
/// });
/// let by_hand = Mount::new([0.42, 0.22, 0.0, 0.0, 0.0, 0.0])?;
/// let fit = fit_points(&camera, &by_hand, points.iter(), &PointNoise::default(), Fitted::HEIGHT_AND_ANGLES)?;
/// assert!((fit.mount.height() - 0.4).abs() < 1e-9);
/// # Ok::<(), monorange_core::Error>(())
/// ```
pub fn fit_points<'a>(
    camera: &Camera<f64>,
    first: &Mount<f64>,
    points: impl Iterator<Item = &'a KnownPoint> + Clone,
    noise: &PointNoise,
    fitted: Fitted,
) -> Result<MountFit> {
    solve(first, fitted, |mount| {
        let finder = RangeFinder::new(*camera, *mount);
        let mut normal = Normal::default();
        for point in points.clone() {
            let (residual, covariance, by_mount) = residual(&finder, point, noise)?;
            let weight = covariance.try_inverse()?;
            normal.matrix += by_mount.transpose() * weight * by_mount;
            normal.gradient += by_mount.transpose() * weight * residual;
            normal.cost += residual.dot(&(weight * residual));
            normal.count += 2;
        }
        normal.cost.is_finite().then_some(normal)
    })
}

/// (range, bearing) as measured less as seen through the finder; `None` where the pixel does not see the floor.
pub fn point_residual(finder: &RangeFinder<f64>, point: &KnownPoint) -> Option<Vector2<f64>> {
    let seen = finder.sight(point.pixel).ok()?;
    Some(difference(point, seen.range, seen.bearing))
}

fn difference(point: &KnownPoint, range: f64, bearing: f64) -> Vector2<f64> {
    Vector2::new(point.range_bearing.x - range, wrap_angle(point.range_bearing.y - bearing))
}

/// The residual of a point's range and of its bearing, each in standard deviations; `None` where the pixel does not see
/// the floor.
pub fn deviations(finder: &RangeFinder<f64>, point: &KnownPoint, noise: &PointNoise) -> Option<[f64; 2]> {
    let (residual, covariance, _) = residual(finder, point, noise)?;
    Some([residual.x / libm::sqrt(covariance.m11), residual.y / libm::sqrt(covariance.m22)])
}

/// The residual, its covariance, and ∂(range, bearing)/∂m.
pub(super) fn residual(
    finder: &RangeFinder<f64>,
    point: &KnownPoint,
    noise: &PointNoise,
) -> Option<(Vector2<f64>, Matrix2<f64>, SMatrix<f64, 2, 6>)> {
    let seen = finder.sight(point.pixel).ok()?;
    let of_pixel = seen.noise(&(Matrix2::identity() * (noise.pixel_std_px * noise.pixel_std_px)));
    let range_std = noise.range_std_share * point.range_bearing.x;
    let of_tape = Matrix2::new(range_std * range_std, 0.0, 0.0, noise.bearing_std * noise.bearing_std);
    let by_mount = seen.by_mount;
    Some((difference(point, seen.range, seen.bearing), of_pixel + of_tape, by_mount))
}

impl PointNoise {
    /// The noise itself if it can weigh anything.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the value that cannot be used.
    pub fn validated(self) -> Result<Self> {
        let values = [
            ("pixel_std_px", self.pixel_std_px),
            ("range_std_share", self.range_std_share),
            ("bearing_std", self.bearing_std),
        ];
        for (name, value) in values {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfRange { name, value, expected: "a finite number above 0" });
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const TRUE: [f64; 6] = [0.43, 0.22, 0.02, -0.03, 0.0, 0.0];
    const SPREAD: [(f64, f64); 6] =
        [(40.0, 230.0), (280.0, 225.0), (60.0, 120.0), (250.0, 110.0), (160.0, 160.0), (100.0, 190.0)];

    fn camera() -> Camera<f64> {
        Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap()
    }

    fn points(pixels: &[(f64, f64)]) -> Vec<KnownPoint> {
        let finder = RangeFinder::new(camera(), Mount::new(TRUE).unwrap());
        let known = |&(u, v): &(f64, f64)| {
            let pixel = Vector2::new(u, v);
            KnownPoint::from_place(pixel, finder.sight(pixel).unwrap().point_in_robot)
        };
        pixels.iter().map(known).collect()
    }

    fn fit(points: &[KnownPoint], fitted: Fitted) -> Result<MountFit> {
        let first = Mount::new([0.3, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
        fit_points(&camera(), &first, points.iter(), &PointNoise::default(), fitted)
    }

    #[test]
    fn exact_points_give_the_mount_back() {
        let fit = fit(&points(&SPREAD), Fitted::HEIGHT_AND_ANGLES).unwrap();
        for (fitted, is) in fit.mount.parameters().iter().zip(TRUE) {
            assert!((fitted - is).abs() < 1e-6, "{fit:?}");
        }
        assert_eq!((fit.freedom, fit.indistinct()), (8, None));
    }

    #[test]
    fn what_is_not_fitted_stays() {
        let fit = fit(&points(&SPREAD), Fitted::ANGLES).unwrap();
        assert_eq!((fit.mount.height(), fit.std()[0]), (0.3, 0.0));
    }

    #[test]
    fn points_at_one_distance_do_not_tell_height_from_tilt() {
        let row = fit(&points(&[(40.0, 160.0), (160.0, 160.0), (280.0, 161.0)]), Fitted::HEIGHT_AND_ANGLES);
        let warned =
            row.map_or(true, |fit| fit.indistinct().is_some_and(|(names, _)| names == ["height", "tilt"]));
        assert!(warned, "{row:?}");
    }

    #[test]
    fn too_few_points_are_refused() {
        assert!(fit(&points(&[(40.0, 160.0)]), Fitted::HEIGHT_AND_ANGLES).is_err());
        assert!(fit(&[], Fitted::ANGLES).is_err());
    }
}
