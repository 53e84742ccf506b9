//! Write address of finished vectors in the operand memory.

use rust_hdl::prelude::*;

use super::case_counter::{largest, number_by_case};
use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Counts the quads of the v_ij as they arrive: the write address of the current quad, whether it is an operand of a
/// later pass and has to be written, and how many vectors are complete.
#[derive(LogicBlock)]
pub struct Filler {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case.
    pub which: Wire<In>,
    /// Restarts the counts for the next subarray, with priority over `valid`.
    pub clear: Signal<In, Bit>,
    /// A quad of a v_ij arrives in this cycle.
    pub valid: Signal<In, Bit>,
    /// Write address of the quad; valid with `keep`.
    pub address: Wire<Out>,
    /// Write enable: the quad is an operand of a later pass. Combinational from `valid`.
    pub keep: Signal<Out, Bit>,
    /// Number of complete operand vectors of this subarray.
    pub finished: Wire<Out>,
    _quads: Vec<usize>,
    _vectors: usize,
    _seen: usize,
}

impl Filler {
    /// `vectors` operand vectors per subarray, of `quads[case]` quads each.
    pub fn new(vectors: usize, quads: &[usize]) -> Self {
        Filler {
            clk: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            clear: Default::default(),
            valid: Default::default(),
            address: Wire::new(count_bits(vectors.max(1) * largest(quads))),
            keep: Default::default(),
            finished: Wire::new(count_bits(vectors + 1)),
            _quads: quads.to_vec(),
            _vectors: vectors,
            _seen: 0,
        }
    }
}

impl Logic for Filler {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.clear.val() {
                self._seen = 0;
            } else if self.keep.val() {
                self._seen += 1;
            }
        }
        let quads = self._quads[(self.which.val().number() as usize).min(self._quads.len() - 1)];
        let all = self._vectors * quads;
        self.address.next = Word::from(self._seen.min(all.saturating_sub(1)) as u64);
        self.finished.next = Word::from((self._seen / quads) as u64);
        self.keep.next = self.valid.val() && self._seen < all;
    }

    fn connect(&mut self) {
        self.address.connect();
        self.keep.connect();
        self.finished.connect();
    }

    fn hdl(&self) -> Verilog {
        let (a, f) = (self.address.width(), self.finished.width());
        let q = count_bits(largest(&self._quads));
        if self._vectors == 0 {
            return Verilog::Custom(format!(
                "// No v_ij is an operand of a later pass.\nwire unused = &{{1'b0, clk, which, clear, valid}};\n\
                 always @(*) {{keep, address, finished}} = {}'d0;",
                1 + a + f
            ));
        }
        Verilog::Custom(format!(
            "\
reg [{q_end}:0] quad;
wire unused_which = &{{1'b0, which}};
wire last_quad = quad == {last};
always @(*) keep = valid && finished != {f}'d{vectors};
always @(posedge clk) begin
  if (clear) begin
    quad <= {q}'d0;
    address <= {a}'d0;
    finished <= {f}'d0;
  end else if (keep) begin
    quad <= last_quad ? {q}'d0 : quad + {q}'d1;
    if (address != {a}'d{end}) address <= address + {a}'d1;
    if (last_quad) finished <= finished + {f}'d1;
  end
end",
            q_end = q - 1,
            last = number_by_case(self._quads.iter().map(|quads| quads - 1), q),
            vectors = self._vectors,
            end = self._vectors * largest(&self._quads) - 1,
        ))
    }
}
