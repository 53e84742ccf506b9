//! Results and frames as datasets of xarray, which `python/dermis/_xarray.py` makes.

use dermis_golden::spec::sensor::Sensor;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::exceptions::input;
use crate::frame::Frame;

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

/// Make one dataset of xarray of frames of one sensor, with an axis of time, as Frame.to_xarray has it of one.
///
/// Parameters
/// ----------
/// frames : iterable of Frame
///     At least one, all of the same array.
///
/// Raises
/// ------
/// InputError
///     No frame, what is none, or frames of different arrays.
/// ImportError
///     xarray is not installed.
#[pyfunction]
pub fn frames_to_xarray<'py>(frames: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (mut sensor, mut all) = (None, Vec::new());
    for (index, frame) in frames.try_iter()?.enumerate() {
        let frame = frame?;
        let own = frame.cast::<Frame>().map_err(|_| input(format!("frames[{index}] is not a Frame")))?;
        let own = own.get().0.sensor.clone();
        let first = sensor.get_or_insert_with(|| own.clone());
        if *first != own {
            return Err(input(format!("frames[{index}] has the array {own}, frames[0] {first}")));
        }
        all.push(frame);
    }
    match sensor {
        Some(sensor) => made("of_frames", PyList::new(frames.py(), all)?.as_any(), &sensor),
        None => Err(input("frames is empty, wanted at least one")),
    }
}
