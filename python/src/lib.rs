//! monorange for Python: the classes of the module `monorange._monorange`, which `monorange/__init__.py` shows.
//!
//! Arrays come in without a copy where they are contiguous and of the right type, and go out as they were computed. The
//! interpreter's lock is released while Rust works.
mod calibration;
mod device;
mod drive;
mod errors;
mod evaluation;
mod extractor;
mod pictures;
mod range_finder;
mod results;
mod rig;
mod scanner;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
fn _monorange(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<range_finder::RangeFinder>()?;
    module.add_class::<extractor::Extractor>()?;
    module.add_class::<drive::Drive>()?;
    module.add_class::<scanner::Scanner>()?;
    module.add_class::<device::Device>()?;
    module.add_function(wrap_pyfunction!(calibration::calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::evaluate, module)?)?;
    Ok(())
}
