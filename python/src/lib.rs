//! The native half of the Python package `smithwalk`: flat arrays of
//! directions in, flat arrays of values out, on all cores, without the
//! interpreter's lock. What users see (shapes, defaults, documentation) is
//! `smithwalk/__init__.py`.

mod measure;
mod scatter;
mod surface;

use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

/// The first row that is no unit vector, to a millionth.
#[pyfunction]
fn first_not_unit(rows: PyReadonlyArray2<'_, f64>) -> PyResult<Option<usize>> {
    let mut rows = rows.as_slice()?.chunks_exact(3);
    let square = |v: &[f64]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    // What is no number is off as well.
    let unit = |v| (square(v) - 1.0).abs() <= 1e-6;
    Ok(rows.position(|v| !unit(v)))
}

#[pymodule]
fn _smithwalk(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(first_not_unit, module)?)?;
    module.add_class::<surface::Surface>()
}
