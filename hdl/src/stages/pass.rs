//! Stage `pass`: the matrix-vector products of a subarray, one after the other on the MAC lanes.
//!
//! The schedule issues one column per cycle. It waits for one to three cycles after each accumulation and where the operand of a
//! step is not complete yet; where quads are written and read in order, until its first quad has been written. From issue
//! to operands: addresses (1 cycle, 3 with a column list), memories (2), selection of limb and parity (1); then the
//! lanes.

use dermis_golden::fixed::plan::resources::{operand_vectors, Holds};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    control_bits, count_bits, BitDelay, Counter, Delay, Dff, Lanes, OperandSelect, OperandWriter, PassProgram, Ram,
    Slice, SOURCE_BITS,
};
use crate::wire::Wire;

/// Words of the input memory and finished v_ij in, accumulators of whole rows out.
#[derive(LogicBlock)]
pub struct Pass {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// The products of a subarray may begin while its input is still being written.
    pub start: Signal<In, Bit>,
    /// Address of the quad to read from the input memory; in every cycle of a product with the input.
    pub input_address: Wire<Out>,
    /// Four parities of that quad, `fold_bits` each, signed; two cycles after `input_address`.
    pub input_quad: Wire<In>,
    /// Four parities of a finished v_ij, `data_bits` each, signed, quads in order; valid with `vector_valid`.
    pub vector_quad: Wire<In>,
    /// `vector_quad` holds a quad.
    pub vector_valid: Signal<In, Bit>,
    /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
    pub quad: Wire<Out>,
    /// `quad` holds a row.
    pub quad_valid: Signal<Out, Bit>,
    /// `quad` holds a row two cycles later.
    pub quad_soon: Signal<Out, Bit>,
    /// The coefficient signature of the subarray is wrong, 1 bit; valid with its last row.
    pub damaged: Wire<Out>,
    column: Counter,
    running: Dff,
    /// Schedule of the products.
    pub pass_program: PassProgram,
    vectors: Ram,
    operand_writer: OperandWriter,
    source: Delay,
    control: Delay,
    valid: BitDelay,
    select: OperandSelect,
    /// The MAC lanes.
    pub lanes: Lanes,
    low_address: Slice,
    issue: Signal<Local, Bit>,
    column_end: Signal<Local, Bit>,
}

impl Pass {
    /// For the schedule and the coefficients of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads = formats.quads;
        let pass_program = PassProgram::new(model);
        let lanes = Lanes::new(model);
        let operands = operand_vectors(formats.degree);
        let vectors = |memory: Ram| if operands == 0 { memory.left_out() } else { memory };
        let parity_bits = 4 * formats.data_bits as usize;
        Pass {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(model.cases().len())),
            start: Default::default(),
            input_address: Wire::new(count_bits(quads)),
            input_quad: Wire::new(4 * formats.fold_bits as usize),
            vector_quad: Wire::new(parity_bits),
            vector_valid: Default::default(),
            quad: Wire::new(4 * formats.lane_bits as usize),
            quad_valid: Default::default(),
            quad_soon: Default::default(),
            damaged: Wire::new(1),
            column: Counter::new(quads),
            running: Default::default(),
            low_address: Slice::new(pass_program.operand_address.width(), count_bits(quads)),
            vectors: vectors(Ram::new(operands.max(1) * quads, 1, parity_bits))
                .holding([Holds::Operands(0)])
                .registered(),
            operand_writer: OperandWriter::new(
                operands,
                &model.cases().iter().map(|case| case.formats.quads).collect::<Vec<_>>(),
                model.first().storage.streamed,
            ),
            source: Delay::new(SOURCE_BITS, 2),
            control: Delay::new(control_bits(model), 3),
            valid: BitDelay::new(3 + pass_program.latency()),
            select: OperandSelect::new(formats),
            pass_program,
            lanes,
            issue: Default::default(),
            column_end: Default::default(),
        }
    }
}

impl Logic for Pass {
    #[hdl_gen]
    fn update(&mut self) {
        self.column.clk.next = self.clk.val();
        self.running.clk.next = self.clk.val();
        self.pass_program.clk.next = self.clk.val();
        self.vectors.clk.next = self.clk.val();
        self.operand_writer.clk.next = self.clk.val();
        self.source.clk.next = self.clk.val();
        self.control.clk.next = self.clk.val();
        self.valid.clk.next = self.clk.val();
        self.select.clk.next = self.clk.val();
        self.lanes.clk.next = self.clk.val();
        self.valid.rst.next = self.rst.val();
        self.lanes.rst.next = self.rst.val();

        self.pass_program.which.next = self.which.val();
        self.operand_writer.which.next = self.which.val();
        self.lanes.which.next = self.which.val();
        self.issue.next = self.running.q.val() & self.pass_program.ready.val();
        self.column_end.next = self.issue.val() & self.pass_program.last.val();
        self.running.d.next = (self.start.val()
            | (self.running.q.val() & !(self.column_end.val() & self.pass_program.ends.val())))
            & !self.rst.val();
        self.column.clear.next = self.start.val() | self.column_end.val();
        self.column.enable.next = self.issue.val();
        self.pass_program.start.next = self.start.val();
        self.pass_program.advance.next = self.column_end.val();
        self.pass_program.column.next = self.column.value.val();
        self.pass_program.finished.next = self.operand_writer.finished.val();

        self.low_address.word.next = self.pass_program.operand_address.val();
        self.input_address.next = self.low_address.low.val();
        self.vectors.read.next = true;
        self.vectors.read_address.next = self.pass_program.operand_address.val();
        self.operand_writer.clear.next = self.start.val();
        self.operand_writer.valid.next = self.vector_valid.val();
        self.vectors.write.next = self.operand_writer.keep.val().into();
        self.vectors.write_address.next = self.operand_writer.address.val();
        self.vectors.write_data.next = self.vector_quad.val();

        self.source.d.next = self.pass_program.source.val();
        self.select.source.next = self.source.q.val();
        self.select.input_quad.next = self.input_quad.val();
        self.select.vector_quad.next = self.vectors.read_data.val();
        self.control.d.next = self.pass_program.control.val();
        self.valid.d.next = self.issue.val();

        self.lanes.address.next = self.pass_program.coefficient_address.val();
        self.lanes.operands.next = self.select.operands.val();
        self.lanes.valid.next = self.valid.q.val();
        self.lanes.control.next = self.control.q.val();
        self.quad.next = self.lanes.quad.val();
        self.quad_valid.next = self.lanes.quad_valid.val();
        self.quad_soon.next = self.lanes.quad_soon.val();
        self.damaged.next = self.lanes.damaged.val();
    }
}
