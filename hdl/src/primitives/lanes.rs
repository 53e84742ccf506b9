//! The MAC lanes with their coefficient memory and shift-out chains.

use dermis_golden::fixed::check::{parity, signature, step, POLYNOMIAL, START};
use dermis_golden::fixed::formats::{Formats, MULTIPLIER_BITS};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::case_counter::{by_case, largest, number_by_case};
use super::counter::count_bits;
use super::polynomial_word::resize;
use super::steps::control_bits;
use crate::wire::{Wire, Word};

const M: usize = MULTIPLIER_BITS as usize;

/// ```text
/// address --> memory --> register --> a \
///                                        * --> product --> aligned --> accumulator --> chain --> quad
/// operands -----------------------> b   /
/// ```
/// A memory word holds one coefficient per lane. `operands`, `valid` and `control` belong to the address of two cycles
/// earlier. After the last product of an accumulation its rows leave one per cycle: `lanes_per_parity` quads, fewer in
/// the last group, the first of them five cycles after the `control` of that product.
#[derive(LogicBlock)]
pub struct Lanes {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; clears the control pipeline only.
    pub rst: Signal<In, Bit>,
    /// Index of the case.
    pub which: Wire<In>,
    /// Address in the coefficient memory, two cycles before its operands.
    pub address: Wire<In>,
    /// Four operands, one per parity, 18 bits each, signed.
    pub operands: Wire<In>,
    /// `operands` and `control` are valid: one product per lane to accumulate.
    pub valid: Signal<In, Bit>,
    /// From bit 0: align, first product, last product of an accumulation; with the coefficient check also first product
    /// of a subarray. Valid with `valid`.
    pub control: Wire<In>,
    /// Accumulators of one row for the four parities, `acc_bits` each, signed.
    pub quad: Wire<Out>,
    /// `quad` holds a row.
    pub quad_valid: Signal<Out, Bit>,
    /// The signature of the coefficients read since the subarray's first product is wrong, 1 bit; valid from four
    /// cycles after its last product. Constant 0 without the check.
    pub damaged: Wire<Out>,
    _shape: Shape,
    _groups: Vec<usize>,
    _last_rows: Vec<usize>,
    _memory: Vec<Vec<i64>>,
    _pipe: Vec<Beat>,
    _coefficients: [usize; 2],
    _accumulators: Vec<i64>,
    _chain: Vec<i64>,
    _left: usize,
    _group: usize,
    /// Current signature, and the expected one of each case.
    _check: Option<(u32, Vec<u32>)>,
}

/// File of the coefficient memory, one line per word.
pub const MEMORY_FILE: &str = "coefficients.hex";

#[derive(Clone, Copy, Debug)]
struct Shape {
    per_parity: usize,
    acc_bits: usize,
    align: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct Beat {
    valid: bool,
    align: bool,
    first: bool,
    last: bool,
    opens: bool,
    word: usize,
    operands: Word,
}

impl Lanes {
    /// The lanes of `model`, with the coefficients of all its cases in one memory.
    pub fn new(model: &Model) -> Self {
        let (formats, cases) = (&model.formats, model.cases());
        let words = |case: &Model| case.storage.memory(&case.formats, &case.quantised);
        let memory: Vec<Vec<i64>> = cases.iter().flat_map(words).collect();
        let per_parity = formats.lanes_per_parity;
        let shape = Shape { per_parity, acc_bits: formats.acc_bits as usize, align: formats.limb_align as usize };
        Lanes {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            address: Wire::new(count_bits(memory.len())),
            operands: Wire::new(4 * M),
            valid: Default::default(),
            control: Wire::new(control_bits(model)),
            quad: Wire::new(4 * shape.acc_bits),
            quad_valid: Default::default(),
            damaged: Wire::new(1),
            _check: model.has_coefficient_check().then(|| (START, cases.iter().map(signature).collect())),
            _pipe: vec![Beat::default(); 4],
            _coefficients: [0; 2],
            _accumulators: vec![0; 4 * per_parity],
            _chain: vec![0; 4 * per_parity],
            _left: 0,
            _group: 0,
            _shape: shape,
            _groups: cases.iter().map(|case| case.formats.groups).collect(),
            _last_rows: cases.iter().map(|case| last_rows(&case.formats)).collect(),
            _memory: memory,
        }
    }

    /// Content of [`MEMORY_FILE`] for `$readmemh`, lane 0 in the least significant bits.
    pub fn memory_file(&self) -> String {
        let digits = (4 * self._shape.per_parity * M).div_ceil(4);
        self._memory
            .iter()
            .map(|word| {
                let mut nibbles = vec![0u8; digits];
                for (lane, &c) in word.iter().enumerate() {
                    for bit in (0..M).filter(|bit| c >> bit & 1 == 1) {
                        let at = lane * M + bit;
                        nibbles[at / 4] |= 1 << (at % 4);
                    }
                }
                nibbles.iter().rev().map(|n| format!("{n:x}")).collect::<String>() + "\n"
            })
            .collect()
    }

