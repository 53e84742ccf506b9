//! Errors of the crates as Python exceptions, and relative errors of a force.
//!
//! | exception | base | raised for |
//! |---|---|---|
//! | `InputError` | `ValueError` | a scene, frame or argument that cannot be used; the message names field and value |
//! | `RuntimeError` | | a broken invariant: a defect of Dermis |

use std::fmt::Display;

use dermis_golden::errors::Errors as Relative;
use dermis_golden::fixed::FixedError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::vector;

pyo3::create_exception!(
    dermis,
    InputError,
    PyValueError,
    "A scene, a frame or an argument cannot be used; the message names field and value."
);

/// The exception for input that cannot be used.
pub fn input(error: impl Display) -> PyErr {
    InputError::new_err(error.to_string())
}

/// The exception for an argument out of range.
pub fn not_allowed(field: &str, value: impl Display, allowed: &str) -> PyErr {
    input(format!("{field} = {value} is not allowed; it must be {allowed}"))
}

/// The exception for an error of the bit-true model.
pub fn fixed(error: FixedError) -> PyErr {
    match error {
        FixedError::Internal(_) | FixedError::Beats { .. } => PyRuntimeError::new_err(error.to_string()),
        error => input(error),
    }
}

/// Relative errors of a force as fractions; None where the reference is below 1 % of its length.
#[pyclass(frozen, module = "dermis")]
pub struct Errors(pub(crate) Relative);

#[pymethods]
impl Errors {
    /// (reference - value) / reference along x.
    #[getter]
    fn x1(&self) -> Option<f64> {
        self.0.x1
    }

    /// (reference - value) / reference along y.
    #[getter]
    fn x2(&self) -> Option<f64> {
        self.0.x2
    }

    /// (reference - value) / reference of the normal force.
    #[getter]
    fn x3(&self) -> Option<f64> {
        self.0.x3
    }

    /// Length of the shear's error over the length of the shear.
    #[getter]
    fn tangential(&self) -> Option<f64> {
        self.0.tangential
    }

    /// |error| of the normal force over the normal force.
    #[getter]
    fn normal(&self) -> Option<f64> {
        self.0.normal
    }

    fn __repr__(&self) -> String {
        let shown = |error: Option<f64>| error.map_or("None".to_owned(), |error| format!("{error:.4}"));
        format!("Errors(tangential={}, normal={})", shown(self.0.tangential), shown(self.0.normal))
    }
}

/// Errors of a force relative to a reference.
///
/// Parameters
/// ----------
/// reference_N : array of shape [3]
///     The true force in N: x, y, normal.
/// value_N : array of shape [3]
///     The force found in N.
///
/// Raises
/// ------
/// InputError
///     An argument of another shape, or not of finite numbers.
#[pyfunction]
pub fn errors(reference_N: &Bound<'_, PyAny>, value_N: &Bound<'_, PyAny>) -> PyResult<Errors> {
    Ok(Errors(Relative::new(vector("reference_N", reference_N)?, vector("value_N", value_N)?)))
}
