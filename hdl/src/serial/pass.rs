//! Stage `pass`: one lane per parity, each with its own coefficient and operand memory.
//!
//! ```text
//! address, operand_address --> memories | select | operands | product | accumulate --> quad; word, one after the other
//! ```
//! An operand is written twice, for its own lane and for the lane of the opposite parities, so that `flip` is an
//! address bit.
//!
//! A product issued in cycle t is in its accumulator in cycle t + 4. The accumulators leave one per cycle from the
//! fourth cycle after the `last` product, and are cleared with the fourth; the first product of the next row follows
//! the last one by five cycles at the earliest.

use dermis_golden::fixed::resources::operand_vectors;
use dermis_golden::fixed::schedule::Kind;
use dermis_golden::fixed::serial::{coefficients, first_vector, OPERAND_BITS, WIDE};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// File of the coefficients as wide as an operand.
pub const WIDE_FILE: &str = "coefficients.hex";
/// File of the low limb of Cz⁺.
pub const LOW_FILE: &str = "coefficients_low.hex";
const OPERAND: usize = OPERAND_BITS as usize;

/// Four multiply-accumulate lanes; timing in the module docs.
#[derive(LogicBlock)]
pub struct Pass {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A product is issued in this cycle.
    pub valid: Signal<In, Bit>,
    /// The product is the last of its row; valid with `valid`.
    pub last: Signal<In, Bit>,
    /// Wide matrix, row and column of the coefficient; valid with `valid`.
    pub address: Wire<In>,
    /// Use the low limb of Cz⁺ in place of the wide matrix; valid with `valid`.
    pub low: Signal<In, Bit>,
    /// Vector and column of the operand; valid with `valid`.
    pub operand_address: Wire<In>,
    /// Source parity = target parity with both bits inverted; valid with `valid`.
    pub flip: Signal<In, Bit>,
    /// The product is of two high limbs and is shifted left; valid with `valid`.
    pub align: Signal<In, Bit>,
    /// Write `write_data` to the operand memory.
    pub write: Signal<In, Bit>,
    /// Vector and quad to write; valid with `write`.
    pub write_address: Wire<In>,
    /// Parity to write, 2 bits; valid with `write`.
    pub write_lane: Wire<In>,
    /// Operand of 16 bits, signed; valid with `write`.
    pub write_data: Wire<In>,
    /// All four accumulators, `acc_bits` each, signed; valid with `quad_valid`.
    pub quad: Wire<Out>,
    /// The accumulators hold a row; the first leaves in this cycle.
    pub quad_valid: Signal<Out, Bit>,
    /// One accumulator, `acc_bits` wide, signed.
    pub word: Wire<Out>,
    /// `word` is valid.
    pub word_valid: Signal<Out, Bit>,
    _wide: Vec<[i64; 4]>,
    _low: Vec<[i64; 4]>,
    _low_bits: usize,
    _align: usize,
    _operands: Vec<[i64; 4]>,
    _state: State,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    control: [Control; 3],
    coefficient: [i64; 4],
    low: [i64; 4],
    operand: [i64; 4],
    factors: [[i64; 2]; 4],
    products: [i64; 4],
    accumulators: [i64; 4],
    reading: bool,
    read: u64,
}

/// Control bits that travel with a product.
#[derive(Clone, Copy, Debug, Default)]
struct Control {
    valid: bool,
    last: bool,
    low: bool,
    align: bool,
}

impl Pass {
    /// The lanes of `model`, with its coefficients.
    pub fn new(model: &Model) -> Self {
        let f = &model.formats;
        let bits = count_bits(f.quads);
        let vectors = first_vector(f) + operand_vectors(f.degree);
        let table = |kind| coefficients(f, &model.quantised, kind);
        let low_bits = f.inverse_low_bits as usize;
        Pass {
            clk: Default::default(),
            rst: Default::default(),
            valid: Default::default(),
            last: Default::default(),
            address: Wire::new(2 + 2 * bits),
            low: Default::default(),
            operand_address: Wire::new(count_bits(vectors) + bits),
            flip: Default::default(),
            align: Default::default(),
            write: Default::default(),
            write_address: Wire::new(count_bits(vectors) + bits),
            write_lane: Wire::new(2),
            write_data: Wire::new(OPERAND),
            quad: Wire::new(4 * f.acc_bits as usize),
            quad_valid: Default::default(),
            word: Wire::new(f.acc_bits as usize),
            word_valid: Default::default(),
            _wide: WIDE.into_iter().flat_map(table).collect(),
            _low: if low_bits > 0 { table(Kind::InverseLow) } else { Vec::new() },
            _low_bits: low_bits,
            _align: f.limb_align as usize,
            _operands: vec![[0; 4]; 2 << (count_bits(vectors) + bits)],
            _state: State::default(),
        }
    }

