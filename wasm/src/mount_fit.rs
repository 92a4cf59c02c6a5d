//! The mount from points that someone clicked and measured.
use monorange_core::calibration::{Fitted, KnownPoint as Measured, PointNoise, fit_points};
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use monorange_core::{Error, Result};
use nalgebra::Vector2;

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

/// The mount that sees the points where they are, from a first guess; the lever arm stays as it is.
///
/// # Errors
/// [`Error::Size`] with fewer than two points; [`Error::OutOfRange`] where the points do not determine the mount.
pub fn fit_mount(camera: &Camera<f64>, first: &Mount<f64>, points: &[KnownPoint]) -> Result<MountFit> {
    if points.len() < 2 {
        return Err(Error::Size { name: "points", got: points.len(), expected: 2 });
    }
    let measured: Vec<_> =
        points.iter().map(|point| Measured::from_place(point.pixel, point.point_in_robot)).collect();
    let fit = fit_points(camera, first, measured.iter(), &PointNoise::default(), Fitted::HEIGHT_AND_ANGLES)?;
    let finder = RangeFinder::new(*camera, fit.mount);
    let off = |point: &KnownPoint| {
        finder
            .floor_from_pixel(point.pixel)
            .map_or(f64::NAN, |seen| (seen - point.point_in_robot).norm_squared())
    };
    let [height, tilt, roll, yaw, ..] = fit.std();
    let std = [height, tilt, roll, yaw];
    Ok(MountFit {
        parameters: fit.mount.parameters(),
        std,
        rms: libm::sqrt(points.iter().map(off).sum::<f64>() / points.len() as f64),
        correlation: fit.covariance.m12 / (std[0] * std[1]),
    })
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
    fn one_point_is_too_few() {
        let first = Mount::new(TRUE).unwrap();
        assert!(fit_mount(&camera(), &first, &points(&[(40.0, 160.0)])).is_err());
    }
}
