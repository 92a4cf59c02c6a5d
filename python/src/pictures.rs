//! Pictures out of numpy arrays.
use crate::errors::value;
use monorange_formats::files::Rig;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The pixels of a grey picture of the rig's size, (height, width) of uint8, without a copy.
pub(crate) fn grey<'a>(picture: &'a PyReadonlyArray2<'_, u8>, rig: &Rig) -> PyResult<&'a [u8]> {
    let camera = rig.finder.camera();
    let expected = [camera.height(), camera.width()];
    if picture.shape() != expected {
        return Err(value(format!(
            "the picture has the shape {:?}, the camera's is {expected:?} (height, width)",
            picture.shape()
        )));
    }
    // `as_slice` takes columns one after the other for contiguous too.
    let rows = picture.is_c_contiguous().then(|| picture.as_slice().ok()).flatten();
    rows.ok_or_else(|| value("the picture must be contiguous (C order): numpy.ascontiguousarray(picture)"))
}
