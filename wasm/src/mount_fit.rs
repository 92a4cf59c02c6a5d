//! The mount from floor points of known position: weighted least squares on range and bearing.
//!
//! ```text
//! minimise over m = (height, tilt, roll, yaw)   Σᵢ rᵢᵀ Wᵢ rᵢ,   rᵢ = (range, bearing)ᵢ − f(pixelᵢ, m)
//! Wᵢ = (J_pixel σ² J_pixelᵀ)⁻¹,     (Σ J_mᵀ W J_m + λ diag) δ = Σ J_mᵀ W r
//! ```
//!
//! by Levenberg and Marquardt with the range finder's own Jacobians, in f64. A click is taken to be good to one
//! pixel; the covariance (Σ J_mᵀ W J_m)⁻¹ grows with the residuals where they say that it was not. Two points
//! give four equations for four unknowns; points at one distance cannot tell height from tilt, which the
//! correlation of the two says.
use monorange_core::geometry::{Camera, Mount, RangeFinder, wrap_angle};
use monorange_core::{Error, Result};
use nalgebra::{Matrix4, SMatrix, Vector2, Vector4};

/// Standard deviation of a click, px.
const CLICK_STD: f64 = 1.0;
const MAX_ITERATIONS: usize = 100;

/// A pixel and the floor point (X, Y) of the robot's frame that it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPoint {
    /// (u, v), px.
    pub pixel: Vector2<f64>,
    /// (X, Y), m.
    pub point_in_robot: Vector2<f64>,
}

/// A mount that was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountFit {
    /// Height, tilt, roll, yaw, forward, left.
    pub parameters: [f64; 6],
    /// Standard deviations of height, tilt, roll, yaw.
    pub std: [f64; 4],
    /// Root mean square distance between the points and where the mount sees them, m.
    pub rms: f64,
    /// Correlation of height and tilt.
    pub correlation: f64,
}

struct Normal {
    matrix: Matrix4<f64>,
    gradient: Vector4<f64>,
    cost: f64,
    squared_distance: f64,
}

/// The mount that sees the points where they are, from a first guess; the lever arm stays as it is.
///
/// # Errors
/// [`Error::Size`] with fewer than two points; [`Error::OutOfRange`] where the points do not determine the mount.
pub fn fit_mount(camera: &Camera<f64>, first: &Mount<f64>, points: &[KnownPoint]) -> Result<MountFit> {
    if points.len() < 2 {
        return Err(Error::Size { name: "points", got: points.len(), expected: 2 });
    }
    let undetermined = Error::OutOfRange {
        name: "points",
        value: points.len() as f64,
        expected: "floor points below the horizon, near and far, left and right",
    };
    let mut parameters = first.parameters();
    let mut normal = normal_equations(camera, &parameters, points).ok_or(undetermined)?;
    let mut damping = 1e-3;
    for _ in 0..MAX_ITERATIONS {
        let damped = normal.matrix + Matrix4::from_diagonal(&(normal.matrix.diagonal() * damping));
        let step = damped.cholesky().ok_or(undetermined)?.solve(&normal.gradient);
        let mut moved = parameters;
        for (parameter, change) in moved.iter_mut().zip(step.iter()) {
            *parameter += *change;
        }
        match normal_equations(camera, &moved, points).filter(|next| next.cost <= normal.cost) {
            Some(next) => {
                let settled = normal.cost - next.cost <= 1e-12 * (1.0 + normal.cost);
                (parameters, normal) = (moved, next);
                damping = (damping * 0.2).max(1e-12);
                if settled {
                    break;
                }
            }
            None if damping > 1e8 => break,
            None => damping *= 5.0,
        }
    }
    let covariance = normal.matrix.try_inverse().ok_or(undetermined)?;
    let freedom = 2 * points.len() - 4;
    let scale = if freedom > 0 { (normal.cost / freedom as f64).max(1.0) } else { 1.0 };
    let std = covariance.diagonal().map(|variance| libm::sqrt(variance * scale));
    if !std.iter().all(|std| std.is_finite()) {
        return Err(undetermined);
    }
    Ok(MountFit {
        parameters,
        std: std.into(),
        rms: libm::sqrt(normal.squared_distance / points.len() as f64),
        correlation: covariance.m12 / libm::sqrt(covariance.m11 * covariance.m22),
    })
}

/// `None` where the mount is impossible or a pixel does not see the floor with it.
fn normal_equations(camera: &Camera<f64>, parameters: &[f64; 6], points: &[KnownPoint]) -> Option<Normal> {
    let finder = RangeFinder::new(*camera, Mount::new(*parameters).ok()?);
    let mut normal =
        Normal { matrix: Matrix4::zeros(), gradient: Vector4::zeros(), cost: 0.0, squared_distance: 0.0 };
    for known in points {
        let seen = finder.sight(known.pixel).ok()?;
        let at = known.point_in_robot;
        let residual =
            Vector2::new(at.norm() - seen.range, wrap_angle(libm::atan2(at.y, at.x) - seen.bearing));
        let covariance = seen.by_pixel * seen.by_pixel.transpose() * (CLICK_STD * CLICK_STD);
        let weight = covariance.try_inverse()?;
        let by_mount: SMatrix<f64, 2, 4> = seen.by_mount.fixed_columns::<4>(0).into();
        normal.matrix += by_mount.transpose() * weight * by_mount;
        normal.gradient += by_mount.transpose() * weight * residual;
        normal.cost += residual.dot(&(weight * residual));
        normal.squared_distance += (seen.point_in_robot - at).norm_squared();
    }
    normal.cost.is_finite().then_some(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUE: [f64; 6] = [0.43, 0.22, 0.02, -0.03, 0.0, 0.0];

    fn camera() -> Camera<f64> {
        Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap()
    }

    fn points(pixels: &[(f64, f64)]) -> Vec<KnownPoint> {
        let finder = RangeFinder::new(camera(), Mount::new(TRUE).unwrap());
        let known = |&(u, v): &(f64, f64)| {
            let pixel = Vector2::new(u, v);
            KnownPoint { pixel, point_in_robot: finder.sight(pixel).unwrap().point_in_robot }
        };
        pixels.iter().map(known).collect()
    }

    #[test]
    fn exact_points_give_the_mount_back() {
        let points = points(&[(40.0, 230.0), (280.0, 225.0), (60.0, 120.0), (250.0, 110.0), (160.0, 160.0)]);
        let first = Mount::new([0.3, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let fit = fit_mount(&camera(), &first, &points).unwrap();
        for (fitted, is) in fit.parameters.iter().zip(TRUE) {
            assert!((fitted - is).abs() < 1e-6, "{fit:?}");
        }
        assert!(fit.rms < 1e-6 && fit.correlation.abs() < 0.999, "{fit:?}");
    }

    #[test]
    fn points_at_one_distance_hardly_tell_height_from_tilt() {
        let row = points(&[(40.0, 160.0), (160.0, 160.0), (280.0, 160.0)]);
        let spread = points(&[(40.0, 230.0), (160.0, 110.0), (280.0, 160.0)]);
        let first = Mount::new(TRUE).unwrap();
        let [row, spread] = [row, spread].map(|points| fit_mount(&camera(), &first, &points).unwrap());
        assert!(row.correlation.abs() > spread.correlation.abs(), "{row:?} {spread:?}");
        assert!(row.std[0] > 3.0 * spread.std[0], "{row:?} {spread:?}");
    }

    #[test]
    fn one_point_is_too_few() {
        let first = Mount::new(TRUE).unwrap();
        assert!(fit_mount(&camera(), &first, &points(&[(40.0, 160.0)])).is_err());
    }
}
