//! Recordings of a stream: its frames and results in an MCAP file, with the message types of ROS 2.
//!
//! Channels, units and times are in the guide's page on file formats; the files themselves, and the frames in them, in
//! [`dermis_golden::data::recording`].
//!
//! | module | does |
//! |---|---|
//! | [`arrows`] | the forces of a result as arrows that viewers draw |
//! | [`points`] | the taxels of a result as points with their forces |
//! | [`lines`] | recorded frames at a pace, as values or as lines of a stream |
//! | [`mod@write`] | outcomes of a stream into a file |

pub mod arrows;
pub mod lines;
pub mod points;
pub mod write;

pub use arrows::Arrows;
pub use lines::{Lines, Pace, Paced};
pub use points::Points;
pub use write::Recorder;

use dermis_golden::data::recording::message::{Header, Time, Vector3};

/// Metres of a millimetre.
pub const METRES: f64 = 1e-3;
/// Coordinate system of all messages of a recording.
pub const FRAME_ID: &str = "dermis";
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

/// Header of a message in this coordinate system, of this time in ns since 1970.
pub fn header(frame_id: &str, time_ns: i64) -> Header {
    Header { stamp: Time::from(u64::try_from(time_ns).unwrap_or(0)), frame_id: frame_id.into() }
}

/// Torque in N·m about the array's centre of a force in N that acts on the surface at a place in mm.
pub fn torque([x, y]: [f64; 2], [fx, fy, fz]: Vector3) -> Vector3 {
    [y * fz, -x * fz, x * fy - y * fx].map(|moment| moment * METRES)
}
