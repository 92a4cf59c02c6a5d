use crate::{errors::value, pictures::grey, range_finder::RangeFinder, results::make};
use monorange_formats::{
    extraction::{HeapExtractor, extractor},
    files::Rig,
};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;

/// Finds floor corners: where an upright edge meets the floor.
///
/// Args:
///     finder: the camera whose pictures are searched.
#[pyclass(module = "monorange")]
pub(crate) struct Extractor {
    rig: Rig,
    extractor: HeapExtractor,
}

#[pymethods]
impl Extractor {
    #[new]
    fn new(finder: &RangeFinder) -> PyResult<Self> {
        let rig = finder.rig.clone();
        let extractor = extractor(&rig).map_err(value)?;
        Ok(Self { rig, extractor })
    }

    /// The floor corners in a grey picture.
    ///
    /// Args:
    ///     picture: (height, width) uint8, contiguous; read without a copy.
    ///
    /// Returns:
    ///     Corners: pixels (N, 2) and covariances (N, 2, 2), px^2.
    fn corners<'py>(
        &mut self,
        py: Python<'py>,
        picture: PyReadonlyArray2<'py, u8>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels = grey(&picture, &self.rig)?;
        let width = self.rig.finder.camera().width();
        let extractor = &mut self.extractor;
        let found = py.detach(|| -> Result<Vec<_>, monorange_core::Error> {
            extractor.begin();
            pixels.chunks(width).try_for_each(|row| extractor.push_row(row))?;
            Ok(extractor.finish()?.corners.iter().map(|corner| (corner.pixel, corner.covariance)).collect())
        });
        let found = found.map_err(value)?;
        let places = found.iter().flat_map(|(pixel, _)| [pixel.x, pixel.y].map(f64::from)).collect();
        let covariances =
            found.iter().flat_map(|(_, c)| [c.m11, c.m12, c.m21, c.m22].map(f64::from)).collect();
        let places = PyArray1::from_vec(py, places).reshape([found.len(), 2])?;
        make(py, "Corners", (places, PyArray1::from_vec(py, covariances).reshape([found.len(), 2, 2])?))
    }
}
