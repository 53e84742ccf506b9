//! Scores of the nine candidates, one value at a time: log2(|p| + ⌊Σp / 2^20⌋) is added to the candidate's total.
//!
//! ```text
//! value --> magnitude --> + floor of the candidate --> leading one, by halves --> table --> total of the candidate
//! ```
//! The sum polynomial comes first. Its value is Σp itself: ⌊Σp / 2^20⌋ is stored as the candidate's floor, and its
//! total starts at −n log2 Σp.

use dermis_golden::fixed::formats::{Formats, EPSILON_SHIFT, LOG_FRACTION};
use dermis_golden::fixed::search::{log2, log_table};
use dermis_golden::fixed::serial::{floor_bits, word_bits};
use rust_hdl::prelude::*;

use super::solve::padded;
use crate::wire::{Wire, Word};

/// Width of the leading one's position: words have at most 32 bits.
const PLACE_BITS: usize = 5;
const LOG_BITS: usize = PLACE_BITS + LOG_FRACTION as usize;

/// Function in the module docs. A total is written to its memory six cycles after its value arrived; the values of a
/// candidate are 16 cycles apart.
#[derive(LogicBlock)]
pub struct Score {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A candidate's value p, signed.
    pub value: Wire<In>,
    /// Index of the candidate; valid with `valid`.
    pub index: Wire<In>,
    /// `value` is valid.
    pub valid: Signal<In, Bit>,
    /// `value` is Σp; valid with `valid`.
    pub sum: Signal<In, Bit>,
    /// The candidate's floor ⌊Σp / 2^20⌋, one cycle after `index`.
    pub floor: Wire<In>,
    /// Write `floor_data`.
    pub floor_write: Signal<Out, Bit>,
    /// Index of the candidate whose floor is written; valid with `floor_write`.
    pub floor_index: Wire<Out>,
    /// Floor to write, 0 if Σp ≤ 0; valid with `floor_write`.
    pub floor_data: Wire<Out>,
    /// Index of the candidate whose total is read.
    pub read_index: Wire<Out>,
    /// `{Σp > 0, total}`, total signed, 2^−6; one cycle after `read_index`.
    pub total: Wire<In>,
    /// Write `write_data`.
    pub write: Signal<Out, Bit>,
    /// Index of the candidate whose total is written; valid with `write`.
    pub write_index: Wire<Out>,
    /// `{Σp > 0, total}` to write; valid with `write`.
    pub write_data: Wire<Out>,
    _taxels: i64,
    _state: [Stage; 5],
}

#[derive(Clone, Copy, Debug, Default)]
struct Stage {
    number: i64,
    index: u64,
    valid: bool,
    sum: bool,
    positive: bool,
}

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let total = formats.score_bits as usize + 1;
        Score {
            clk: Default::default(),
            rst: Default::default(),
            value: Wire::new(word_bits(formats)),
            index: Wire::new(4),
            valid: Default::default(),
            sum: Default::default(),
            floor: Wire::new(floor_bits(formats)),
            floor_write: Default::default(),
            floor_index: Wire::new(4),
            floor_data: Wire::new(floor_bits(formats)),
            read_index: Wire::new(4),
            total: Wire::new(total),
            write: Default::default(),
            write_index: Wire::new(4),
            write_data: Wire::new(total),
            _taxels: 4 * formats.quads as i64,
            _state: [Stage::default(); 5],
        }
    }
}

