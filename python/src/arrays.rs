//! Arrays of numbers to and from Python.

use dermis_golden::data::frame::Forces;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::exceptions::input;

/// Kinds of NumPy's types that are real numbers: signed and unsigned integers, floating point.
const REAL: [&str; 3] = ["i", "u", "f"];

/// An argument called `name` as a contiguous array of real numbers. An array that is one is not copied.
///
/// # Errors
/// `InputError` for what is no array, not of real numbers, or has masked ones.
pub fn numbers<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let borrowed =
        |array: &Bound<'py, PyArrayDyn<f64>>| array.try_readonly().map_err(|error| input(format!("{name}: {error}")));
    let numpy = value.py().import("numpy")?;
    if numpy.getattr("ma")?.call_method1("is_masked", (value,))?.is_truthy()? {
        return Err(input(format!("{name} has masked values, wanted numbers")));
    }
    if let Ok(array) = value.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
    {
        return borrowed(array);
    }
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| input(format!("{name}: {error}")))?;
    let dtype = array.getattr("dtype")?;
    if !REAL.contains(&dtype.getattr("kind")?.extract::<String>()?.as_str()) {
        return Err(input(format!("{name} has values of type {dtype}, wanted real numbers")));
    }
    borrowed(numpy.call_method1("ascontiguousarray", (array, "float64"))?.cast::<PyArrayDyn<f64>>()?)
}

/// The same of readings: NaN where one is masked or `None`.
///
/// # Errors
/// As [`numbers`].
pub fn readings<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = value.py().import("numpy")?;
    let masked = numpy.getattr("ma")?.getattr("MaskedArray")?;
    let value = &unmasked(value, &masked).map_err(|error| input(format!("{name}: {error}")))?;
    if value.cast::<PyArrayDyn<f64>>().is_ok() {
        return numbers(name, value);
    }
    // None makes an array of objects.
    let array = numpy.call_method1("asarray", (value,)).map_err(|error| input(format!("{name}: {error}")))?;
    if array.getattr("dtype")?.getattr("kind")?.extract::<String>()? != "O" {
        return numbers(name, &array);
    }
    let real = |item: Bound<'_, PyAny>| item.is_none() || item.extract::<f64>().is_ok();
    let all_real = array.call_method0("ravel")?.try_iter()?.all(|item| item.is_ok_and(real));
    let array = if all_real { array.call_method1("astype", ("float64",))? } else { array };
    numbers(name, &array)
}

/// NaN in place of what is masked: in an array, and in lists of arrays and numbers, of which NumPy would drop the masks.
fn unmasked<'py>(value: &Bound<'py, PyAny>, masked: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    if value.is_instance(masked)? {
        return value.call_method1("astype", ("float64",))?.call_method1("filled", (f64::NAN,));
    }
    if !value.is_instance_of::<PyList>() && !value.is_instance_of::<PyTuple>() {
        return Ok(value.clone());
    }
    let items = value.try_iter()?.map(|item| unmasked(&item?, masked)).collect::<PyResult<Vec<_>>>()?;
    Ok(PyList::new(value.py(), items)?.into_any())
}

/// An argument called `name` as a vector of N finite numbers.
///
/// # Errors
/// `InputError` for another shape or a number that is not finite.
pub fn vector<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    let array = numbers(name, value)?;
    let values = array.as_slice()?;
    let wanted = || input(format!("{name} has shape {}, wanted ({N},)", shape(array.shape())));
    let vector: [f64; N] = values.try_into().ok().filter(|_| array.ndim() == 1).ok_or_else(wanted)?;
    match vector.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(input(format!("{name}[{index}] = {} is not a finite number", vector[index]))),
        None => Ok(vector),
    }
}

/// A shape as Python writes it.
pub fn shape(lengths: &[usize]) -> String {
    let lengths: Vec<String> = lengths.iter().map(usize::to_string).collect();
    match &lengths[..] {
        [one] => format!("({one},)"),
        more => format!("({})", more.join(", ")),
    }
}

/// An array of shape (n,).
pub fn array<'py, const N: usize>(py: Python<'py>, values: [f64; N]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, &values)
}

/// Row-major values as an array of shape (rows, cols).
///
/// # Errors
/// Another number of values.
pub fn grid<'py>(py: Python<'py>, values: &[f64], lengths: [usize; 2]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    PyArray1::from_slice(py, values).reshape(lengths)
}

/// Values as an array of three axes.
///
/// # Errors
/// Another number of values.
pub fn cube<'py>(py: Python<'py>, values: Vec<f64>, lengths: [usize; 3]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    PyArray1::from_vec(py, values).reshape(lengths)
}

/// Forces taxel by taxel, x, y and normal of each.
pub fn interleaved(forces: &Forces) -> impl Iterator<Item = f64> + '_ {
    let pairs = forces.fx.iter().zip(&forces.fy).zip(&forces.fz);
    pairs.flat_map(|((x, y), z)| [*x, *y, *z])
}
