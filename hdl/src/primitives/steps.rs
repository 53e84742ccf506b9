//! The schedule of the matrix passes, as a small memory.

use dermis_golden::fixed::resources::operand_vectors;
use dermis_golden::fixed::schedule::{schedule, Operand};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// One pass over the columns of one group of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// First word in the coefficient memory.
    pub coefficients: usize,
    /// Words of it: the columns that are kept.
    pub columns: usize,
    /// First word in the operand memory.
    pub operand: usize,
    /// 0: a v_ij; 1: the input's high limb; 2: its low limb.
    pub kind: u64,
    /// Source parity = target parity XOR this.
    pub flip: u64,
    /// Read the operand with x and y exchanged.
    pub transposed: bool,
    /// Align the products of the two high limbs.
    pub align: bool,
    /// Begins a new accumulation.
    pub first: bool,
    /// Ends it.
    pub last: bool,
    /// Begins a subarray.
    pub opens: bool,
    /// Ends it.
    pub ends: bool,
    /// Vectors that must be finished before.
    pub needs: usize,
}

/// Unrolls a model's schedule: for each v_ij, for each group of rows, its products.
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

/// Position in a step's columns in; addresses and control out, one cycle later, or three where a list of columns is read.
///
/// `start` begins with the first step of case `which`, `advance` goes on to the next one, both at the clock edge. `ready` (the
/// step's operand is finished), `last` (its last column) and `ends` (the case's last step; its first one follows) are
/// combinational.
///
/// The step's word stands in a register. The memory is asked for the word after it all the time: whether it is taken is known
/// late in a cycle.
#[derive(LogicBlock)]
pub struct Steps {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Which case.
    pub which: Wire<In>,
    /// The first step is next.
    pub start: Signal<In, Bit>,
    /// The step after this one is next.
    pub advance: Signal<In, Bit>,
    /// Position in the step's columns.
    pub column: Wire<In>,
    /// Finished vectors of this subarray.
    pub finished: Wire<In>,
    /// The step may run.
    pub ready: Signal<Out, Bit>,
    /// The position is the step's last.
    pub last: Signal<Out, Bit>,
    /// The step is the case's last.
    pub ends: Signal<Out, Bit>,
    /// Address in the coefficient memory.
    pub coefficient_address: Wire<Out>,
    /// Address in the operand memories.
    pub operand_address: Wire<Out>,
    /// Kind of operand, 2 bits; parity flip, 2 bits; exchange of the mirrors: from bit 0.
    pub source: Wire<Out>,
    /// `align`, `first product of an accumulation`, `last product`, from bit 0; then, where the coefficients are checked,
    /// `first product of a subarray`.
    pub control: Wire<Out>,
    _steps: Vec<Vec<Step>>,
    _list: Vec<[usize; 2]>,
    /// Some step reads its operand transposed.
    _across: bool,
    /// The step whose word stands in the register, and its index in the case.
    _now: (Step, usize),
    _pipe: Vec<(Step, usize)>,
}

/// Name of the column list's file.
pub const COLUMN_FILE: &str = "columns.hex";
/// Bits of `control`.
pub fn control_bits(model: &Model) -> usize {
    3 + usize::from(model.has_coefficient_check())
}
/// Bits of `source`.
pub const SOURCE_BITS: usize = 5;

impl Steps {
    /// The schedule of `model`.
    pub fn new(model: &Model) -> Self {
        let (formats, cases) = (&model.formats, model.cases());
        let steps: Vec<Vec<Step>> = cases.iter().map(unroll).collect();
        let words = cases.iter().map(|case| case.storage.words()).sum();
        // Straight and transposed address of each word's column.
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

    /// Cycles from step and position to the addresses.
    pub fn latency(&self) -> usize {
        if self._list.is_empty() {
            1
        } else {
            3
        }
    }

    /// The column list as hex lines for `$readmemh`, the straight address in the low bits; `None` without a list.
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
        // The case in front of the step, where there are several.
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
  // A few words that change with the scene: no block RAM.
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
// The column of each coefficient word, and transposed where that is read.
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

/// Verilog that puts zeros before `name` of `from` bits to make `to` of them.
fn widen(name: &str, from: usize, to: usize) -> String {
    match to - from {
        0 => name.to_string(),
        more => format!("{{{more}'d0, {name}}}"),
    }
}
