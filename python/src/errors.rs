//! Relative errors of a force, by Eq. 3.

use dermis_golden::result::errors::Errors as Relative;
use pyo3::prelude::*;

use crate::arrays::vector;

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
/// reference_N : array of shape (3,)
///     The true force in N: x, y, normal.
/// value_N : array of shape (3,)
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