    /// Verilog of the signature: parity of each lane, of four lanes, of all lanes, one cycle each.
    fn check(&self) -> String {
        let Some((_, wanted)) = &self._check else { return "always @(*) damaged = 1'b0;\n".to_string() };
        let wanted: Vec<String> = wanted.iter().map(|signature| format!("32'h{signature:08x}")).collect();
        let fours = self._shape.per_parity;
        format!(
            "\
// Signature of the coefficients read, compared with the expected one.
reg [{lanes_end}:0] odd_lanes;
reg [{fours_end}:0] odd_fours;
reg [31:0] signature;
reg opens1, opens2;
wire [31:0] sofar = opens2 ? 32'h{START:08x} : signature;
always @(posedge clk) begin
  {{opens2, opens1}} <= {{opens1, control[3]}};
  if (valid2) signature <= {{sofar[30:0], ^odd_fours}} ^ (sofar[31] ? 32'h{POLYNOMIAL:08x} : 32'd0);
end
always @(*) damaged = signature != {wanted};
genvar o;
generate
  for (o = 0; o < {lanes}; o = o + 1) begin : odd_lane
    always @(posedge clk) odd_lanes[o] <= ^coefficients[o * {M} +: {M}];
  end
  for (o = 0; o < {fours}; o = o + 1) begin : odd_four
    always @(posedge clk) odd_fours[o] <= ^odd_lanes[o * 4 +: 4];
  end
endgenerate
",
            lanes = 4 * fours,
            lanes_end = 4 * fours - 1,
            fours_end = fours - 1,
            wanted = by_case(&wanted),
        )
    }

