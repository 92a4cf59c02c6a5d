//! The mount from points that someone clicked and measured.
use monorange_core::calibration::{Fitted, KnownPoint as Measured, PointNoise, fit_points};
use monorange_core::geometry::{Camera, Lens, Mount, RangeFinder};
use monorange_core::{Error, Result};
use nalgebra::Vector2;
use serde::Deserialize;
use wasm_bindgen::prelude::*;

/// A pixel and the floor point (X, Y) of the robot's frame that it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownPoint {
    /// (u, v), px.
    pub pixel: Vector2<f64>,
    /// (X, Y), m.
    pub point_in_robot: Vector2<f64>,
}

/// A mount that was fitted: metres and radians, `_std` their standard deviations.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountFit {
    /// Of the camera above the floor.
    pub height: f64,
    /// Positive downwards.
    pub tilt: f64,
    /// About the viewing direction.
    pub roll: f64,
    /// Positive to the left.
    pub yaw: f64,
    /// Of the height.
    pub height_std: f64,
    /// Of the tilt.
    pub tilt_std: f64,
    /// Of the roll.
    pub roll_std: f64,
    /// Of the yaw.
    pub yaw_std: f64,
    /// Root mean square distance between the points and where the mount sees them, m.
    pub rms: f64,
    /// Correlation of height and tilt.
    pub correlation: f64,
}

/// The mount from rows u, v, x, y of clicked pixels and the floor points they are known to see; camera and first guess
/// are those of a page's rig.
///
/// # Errors
/// A sentence, where the rig has no camera or the points do not determine the mount.
#[wasm_bindgen(js_name = fitMount)]
pub fn fit_of_rig(rig: JsValue, rows: &[f64]) -> core::result::Result<MountFit, JsError> {
    let known = |row: &[f64]| {
        let [u, v, x, y] = *row else { return None };
        Some(KnownPoint { pixel: Vector2::new(u, v), point_in_robot: Vector2::new(x, y) })
    };
    let points: Vec<_> = rows.chunks_exact(4).filter_map(known).collect();
    let text = js_sys::JSON::stringify(&rig).ok().and_then(|text| text.as_string()).unwrap_or_default();
    let rig: RigEntries = serde_json::from_str(&text)?;
    let (camera, mount) = rig.read()?;
    Ok(fit_mount(&camera, &mount, &points)?)
}

/// What a fit needs of a page's rig.
#[derive(Deserialize)]
struct RigEntries {
    width: usize,
    height: usize,
    focal: [f64; 2],
    principal: [f64; 2],
    skew: f64,
    lens: String,
    distortion: Vec<f64>,
    mount: MountEntries,
}

#[derive(Deserialize)]
struct MountEntries {
    height: f64,
    tilt: f64,
    roll: f64,
    yaw: f64,
    forward: f64,
    left: f64,
}

impl RigEntries {
    fn read(&self) -> Result<(Camera<f64>, Mount<f64>)> {
        let got = self.distortion.len();
        let lens = match self.lens.as_str() {
            "equidistant" => self.distortion.as_slice().try_into().ok().map(Lens::Equidistant),
            _ => Lens::from_polynomial(&self.distortion),
        };
        let lens = lens.ok_or(Error::Size { name: "distortion", got, expected: 5 })?;
        let MountEntries { height, tilt, roll, yaw, forward, left } = self.mount;
        let camera = Camera::with_lens(self.width, self.height, self.focal, self.principal, self.skew, lens)?;
        Ok((camera, Mount::new([height, tilt, roll, yaw, forward, left])?))
    }
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
    let [height, tilt, roll, yaw, ..] = fit.mount.parameters();
    let [height_std, tilt_std, roll_std, yaw_std, ..] = fit.std();
    Ok(MountFit {
        height,
        tilt,
        roll,
        yaw,
        height_std,
        tilt_std,
        roll_std,
        yaw_std,
        rms: (points.iter().map(off).sum::<f64>() / points.len() as f64).sqrt(),
        correlation: fit.covariance.m12 / (height_std * tilt_std),
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
        for (fitted, is) in [fit.height, fit.tilt, fit.roll, fit.yaw].into_iter().zip(TRUE) {
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
