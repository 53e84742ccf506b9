//! Schedule of the matrix passes as a table of instructions.

use dermis_golden::fixed::resources::operand_vectors;
use dermis_golden::fixed::schedule::{schedule, Operand};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// One product over the columns of one group of rows: an instruction of the schedule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// First address in the coefficient memory.
    pub coefficients: usize,
    /// Number of words there: the stored columns.
    pub columns: usize,
    /// First address in the operand memory.
    pub operand: usize,
    /// Operand: 0 = v_ij, 1 = high limb of the input, 2 = low limb.
    pub kind: u64,
    /// Source parity = target parity XOR `flip`.
    pub flip: u64,
    /// The operand is read with x and y exchanged.
    pub transposed: bool,
    /// The product is of two high limbs and is shifted left.
    pub align: bool,
    /// First product of an accumulation.
    pub first: bool,
    /// Last product of an accumulation.
    pub last: bool,
    /// First step of a subarray.
    pub opens: bool,
    /// Last step of a subarray.
    pub ends: bool,
    /// Number of operand vectors that must be complete before this step.
    pub needs: usize,
}

/// The steps of one case's `model`: for each v_ij, for each group of rows, its products.
pub fn unroll(model: &Model) -> Vec<Step> {
    let (formats, storage) = (&model.formats, &model.storage);
    let mut steps = Vec::new();
    for products in schedule(formats) {
        for group in 0..formats.groups {
            for (index, product) in products.iter().enumerate() {
                let (kind, operand, needs) = match product.operand {
                    Operand::Vector(k) => (0, k * formats.quads, k + 1),
                    Operand::InputHigh => (1, 0, 0),
                    Operand::InputLow => (2, 0, 0),
                };
                steps.push(Step {
                    coefficients: storage.address_of(product.matrix, group),
                    columns: storage.columns_of(product.matrix, group).len(),
                    operand,
                    kind,
                    flip: product.matrix.flip as u64,
                    transposed: product.transposed,
                    align: product.align,
                    first: index == 0,
                    last: index + 1 == products.len(),
                    opens: steps.is_empty(),
                    ends: false,
                    needs,
                });
            }
        }
    }
    if let Some(step) = steps.last_mut() {
        step.ends = true;
    }
    steps
}

/// Position in the step's columns in; addresses and control out, one cycle later, or three where a column list is read.
///
/// `start` loads the first step of case `which`, `advance` the next one, both at the clock edge. `ready` (the step's
/// operand is complete), `last` (its last column) and `ends` (the last step of the case, after which the first follows)
/// are combinational.
///
/// The current instruction is in a register. The table is always read at the next instruction, because `advance`
/// settles late in the cycle.
#[derive(LogicBlock)]
pub struct Steps {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case.
    pub which: Wire<In>,
    /// Load the first step at the clock edge.
    pub start: Signal<In, Bit>,
    /// Load the next step at the clock edge.
    pub advance: Signal<In, Bit>,
    /// Position in the step's columns.
    pub column: Wire<In>,
    /// Number of complete operand vectors of this subarray.
    pub finished: Wire<In>,
    /// The step's operand is complete.
    pub ready: Signal<Out, Bit>,
    /// `column` is the step's last.
    pub last: Signal<Out, Bit>,
    /// The step is the last of its case.
    pub ends: Signal<Out, Bit>,
    /// Address in the coefficient memory; [`latency`](Steps::latency) cycles after `column`.
    pub coefficient_address: Wire<Out>,
    /// Address in the operand memory, and in its low bits in the input memory; [`latency`](Steps::latency) cycles after
    /// `column`.
    pub operand_address: Wire<Out>,
    /// Operand selection as in [`OperandSelect`](super::OperandSelect): kind, flip, exchange, from bit 0; with the
    /// addresses.
    pub source: Wire<Out>,
    /// Control of [`Lanes`](super::Lanes) from bit 0: align, first, last product of an accumulation; with the
    /// coefficient check also first product of a subarray; with the addresses.
    pub control: Wire<Out>,
    _steps: Vec<Vec<Step>>,
    _list: Vec<[usize; 2]>,
    /// Some step reads its operand transposed.
    _across: bool,
    /// The current step, and its index in the case.
    _now: (Step, usize),
    _pipe: Vec<(Step, usize)>,
}

/// File of the column list, one line per word of the coefficient memory.
pub const COLUMN_FILE: &str = "columns.hex";
/// Width of `control`, in bits.
pub fn control_bits(model: &Model) -> usize {
    3 + usize::from(model.has_coefficient_check())
}
/// Width of `source`, in bits.
pub const SOURCE_BITS: usize = 5;

