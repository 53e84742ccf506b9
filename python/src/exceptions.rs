//! Errors of the crates as Python exceptions.
//!
//! | exception | base | raised for |
//! |---|---|---|
//! | `InputError` | `ValueError` | a scene, frame or argument that cannot be used; the message names field and value |
//! | `BoardError` | `OSError` | a port that fails, a board that does not answer or is another ([`board`](crate::board)) |
//! | `RuntimeError` | | a broken invariant: a defect of Dermis |

use std::fmt::Display;

use dermis_golden::fixed::FixedError;
use dermis_golden::plain_words::without_numbers;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    dermis,
    InputError,
    PyValueError,
    "A scene, a frame or an argument cannot be used; the message names field and value."
);

/// The exception for input that cannot be used.
pub fn input(error: impl Display) -> PyErr {
    InputError::new_err(without_numbers(&error.to_string()))
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

/// The exception for an error of a model.
pub fn model(error: anyhow::Error) -> PyErr {
    match error.downcast::<FixedError>() {
        Ok(error) => fixed(error),
        Err(error) => input(error),
    }
}
