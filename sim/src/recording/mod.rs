//! Recordings of a stream: its frames and results in an MCAP file, with the message types of ROS 2.
//!
//! Channels, units and times are in the guide's [file formats](crate::guide::files); the files themselves, and the frames in them, in
//! [`dermis_golden::data::recording`].
//!
//! | module | does |
//! |---|---|
//! | `arrows` | the forces of a result as arrows that viewers draw |
//! | [`lines`] | recorded frames as lines of a stream, at a pace |
//! | [`mod@write`] | outcomes of a stream into a file |

mod arrows;
pub mod lines;
pub mod write;

pub use lines::{Lines, Pace};
pub(crate) use write::header;
pub use write::Recorder;

/// Metres of a millimetre.
const METRES: f64 = 1e-3;
/// Channel of the forces on the taxels.
pub const FORCES: &str = "/dermis/forces";
/// Channel of the forces as arrows.
pub const ARROWS: &str = "/dermis/arrows";
/// Channel of the output lines, each a text.
pub const RESULT: &str = "/dermis/result";
/// Channel of the contact with this number, from 1.
pub fn contact_channel(number: usize) -> String {
    format!("/dermis/contacts/{number}")
}
