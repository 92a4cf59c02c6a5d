use pyo3::{PyErr, exceptions::PyValueError};

/// The core's words, or a file's, as `ValueError`.
pub(crate) fn value(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}
