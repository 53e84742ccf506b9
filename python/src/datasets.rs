//! Results and frames as datasets of xarray, which `python/dermis/_xarray.py` makes.

use dermis_golden::spec::sensor::Sensor;
use numpy::PyArray1;
use pyo3::prelude::*;

/// The dataset that a function of `_xarray.py` makes of `own`, on an array.
///
/// # Errors
/// xarray is not installed.
pub fn made<'py>(function: &str, own: &Bound<'py, PyAny>, sensor: &Sensor) -> PyResult<Bound<'py, PyAny>> {
    let py = own.py();
    let x_mm = PyArray1::from_iter(py, (0..sensor.cols).map(|col| sensor.position_mm(0, col)[0]));
    let y_mm = PyArray1::from_iter(py, (0..sensor.rows).map(|row| sensor.position_mm(row, 0)[1]));
    py.import("dermis._xarray")?.call_method1(function, (own, x_mm, y_mm))
}
