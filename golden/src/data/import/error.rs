//! Errors of an import; each names file, line or field, and value.

use super::format::Format;
use crate::data::frame::FrameError;
use crate::data::text::NoReadings;
use crate::spec::scene::SceneError;
use crate::write::FileError;
use std::path::PathBuf;
use thiserror::Error;

/// A recording cannot be imported.
#[derive(Debug, Error)]
pub enum ImportError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than a recording may be.
    #[error("{file}: over {limit} bytes, too large for a recording; export fewer frames")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Largest size in bytes.
        limit: u64,
    },
    /// No format matches the content.
    #[error("{file}: the format is not recognised; give it with --format, one of {}; csv: lines of numbers, with --size, --units and --columns", Format::names().join(", "))]
    Unrecognised {
        /// Path as given.
        file: String,
    },
    /// HDF5 has arrays of any names and shapes, and is not read.
    #[error("{file}: HDF5 is not read; in Python: numpy.save(\"frames.npy\", h5py.File({file:?})[\"NAME\"][:]) writes the array NAME; then import frames.npy with --units, --pitch and, for a line of taxels per frame, --size")]
    Hdf5 {
        /// Path as given.
        file: String,
    },
    /// An archive of arrays of NumPy, of any names and shapes.
    #[error("{file}: .npz, an archive of several arrays, is not read; in Python: numpy.save(\"frames.npy\", numpy.load({file:?})[\"NAME\"]) writes the array NAME; then import frames.npy")]
    Npz {
        /// Path as given.
        file: String,
    },
    /// The folder has the import of another file, or files that no import wrote.
    #[error("{}: has {other} already; --out names another folder, --name another name", folder.display())]
    Taken {
        /// The folder.
        folder: PathBuf,
        /// What it has.
        other: String,
    },
    /// A text holds no frames of the array.
    #[error("{}", reason.in_file(file))]
    Text {
        /// Path as given.
        file: String,
        /// Line, cell and what is wrong.
        reason: NoReadings,
    },
    /// A line is wrong as a whole.
    #[error("{file}, line {line}: {value:?} is not allowed; it must be {allowed}")]
    Line {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The text found, shortened.
        value: String,
        /// The allowed text, in words.
        allowed: String,
    },
    /// A value of a line is wrong.
    #[error("{file}, line {line}, value {column}: {value:?} is not allowed; it must be {allowed}")]
    Value {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Position in the line, from 1.
        column: usize,
        /// The text found, shortened.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// A field of the file's header, or an option, is wrong.
    #[error("{file}: {field} = {value} is not allowed; it must be {allowed}")]
    Field {
        /// Path as given.
        file: String,
        /// Field of the header, or option.
        field: String,
        /// The value found, shortened.
        value: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// The end of the file is missing.
    #[error("{file}: ends early: {words}; {}", match whole {
        0 => "no frame before that is whole".to_owned(),
        whole => format!("--partial takes the {whole} frames before that"),
    })]
    Cut {
        /// Path as given.
        file: String,
        /// What is missing.
        words: String,
        /// Number of frames that are whole.
        whole: usize,
    },
    /// Something that a scene needs is neither in the file nor in the options.
    #[error("{file}: {field} is missing; {remedy}")]
    Missing {
        /// Path as given.
        file: String,
        /// What is missing.
        field: String,
        /// How to supply it.
        remedy: String,
    },
    /// `recording.json` of an imported recording is not one that an import writes.
    #[error("{file}, line {line}, column {column}: {message}")]
    Json {
        /// Path as given.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Error of the JSON reader.
        message: String,
    },
    /// The scene of the recording is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A frame of the recording is refused.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A file of the imported recording cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Makes errors that name one file.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// Path as given.
    pub file: &'a str,
}

impl Source<'_> {
    pub(super) fn text(&self, reason: NoReadings) -> ImportError {
        ImportError::Text { file: self.file.to_string(), reason }
    }

    pub(super) fn line(&self, line: usize, value: &str, allowed: impl Into<String>) -> ImportError {
        ImportError::Line { file: self.file.to_string(), line, value: shortened(value), allowed: allowed.into() }
    }

    pub(super) fn value(&self, line: usize, column: usize, value: &str, allowed: impl Into<String>) -> ImportError {
        let (file, value) = (self.file.to_string(), shortened(value));
        ImportError::Value { file, line, column, value, allowed: allowed.into() }
    }

    pub(super) fn field(&self, field: &str, value: impl ToString, allowed: impl Into<String>) -> ImportError {
        let (file, field) = (self.file.to_string(), field.to_string());
        ImportError::Field { file, field, value: shortened(&value.to_string()), allowed: allowed.into() }
    }

    pub(super) fn cut(&self, words: &str, whole: usize) -> ImportError {
        ImportError::Cut { file: self.file.to_string(), words: words.to_string(), whole }
    }

    pub(super) fn missing(&self, field: &str, remedy: impl Into<String>) -> ImportError {
        ImportError::Missing { file: self.file.to_string(), field: field.to_string(), remedy: remedy.into() }
    }
}

/// A text of at most 40 characters, without control characters.
fn shortened(text: &str) -> String {
    let tame = |c: char| if c.is_control() { ' ' } else { c };
    text.trim().chars().take(40).map(tame).collect()
}
