use crate::{
    errors::value,
    results::make,
    rig::{Numbers, named, read},
};
use monorange_core::geometry::{NoFloor, Ranged, Sighting};
use monorange_formats::files::Rig;
use nalgebra::{Matrix2, Vector2};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};
use rayon::prelude::*;
use std::path::PathBuf;

/// Pixels that one thread takes at a time.
const CHUNK: usize = 4096;
/// Pixels that go through the lens together.
const TOGETHER: usize = 8;

/// A calibrated camera on its mount: pixels of the floor to range and bearing, with covariance.
///
/// Frames: the robot's is x forward, y left, z up; bearing is positive to the left; pixel (0, 0) is the centre of the top-left
/// pixel. Lengths are metres, angles radians.
///
/// Args:
///     camera_matrix: (3, 3), [[fu, s, u0], [0, fv, v0], [0, 0, 1]], px.
///     size: (width, height) of the picture, px.
///     height: of the lens centre above the floor, m.
///     tilt: of the optical axis, positive downwards, rad.
///     distortion: k1, k2, p1, p2[, k3[, k4, k5, k6]] as OpenCV orders them; k1 to k4 of a fisheye.
///     lens: "plumb_bob", "rational_polynomial" or "equidistant" (fisheye).
///     roll, yaw: positive with the left side up, and to the left, rad.
///     forward, left: of the lens centre in the robot's frame, m.
///     pixel_std: standard deviation of (u, v), px.
///     mount_std: standard deviations of height, tilt, roll, yaw, forward, left: m and rad.
///
/// Raises:
///     ValueError: a number is not finite or out of its range.
#[pyclass(frozen, module = "monorange")]
pub(crate) struct RangeFinder {
    pub(crate) rig: Rig,
}

/// What is known of a pixel: range, bearing, x, y, four covariances and the status.
type Sight = ([f64; 4], [f64; 4], u8);

#[pymethods]
impl RangeFinder {
    #[new]
    #[pyo3(signature = (camera_matrix, *, size, height, tilt, distortion = Vec::new(), lens = "plumb_bob".to_owned(), roll = 0.0, yaw = 0.0,
        forward = 0.0, left = 0.0, pixel_std = None, mount_std = None))]
    #[expect(clippy::too_many_arguments, reason = "Python's callers name them")]
    fn new(
        camera_matrix: [[f64; 3]; 3],
        size: (usize, usize),
        height: f64,
        tilt: f64,
        distortion: Vec<f64>,
        lens: String,
        roll: f64,
        yaw: f64,
        forward: f64,
        left: f64,
        pixel_std: Option<(f64, f64)>,
        mount_std: Option<[f64; 6]>,
    ) -> PyResult<Self> {
        let mount = [height, tilt, roll, yaw, forward, left];
        let numbers = Numbers { size, matrix: camera_matrix, distortion, lens, mount, mount_std, pixel_std };
        Ok(Self { rig: numbers.rig()? })
    }

    /// The range finder in a rig file (TOML).
    ///
    /// Raises:
    ///     ValueError: names the file, the line and the key.
    #[staticmethod]
    fn from_rig(path: PathBuf) -> PyResult<Self> {
        Ok(Self { rig: read(&path)? })
    }

    /// (width, height) of the picture, px.
    #[getter]
    fn size(&self) -> (usize, usize) {
        let camera = self.rig.finder.camera();
        (camera.width(), camera.height())
    }

    /// height, tilt, roll, yaw, forward, left: m and rad.
    #[getter]
    fn mount<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mount = PyDict::new(py);
        for (name, number) in named(self.rig.finder.mount().parameters()) {
            mount.set_item(name, number)?;
        }
        Ok(mount)
    }

    /// Standard deviations of height, tilt, roll, yaw, forward, left: m and rad.
    #[getter]
    fn mount_std(&self) -> [f64; 6] {
        self.rig.mount_std
    }

    /// Standard deviations of u and v, px.
    #[getter]
    fn pixel_std(&self) -> [f64; 2] {
        self.rig.pixel_std
    }

    /// Writes camera and mount as a rig file (TOML).
    fn write_rig(&self, path: PathBuf) -> PyResult<()> {
        let mut text = Vec::new();
        self.rig.write(&mut text)?;
        Ok(std::fs::write(path, text)?)
    }

    /// Range and bearing of the floor points that pixels see.
    ///
    /// Args:
    ///     pixels: (N, 2) float64 of (u, v), px; read without a copy where contiguous.
    ///     pixel_std: (u, v), px; the rig's without it.
    ///     mount_uncertainty: adds the mount's, which is common to all pixels.
    ///     height_above_floor: of what is seen, m: a switch, a lamp, a marker on a wall. Above the lens "above_horizon" means below it.
    ///
    /// Returns:
    ///     Sightings: arrays of N; NaN where a pixel sees no floor.
    ///
    /// Raises:
    ///     ValueError: another shape, or not contiguous.
    #[pyo3(signature = (pixels, pixel_std = None, mount_uncertainty = false, height_above_floor = 0.0))]
    fn sight<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
        pixel_std: Option<(f64, f64)>,
        mount_uncertainty: bool,
        height_above_floor: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels = pairs(&pixels, "pixels")?;
        let covariance = match pixel_std {
            None => self.rig.pixel_covariance(),
            Some((u, v)) if u > 0.0 && v > 0.0 => Matrix2::new(u * u, 0.0, 0.0, v * v),
            Some(_) => return Err(value("pixel_std must be above 0 (pixels)")),
        };
        let count = pixels.len();
        let mount_std = mount_uncertainty.then_some(&self.rig.mount_std);
        let finder = &self.rig.finder.of_height(height_above_floor).map_err(value)?;
        // Each becomes an array as it is.
        let [mut range, mut bearing, mut x, mut y] = [(); 4].map(|()| vec![0.0; count]);
        let (mut covariances, mut status) = (vec![0.0; 4 * count], vec![0; count]);
        py.detach(|| {
            let parts = (
                pixels.par_chunks(CHUNK),
                range.par_chunks_mut(CHUNK),
                bearing.par_chunks_mut(CHUNK),
                x.par_chunks_mut(CHUNK),
                y.par_chunks_mut(CHUNK),
                covariances.par_chunks_mut(4 * CHUNK),
                status.par_chunks_mut(CHUNK),
            );
            parts.into_par_iter().for_each(|(pixels, range, bearing, x, y, covariances, status)| {
                let mut put = |index: usize, (numbers, covariance, code): Sight| {
                    [range[index], bearing[index], x[index], y[index]] = numbers;
                    covariances[4 * index..4 * index + 4].copy_from_slice(&covariance);
                    status[index] = code;
                };
                if let Some(std) = mount_std {
                    for (index, pixel) in pixels.iter().enumerate() {
                        put(index, with_mount(finder.sight(Vector2::from(*pixel)), &covariance, std));
                    }
                    return;
                }
                let (groups, rest) = pixels.as_chunks::<TOGETHER>();
                for (group, pixels) in groups.iter().enumerate() {
                    for (index, seen) in finder.ranges(pixels.map(Vector2::from)).iter().enumerate() {
                        put(TOGETHER * group + index, without_mount(seen, &covariance));
                    }
                }
                for (index, pixel) in rest.iter().enumerate() {
                    let [seen] = finder.ranges([Vector2::from(*pixel)]);
                    put(TOGETHER * groups.len() + index, without_mount(&seen, &covariance));
                }
            });
        });
        let covariance = PyArray1::from_vec(py, covariances).reshape([count, 2, 2])?;
        let [range, bearing, x, y] = [range, bearing, x, y].map(|column| PyArray1::from_vec(py, column));
        make(py, "Sightings", (range, bearing, covariance, x, y, PyArray1::from_vec(py, status)))
    }

    /// The pixels that see floor points: (N, 2) of (x, y) in the robot's frame, m, to (N, 2) of (u, v); NaN where none does.
    fn pixels<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = pairs(&points, "points")?;
        let finder = &self.rig.finder;
        let pixels: Vec<f64> = py.detach(|| {
            let pixel = |point: &[f64; 2]| {
                finder.pixel_from_floor(Vector2::from(*point)).map_or([f64::NAN; 2], |pixel| pixel.into())
            };
            points.par_iter().with_min_len(CHUNK).flat_map_iter(pixel).collect()
        });
        PyArray1::from_vec(py, pixels).reshape([points.len(), 2])
    }

    fn __repr__(&self) -> String {
        let ((width, height), [up, tilt, ..]) = (self.size(), self.rig.finder.mount().parameters());
        format!(
            "RangeFinder({width}x{height} px, {up} m above the floor, tilted {:.2} deg)",
            tilt.to_degrees()
        )
    }
}