    /// Memory files: name and text.
    pub fn memory_files(&self) -> Vec<(&'static str, String)> {
        let text = |words: &[[i64; 4]], bits: usize| -> String {
            let digits = (4 * bits).div_ceil(4);
            let line = |word: &[i64; 4]| {
                let packed = Word::of_fields(word, bits);
                format!("{:0digits$x}\n", packed.field(0, 4 * bits))
            };
            words.iter().map(line).collect()
        };
        let low = (self._low_bits > 0).then(|| (LOW_FILE, text(&self._low, self._low_bits)));
        [(WIDE_FILE, text(&self._wide, OPERAND))].into_iter().chain(low).collect()
    }

    fn clocked(&mut self) {
        let state = self._state;
        let mut next = state;
        let row = self.address.val().number() as usize;
        let low_address = row % self._low.len().max(1);
        next.coefficient = self._wide.get(row).copied().unwrap_or_default();
        next.low = self._low.get(low_address).copied().unwrap_or_default();
        let half = self._operands.len() / 2;
        let at = self.operand_address.val().number() as usize + if self.flip.val() { half } else { 0 };
        next.operand = self._operands.get(at).copied().unwrap_or_default();
        next.control = [
            Control {
                valid: self.valid.val() && !self.rst.val(),
                last: self.last.val(),
                low: self.low.val(),
                align: self.align.val(),
            },
            Control { valid: state.control[0].valid && !self.rst.val(), ..state.control[0] },
            Control { valid: state.control[1].valid && !self.rst.val(), ..state.control[1] },
        ];
        let control = state.control[0];
        let coefficient = if control.low { state.low } else { state.coefficient };
        next.factors = std::array::from_fn(|lane| [coefficient[lane], state.operand[lane]]);
        next.products = state.factors.map(|[c, x]| c * x);
        let arriving = state.control[2];
        let ends = state.reading && state.read == 3;
        for lane in 0..4 {
            if ends || self.rst.val() {
                next.accumulators[lane] = 0;
            } else if arriving.valid {
                let shift = if arriving.align { self._align } else { 0 };
                next.accumulators[lane] += state.products[lane] << shift;
            }
        }
        next.reading = ((arriving.valid && arriving.last) || (state.reading && !ends)) && !self.rst.val();
        next.read = if state.reading && !self.rst.val() { (state.read + 1) % 4 } else { 0 };
        self._state = next;
        if self.write.val() {
            let at = self.write_address.val().number() as usize;
            let lane = self.write_lane.val().number() as usize;
            for (at, lane) in [(at, lane), (at + half, 3 - lane)] {
                if let Some(word) = self._operands.get_mut(at) {
                    word[lane] = self.write_data.val().signed(0, OPERAND);
                }
            }
        }
    }
}