    fn accumulate(&mut self, beat: &Beat) {
        let word = &self._memory[beat.word];
        if let Some((signature, _)) = &mut self._check {
            *signature = step(if beat.opens { START } else { *signature }, parity(word));
        }
        for (lane, acc) in self._accumulators.iter_mut().enumerate() {
            let operand = beat.operands.signed(lane / self._shape.per_parity, M);
            let product = (word[lane] * operand) << if beat.align { self._shape.align } else { 0 };
            *acc = if beat.first { product } else { *acc + product };
        }
    }
}

/// Rows (quads) of the last group of a pass.
fn last_rows(formats: &Formats) -> usize {
    formats.quads - (formats.groups - 1) * formats.lanes_per_parity
}

impl Logic for Lanes {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let per_parity = self._shape.per_parity;
            // Last pipeline step first: a row leaves the chain, the accumulators move to the chain, a product is
            // accumulated.
            if self._left > 0 {
                self._left -= 1;
                for parity in 0..4 {
                    self._chain[parity * per_parity..(parity + 1) * per_parity].rotate_left(1);
                }
            }
            let captured = self._pipe[0];
            if captured.valid && captured.last {
                self._chain.clone_from(&self._accumulators);
                let case = (self.which.val().number() as usize).min(self._groups.len() - 1);
                self._group = (self._group + 1) % self._groups[case];
                self._left = if self._group == 0 { self._last_rows[case] } else { per_parity };
            }
            let done = self._pipe[1];
            if done.valid {
                self.accumulate(&done);
            }
            let control = self.control.val().number();
            self._pipe.remove(0);
            self._pipe.push(Beat {
                valid: self.valid.val() && !self.rst.val(),
                align: control & 1 == 1,
                first: control & 2 == 2,
                last: control & 4 == 4,
                opens: control & 8 == 8,
                word: self._coefficients[1],
                operands: self.operands.val(),
            });
            let address = self.address.val().number() as usize;
            self._coefficients = [address.min(self._memory.len() - 1), self._coefficients[0]];
            if self.rst.val() {
                self._pipe.iter_mut().for_each(|beat| beat.valid = false);
                self._left = 0;
                self._group = 0;
            }
            let heads: [i64; 4] = std::array::from_fn(|parity| self._chain[parity * per_parity]);
            self.quad.next = Word::of_fields(&heads, self._shape.acc_bits);
            self.quad_valid.next = self._left > 0;
        }
        if let Some((signature, wanted)) = &self._check {
            let case = (self.which.val().number() as usize).min(wanted.len() - 1);
            self.damaged.next = (*signature != wanted[case]).into();
        }
    }

    fn connect(&mut self) {
        self.quad.connect();
        self.quad_valid.connect();
        self.damaged.connect();
    }

    fn hdl(&self) -> Verilog {
        let Shape { per_parity, acc_bits, align } = self._shape;
        let groups = largest(&self._groups);
        let (lanes, words) = (4 * per_parity, self._memory.len());
        let row_bits = count_bits(per_parity + 1);
        let group_bits = count_bits(groups);
        let product = 2 * M;
        let wide = product + align;
        // Only products of two high limbs are shifted; without limbs the multiplexer is omitted.
        let (align_register, aligns, shifted) = match align {
            0 => (String::new(), String::new(), "product".to_string()),
            _ => (
                "reg align1;\nalways @(posedge clk) align1 <= control[0];\n".to_string(),
                "      reg aligns;\n      (* keep *) always @(posedge clk) aligns <= align1;\n".to_string(),
                format!("aligns ? {{product, {align}'d0}} : {{{{{align}{{product[{}]}}}}, product}}", product - 1),
            ),
        };
        let aligned = resize("shifted", wide, acc_bits);
        let last_rows = number_by_case(self._last_rows.iter().copied(), row_bits);
        let last_group = number_by_case(self._groups.iter().map(|groups| groups - 1), group_bits);
        let rows = match groups {
            1 => last_rows,
            _ => format!("group == {last_group} ? {last_rows} : {row_bits}'d{per_parity}"),
        };
        let count_group = if groups == 1 {
            String::new()
        } else {
            format!(
                "reg [{end}:0] group;
always @(posedge clk) begin
  if (rst) group <= {group_bits}'d0;
  else if (valid4 && last4) group <= group == {last_group} ? {group_bits}'d0 : group + {group_bits}'d1;
end
",
                end = group_bits - 1,
            )
        };
        Verilog::Custom(format!(
            "\
// One word: a coefficient of {M} bits for each of the {lanes} lanes.
wire unused_which = &{{1'b0, which}};
reg [{word_end}:0] memory [0:{words_end}];
initial $readmemh(\"{MEMORY_FILE}\", memory);
reg [{word_end}:0] word, coefficients;
reg valid1, valid2, valid3, valid4;
reg first1, first2;
reg last1, last2, last3, last4;
reg [{row_end}:0] left;
wire [{acc_word_end}:0] chain_head;
always @(posedge clk) begin
  word <= memory[address];
  coefficients <= word;
  valid1 <= !rst && valid;
  valid2 <= !rst && valid1;
  valid3 <= !rst && valid2;
  valid4 <= !rst && valid3;
  {{first2, first1}} <= {{first1, control[1]}};
  {{last4, last3, last2, last1}} <= {{last3, last2, last1, control[2]}};
end
{align_register}{count_group}{check}always @(posedge clk) begin
  if (rst) left <= {row_bits}'d0;
  else if (valid4 && last4) left <= {rows};
  else if (left != {row_bits}'d0) left <= left - {row_bits}'d1;
  // Registered to shorten a long route. Not written as left > 1, which is constant where left has one bit.
  quad_valid <= !rst && (valid4 && last4 || left != {row_bits}'d0 && left != {row_bits}'d1);
end
always @(*) quad = chain_head;
genvar p, k;
generate
  for (p = 0; p < 4; p = p + 1) begin : parity
    wire [{chain_end}:0] chain_in;
    // One copy per parity, each for a quarter of the lanes, to limit fan-out and route length.
    reg leaves2, leaves3;
    (* keep *) always @(posedge clk) begin
      leaves2 <= !rst && valid1 && last1;
      leaves3 <= !rst && leaves2;
    end
    assign chain_in[{chain_end} -: {acc_bits}] = {acc_bits}'d0;
    assign chain_head[p * {acc_bits} +: {acc_bits}] = chain_in[{acc_end}:0];
    for (k = 0; k < {per_parity}; k = k + 1) begin : lane
      reg signed [{m_end}:0] a, b;
      reg signed [{product_end}:0] product;
      reg [{acc_end}:0] aligned, accumulator, chain;
      // One copy per lane, to limit fan-out; the attribute keeps synthesis from merging them.
      reg adds, begins, leaves;
      (* keep *) always @(posedge clk) begin
        adds <= valid2;
        begins <= first2;
        leaves <= leaves3;
      end
{aligns}      wire [{wide_end}:0] shifted = {shifted};
      wire unused = &{{1'b0, shifted}};
      assign chain_in[k * {acc_bits} +: {acc_bits}] = chain;
      always @(posedge clk) begin
        a <= coefficients[(p * {per_parity} + k) * {M} +: {M}];
        b <= operands[p * {M} +: {M}];
        product <= a * b;
        aligned <= {aligned};
        if (adds) accumulator <= begins ? aligned : accumulator + aligned;
        chain <= leaves ? accumulator : chain_in[(k + 1) * {acc_bits} +: {acc_bits}];
      end
    end
  end
endgenerate",
            check = self.check(),
            word_end = lanes * M - 1,
            words_end = words - 1,
            row_end = row_bits - 1,
            acc_word_end = 4 * acc_bits - 1,
            acc_end = acc_bits - 1,
            chain_end = (per_parity + 1) * acc_bits - 1,
            wide_end = wide - 1,
            m_end = M - 1,
            product_end = product - 1,
        ))
    }
}
