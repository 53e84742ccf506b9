//! Packets, and a decoder that finds them in a stream of bytes.

use thiserror::Error;

use super::slip::{self, Symbol, Unescape};
use super::{Header, Kind, CRC_BYTES, OVERHEAD};

/// A packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Type of the packet.
    pub kind: Kind,
    /// Sequence number: chosen by the host, repeated in the answer.
    pub sequence: u8,
    /// Payload, at most 65535 bytes.
    pub payload: Vec<u8>,
}

/// The bytes between two ENDs are not a valid packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PacketError {
    /// An escape byte is followed by a byte that is not allowed there.
    #[error("a broken escape sequence")]
    Framing,
    /// The bytes are too few, too many or damaged.
    #[error("the CRC of {bytes} bytes is wrong")]
    Crc {
        /// Number of bytes received.
        bytes: usize,
    },
    /// There is no such packet type.
    #[error("packet type 0x{0:02x} is unknown")]
    UnknownType(u8),
    /// The length field does not match the number of bytes.
    #[error("a packet says {says} bytes of payload and has {has}")]
    Length {
        /// Length field of the header.
        says: usize,
        /// Bytes of payload received.
        has: usize,
    },
}

impl Packet {
    /// A packet without payload.
    pub fn request(kind: Kind, sequence: u8) -> Packet {
        Packet { kind, sequence, payload: Vec::new() }
    }

    /// The packet as bytes on the wire, with SLIP framing.
    pub fn to_wire(&self) -> Vec<u8> {
        let length = self.payload.len() as u16;
        let mut bytes = Header { kind: self.kind as u8, sequence: self.sequence, length }.to_bytes();
        bytes.extend(&self.payload);
        let crc = crc32fast::hash(&bytes);
        bytes.extend(crc.to_le_bytes());
        slip::encode(&bytes)
    }

    /// Checks the bytes between two ENDs, in the same order as the board.
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

/// Finds packets in a stream of bytes; after an error it resynchronises at the next END.
///
/// ```
/// use dermis_golden::wire::link::{Decoder, Kind, Packet, PacketError};
///
/// let packet = Packet { kind: Kind::FrameForForces, sequence: 7, payload: vec![0xc0, 1, 0xdb] };
/// let mut wire = packet.to_wire();
/// let damaged = wire.len() - 2;
/// let mut decoder = Decoder::default();
/// let found: Vec<_> = wire.iter().filter_map(|byte| decoder.next(*byte)).collect();
/// assert_eq!(found, [Ok(packet)]);
/// wire[damaged] ^= 1;
/// let found: Vec<_> = wire.iter().filter_map(|byte| decoder.next(*byte)).collect();
/// assert!(matches!(found[..], [Err(PacketError::Crc { .. })]));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    unescape: Unescape,
    bytes: Vec<u8>,
    broken: bool,
}

impl Decoder {
    /// Takes the next byte from the wire; if it ends a packet, returns the packet or the error.
    pub fn next(&mut self, byte: u8) -> Option<Result<Packet, PacketError>> {
        match self.unescape.next(byte) {
            Symbol::None => None,
            Symbol::Broken => {
                self.broken = true;
                None
            }
            // Bytes beyond the longest packet are not stored.
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
                    // The END of one packet and that of the next have no bytes in between.
                    (false, true) => None,
                    (false, false) => Some(Packet::of_bytes(&bytes)),
                }
            }
        }
    }
}
