use crate::{errors::value, range_finder::RangeFinder, results::make, rig::named};
use monorange_core::{
    calibration::{Fitted, KnownPoint, PointNoise, fit_points, point_residual},
    geometry::{MOUNT_PARAMETERS, RangeFinder as Finder},
};
use monorange_formats::files::Rig;
use nalgebra::Vector2;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};

/// The mount from floor points whose places were measured, by least squares.
///
/// Args:
///     finder: the camera, and the mount as measured by hand.
///     pixels: (N, 2) float64 of (u, v), px.
///     places: (N, 2) float64 of (x, y) in the robot's frame, m.
///     fit: some of "height", "tilt", "roll", "yaw", "forward", "left"; the first four without it.
///     pixel_std: px. range_std: share of the range. bearing_std: rad.
///
/// Returns:
///     Calibration: the better finder, its mount, standard deviations, residuals, whether they agree with the noise.
///
/// Raises:
///     ValueError: the points do not determine what is fitted.
#[pyfunction]
#[pyo3(signature = (finder, pixels, places, *, fit = None, pixel_std = 1.0, range_std = 0.01, bearing_std = 0.01))]
#[expect(clippy::too_many_arguments, reason = "Python's callers name them")]
pub(crate) fn calibrate<'py>(
    py: Python<'py>,
    finder: &RangeFinder,
    pixels: PyReadonlyArray2<'py, f64>,
    places: PyReadonlyArray2<'py, f64>,
    fit: Option<Vec<String>>,
    pixel_std: f64,
    range_std: f64,
    bearing_std: f64,
) -> PyResult<Bound<'py, PyAny>> {
    if pixels.shape() != places.shape() || pixels.shape()[1] != 2 {
        let (a, b) = (pixels.shape(), places.shape());
        return Err(value(format!(
            "pixels and places must both have the shape (N, 2), have {a:?} and {b:?}"
        )));
    }
    let rows = |array: &PyReadonlyArray2<'py, f64>| -> Vec<Vector2<f64>> {
        array.as_array().rows().into_iter().map(|row| Vector2::new(row[0], row[1])).collect()
    };
    let points: Vec<_> = rows(&pixels)
        .into_iter()
        .zip(rows(&places))
        .map(|(pixel, place)| KnownPoint::from_place(pixel, place))
        .collect();
    const NAMES: [&str; 6] = MOUNT_PARAMETERS;
    let fit = fit.unwrap_or_else(|| ["height", "tilt", "roll", "yaw"].map(str::to_owned).into());
    if let Some(unknown) = fit.iter().find(|name| !NAMES.contains(&name.as_str())) {
        return Err(value(format!("`{unknown}` cannot be fitted, only {} can", NAMES.join(", "))));
    }
    let fitted = Fitted(NAMES.map(|name| fit.iter().any(|wanted| wanted == name)));
    let noise = PointNoise { pixel_std_px: pixel_std, range_std_share: range_std, bearing_std };
    let noise = noise.validated().map_err(value)?;
    let (camera, first) = (finder.rig.finder.camera(), finder.rig.finder.mount());
    let found = py.detach(|| fit_points(camera, first, points.iter(), &noise, fitted)).map_err(value)?;
    let better = Finder::new(*camera, found.mount);
    let residuals: Vec<f64> = points
        .iter()
        .flat_map(|point| point_residual(&better, point).map_or([f64::NAN; 2], |residual| residual.into()))
        .collect();
    let mut mount_std = finder.rig.mount_std;
    for (slot, (std, fitted)) in mount_std.iter_mut().zip(found.std().into_iter().zip(fitted.0)) {
        if fitted {
            *slot = std;
        }
    }
    let rig = Rig::new(better, finder.rig.pixel_std, mount_std).map_err(value)?;
    let mount = PyDict::new(py);
    for (name, number) in named(found.mount.parameters()) {
        mount.set_item(name, number)?;
    }
    let residuals = PyArray1::from_vec(py, residuals).reshape([points.len(), 2])?;
    make(py, "Calibration", (RangeFinder { rig }, mount, found.std(), residuals, found.is_consistent()))
}
