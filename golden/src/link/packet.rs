//! Packets, and how they are found in what comes over the wire.

use thiserror::Error;

use super::slip::{self, Symbol, Unescape};
use super::{Header, Kind, CRC_BYTES, OVERHEAD};

/// A packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Its type.
    pub kind: Kind,
    /// Its sequence number.
    pub sequence: u8,
    /// What it carries, at most 65535 bytes.
    pub payload: Vec<u8>,
}

/// Why bytes between two ENDs are no packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PacketError {
    /// An escape before a byte that cannot follow it.
    #[error("a broken escape sequence")]
    Framing,
    /// Too short, too long, or damaged.
    #[error("the CRC of {bytes} bytes is wrong")]
    Crc {
        /// How many came.
        bytes: usize,
    },
    /// A type that does not exist.
    #[error("packet type 0x{0:02x} is unknown")]
    UnknownType(u8),
    /// Its length is not what it says.
    #[error("a packet says {says} bytes of payload and has {has}")]
    Length {
        /// In its header.
        says: usize,
        /// Bytes of payload that came.
        has: usize,
    },
}

impl Packet {
    /// A packet without payload.
    pub fn request(kind: Kind, sequence: u8) -> Packet {
        Packet { kind, sequence, payload: Vec::new() }
    }

    /// The packet as it goes over the wire.
    pub fn to_wire(&self) -> Vec<u8> {
        let length = self.payload.len() as u16;
        let mut bytes = Header { kind: self.kind as u8, sequence: self.sequence, length }.to_bytes();
        bytes.extend(&self.payload);
        let crc = crc32fast::hash(&bytes);
        bytes.extend(crc.to_le_bytes());
        slip::encode(&bytes)
    }

    /// Checks what came between two ENDs; the order of the checks is the board's.
    fn of_bytes(bytes: &[u8]) -> Result<Packet, PacketError> {
        let crc = PacketError::Crc { bytes: bytes.len() };
        let (content, sum) = bytes.split_last_chunk::<CRC_BYTES>().ok_or(crc)?;
        let (head, payload) = content.split_first_chunk::<{ Header::BYTES }>().ok_or(crc)?;
        let header =
            Header::of_bytes(head).filter(|_| crc32fast::hash(content) == u32::from_le_bytes(*sum)).ok_or(crc)?;
        let kind = Kind::of(header.kind).ok_or(PacketError::UnknownType(header.kind))?;
        let says = usize::from(header.length);
        if payload.len() != says {
            return Err(PacketError::Length { says, has: payload.len() });
        }
        Ok(Packet { kind, sequence: header.sequence, payload: payload.to_vec() })
    }
}

/// Finds packets in a stream of bytes.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    unescape: Unescape,
    bytes: Vec<u8>,
    broken: bool,
}

impl Decoder {
    /// The next byte from the wire; a packet or what is wrong with it when the byte ends one.
    pub fn next(&mut self, byte: u8) -> Option<Result<Packet, PacketError>> {
        match self.unescape.next(byte) {
            Symbol::None => None,
            Symbol::Broken => {
                self.broken = true;
                None
            }
            // Beyond the longest packet only the count of bytes would be of use.
            Symbol::Byte(byte) => {
                if self.bytes.len() <= usize::from(u16::MAX) + OVERHEAD {
                    self.bytes.push(byte);
                }
                None
            }
            Symbol::End => {
                let bytes = std::mem::take(&mut self.bytes);
                match (std::mem::take(&mut self.broken), bytes.is_empty()) {
                    (true, _) => Some(Err(PacketError::Framing)),
                    // Between the END of one packet and that of the next there is nothing.
                    (false, true) => None,
                    (false, false) => Some(Packet::of_bytes(&bytes)),
                }
            }
        }
    }
}
