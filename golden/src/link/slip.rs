//! SLIP, RFC 1055: packets between END bytes, so that whoever has lost the thread finds the next packet at once; with
//! one more special byte, [`IDLE`], for wires that must carry something when there is nothing to say.

/// Between packets.
pub const END: u8 = 0xc0;
/// Before a byte that stands for another.
pub const ESC: u8 = 0xdb;
/// Nothing: skipped wherever it comes, inside a packet, too.
pub const IDLE: u8 = 0xde;
/// After [`ESC`]: a byte [`END`] of the packet.
pub const ESC_END: u8 = 0xdc;
/// After [`ESC`]: a byte [`ESC`] of the packet.
pub const ESC_ESC: u8 = 0xdd;
/// After [`ESC`]: a byte [`IDLE`] of the packet.
pub const ESC_IDLE: u8 = 0xdf;

/// The bytes that no packet has on the wire as they are, each with the one that stands for it after [`ESC`].
pub const SPECIAL: [(u8, u8); 3] = [(END, ESC_END), (ESC, ESC_ESC), (IDLE, ESC_IDLE)];

/// What stands for a byte of a packet after [`ESC`], if it needs that.
pub fn escape(byte: u8) -> Option<u8> {
    SPECIAL.into_iter().find(|(special, _)| *special == byte).map(|(_, after)| after)
}

/// The byte of a packet that this one stands for after [`ESC`].
pub fn unescape(after: u8) -> Option<u8> {
    SPECIAL.into_iter().find(|(_, stands)| *stands == after).map(|(special, _)| special)
}

/// A packet on the wire, an END before and after it.
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

/// What a byte from the wire gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// A byte of the packet.
    Byte(u8),
    /// The packet is over.
    End,
    /// An escape before a byte that cannot follow it.
    Broken,
    /// Nothing yet.
    None,
}

/// Takes bytes from the wire.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unescape {
    escaped: bool,
}

impl Unescape {
    /// The next byte from the wire. An END always ends the packet, so that a broken escape spoils one packet only; an
    /// escape right before it is lost, which the CRC shows.
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
