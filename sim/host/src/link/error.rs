//! Errors between host and board.

use thiserror::Error;

/// Why a board cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum HostError {
    /// The port cannot be opened, or fails.
    #[error("port {port}: {reason}")]
    Port {
        /// The port, as given.
        port: String,
        /// The system's error message.
        reason: String,
    },
    /// No valid answer after several attempts.
    #[error(
        "port {port}: no answer to {what}, sent {attempts} times with a timeout of {milliseconds} ms each: is it a \
         Dermis board, configured, and at this bit rate?"
    )]
    NoAnswer {
        /// The port.
        port: String,
        /// The request.
        what: &'static str,
        /// Number of attempts.
        attempts: u32,
        /// Timeout of each attempt in ms.
        milliseconds: u128,
    },
    /// No valid answer of a core behind Ethernet after several attempts.
    #[error(
        "{port}: no answer to {what}, sent {attempts} times with a timeout of {milliseconds} ms each: is it a Dermis core, \
         configured, at this address?"
    )]
    NoCore {
        /// The address.
        port: String,
        /// The request.
        what: &'static str,
        /// Number of attempts.
        attempts: u32,
        /// Timeout of each attempt in ms.
        milliseconds: u128,
    },
    /// The board is another one.
    #[error("port {port}: {reason}")]
    Identity {
        /// The port.
        port: String,
        /// The field of the identity that differs.
        reason: IdentityError,
    },
    /// The board's tables are not those that were written.
    #[error("port {port}: after tables of version {wants} the board's are {has}")]
    Tables {
        /// The port.
        port: String,
        /// Version of its tables, or what is wrong with them.
        has: String,
        /// Version of the tables written.
        wants: u16,
    },
    /// An answer has the wrong length: a defect of the board or of this program.
    #[error("port {port}: {what} answer has a wrong length: {bytes} bytes")]
    Answer {
        /// The port.
        port: String,
        /// The answer.
        what: &'static str,
        /// Its length in bytes.
        bytes: usize,
    },
}

/// Why a board does not belong to a scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum IdentityError {
    /// The board uses another packet version.
    #[error("the board uses packet version {has}, this program version {wants}")]
    Version {
        /// The board's version.
        has: u16,
        /// This program's version.
        wants: u16,
    },
    /// The board's bitstream was built for another scene.
    #[error("the board was built for another scene: {has}; {scene} is {wants}")]
    OtherScene {
        /// Description of the board's scene.
        has: String,
        /// Name of the expected scene.
        scene: String,
        /// Description of the expected scene.
        wants: String,
    },
    /// The identity has the wrong length: a defect of the board or of this program.
    #[error("identity answer has a wrong length: {bytes} bytes")]
    Length {
        /// Its length in bytes.
        bytes: usize,
    },
}
