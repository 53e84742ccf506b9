//! What can be wrong with a described contact, each with its place, field and value.

use crate::sensor::SensorError;
use thiserror::Error;

/// Contacts that make no frame.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GeneratorError {
    /// A size or length out of range.
    #[error("sensor.{0}")]
    Sensor(#[from] SensorError),
    /// Nothing presses.
    #[error("no contact given")]
    NoContact,
    /// A contact's field is missing or does not fit the others.
    #[error("contact {index}: {field} = {value} is not allowed; it must be {allowed}")]
    Contact {
        /// Position in the list, from 0.
        index: usize,
        /// The field.
        field: &'static str,
        /// The value found.
        value: String,
        /// What the field may hold.
        allowed: String,
    },
    /// Loads and sizes so far apart that the stress is not a finite number.
    #[error("the stress under taxel {index} is not a finite number")]
    NotFinite {
        /// Row-major index of the taxel.
        index: usize,
    },
    /// A taxel that the array does not have.
    #[error("{field}: taxel {row},{col} is outside the array of {rows} rows and {cols} columns")]
    Taxel {
        /// The option that names it.
        field: &'static str,
        /// Its row.
        row: usize,
        /// Its column.
        col: usize,
        /// The array's rows.
        rows: usize,
        /// The array's columns.
        cols: usize,
    },
    /// A converter's option out of range.
    #[error("{field} = {value} is not allowed; it must be {allowed}")]
    Option {
        /// The option.
        field: &'static str,
        /// The value found.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
}