impl Logic for Pass {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.clocked();
        }
        let bits = self.word.width();
        let state = &self._state;
        self.quad.next = Word::of_fields(&state.accumulators, bits);
        self.quad_valid.next = state.reading && state.read == 0;
        self.word.next = Word::of_fields(&[state.accumulators[state.read as usize]], bits);
        self.word_valid.next = state.reading;
    }

    fn connect(&mut self) {
        self.quad.connect();
        self.quad_valid.connect();
        self.word.connect();
        self.word_valid.connect();
    }

    fn hdl(&self) -> Verilog {
        let acc = self.word.width();
        let acc_end = acc - 1;
        let end = OPERAND - 1;
        let low_bits = self._low_bits;
        let wide_end = 4 * OPERAND - 1;
        let operands_end = self._operands.len() - 1;
        let fields = |lane: usize, bits: usize| format!("[{}:{}]", (lane + 1) * bits - 1, lane * bits);
        let low_memory = match low_bits {
            0 => "wire unused = &{1'b0, low};\n".to_string(),
            bits => format!(
                "\
reg [{low_end}:0] low_word;
reg [{low_end}:0] low_memory [0:{last}];
initial $readmemh(\"{LOW_FILE}\", low_memory);
always @(posedge clk) low_word <= low_memory[address[{at_end}:0]];
reg low_selected;
always @(posedge clk) low_selected <= low;
",
                low_end = 4 * bits - 1,
                last = self._low.len() - 1,
                at_end = count_bits(self._low.len()) - 1,
            ),
        };
        let lanes: String = (0..4)
            .map(|lane| {
                let coefficient = match low_bits {
                    0 => format!("wide_word{}", fields(lane, OPERAND)),
                    bits => format!(
                        "low_selected ? {{{}'d0, low_word{}}} : wide_word{}",
                        OPERAND - bits,
                        fields(lane, bits),
                        fields(lane, OPERAND)
                    ),
                };
                // The sums fit an accumulator, so the higher bits of a product are not needed.
                let shifted = |by: usize| {
                    let bits = (acc - by).min(32);
                    let fill = if by > 0 { format!(", {by}'d0") } else { String::new() };
                    match acc - by - bits {
                        0 => format!("{{product{lane}[{}:0]{fill}}}", bits - 1),
                        more => format!("{{{{{more}{{product{lane}[31]}}}}, product{lane}{fill}}}"),
                    }
                };
                let align = match self._align {
                    0 => shifted(0),
                    by => format!("control2[0] ? {}\n    : {}", shifted(by), shifted(0)),
                };
                let unused = match acc < 32 {
                    true => format!("wire unused{lane} = &{{1'b0, product{lane}[31:{acc}]}};\n"),
                    false => String::new(),
                };
                format!(
                    "
reg [{end}:0] operands{lane} [0:{operands_end}];
reg [{end}:0] operand{lane};
reg signed [{end}:0] coefficient{lane}, factor{lane};
reg signed [31:0] product{lane};
reg [{acc_end}:0] accumulator{lane};
{unused}wire [{acc_end}:0] aligned{lane} = {align};
always @(posedge clk) begin
  if (write && {own} (write_lane[0] ^ write_lane[1])) operands{lane}[{{{other}write_lane[0], write_address}}] <= write_data;
  operand{lane} <= operands{lane}[{{flip, operand_address}}];
  coefficient{lane} <= {coefficient};
  factor{lane} <= operand{lane};
  product{lane} <= coefficient{lane} * factor{lane};
  if (rst || (reading && read == 2'd3)) accumulator{lane} <= {acc}'d0;
  else if (control2[2]) accumulator{lane} <= accumulator{lane} + aligned{lane};
end
",
                    own = if lane == 0 || lane == 3 { "!" } else { "" },
                    other = if lane % 2 == 1 { "!" } else { "" },
                )
            })
            .collect();
        Verilog::Custom(format!(
            "\
reg [{wide_end}:0] wide_word;
reg [{wide_end}:0] wide [0:{wide_last}];
initial $readmemh(\"{WIDE_FILE}\", wide);
always @(posedge clk) wide_word <= wide[address];
{low_memory}// valid, last, align
reg [2:0] control0, control1, control2;
reg reading;
reg [1:0] read;
always @(posedge clk) begin
  control0 <= {{valid && !rst, last, align}};
  control1 <= {{control0[2] && !rst, control0[1:0]}};
  control2 <= {{control1[2] && !rst, control1[1:0]}};
  reading <= ((control2[2] && control2[1]) || (reading && read != 2'd3)) && !rst;
  read <= reading && !rst ? read + 2'd1 : 2'd0;
end
{lanes}always @(*) begin
  quad = {{accumulator3, accumulator2, accumulator1, accumulator0}};
  quad_valid = reading && read == 2'd0;
  case (read)
    2'd0: word = accumulator0;
    2'd1: word = accumulator1;
    2'd2: word = accumulator2;
    default: word = accumulator3;
  endcase
  word_valid = reading;
end",
            wide_last = self._wide.len() - 1,
        ))
    }
}
