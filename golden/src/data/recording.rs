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

pub use file::{Kind, RecordingFile, Stamp};
pub use read::{End, FrameOptions, Frames, Messages, Recorded, RecordedFrame};

use message::{Header, Image, Message};
use thiserror::Error;

/// Channel of the frames for viewers, which take pixels of 32 bits.
pub const STRESS: &str = "/dermis/stress";
/// Channel of the frames with every bit of their values.
pub const EXACT: &str = "/dermis/stress_exact";

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

/// The messages of a frame of `rows` × `cols` readings in MPa, NaN where one is missing: channel and bytes of each.
///
/// # Errors
/// A header that CDR cannot represent.
pub fn frame_messages(
    [rows, cols]: [usize; 2],
    header: &Header,
    readings_MPa: &[f64],
) -> Result<[(&'static str, Vec<u8>); 2], RecordingError> {
    let exact: Vec<u8> = readings_MPa.iter().flat_map(|value| value.to_le_bytes()).collect();
    let rounded: Vec<u8> = readings_MPa.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    let image = |encoding: &str, data: &[u8]| {
        let (height, width, step) = (rows as u32, cols as u32, (data.len() / rows.max(1)) as u32);
        let image =
            Image { header: header.clone(), height, width, encoding: encoding.into(), is_bigendian: 0, step, data };
        image.to_cdr().map_err(RecordingError)
    };
    Ok([(EXACT, image(read::DOUBLE, &exact)?), (STRESS, image(read::SINGLE, &rounded)?)])
}