impl Steps {
    /// The schedule of `model`.
    pub fn new(model: &Model) -> Self {
        let (formats, cases) = (&model.formats, model.cases());
        let steps: Vec<Vec<Step>> = cases.iter().map(unroll).collect();
        let words = cases.iter().map(|case| case.storage.words()).sum();
        // Address of each word's column, and its transposed address.
        let pair = |case: &Model, j| [j, if formats.shared_a { case.layout().transposed(j) } else { j }];
        let pairs = |case: &Model| case.storage.column_list().iter().map(|&j| pair(case, j)).collect::<Vec<_>>();
        let listed = cases.iter().filter(|case| case.storage.listed);
        let list: Vec<[usize; 2]> = listed.flat_map(pairs).collect();
        let vectors = operand_vectors(formats.degree);
        Steps {
            clk: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            start: Default::default(),
            advance: Default::default(),
            column: Wire::new(count_bits(formats.quads)),
            finished: Wire::new(count_bits(vectors + 1)),
            ready: Default::default(),
            last: Default::default(),
            ends: Default::default(),
            coefficient_address: Wire::new(count_bits(words)),
            operand_address: Wire::new(count_bits(vectors.max(1) * formats.quads)),
            source: Wire::new(SOURCE_BITS),
            control: Wire::new(control_bits(model)),
            _now: Default::default(),
            _pipe: Vec::new(),
            _list: list,
            _across: formats.shared_a,
            _steps: steps,
        }
    }

    /// Cycles from `column` to the addresses: 1, or 3 with a column list.
    pub fn latency(&self) -> usize {
        if self._list.is_empty() {
            1
        } else {
            3
        }
    }

    /// Content of [`COLUMN_FILE`] for `$readmemh`, the transposed address above the plain one; `None` without a list.
    pub fn column_file(&self) -> Option<String> {
        let bits = self.column.width();
        let word = |&[straight, transposed]: &[usize; 2]| match self._across {
            true => format!("{:x}\n", transposed << bits | straight),
            false => format!("{straight:x}\n"),
        };
        (!self._list.is_empty()).then(|| self._list.iter().map(word).collect())
    }

    fn put(&mut self, step: &Step, column: usize) {
        let address = step.coefficients + column;
        let quad = match self._list.get(address) {
            Some(pair) => pair[usize::from(step.transposed)],
            None => column,
        };
        self.coefficient_address.next = Word::from(address as u64);
        self.operand_address.next = Word::from((step.operand + quad) as u64);
        self.source.next = Word::from(step.kind | step.flip << 2 | u64::from(step.transposed) << 4);
        let first = step.first && column == 0;
        let last = step.last && column + 1 == step.columns;
        let opens = step.opens && column == 0 && self.control.width() == 4;
        let bits = [step.align, first, last, opens];
        self.control.next = Word::from(bits.iter().rev().fold(0, |word, &bit| word << 1 | u64::from(bit)));
    }
}

impl Logic for Steps {
    fn update(&mut self) {
        let column = self.column.val().number() as usize;
        if self.clk.pos_edge() {
            let (step, index) = self._now;
            self._pipe.push((step, column));
            if self._pipe.len() == self.latency() {
                let (step, column) = self._pipe.remove(0);
                self.put(&step, column);
            }
            if self.start.val() || self.advance.val() {
                let asked = if self.start.val() || step.ends { 0 } else { index + 1 };
                let case = self._steps.get(self.which.val().number() as usize);
                let word = case.and_then(|steps| steps.get(asked)).copied().unwrap_or_default();
                self._now = (word, asked);
            }
        }
        let (step, _) = self._now;
        self.ready.next = self.finished.val().number() as usize >= step.needs;
        self.last.next = column + 1 == step.columns;
        self.ends.next = step.ends;
    }

    fn connect(&mut self) {
        self.ready.connect();
        self.last.connect();
        self.ends.connect();
        self.coefficient_address.connect();
        self.operand_address.connect();
        self.source.connect();
        self.control.connect();
    }