impl Logic for Score {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let s = self._state;
            let value = self.value.val().signed(0, self.value.width());
            let sum = self.sum.val();
            let floor = if s[0].sum { 0 } else { self.floor.val().number() as i64 };
            self._state = [
                Stage {
                    number: if sum { value } else { value.abs() },
                    index: self.index.val().number(),
                    valid: self.valid.val(),
                    sum,
                    positive: value > 0,
                },
                Stage { number: s[0].number + floor, ..s[0] },
                s[1],
                Stage { number: log2(s[2].number), ..s[2] },
                s[3],
            ];
            if self.rst.val() {
                self._state = [Stage::default(); 5];
            }
        }
        let s = self._state;
        self.floor_write.next = s[0].valid && s[0].sum;
        self.floor_index.next = Word::from(s[0].index);
        self.floor_data.next = Word::from(if s[0].positive { s[0].number as u64 >> EPSILON_SHIFT } else { 0 });
        self.read_index.next = Word::from(s[3].index);
        let end = s[4];
        self.write.next = end.valid;
        self.write_index.next = Word::from(end.index);
        let bits = self.total.width() - 1;
        let old = self.total.val();
        let (total, positive) = match end.sum {
            true => (-self._taxels * end.number, end.positive),
            false => (old.signed(0, bits) + end.number, old.field(bits, 1) == 1),
        };
        let mut word = Word::of_fields(&[total], bits);
        word.set(bits, 1, u64::from(positive));
        self.write_data.next = word;
    }

    fn connect(&mut self) {
        let wires = [
            &mut self.floor_index,
            &mut self.floor_data,
            &mut self.read_index,
            &mut self.write_index,
            &mut self.write_data,
        ];
        wires.into_iter().for_each(Wire::connect);
        [&mut self.floor_write, &mut self.write].into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let (bits, floor, total) = (self.value.width(), self.floor.width(), self.total.width() - 1);
        let end = bits - 1;
        // As gates: synthesis would map a table to a memory.
        let table: Vec<String> = (0..LOG_FRACTION)
            .rev()
            .map(|bit| {
                let terms: Vec<String> = log_table()
                    .iter()
                    .enumerate()
                    .filter(|(_, entry)| **entry >> bit & 1 == 1)
                    .map(|(cell, _)| format!("mantissa == 4'd{cell}"))
                    .collect();
                if terms.is_empty() {
                    "1'b0".to_string()
                } else {
                    format!("({})", terms.join(" || "))
                }
            })
            .collect();
        let weighed: Vec<String> = (0..total - LOG_BITS)
            .filter(|shift| self._taxels >> shift & 1 == 1)
            .map(|shift| match (shift, total - LOG_BITS - shift) {
                (0, zeros) => format!("{{{zeros}'d0, late}}"),
                (_, zeros) => format!("{{{zeros}'d0, late, {shift}'d0}}"),
            })
            .collect();
        let floor_top = if bits > EPSILON_SHIFT as usize {
            format!("magnitude[{end}:{EPSILON_SHIFT}]")
        } else {
            format!("{floor}'d0")
        };
        Verilog::Custom(format!(
            "\
reg [{end}:0] magnitude, argument;
reg [11:0] coarse;
reg [1:0] place_high;
reg [{log_end}:0] logarithm, late;
reg [3:0] index0, index1, index2, index3, index4;
// valid, sum, positive of each pipeline step
reg [2:0] kind0, kind1, kind2, kind3, kind4;
wire negative = value[{end}] && !sum;
wire [31:0] whole = {whole};
wire upper = |whole[31:16];
wire [19:0] half = upper ? whole[31:12] : {{whole[15:0], 4'd0}};
wire upper_byte = |half[19:12];
wire fours = |coarse[11:8];
wire [7:0] byte_left = fours ? coarse[11:4] : coarse[7:0];
wire twos = |byte_left[7:6];
wire [5:0] pair_left = twos ? byte_left[7:2] : byte_left[5:0];
wire ones = pair_left[5];
wire [3:0] mantissa = ones ? pair_left[4:1] : pair_left[3:0];
wire [{total_end}:0] weighed = {weighed};
wire [{total_end}:0] grown = total[{total_end}:0] + {late};
always @(posedge clk) begin
  magnitude <= (value ^ {{{bits}{{negative}}}}) + {{{end}'d0, negative}};
  argument <= magnitude + (kind0[1] ? {bits}'d0 : {floor_word});
  coarse <= upper_byte ? half[19:8] : half[11:0];
  place_high <= {{upper, upper_byte}};
  logarithm <= {{place_high, fours, twos, ones, {table}}};
  late <= logarithm;
  index0 <= index;
  index1 <= index0;
  index2 <= index1;
  index3 <= index2;
  index4 <= index3;
  kind0 <= {{valid && !rst, sum, !value[{end}] && value != {bits}'d0}};
  kind1 <= rst ? 3'd0 : kind0;
  kind2 <= rst ? 3'd0 : kind1;
  kind3 <= rst ? 3'd0 : kind2;
  kind4 <= rst ? 3'd0 : kind3;
end
always @(*) begin
  floor_write = kind0[2] && kind0[1];
  floor_index = index0;
  floor_data = kind0[0] ? {floor_top} : {floor}'d0;
  read_index = index3;
  write = kind4[2];
  write_index = index4;
  write_data = kind4[1] ? {{kind4[0], {total}'d0 - weighed}} : {{total[{total}], grown}};
end",
            log_end = LOG_BITS - 1,
            total_end = total - 1,
            whole = padded("argument", bits, 32),
            weighed = weighed.join(" + "),
            late = padded("late", LOG_BITS, total),
            floor_word = padded("floor", floor, bits),
            table = table.join(", "),
        ))
    }
}