#[inline]
fn without_mount(seen: &Result<Ranged<f64>, NoFloor>, pixel_covariance: &Matrix2<f64>) -> Sight {
    match seen {
        Ok(seen) => told(seen.range, seen.bearing, seen.point_in_robot, seen.noise(pixel_covariance)),
        Err(why) => untold(*why),
    }
}

fn with_mount(
    seen: Result<Sighting<f64>, NoFloor>,
    pixel_covariance: &Matrix2<f64>,
    mount_std: &[f64; 6],
) -> Sight {
    match seen {
        Ok(seen) => {
            let covariance = seen.noise(pixel_covariance) + seen.systematic(mount_std);
            told(seen.range, seen.bearing, seen.point_in_robot, covariance)
        }
        Err(why) => untold(why),
    }
}

#[inline]
fn told(range: f64, bearing: f64, point: Vector2<f64>, c: Matrix2<f64>) -> Sight {
    ([range, bearing, point.x, point.y], [c.m11, c.m12, c.m21, c.m22], 0)
}

fn untold(why: NoFloor) -> Sight {
    let code = match why {
        NoFloor::AboveHorizon => 1,
        NoFloor::OutsideImage => 2,
        NoFloor::OutsideLensModel => 3,
    };
    ([f64::NAN; 4], [f64::NAN; 4], code)
}

/// The rows of a contiguous (N, 2) array.
fn pairs<'a>(array: &'a PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<&'a [[f64; 2]]> {
    if array.shape()[1] != 2 {
        return Err(value(format!("{name} must have the shape (N, 2), has {:?}", array.shape())));
    }
    // `as_slice` takes columns one after the other for contiguous too.
    let numbers = array.is_c_contiguous().then(|| array.as_slice().ok()).flatten();
    let numbers = numbers.ok_or_else(|| value(format!("{name} must be contiguous (C order)")))?;
    Ok(numbers.as_chunks::<2>().0)
}
