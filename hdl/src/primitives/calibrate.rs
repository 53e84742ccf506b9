//! Codes to stress: subtracts the zero and multiplies by the gain of each taxel, from a table in a memory file.

use dermis_golden::fixed::prepare::{Prepare, GAIN_BITS, GAIN_FRACTION};
use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::pass_through::pass_through;
use crate::wire::{Wire, Word};

/// ```text
/// s_axis --> read table, hold code --> difference --> product --> round, saturate --> m_axis
/// ```
/// All registers advance together while the output is free: latency 4 cycles with gains, 2 with zeros alone, 0 with no
/// table, where the stream passes through. The taxel count restarts at `tlast`, as in `receive`.
#[derive(LogicBlock)]
pub struct Calibrate {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's stress in codes, `bits` wide, two's complement, saturated; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    _prepare: Prepare,
    _taxels: usize,
    _taxel: usize,
    _pipe: Vec<Option<(i64, bool)>>,
}

/// File of the table, one line per taxel: zero in the low bits, gain above.
pub const CALIBRATION_FILE: &str = "calibration.hex";

impl Calibrate {
    /// Calibrates codes of `bits` bits of `taxels` taxels with the tables of `prepare`.
    pub fn new(prepare: &Prepare, taxels: usize, bits: usize) -> Self {
        let steps = match (&prepare.zero, &prepare.gain) {
            (None, None) => 0,
            (_, None) => 2,
            (_, Some(_)) => 4,
        };
        Calibrate {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            _prepare: prepare.clone(),
            _taxels: taxels,
            _taxel: 0,
            _pipe: vec![None; steps],
        }
    }

    /// Content of [`CALIBRATION_FILE`] for `$readmemh`; `None` without a table.
    pub fn table_file(&self) -> Option<String> {
        let bits = self.s_axis_tdata.width();
        let zero = self._prepare.zero.as_ref()?;
        let word = |taxel: usize| {
            let gain = self._prepare.gain.as_ref().map_or(0, |gain| gain[taxel] as u64 & ((1 << GAIN_BITS) - 1));
            gain << bits | zero[taxel] as u64 & ((1 << bits) - 1)
        };
        Some((0..self._taxels).map(|taxel| format!("{:x}\n", word(taxel))).collect())
    }
}

impl Logic for Calibrate {
    fn update(&mut self) {
        let bits = self.s_axis_tdata.width();
        let Some(&leaving) = self._pipe.first() else {
            self.m_axis_tdata.next = self.s_axis_tdata.val();
            self.m_axis_tvalid.next = self.s_axis_tvalid.val();
            self.m_axis_tlast.next = self.s_axis_tlast.val();
            self.s_axis_tready.next = self.m_axis_tready.val();
            return;
        };
        let moves = leaving.is_none() || self.m_axis_tready.val();
        if self.clk.pos_edge() {
            if moves {
                let taken = self.s_axis_tvalid.val().then(|| {
                    let last = self.s_axis_tlast.val();
                    let code = self.s_axis_tdata.val().signed(0, bits) as i32;
                    let stress = self._prepare.calibrate(self._taxel, code);
                    self._taxel = if last || self._taxel + 1 == self._taxels { 0 } else { self._taxel + 1 };
                    (stress, last)
                });
                self._pipe.remove(0);
                self._pipe.push(taken);
            }
            if self.rst.val() {
                self._pipe.fill(None);
                self._taxel = 0;
            }
        }
        let leaving = self._pipe[0];
        self.s_axis_tready.next = (leaving.is_none() || self.m_axis_tready.val()) && !self.rst.val();
        self.m_axis_tvalid.next = leaving.is_some();
        let (stress, last) = leaving.unwrap_or((self.m_axis_tdata.val().signed(0, bits), self.m_axis_tlast.val()));
        self.m_axis_tdata.next = Word::of_fields(&[stress], bits);
        self.m_axis_tlast.next = last;
    }

    fn connect(&mut self) {
        self.s_axis_tready.connect();
        self.m_axis_tdata.connect();
        self.m_axis_tvalid.connect();
        self.m_axis_tlast.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.s_axis_tdata.width();
        let steps = self._pipe.len();
        if steps == 0 {
            return pass_through("No zero and no gain: the stream passes through.");
        }
        let gain = if self._prepare.gain.is_some() { GAIN_BITS as usize } else { 0 };
        let taxel = count_bits(self._taxels);
        // The difference has one bit more; the product with a gain is shifted right by its fraction.
        let product = bits + 1 + gain;
        let (declare, clocked, result) = match gain {
            0 => (String::new(), String::new(), "difference".to_string()),
            _ => (
                format!(
                    "\
wire signed [{gain_end}:0] gain = entry[{bits} +: {gain}];
reg signed [{bits}:0] held;
reg signed [{gain_end}:0] held_gain;
reg signed [{product_end}:0] product;
wire signed [{product_end}:0] doubled = product >>> {fraction_less};
wire [{product_end}:0] half_up = doubled + {product}'sd1;
wire [{cut_end}:0] rounded = half_up[{product_end}:1];
wire unused = &{{1'b0, half_up[0]}};
",
                    gain_end = gain - 1,
                    product_end = product - 1,
                    fraction_less = GAIN_FRACTION - 1,
                    cut_end = product - 2,
                ),
                "    held <= difference;\n    held_gain <= gain;\n    product <= held * held_gain;\n".to_string(),
                "rounded".to_string(),
            ),
        };
        let wide = if gain == 0 { bits + 1 } else { product - 1 };
        Verilog::Custom(format!(
            "\
reg [{entry_end}:0] entries [0:{last_taxel}];
initial $readmemh(\"{CALIBRATION_FILE}\", entries);
reg [{taxel_end}:0] taxel;
reg [{entry_end}:0] entry;
reg signed [{end}:0] code;
reg [{steps_end}:0] valids, lasts;
wire signed [{end}:0] zero = entry[0 +: {bits}];
wire signed [{bits}:0] difference = code - zero;
{declare}wire [{over}:0] sign = {result}[{wide_end}:{end}];
wire clipped = sign != {{{over1}{{{result}[{wide_end}]}}}};
wire moves = !valids[{steps_end}] || m_axis_tready;
always @(*) s_axis_tready = moves && !rst;
always @(*) m_axis_tvalid = valids[{steps_end}];
always @(*) m_axis_tlast = lasts[{steps_end}];
always @(posedge clk) begin
  if (rst) begin
    valids <= {steps}'d0;
    taxel <= {taxel}'d0;
  end else if (moves) begin
    valids <= {{valids[{steps_less}:0], s_axis_tvalid}};
    if (s_axis_tvalid) taxel <= s_axis_tlast || taxel == {taxel}'d{last_taxel} ? {taxel}'d0 : taxel + {taxel}'d1;
  end
  if (moves) begin
    lasts <= {{lasts[{steps_less}:0], s_axis_tlast}};
    entry <= entries[taxel];
    code <= s_axis_tdata;
{clocked}    m_axis_tdata <= clipped ? {{{result}[{wide_end}], {{{end}{{!{result}[{wide_end}]}}}}}} : {result}[{end}:0];
  end
end",
            entry_end = bits + gain - 1,
            last_taxel = self._taxels - 1,
            taxel_end = taxel - 1,
            end = bits - 1,
            steps_end = steps - 1,
            steps_less = steps - 2,
            wide_end = wide - 1,
            over = wide - bits,
            over1 = wide - bits + 1,
        ))
    }
}
