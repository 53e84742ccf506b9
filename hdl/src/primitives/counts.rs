//! Lane mask of a quad: which lanes hold distinct taxels.

use dermis_golden::fixed::quads::Quads;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Quad address to lane mask; combinational. All four lanes count, except that of each pair of copies on the middle
/// line of an odd row or column count only one does.
#[derive(LogicBlock)]
pub struct Counts {
    /// Index of the case.
    pub which: Wire<In>,
    /// Quad address in the subarray.
    pub address: Wire<In>,
    /// One bit per lane: the lane is counted.
    pub mask: Wire<Out>,
    _layouts: Vec<Quads>,
}

impl Counts {
    /// `layouts[case]` is the quad layout of the subarrays of each case.
    pub fn new(layouts: &[Quads]) -> Self {
        let quads = layouts.iter().map(Quads::len).max().unwrap_or(1);
        Counts {
            which: Wire::new(count_bits(layouts.len())),
            address: Wire::new(count_bits(quads)),
            mask: Wire::new(4),
            _layouts: layouts.to_vec(),
        }
    }
}

impl Logic for Counts {
    fn update(&mut self) {
        let address = self.address.val().number() as usize;
        let layout = self._layouts.get(self.which.val().number() as usize).filter(|layout| address < layout.len());
        let mask = layout.map_or(0b1111, |layout| layout.lane_mask(address));
        self.mask.next = Word::from(u64::from(mask));
    }

    fn connect(&mut self) {
        self.mask.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.address.width();
        let (selector, selector_bits) = match self._layouts.len() {
            1 => ("address", bits),
            _ => ("{which, address}", self.which.width() + bits),
        };
        let all = self._layouts.iter().enumerate().flat_map(|(case, layout)| {
            (0..layout.len()).map(move |address| (case << bits | address, layout.lane_mask(address)))
        });
        let cases: String = all
            .filter(|&(_, mask)| mask != 0b1111)
            .map(|(index, mask)| format!("    {selector_bits}'d{index}: mask = 4'b{mask:04b};\n"))
            .collect();
        Verilog::Custom(if cases.is_empty() {
            "// Even row and column counts: every lane is a taxel.\n\
             wire unused = &{1'b0, which, address};\nalways @(*) mask = 4'b1111;"
                .to_string()
        } else {
            format!(
                "wire unused_which = &{{1'b0, which}};\n\
                 always @(*) begin\n  case ({selector})\n{cases}    default: mask = 4'b1111;\n  endcase\nend"
            )
        })
    }
}
