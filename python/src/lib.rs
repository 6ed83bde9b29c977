//! The native half of the Python package `smithwalk`: flat arrays of
//! directions in, flat arrays of values out, on all cores, without the
//! interpreter's lock. What users see (shapes, defaults, documentation) is
//! `smithwalk/__init__.py`.

mod measure;
mod scatter;
mod surface;

use pyo3::prelude::*;

#[pymodule]
fn _smithwalk(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<surface::Surface>()
}
