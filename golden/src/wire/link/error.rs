//! Errors of a board's link.

use thiserror::Error;

/// A scene or board cannot have a link.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinkError {
    /// The engine of the scene does not send a fixed number of beats for each frame.
    #[error(
        "{field} = {value}: a board's link does not support it; it needs one frame per answer and the same subarrays in \
         every frame"
    )]
    Unsupported {
        /// The scene's field.
        field: &'static str,
        /// Its value.
        value: String,
    },
    /// A payload is longer than its length field allows.
    #[error("scene {scene}: {what} of {taxels} taxels take {bytes} bytes, a packet holds 65535")]
    TooLong {
        /// The scene's name.
        scene: String,
        /// The kind of payload.
        what: &'static str,
        /// Number of taxels.
        taxels: usize,
        /// Length of the payload in bytes.
        bytes: usize,
    },
    /// The bit rate is too high for the board's clock.
    #[error("{file}: {field} = {value}: the clock of {clock_MHz} MHz takes at most {most}")]
    TooFast {
        /// The board's file.
        file: String,
        /// Field of its file.
        field: &'static str,
        /// Its bit rate in the field's unit.
        value: f64,
        /// The engine's clock.
        clock_MHz: f64,
        /// The highest bit rate in the field's unit.
        most: f64,
    },
    /// The scene asks for a link for which its board has no pins.
    #[error("hardware.link = {link:?}: board {board} has no pins for it (no {field} in {file}); it has {others}")]
    NoPins {
        /// The link.
        link: &'static str,
        /// The board's name.
        board: String,
        /// The board's file.
        file: String,
        /// Field of its file with the bit rate.
        field: &'static str,
        /// The links that the board has.
        others: String,
    },
}
