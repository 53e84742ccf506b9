//! Errors of boards; each names file, field and value.

use thiserror::Error;

/// A board cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BoardError {
    /// There is no board of this name.
    #[error(
        "hardware.board = {name:?}: unknown board; there are: {known}; a board of your own is the path of a file that ends \
         with .toml"
    )]
    Unknown {
        /// The name given.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// A file cannot be read as text.
    #[error("{file}: cannot be read: {reason}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Error of the operating system.
        reason: String,
    },
    /// A field that a board's file cannot have, a value that is not allowed, or a file it names that cannot be used.
    #[error("{file}, line {line}: {reason}")]
    Invalid {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The field, its value, and what is allowed or wrong.
        reason: String,
    },
    /// The board's file lacks a field.
    #[error("{file}: {field} is missing; it must be {allowed}")]
    Missing {
        /// Path as given.
        file: String,
        /// The field.
        field: &'static str,
        /// The allowed values, in words.
        allowed: String,
    },
}
