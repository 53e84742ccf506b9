//! Errors of scenes; each names file, field and value.

use thiserror::Error;

/// A scene cannot be used.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The name is neither that of a built-in scene nor that of a file.
    #[error("no scene {name:?}: not a file, and not built in ({}){}", builtins.join(", "), did_you_mean(*nearest))]
    NotFound {
        /// The name or path given.
        name: String,
        /// Every built-in name.
        builtins: Vec<&'static str>,
        /// The built-in name that it resembles, if one does.
        nearest: Option<&'static str>,
    },
    /// The file exists but cannot be read as text.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than a scene may be.
    #[error("{file}: over {limit} bytes, too large for a scene")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest allowed size in bytes.
        limit: u64,
    },
    /// The scene has no array of this number.
    #[error("{file}#{number}: the scene has {arrays} (hardware.arrays), numbered from 0")]
    NoArray {
        /// Path or built-in name.
        file: String,
        /// The number given.
        number: String,
        /// How many there are.
        arrays: usize,
    },
    /// The text is not valid TOML.
    #[error("{file}, line {line}: {message}")]
    Syntax {
        /// Path or built-in name.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Error of the TOML reader.
        message: String,
    },
    /// The schema has no such field.
    #[error("{file}: unknown field {field}; {hint}")]
    UnknownField {
        /// Path or built-in name.
        file: String,
        /// The field with its table, `table.field`.
        field: String,
        /// The valid field that it resembles, else the valid ones of its table.
        hint: String,
    },
    /// A required field is missing.
    #[error("{file}: {field} is missing; it must be {allowed}")]
    Missing {
        /// Path or built-in name.
        file: String,
        /// The field with its table, `table.field`.
        field: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// A value has the wrong type or is out of range.
    #[error("{file}: {field} = {value} is not allowed; it must be {allowed}")]
    WrongValue {
        /// Path or built-in name.
        file: String,
        /// The field with its table, `table.field`.
        field: String,
        /// The value found.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// A valid value that this version does not implement.
    #[error("scene {scene}: not available yet: {field} = {value}; available: {available}")]
    NotAvailable {
        /// The scene's name.
        scene: String,
        /// The field with its table, `table.field`.
        field: &'static str,
        /// The value.
        value: String,
        /// The values implemented.
        available: &'static str,
    },
}

/// A suggestion as it follows the list of names.
fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map_or(String::new(), |nearest| format!("; did you mean {nearest:?}?"))
}
