//! Link: the packets between a host and the engine on a board.
//!
//! The definitions ([`Kind`], [`Header`] and the payloads) do not depend on the hardware description; the host program,
//! the hardware description and the C header all use them.
//!
#![doc = include_str!("link/format.md")]

mod codes;
mod error;
mod format;
mod header;
mod identity;
mod packet;
mod payload;
mod rate;
pub mod slip;
mod sums;
#[cfg(test)]
mod tests;

pub use codes::{beats_of_bytes, code_bytes, codes_of_bytes, codes_to_bytes, BEAT_BYTES};
pub use error::LinkError;
pub use format::markdown;
pub use header::c_header;
pub use identity::{image_bytes, payloads, require_one_answer, scene_hash, supports};
pub use packet::{Decoder, Packet, PacketError};
pub use payload::{Beat, Counters, Field, Header, Identity, Sums};

/// Version of the packet format; a host rejects any other.
pub const VERSION: u16 = 4;
/// Bytes of a packet besides its payload: [`Header`] and CRC.
pub const OVERHEAD: usize = Header::BYTES + CRC_BYTES;
/// Bytes of the CRC-32 after the payload.
pub const CRC_BYTES: usize = 4;
/// Bit that is set in the type of an answer, which is otherwise that of its request; of tables that of the counters.
pub const ANSWER: u8 = 0x80;
/// Polynomial of CRC-32, reflected.
pub const CRC_POLYNOMIAL: u32 = 0xedb8_8320;
/// Residue: the CRC-32 (polynomial [`CRC_POLYNOMIAL`]) over a packet including its CRC, before the final inversion.
pub const CRC_RESIDUE: u32 = 0xdebb_20e3;

/// Type of a packet; the discriminant is the number in the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Requests the board's [`Identity`].
    Identify = 0x01,
    /// Requests the packet [`Counters`].
    ReadCounters = 0x02,
    /// A frame; requests its resultants.
    FrameForResultants = 0x03,
    /// A frame; requests its forces.
    FrameForForces = 0x04,
    /// An image of tables ([`load`](crate::fixed::stages::load)) for a board with `hardware.tables = "writable"`.
    Tables = 0x05,
    /// Answers `Identify`.
    Identity = 0x81,
    /// Answers `ReadCounters`, and `Tables` once they are in the engine.
    Counters = 0x82,
    /// Answers `FrameForResultants`.
    Resultants = 0x83,
    /// Answers `FrameForForces`.
    Forces = 0x84,
}

impl Kind {
    /// All types, requests first.
    pub const ALL: [Kind; 9] = [
        Kind::Identify,
        Kind::ReadCounters,
        Kind::FrameForResultants,
        Kind::FrameForForces,
        Kind::Tables,
        Kind::Identity,
        Kind::Counters,
        Kind::Resultants,
        Kind::Forces,
    ];

    /// The type with this number; `None` if there is none.
    pub fn of(number: u8) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| *kind as u8 == number)
    }

    /// The type of the answer to a request; an answer is returned unchanged.
    pub fn answer(self) -> Kind {
        match self {
            Kind::Tables => Kind::Counters,
            _ => Kind::of(self as u8 | ANSWER).unwrap_or(self),
        }
    }

    /// Name in the documentation and the C header.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Identify => "identify",
            Kind::ReadCounters => "read_counters",
            Kind::FrameForResultants => "frame_for_resultants",
            Kind::FrameForForces => "frame_for_forces",
            Kind::Tables => "tables",
            Kind::Identity => "identity",
            Kind::Counters => "counters",
            Kind::Resultants => "resultants",
            Kind::Forces => "forces",
        }
    }
}
