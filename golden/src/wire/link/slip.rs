//! SLIP framing, RFC 1055: packets stand between END bytes, so a receiver resynchronises at the next END. One more
//! special byte, [`IDLE`], fills links that must transfer bytes when there is nothing to send.

/// Start and end of a packet.
pub const END: u8 = 0xc0;
/// Escape: the next byte represents a special byte of the packet.
pub const ESC: u8 = 0xdb;
/// Idle: skipped everywhere, also inside a packet.
pub const IDLE: u8 = 0xde;
/// After [`ESC`]: represents a byte [`END`] of the packet.
pub const ESC_END: u8 = 0xdc;
/// After [`ESC`]: represents a byte [`ESC`] of the packet.
pub const ESC_ESC: u8 = 0xdd;
/// After [`ESC`]: represents a byte [`IDLE`] of the packet.
pub const ESC_IDLE: u8 = 0xdf;

/// The bytes that must be escaped in a packet, each with the one that represents it after [`ESC`].
pub const SPECIAL: [(u8, u8); 3] = [(END, ESC_END), (ESC, ESC_ESC), (IDLE, ESC_IDLE)];

/// The byte that represents `byte` after [`ESC`]; `None` if it needs no escape.
pub fn escape(byte: u8) -> Option<u8> {
    SPECIAL.into_iter().find(|(special, _)| *special == byte).map(|(_, after)| after)
}

/// The byte of a packet that `after` represents after [`ESC`]; `None` if there is none.
pub fn unescape(after: u8) -> Option<u8> {
    SPECIAL.into_iter().find(|(_, stands)| *stands == after).map(|(special, _)| special)
}

/// The bytes of a packet on the wire: escaped, with an END before and after.
pub fn encode(packet: &[u8]) -> Vec<u8> {
    let mut wire = vec![END];
    for &byte in packet {
        match escape(byte) {
            Some(after) => wire.extend([ESC, after]),
            None => wire.push(byte),
        }
    }
    wire.push(END);
    wire
}

/// Meaning of a byte from the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// A byte of the packet.
    Byte(u8),
    /// End of the packet.
    End,
    /// A byte that is not allowed after an escape.
    Broken,
    /// No byte of the packet: an idle or escape byte.
    None,
}

/// Removes SLIP escapes and idle bytes from a stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unescape {
    escaped: bool,
}

impl Unescape {
    /// Takes the next byte from the wire. An END always ends the packet, so a broken escape affects one packet only; an
    /// escape right before an END is lost, which the CRC detects.
    pub fn next(&mut self, byte: u8) -> Symbol {
        if byte == IDLE {
            return Symbol::None;
        }
        let escaped = self.escaped;
        self.escaped = byte == ESC && !escaped;
        match (escaped, byte) {
            (_, END) => Symbol::End,
            (true, byte) => unescape(byte).map_or(Symbol::Broken, Symbol::Byte),
            (false, ESC) => Symbol::None,
            (false, byte) => Symbol::Byte(byte),
        }
    }
}
