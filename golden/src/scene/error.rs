//! What can be wrong with a scene, each with file, field and value.

use thiserror::Error;

/// A scene that cannot be used.
#[derive(Debug, Error)]
pub enum SceneError {
    /// Neither a built-in name nor a file.
    #[error("no scene {name:?}: not a file, and not built in ({}); did you mean {nearest:?}?", builtins.join(", "))]
    NotFound {
        /// What was asked for.
        name: String,
        /// Every built-in name.
        builtins: Vec<&'static str>,
        /// The built-in name most like it.
        nearest: &'static str,
    },
    /// The file is there and cannot be read as text.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// More text than a scene can have.
    #[error("{file}: over {limit} bytes, too large for a scene")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// Not TOML.
    #[error("{file}, line {line}: {message}")]
    Syntax {
        /// Path or built-in name.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The TOML reader's reason.
        message: String,
    },
    /// A field the schema does not have.
    #[error("{file}: unknown field {field}; the nearest valid field is {nearest}")]
    UnknownField {
        /// Path or built-in name.
        file: String,
        /// The field with its table.
        field: String,
        /// The valid field most like it.
        nearest: String,
    },
    /// A field without default is missing.
    #[error("{file}: {field} is missing; it must be {allowed}")]
    Missing {
        /// Path or built-in name.
        file: String,
        /// The field with its table.
        field: String,
        /// What the field may hold.
        allowed: String,
    },
    /// A value of the wrong type or out of range.
    #[error("{file}: {field} = {value} is not allowed; it must be {allowed}")]
    WrongValue {
        /// Path or built-in name.
        file: String,
        /// The field with its table.
        field: String,
        /// The value found.
        value: String,
        /// What the field may hold.
        allowed: String,
    },
    /// A valid choice that this version does not build.
    #[error("scene {scene}: not available yet: {field} = {value}; available: {available}")]
    NotAvailable {
        /// The scene's name.
        scene: String,
        /// The field with its table.
        field: &'static str,
        /// The choice.
        value: String,
        /// What can be chosen instead.
        available: &'static str,
    },
}
