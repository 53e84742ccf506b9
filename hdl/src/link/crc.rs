//! CRC-32, two bits per cycle: bytes on a link are further apart, and this takes few logic cells.

use dermis_golden::link::CRC_RESIDUE;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Initial value of the CRC register.
const START: u32 = u32::MAX;
/// Polynomial of CRC-32, reflected.
const POLYNOMIAL: u32 = 0xedb8_8320;
/// The reflected polynomial shifted by one, for the first of two bits; its lowest bit is 0, so that it does not change
/// the second.
const BEFORE: u32 = POLYNOMIAL >> 1;
/// Cycles that a byte takes after the one with `load`.
pub const CYCLES: u32 = 4;

/// CRC of the received or of the sent bytes of a packet.
///
/// `load` XORs a byte into the low end of the register; the next four cycles process it. To send the CRC, the
/// register's own low byte is loaded for each byte sent: the XOR clears it, which leaves only the shift to the next
/// byte.
#[derive(LogicBlock)]
pub struct Crc {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// A packet starts: resets the CRC, with priority over `load`.
    pub restart: Signal<In, Bit>,
    /// A byte of the packet; valid with `load`.
    pub octet: Wire<In>,
    /// Take `octet` in this cycle; not while `busy`.
    pub load: Signal<In, Bit>,
    /// Lowest byte of the inverted CRC register; valid while not `busy`.
    pub low: Wire<Out>,
    /// The bytes so far end with their correct CRC; valid while not `busy`.
    pub right: Signal<Out, Bit>,
    /// A byte is being processed.
    pub busy: Signal<Out, Bit>,
    _crc: u32,
    _left: u32,
}

impl Default for Crc {
    fn default() -> Self {
        Crc {
            clk: Default::default(),
            restart: Default::default(),
            octet: Wire::new(8),
            load: Default::default(),
            low: Wire::new(8),
            right: Default::default(),
            busy: Default::default(),
            _crc: START,
            _left: 0,
        }
    }
}

impl Logic for Crc {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.restart.val() {
                (self._crc, self._left) = (START, 0);
            } else if self.load.val() {
                self._crc ^= self.octet.val().number() as u32;
                self._left = CYCLES;
            } else if self._left > 0 {
                for _ in 0..8 / CYCLES {
                    let feedback = if self._crc & 1 == 1 { POLYNOMIAL } else { 0 };
                    self._crc = self._crc >> 1 ^ feedback;
                }
                self._left -= 1;
            }
        }
        self.low.next = Word::from(u64::from(!self._crc & 0xff));
        self.right.next = self._crc == CRC_RESIDUE;
        self.busy.next = self._left > 0;
    }

    fn connect(&mut self) {
        self.low.connect();
        self.right.connect();
        self.busy.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
reg [31:0] crc;
reg [2:0] left;
always @(*) begin
  low = ~crc[7:0];
  right = crc == 32'h{CRC_RESIDUE:x};
  busy = left != 3'd0;
end
always @(posedge clk) begin
  if (restart) begin
    crc <= 32'h{START:x};
    left <= 3'd0;
  end else if (load) begin
    crc[7:0] <= crc[7:0] ^ octet;
    left <= 3'd{CYCLES};
  end else if (busy) begin
    crc <= {{2'd0, crc[31:2]}} ^ (crc[0] ? 32'h{BEFORE:x} : 32'd0) ^ (crc[1] ? 32'h{POLYNOMIAL:x} : 32'd0);
    left <= left - 3'd1;
  end
end"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::settles;

    fn add(crc: &mut Crc, octet: u8) {
        for cycle in 0..=CYCLES {
            crc.octet.next = Word::from(u64::from(octet));
            crc.load.next = cycle == 0;
            for clock in [false, true] {
                crc.clk.next = clock.into();
                assert!(settles(crc));
            }
        }
    }

    #[test]
    fn the_published_check_value_and_the_residue() {
        let mut crc = Crc::default();
        crc.connect_all();
        b"123456789".iter().for_each(|&octet| add(&mut crc, octet));
        // CRC-32/ISO-HDLC of "123456789".
        assert_eq!(!crc._crc, 0xcbf4_3926);
        // Sending the CRC by its own low bytes leaves zero in the register.
        let mut out = Crc { _crc: crc._crc, ..Crc::default() };
        out.connect_all();
        for octet in 0xcbf4_3926u32.to_le_bytes() {
            assert_eq!(out._crc as u8, !octet);
            add(&mut out, !octet);
            add(&mut crc, octet);
        }
        assert_eq!((out._crc, crc._crc), (0, CRC_RESIDUE));
    }
}
