//! The schedule of the matrix passes, as a small memory.

use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::schedule::{Matrix, Operand, Product};
use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// One pass over the columns of one group of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// First word in the coefficient memory.
    pub coefficients: usize,
    /// First word in the operand memory.
    pub operand: usize,
    /// 0: a v_ij; 1: the input's high limb; 2: its low limb.
    pub kind: u64,
    /// Source parity = target parity XOR this.
    pub flip: u64,
    /// Align the products of the two high limbs.
    pub align: bool,
    /// Begins a new accumulation.
    pub first: bool,
    /// Ends it.
    pub last: bool,
    /// Vectors that must be finished before.
    pub needs: usize,
}

/// Matrices in the order of the coefficient memory.
pub fn matrices(schedule: &[Vec<Product>]) -> Vec<Matrix> {
    let mut order = Vec::new();
    for product in schedule.iter().flatten() {
        if !order.contains(&product.matrix) {
            order.push(product.matrix);
        }
    }
    order
}

/// Unrolls a schedule: for each v_ij, for each group of rows, its products.
pub fn unroll(formats: &Formats, schedule: &[Vec<Product>], flip: impl Fn(Matrix) -> usize) -> Vec<Step> {
    let order = matrices(schedule);
    let mut steps = Vec::new();
    for products in schedule {
        for group in 0..formats.groups {
            for (index, product) in products.iter().enumerate() {
                let matrix = order.iter().position(|&m| m == product.matrix).unwrap_or(0);
                let (kind, operand, needs) = match product.operand {
                    Operand::Vector(k) => (0, k * formats.quads, k + 1),
                    Operand::InputHigh => (1, 0, 0),
                    Operand::InputLow => (2, 0, 0),
                };
                steps.push(Step {
                    coefficients: (matrix * formats.groups + group) * formats.quads,
                    operand,
                    kind,
                    flip: flip(product.matrix) as u64,
                    align: product.align,
                    first: index == 0,
                    last: index + 1 == products.len(),
                    needs,
                });
            }
        }
    }
    steps
}

/// Step and column in; addresses and control of the next cycle out. `ready` is combinational: the step's operand is finished.
#[derive(LogicBlock)]
pub struct Steps {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Index of the step.
    pub step: Wire<In>,
    /// Column.
    pub column: Wire<In>,
    /// Finished vectors of this frame.
    pub finished: Wire<In>,
    /// The step may run.
    pub ready: Signal<Out, Bit>,
    /// Address in the coefficient memory.
    pub coefficient_address: Wire<Out>,
    /// Address in the operand memories.
    pub operand_address: Wire<Out>,
    /// Kind of operand, 2 bits.
    pub kind: Wire<Out>,
    /// Parity flip, 2 bits.
    pub flip: Wire<Out>,
    /// `align`, `first product of an accumulation`, `last product`, from bit 0.
    pub control: Wire<Out>,
    _steps: Vec<Step>,
    _quads: usize,
}

impl Steps {
    /// A memory of `steps` over `quads` columns.
    pub fn new(steps: Vec<Step>, quads: usize, coefficient_words: usize, operand_words: usize, vectors: usize) -> Self {
        Steps {
            clk: Default::default(),
            step: Wire::new(count_bits(steps.len())),
            column: Wire::new(count_bits(quads)),
            finished: Wire::new(count_bits(vectors + 1)),
            ready: Default::default(),
            coefficient_address: Wire::new(count_bits(coefficient_words)),
            operand_address: Wire::new(count_bits(operand_words)),
            kind: Wire::new(2),
            flip: Wire::new(2),
            control: Wire::new(3),
            _steps: steps,
            _quads: quads,
        }
    }
}

impl Logic for Steps {
    fn update(&mut self) {
        let Some(step) = self._steps.get(self.step.val().number() as usize).copied() else { return };
        let column = self.column.val().number() as usize;
        self.ready.next = self.finished.val().number() as usize >= step.needs;
        if self.clk.pos_edge() {
            self.coefficient_address.next = Word::from((step.coefficients + column) as u64);
            self.operand_address.next = Word::from((step.operand + column) as u64);
            self.kind.next = Word::from(step.kind);
            self.flip.next = Word::from(step.flip);
            let first = step.first && column == 0;
            let last = step.last && column + 1 == self._quads;
            self.control.next = Word::from(u64::from(step.align) | u64::from(first) << 1 | u64::from(last) << 2);
        }
    }

    fn connect(&mut self) {
        self.ready.connect();
        self.coefficient_address.connect();
        self.operand_address.connect();
        self.kind.connect();
        self.flip.connect();
        self.control.connect();
    }

    fn hdl(&self) -> Verilog {
        let step_bits = self.step.width();
        let column_bits = self.column.width();
        let needs_bits = self.finished.width();
        let (c_bits, o_bits) = (self.coefficient_address.width(), self.operand_address.width());
        let cases: String = self
            ._steps
            .iter()
            .enumerate()
            .map(|(index, s)| {
                format!(
                    "    {step_bits}'d{index}: begin c_base = {c_bits}'d{}; o_base = {o_bits}'d{}; needs = {needs_bits}'d{}; \
                     fixed = 7'b{:02b}{:02b}{}{}{}; end\n",
                    s.coefficients,
                    s.operand,
                    s.needs,
                    s.kind,
                    s.flip,
                    u8::from(s.last),
                    u8::from(s.first),
                    u8::from(s.align),
                )
            })
            .collect();
        let extend = |bits: usize| match bits - column_bits {
            0 => "column".to_string(),
            more => format!("{{{more}'d0, column}}"),
        };
        Verilog::Custom(format!(
            "\
reg [{c_end}:0] c_base;
reg [{o_end}:0] o_base;
reg [{n_end}:0] needs;
reg [6:0] fixed;  // kind, flip, last, first, align
always @(*) begin
  case (step)
{cases}    default: begin c_base = {c_bits}'d0; o_base = {o_bits}'d0; needs = {needs_bits}'d0; fixed = 7'd0; end
  endcase
end
always @(*) ready = finished >= needs;
always @(posedge clk) begin
  coefficient_address <= c_base + {c_column};
  operand_address <= o_base + {o_column};
  kind <= fixed[6:5];
  flip <= fixed[4:3];
  control[0] <= fixed[0];
  control[1] <= fixed[1] && column == {column_bits}'d0;
  control[2] <= fixed[2] && column == {column_bits}'d{last_column};
end",
            c_end = c_bits - 1,
            o_end = o_bits - 1,
            n_end = needs_bits - 1,
            c_column = extend(c_bits),
            o_column = extend(o_bits),
            last_column = self._quads - 1,
        ))
    }
}
