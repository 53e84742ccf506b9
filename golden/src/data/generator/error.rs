//! Errors of described contacts and converters; each names contact, field and value.

use crate::spec::sensor::SensorError;
use thiserror::Error;

/// The contacts or options cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GeneratorError {
    /// A size of the sensor is out of range.
    #[error("sensor.{0}")]
    Sensor(#[from] SensorError),
    /// The list of contacts is empty.
    #[error("no contact given")]
    NoContact,
    /// A field of a contact is missing or does not fit the others.
    #[error("contact {index}: {field} = {value} is not allowed; it must be {allowed}")]
    Contact {
        /// Position in the list, from 0.
        index: usize,
        /// The field.
        field: &'static str,
        /// The value found.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// Loads and sizes are so far apart that the stress is not a finite number.
    #[error("the stress under taxel {index} is not a finite number")]
    NotFinite {
        /// Row-major index of the taxel.
        index: usize,
    },
    /// A taxel is outside the array.
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
    /// An option of the converter is out of range.
    #[error("{field} = {value} is not allowed; it must be {allowed}")]
    Option {
        /// The option.
        field: &'static str,
        /// The value found.
        value: f64,
        /// The allowed values, in words.
        allowed: &'static str,
    },
}
