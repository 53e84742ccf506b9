//! Accumulators to words: shift, round, saturate, count saturations.

use dermis_golden::fixed::arith::{round_shift, saturate};
use dermis_golden::fixed::formats::{Formats, SEARCH_EXTRA_BITS};
use rust_hdl::prelude::*;

use super::half_up::half_up;
use super::raw_length::shift_bits;
use crate::wire::{Wire, Word};

/// A quad of accumulators, shifted right by `shift` if `measured`, otherwise by the constant shift of an A pass.
///
/// `words` follow three cycles later, `operands` (the same rounded and saturated to `data_bits`) four. `saturations`
/// counts the saturated words of valid quads since `clear`; it includes a quad two cycles after its `words`.
#[derive(LogicBlock)]
pub struct Rescaler {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Sets `saturations` to 0.
    pub clear: Signal<In, Bit>,
    /// `quad` holds a row; otherwise its saturations are not counted.
    pub valid: Signal<In, Bit>,
    /// Shift this quad by `shift`, not by the constant.
    pub measured: Signal<In, Bit>,
    /// Measured right shift; valid with `measured`.
    pub shift: Wire<In>,
    /// Four accumulators, `acc_bits` each, signed.
    pub quad: Wire<In>,
    /// Four v_ij, `vector_bits` each, signed; three cycles after `quad`.
    pub words: Wire<Out>,
    /// Four operands, `data_bits` each, signed; four cycles after `quad`.
    pub operands: Wire<Out>,
    /// Number of saturated words, 16 bits; stays at the largest count.
    pub saturations: Wire<Out>,
    _formats: Formats,
    _taken: (Word, u32, bool),
    _shifted: [i64; 4],
    _valid: bool,
    _clipped: u64,
    _clips: u64,
}

/// Width of a saturation counter, in bits.
pub const SATURATION_BITS: usize = 16;

impl Rescaler {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Rescaler {
            clk: Default::default(),
            clear: Default::default(),
            valid: Default::default(),
            measured: Default::default(),
            shift: Wire::new(shift_bits(formats)),
            quad: Wire::new(4 * formats.acc_bits as usize),
            words: Wire::new(4 * formats.vector_bits as usize),
            operands: Wire::new(4 * formats.data_bits as usize),
            saturations: Wire::new(SATURATION_BITS),
            _formats: formats.clone(),
            _taken: (Word::default(), 0, false),
            _shifted: [0; 4],
            _valid: false,
            _clipped: 0,
            _clips: 0,
        }
    }
}

impl Logic for Rescaler {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let f = &self._formats;
            let operand = |lane| {
                let word = self.words.val().signed(lane, f.vector_bits as usize);
                saturate(round_shift(word, SEARCH_EXTRA_BITS), f.data_bits).0
            };
            self.operands.next = Word::of_fields(&[0, 1, 2, 3].map(operand), f.data_bits as usize);
            let rounded = self._shifted.map(|value| saturate(value, f.vector_bits));
            self.words.next = Word::of_fields(&rounded.map(|(word, _)| word), f.vector_bits as usize);
            let count = self.saturations.val().number() + self._clips;
            self.saturations.next = Word::from(match self.clear.val() {
                true => 0,
                false => count.min((1 << SATURATION_BITS) - 1),
            });
            let clipped = rounded.iter().filter(|(_, clipped)| *clipped).count() as u64;
            self._clips = self._clipped;
            self._clipped = if self._valid { clipped } else { 0 };
            let (quad, shift, valid) = self._taken;
            self._shifted = std::array::from_fn(|lane| round_shift(quad.signed(lane, f.acc_bits as usize), shift));
            self._valid = valid;
            let shift = if self.measured.val() { self.shift.val().number() as u32 } else { f.a_shift };
            self._taken = (self.quad.val(), shift, self.valid.val());
        }
    }

    fn connect(&mut self) {
        self.words.connect();
        self.operands.connect();
        self.saturations.connect();
    }

    fn hdl(&self) -> Verilog {
        let f = &self._formats;
        let (acc, r, d) = (f.acc_bits as usize, f.vector_bits as usize, f.data_bits as usize);
        let extra = SEARCH_EXTRA_BITS as usize;
        let shift_bits = self.shift.width();
        let cap = SATURATION_BITS;
        Verilog::Custom(format!(
            "\
reg [{quad_end}:0] taken;
reg valid1, valid2;
wire [3:0] clipped;
reg [3:0] clipped3;
reg [2:0] clips;
wire [{cap}:0] count = {{1'b0, saturations}} + {{{count_more}'d0, clips}};
always @(posedge clk) begin
  taken <= quad;
  valid1 <= valid;
  valid2 <= valid1;
  clipped3 <= valid2 ? clipped : 4'd0;
  clips <= {{2'd0, clipped3[0]}} + {{2'd0, clipped3[1]}} + {{2'd0, clipped3[2]}} + {{2'd0, clipped3[3]}};
  if (clear) saturations <= {cap}'d0;
  else saturations <= count[{cap}] ? {{{cap}{{1'b1}}}} : count[{cap_end}:0];
end
genvar l;
generate
  for (l = 0; l < 4; l = l + 1) begin : lane
    // One copy per lane: the lanes are placed far apart, near the MAC lanes that feed them.
    reg [{shift_end}:0] amount;
    (* keep *) always @(posedge clk) amount <= measured ? shift : {shift_bits}'d{a_shift};
    // One bit below the LSB is kept, so that adding one and dropping it rounds half up.
    reg signed [{acc}:0] moved;
    wire signed [{acc}:0] doubled = {{taken[l * {acc} +: {acc}], 1'b0}};
{rounding}    wire [{r_end}:0] now = words[l * {r} +: {r}];
    wire [{short_end}:0] operand = {{now[{r_end}], now[{r_end}:{extra_low}]}} + {short}'d1;
    wire overflow = operand[{short_end}] != operand[{short_less}];
    wire unused = &{{1'b0, operand[0], now, half_up[0]}};
    always @(posedge clk) begin
      moved <= doubled >>> amount;
      words[l * {r} +: {r}] <= clipped[l] ? {{moved[{acc}], {{{r_less}{{!moved[{acc}]}}}}}} : half_up[{r}:1];
      operands[l * {d} +: {d}] <= overflow ? {{1'b0, {{{d_less}{{1'b1}}}}}} : operand[{d}:1];
    end
  end
endgenerate",
            shift_end = shift_bits - 1,
            quad_end = 4 * acc - 1,
            a_shift = f.a_shift,
            count_more = cap + 1 - 3,
            cap_end = cap - 1,
            rounding = half_up(acc + 1, r, "clipped[l]"),
            r_end = r - 1,
            r_less = r - 1,
            extra_low = extra - 1,
            short = d + 2,
            short_end = d + 1,
            short_less = d,
            d_less = d - 1,
        ))
    }
}
