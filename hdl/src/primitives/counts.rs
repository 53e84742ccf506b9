//! Which lanes of a quad are taxels of their own.

use dermis_golden::fixed::quads::Quads;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Quad address to the lanes that count: all four, but one of each pair of copies on a middle line. Combinational.
#[derive(LogicBlock)]
pub struct Counts {
    /// Quad address.
    pub address: Wire<In>,
    /// One bit per lane.
    pub mask: Wire<Out>,
    _layout: Quads,
}

impl Counts {
    /// For subarrays of `layout`.
    pub fn new(layout: Quads) -> Self {
        Counts { address: Wire::new(count_bits(layout.len())), mask: Wire::new(4), _layout: layout }
    }
}

impl Logic for Counts {
    fn update(&mut self) {
        let address = self.address.val().number() as usize;
        let mask = if address < self._layout.len() { self._layout.counts(address) } else { 0b1111 };
        self.mask.next = Word::from(u64::from(mask));
    }

    fn connect(&mut self) {
        self.mask.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.address.width();
        let cases: String = (0..self._layout.len())
            .map(|address| (address, self._layout.counts(address)))
            .filter(|&(_, mask)| mask != 0b1111)
            .map(|(address, mask)| format!("    {bits}'d{address}: mask = 4'b{mask:04b};\n"))
            .collect();
        Verilog::Custom(if cases.is_empty() {
            "// Even row and column counts: every lane is a taxel.\n\
             wire unused = &{1'b0, address};\nalways @(*) mask = 4'b1111;"
                .to_string()
        } else {
            format!("always @(*) begin\n  case (address)\n{cases}    default: mask = 4'b1111;\n  endcase\nend")
        })
    }
}
