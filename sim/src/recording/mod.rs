//! Recordings: frames and results of a stream in an MCAP file, with the message types of ROS 2.
//!
//! Channels, units and times are in the guide's [file formats](crate::guide::files).
//!
//! | module | does |
//! |---|---|
//! | [`mod@contacts`] | the contacts of a result |
//! | [`message`] | the ROS 2 messages, their encoding CDR and their schemas |
//! | [`lines`] | recorded frames as lines of a stream, at a pace |
//! | [`read`] | messages of a file; the frames among them |
//! | [`mod@write`] | outcomes of a stream into a file |

pub mod contacts;
pub mod lines;
pub mod message;
pub mod read;
pub mod write;

pub use contacts::contacts;
pub use lines::{Lines, Pace};
pub use read::{Frames, Messages, Recorded, RecordedFrame};
pub use write::Recorder;

/// Channel of the frames.
pub const STRESS: &str = "/dermis/stress";
/// Channel of the forces on the taxels.
pub const FORCES: &str = "/dermis/forces";
/// Channel of the output lines.
pub const RESULT: &str = "/dermis/result";
/// Channel of the contact with this number, from 1.
pub fn contact_channel(number: usize) -> String {
    format!("/dermis/contacts/{number}")
}
