//! SLIP, RFC 1055: packets between END bytes, so that whoever has lost the thread finds the next packet at once.

/// Between packets.
pub const END: u8 = 0xc0;
/// Before a byte that stands for another.
pub const ESC: u8 = 0xdb;
/// After [`ESC`]: a byte [`END`] of the packet.
pub const ESC_END: u8 = 0xdc;
/// After [`ESC`]: a byte [`ESC`] of the packet.
pub const ESC_ESC: u8 = 0xdd;

/// A packet on the wire, an END before and after it.
pub fn encode(packet: &[u8]) -> Vec<u8> {
    let mut wire = vec![END];
    for &byte in packet {
        match byte {
            END => wire.extend([ESC, ESC_END]),
            ESC => wire.extend([ESC, ESC_ESC]),
            byte => wire.push(byte),
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
        let escaped = self.escaped;
        self.escaped = byte == ESC && !escaped;
        match (escaped, byte) {
            (_, END) => Symbol::End,
            (true, ESC_END) => Symbol::Byte(END),
            (true, ESC_ESC) => Symbol::Byte(ESC),
            (true, _) => Symbol::Broken,
            (false, ESC) => Symbol::None,
            (false, byte) => Symbol::Byte(byte),
        }
    }
}
