//! What functions give, as the dataclasses of `monorange/_results.py`.
use pyo3::{call::PyCallArgs, prelude::*};

/// An object of the dataclass `name` with these fields, in their order.
pub(crate) fn make<'py>(
    py: Python<'py>,
    name: &str,
    fields: impl PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("monorange._results")?.getattr(name)?.call1(fields)
}
