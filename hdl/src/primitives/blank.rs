//! Replaces the words of dead taxels by zero.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// Counts the taxels of a frame; `kept` is `word`, or 0 if the current taxel is dead. Combinational from `word` to
/// `kept`: the comparison with the list of dead taxels is registered a cycle ahead.
#[derive(LogicBlock)]
pub struct Blank {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Restarts the count at the first taxel, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// `word` is accepted; the next taxel follows.
    pub enable: Signal<In, Bit>,
    /// The current taxel's word, `bits` wide.
    pub word: Wire<In>,
    /// `word`, or 0 for a dead taxel; same cycle.
    pub kept: Wire<Out>,
    _dead: Vec<usize>,
    _taxels: usize,
    _taxel: usize,
}

impl Blank {
    /// Words of `bits` bits of a frame of `taxels` taxels; `dead` lists the row-major indices of the dead ones.
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
                "// No taxel is dead.\nwire unused = &{1'b0, clk, clear, enable};\nalways @(*) kept = word;"
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
