//! What can go wrong between host and board.

use thiserror::Error;

/// A board that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum HostError {
    /// The port cannot be opened, or fails.
    #[error("--port {port}: {reason}")]
    Port {
        /// As given.
        port: String,
        /// The system's reason.
        reason: String,
    },
    /// Nothing that could be an answer came, several times.
    #[error(
        "--port {port}: no answer to {what}, sent {attempts} times with {milliseconds} ms of silence each: is it a \
         Dermis board, configured, and of this bit rate?"
    )]
    NoAnswer {
        /// The port.
        port: String,
        /// The request.
        what: &'static str,
        /// How often it was sent.
        attempts: u32,
        /// The silence after each.
        milliseconds: u128,
    },
    /// Packets of another version.
    #[error("--port {port}: the board speaks version {has} of the packets, this program version {wants}")]
    Version {
        /// The port.
        port: String,
        /// The board's.
        has: u16,
        /// This program's.
        wants: u16,
    },
    /// A bitstream made for another scene.
    #[error("--port {port}: the board was made for another scene: {has}; {scene} is {wants}")]
    OtherScene {
        /// The port.
        port: String,
        /// What the board is made for.
        has: String,
        /// The scene's name.
        scene: String,
        /// What it would have to be made for.
        wants: String,
    },
    /// An answer of the wrong length; a defect of board or program.
    #[error("--port {port}: {what} of {bytes} bytes")]
    Answer {
        /// The port.
        port: String,
        /// Which answer.
        what: &'static str,
        /// Its length.
        bytes: usize,
    },
}
