use crate::{errors::value, pictures::grey, range_finder::RangeFinder, results::make};
use monorange_core::{
    geometry::Pose,
    image::Grey,
    scan::{BEAMS, Reading, ScanConfig},
};
use monorange_formats::{extraction::scanner, files::Rig};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// How far the floor is free, in every direction: a laser scan from pictures.
///
/// Say with `moved` how the robot has moved since the last picture: what pictures say of the same place of the floor is then put
/// together. Without it each picture stands for itself.
///
/// Args:
///     finder: camera and mount.
///     beams: of a scan, 2 to 96, evenly over the field; one a degree without it.
///     field: bearings of the first and the last beam, rad; what the picture shows without it.
#[pyclass(module = "monorange")]
pub(crate) struct Scanner {
    rig: Rig,
    scanner: Box<monorange_core::scan::Scanner>,
    /// Whether the way from the last picture on is known.
    moved: bool,
}

#[pymethods]
impl Scanner {
    #[new]
    #[pyo3(signature = (finder, beams = None, field = None))]
    fn new(finder: &RangeFinder, beams: Option<usize>, field: Option<[f32; 2]>) -> PyResult<Self> {
        if beams.is_some_and(|beams| !(2..=BEAMS).contains(&beams)) {
            return Err(value(format!("beams must be from 2 to {BEAMS}")));
        }
        let config = ScanConfig { beams: beams.unwrap_or(0), field, ..ScanConfig::default() };
        Self::of_rig(finder.rig.clone(), config)
    }

    /// The robot has moved since the last picture: forward and left (m), then turned (rad). Several calls are one after the other.
    fn moved(&mut self, forward: f32, left: f32, turn: f32) -> PyResult<()> {
        if ![forward, left, turn].into_iter().all(f32::is_finite) {
            return Err(value("forward and left (m) and turn (rad) must be finite numbers"));
        }
        self.go(&Pose::new(forward, left, turn));
        Ok(())
    }

    /// The scan of a picture.
    ///
    /// Args:
    ///     picture: (height, width) uint8, contiguous; read without a copy.
    ///
    /// Returns:
    ///     Scan: bearing, free, range, var_range (N,) and kind of each beam.
    fn scan<'py>(
        &mut self,
        py: Python<'py>,
        picture: PyReadonlyArray2<'py, u8>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels = grey(&picture, &self.rig)?;
        let camera = self.rig.finder.camera();
        let picture = Grey::new(pixels, camera.width(), camera.height()).map_err(value)?;
        self.look(py, picture)
    }
}

impl Scanner {
    pub(crate) fn of_rig(rig: Rig, config: ScanConfig) -> PyResult<Self> {
        let scanner = scanner(&rig, config).map_err(value)?;
        Ok(Self { rig, scanner, moved: false })
    }

    /// The robot's motion since the last call or picture.
    pub(crate) fn go(&mut self, before_from_after: &Pose<f32>) {
        self.scanner.moved(before_from_after);
        self.moved = true;
    }

    /// The `Scan` of a picture of the rig's size.
    pub(crate) fn look<'py>(&mut self, py: Python<'py>, picture: Grey<'_>) -> PyResult<Bound<'py, PyAny>> {
        if !std::mem::take(&mut self.moved) {
            self.scanner.forget_past();
        }
        let scanner = &mut self.scanner;
        let readings = py.detach(|| scanner.scan(picture)).map_err(value)?;
        let column = |of: fn(&Reading) -> f32| {
            PyArray1::from_vec(py, readings.iter().map(|reading| f64::from(of(reading))).collect())
        };
        let kind: Vec<_> = readings.iter().map(|reading| reading.kind.name()).collect();
        let (bearing, free) = (column(|beam| beam.bearing), column(|beam| beam.free));
        let range = column(|beam| beam.range.unwrap_or(f32::NAN));
        let var_range = column(|beam| beam.range.map_or(f32::NAN, |_| beam.var_range));
        make(py, "Scan", (bearing, free, range, var_range, kind))
    }
}