    fn hdl(&self) -> Verilog {
        let step_bits = count_bits(self._steps.iter().map(Vec::len).max().unwrap_or(1));
        let column_bits = self.column.width();
        let needs_bits = self.finished.width();
        let control = self.control.width();
        let (c_bits, o_bits) = (self.coefficient_address.width(), self.operand_address.width());
        let word_bits = c_bits + o_bits + needs_bits + column_bits + 9;
        let bit = |b: bool| u8::from(b);
        // With several cases the table is indexed by case and step.
        let (selector, selector_bits) = match self._steps.len() {
            1 => ("asked", step_bits),
            _ => ("{which, asked}", self.which.width() + step_bits),
        };
        let indexed = self._steps.iter().enumerate().flat_map(|(case, steps)| {
            steps.iter().enumerate().map(move |(index, step)| (case << step_bits | index, step))
        });
        let cases: String = indexed
            .map(|(index, s)| {
                format!(
                    "    {selector_bits}'d{index}: word = {{{c_bits}'d{}, {o_bits}'d{}, {needs_bits}'d{}, {column_bits}'d{}, \
                     9'b{}{}{:02b}{:02b}{}{}{}}};\n",
                    s.coefficients,
                    s.operand,
                    s.needs,
                    s.columns - 1,
                    bit(s.ends),
                    bit(s.transposed),
                    s.flip,
                    s.kind,
                    bit(s.last),
                    bit(s.first),
                    bit(s.align),
                )
            })
            .collect();
        let to_c = widen("column", column_bits, c_bits);
        let declare = format!(
            "\
wire unused_which = &{{1'b0, which}};
reg [{step_end}:0] step;
reg [{c_end}:0] c_base;
reg [{o_end}:0] o_base;
reg [{n_end}:0] needs;
reg [{column_end}:0] final_column;
reg [7:0] fixed;  // transposed, flip, kind, last, first, align
wire [{step_end}:0] asked = start || ends ? {step_bits}'d0 : step + {step_bits}'d1;
reg [{word_end}:0] word;
always @(*) begin
  // A short table, kept out of block RAM.
  (* rom_style = \"logic\" *)
  case ({selector})
{cases}    default: word = {word_bits}'d0;
  endcase
end
always @(posedge clk)
  if (start || advance) begin
    step <= asked;
    {{c_base, o_base, needs, final_column, ends, fixed}} <= word;
  end
always @(*) ready = finished >= needs;
always @(*) last = column == final_column;
wire [{control_end}:0] flags = {{{opens}fixed[2] && last, fixed[1] && column == {column_bits}'d0, fixed[0]}};
",
            step_end = step_bits - 1,
            word_end = word_bits - 1,
            c_end = c_bits - 1,
            o_end = o_bits - 1,
            n_end = needs_bits - 1,
            column_end = column_bits - 1,
            control_end = control - 1,
            opens = match control {
                4 => format!("step == {step_bits}'d0 && column == {column_bits}'d0, "),
                _ => String::new(),
            },
        );
        let body = if self._list.is_empty() {
            format!(
                "\
always @(posedge clk) begin
  coefficient_address <= c_base + {to_c};
  operand_address <= o_base + {to_o};
  source <= fixed[7:3];
  control <= flags;
end",
                to_o = widen("column", column_bits, o_bits)
            )
        } else {
            let (addresses, kept) = match self._across {
                true => (
                    2,
                    format!("source2[4] ? pair[{}:{column_bits}] : pair[{}:0]", 2 * column_bits - 1, column_bits - 1),
                ),
                false => (1, "pair".to_string()),
            };
            format!(
                "\
// Column of each coefficient word, and its transposed address above it if one is needed.
reg [{pair_end}:0] columns [0:{list_end}];
initial $readmemh(\"{COLUMN_FILE}\", columns);
reg [{pair_end}:0] pair;
reg [{c_end}:0] c_address1, c_address2;
reg [{o_end}:0] o_base1, o_base2;
reg [4:0] source1, source2;
reg [{control_end}:0] control1, control2;
wire [{column_end}:0] kept = {kept};
always @(posedge clk) begin
  c_address1 <= c_base + {to_c};
  o_base1 <= o_base;
  source1 <= fixed[7:3];
  control1 <= flags;
  pair <= columns[c_address1];
  c_address2 <= c_address1;
  o_base2 <= o_base1;
  source2 <= source1;
  control2 <= control1;
  coefficient_address <= c_address2;
  operand_address <= o_base2 + {to_o};
  source <= source2;
  control <= control2;
end",
                control_end = control - 1,
                pair_end = addresses * column_bits - 1,
                list_end = self._list.len() - 1,
                c_end = c_bits - 1,
                o_end = o_bits - 1,
                column_end = column_bits - 1,
                to_o = widen("kept", column_bits, o_bits)
            )
        };
        Verilog::Custom(declare + &body)
    }
}

/// Verilog that zero-extends the signal `name` of `from` bits to `to` bits.
fn widen(name: &str, from: usize, to: usize) -> String {
    match to - from {
        0 => name.to_string(),
        more => format!("{{{more}'d0, {name}}}"),
    }
}
