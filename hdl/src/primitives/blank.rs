//! Nothing in the place of what dead taxels read.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Counts the taxels of a frame; `kept` is the word on `word`, or 0 where the taxel whose turn it is is dead.
///
/// Whether it is dead is known a cycle ahead, so that the comparisons are not in the way of the word.
#[derive(LogicBlock)]
pub struct Blank {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Back to the frame's first taxel.
    pub clear: Signal<In, Bit>,
    /// The word is taken: next taxel.
    pub enable: Signal<In, Bit>,
    /// A taxel's word.
    pub word: Wire<In>,
    /// What counts of it.
    pub kept: Wire<Out>,
    _dead: Vec<usize>,
    _taxels: usize,
    _taxel: usize,
}

impl Blank {
    /// Words of `bits` bits of `taxels` taxels, of which those of `dead` do not count.
    pub fn new(bits: usize, taxels: usize, dead: &[usize]) -> Self {
        Blank {
            clk: Default::default(),
            clear: Default::default(),
            enable: Default::default(),
            word: Wire::new(bits),
            kept: Wire::new(bits),
            _dead: dead.to_vec(),
            _taxels: taxels,
            _taxel: 0,
        }
    }
}

impl Logic for Blank {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let last = self._taxel + 1 == self._taxels;
            self._taxel = match (self.clear.val(), self.enable.val()) {
                (true, _) => 0,
                (false, true) if last => 0,
                (false, enable) => self._taxel + usize::from(enable),
            };
        }
        let dead = self._dead.contains(&self._taxel);
        self.kept.next = if dead { Word::default() } else { self.word.val() };
    }

    fn connect(&mut self) {
        self.kept.connect();
    }

    fn hdl(&self) -> Verilog {
        if self._dead.is_empty() {
            return Verilog::Custom(
                "// Every taxel is read.\nwire unused = &{1'b0, clk, clear, enable};\nalways @(*) kept = word;"
                    .to_string(),
            );
        }
        let (bits, count) = (self.word.width(), count_bits(self._taxels));
        let is: String = self._dead.iter().map(|taxel| format!("    {count}'d{taxel},\n")).collect();
        Verilog::Custom(format!(
            "\
reg [{end}:0] taxel;
wire [{end}:0] after = taxel == {count}'d{last} ? {count}'d0 : taxel + {count}'d1;
wire [{end}:0] following = clear ? {count}'d0 : enable ? after : taxel;
reg among, dead;
always @(*) begin
  (* rom_style = \"logic\" *)
  case (following)
{cases}: among = 1'b1;
    default: among = 1'b0;
  endcase
end
always @(posedge clk) begin
  taxel <= following;
  dead <= among;
end
always @(*) kept = dead ? {bits}'d0 : word;",
            end = count - 1,
            last = self._taxels - 1,
            cases = is.trim_end().trim_end_matches(','),
        ))
    }
}
