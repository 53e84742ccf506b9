//! Recordings: frames, and whatever else belongs to them, in MCAP files with the message types of ROS 2.
//!
//! | module | does |
//! |---|---|
//! | [`message`] | the ROS 2 messages, their encoding CDR and their schemas |
//! | [`mod@file`] | a file that is whole after every part that is written to it |
//! | [`read`] | messages of a file; the frames among them |
//!
//! A frame is two images of the same pixels: one for viewers, one with every bit of the values.

pub mod file;
pub mod message;
pub mod read;
mod records;

pub use file::{frame_messages, Kind, RecordingFile, Stamp};
pub use read::{End, FrameOptions, Frames, Messages, Recorded, RecordedFrame};

use thiserror::Error;

/// Channel of the frames for viewers, which take pixels of 32 bits.
pub const STRESS: &str = "/dermis/stress";
/// Channel of the frames with every bit of their values.
pub const EXACT: &str = "/dermis/stress_exact";

/// What begins the library's name in the header of a file that Dermis writes.
const LIBRARY: &str = "dermis ";

/// What is wrong with a recording, in words without the file's name.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct RecordingError(String);

impl RecordingError {
    /// An error in these words.
    pub fn new(words: impl Into<String>) -> RecordingError {
        RecordingError(words.into())
    }
}

impl From<std::io::Error> for RecordingError {
    fn from(error: std::io::Error) -> RecordingError {
        RecordingError(error.to_string())
    }
}

impl From<mcap::McapError> for RecordingError {
    fn from(error: mcap::McapError) -> RecordingError {
        match error {
            mcap::McapError::Io(error) => error.into(),
            other => RecordingError(other.to_string()),
        }
    }
}
