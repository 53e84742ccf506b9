//! Stage `rescale`: accumulators to words of v_ij; v_00 after its block exponent has been measured.
//!
//! The first rows of a subarray are raw v_00: Q rows of the low limbs wait in a memory until the Q rows of the high limbs
//! are added to them, as they are read and written again. The magnitudes of the sums are measured, then they pass the
//! rescaler with the measured shift. All later rows pass it directly, with the constant shift of an A pass. The two
//! never overlap, because no A pass starts before v_00 is complete.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    count_bits, largest, shift_bits, BitDelay, CaseCounter, Delay, Dff, LimbSum, Ram, RawLength, Rescaler,
    SATURATION_BITS,
};
use crate::wire::Wire;

/// Rows of accumulators in; words three cycles after they enter the rescaler, operands four.
#[derive(LogicBlock)]
pub struct Rescale {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A subarray starts: v_00 comes next, and its saturations are counted from 0.
    pub start: Signal<In, Bit>,
    /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
    pub quad: Wire<In>,
    /// `quad` holds a row.
    pub quad_valid: Signal<In, Bit>,
    /// `quad` holds a row two cycles later.
    pub quad_soon: Signal<In, Bit>,
    /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
    pub words: Wire<Out>,
    /// `words` holds a quad.
    pub words_valid: Signal<Out, Bit>,
    /// The same, rounded to `data_bits` each, as operands of later passes; valid with `operands_valid`, a cycle later.
    pub operands: Wire<Out>,
    /// `operands` holds a quad.
    pub operands_valid: Signal<Out, Bit>,
    /// Measured right shift; valid from the first word until the next subarray.
    pub shift: Wire<Out>,
    /// Number of words saturated in this subarray; final two cycles after its last word.
    pub saturations: Wire<Out>,
    collecting: Dff,
    replaying: Dff,
    rows: CaseCounter,
    reads: CaseCounter,
    raw: Ram,
    limb_sum: LimbSum,
    length: RawLength,
    rescaler: Rescaler,
    started: BitDelay,
    writes: BitDelay,
    measures: BitDelay,
    ends: BitDelay,
    row: Delay,
    read: BitDelay,
    words_later: BitDelay,
    operands_later: BitDelay,
    collected: Signal<Local, Bit>,
    complete: Signal<Local, Bit>,
    enters: Signal<Local, Bit>,
}

impl Rescale {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let acc = 4 * formats.acc_bits as usize;
        Rescale {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            start: Default::default(),
            quad: Wire::new(4 * formats.lane_bits as usize),
            quad_valid: Default::default(),
            quad_soon: Default::default(),
            words: Wire::new(4 * formats.vector_bits as usize),
            words_valid: Default::default(),
            operands: Wire::new(4 * formats.data_bits as usize),
            operands_valid: Default::default(),
            shift: Wire::new(shift_bits(formats)),
            saturations: Wire::new(SATURATION_BITS),
            collecting: Default::default(),
            replaying: Default::default(),
            rows: CaseCounter::new(&quads),
            reads: CaseCounter::new(&quads),
            raw: Ram::new(largest(&quads), 1, acc).holding([Holds::Raw]).registered(),
            limb_sum: LimbSum::new(formats),
            length: RawLength::new(formats),
            rescaler: Rescaler::new(formats),
            started: BitDelay::new(1),
            writes: BitDelay::new(1),
            measures: BitDelay::new(1),
            ends: BitDelay::new(1),
            row: Delay::new(count_bits(largest(&quads)), 1),
            read: BitDelay::new(2),
            words_later: BitDelay::new(3),
            operands_later: BitDelay::new(1),
            collected: Default::default(),
            complete: Default::default(),
            enters: Default::default(),
        }
    }
}

impl Logic for Rescale {
    #[hdl_gen]
    fn update(&mut self) {
        self.collecting.clk.next = self.clk.val();
        self.replaying.clk.next = self.clk.val();
        self.rows.clk.next = self.clk.val();
        self.reads.clk.next = self.clk.val();
        self.raw.clk.next = self.clk.val();
        self.limb_sum.clk.next = self.clk.val();
        self.length.clk.next = self.clk.val();
        self.rescaler.clk.next = self.clk.val();
        self.read.clk.next = self.clk.val();
        self.words_later.clk.next = self.clk.val();
        self.operands_later.clk.next = self.clk.val();
        self.started.clk.next = self.clk.val();
        self.started.rst.next = self.rst.val();
        self.writes.clk.next = self.clk.val();
        self.writes.rst.next = self.rst.val();
        self.measures.clk.next = self.clk.val();
        self.measures.rst.next = self.rst.val();
        self.ends.clk.next = self.clk.val();
        self.ends.rst.next = self.rst.val();
        self.row.clk.next = self.clk.val();
        self.read.rst.next = self.rst.val();
        self.words_later.rst.next = self.rst.val();
        self.operands_later.rst.next = self.rst.val();

        comment!("Registered; the first row comes many cycles later");
        self.started.d.next = self.start.val();
        self.collected.next = self.collecting.q.val() & self.quad_valid.val();
        self.complete.next = self.collected.val() & self.limb_sum.complete.val();
        self.collecting.d.next = (self.started.q.val()
            | (self.collecting.q.val() & !(self.complete.val() & self.rows.last.val())))
            & !self.rst.val();
        self.rows.which.next = self.which.val();
        self.reads.which.next = self.which.val();
        self.rows.clear.next = self.started.q.val();
        self.rows.enable.next = self.collected.val();
        comment!("The sum of a row is registered");
        self.writes.d.next = self.collected.val();
        self.measures.d.next = self.complete.val();
        self.ends.d.next = self.complete.val() & self.rows.last.val();
        self.row.d.next = self.rows.value.val();
        self.raw.write.next = self.writes.q.val().into();
        self.raw.write_address.next = self.row.q.val();
        self.raw.write_data.next = self.limb_sum.sum.val();
        self.limb_sum.clear.next = self.started.q.val();
        self.limb_sum.last.next = self.collected.val() & self.rows.last.val();
        self.limb_sum.quad.next = self.quad.val();
        self.limb_sum.low.next = self.raw.read_data.val();
        self.length.clear.next = self.started.q.val();
        self.length.accept.next = self.measures.q.val();
        self.length.quad.next = self.limb_sum.sum.val();

        self.replaying.d.next =
            (self.ends.q.val() | (self.replaying.q.val() & !self.reads.last.val())) & !self.rst.val();
        comment!("Read two cycles before its high limbs come, and again");
        self.reads.clear.next = self.started.q.val();
        self.reads.enable.next = self.replaying.q.val() | (self.collecting.q.val() & self.quad_soon.val());
        self.raw.read.next = true;
        self.raw.read_address.next = self.reads.value.val();
        self.read.d.next = self.replaying.q.val();

        self.enters.next = self.read.q.val() | (self.quad_valid.val() & !self.collecting.q.val());
        self.rescaler.clear.next = self.started.q.val();
        self.rescaler.valid.next = self.enters.val();
        self.rescaler.measured.next = self.read.q.val();
        self.rescaler.shift.next = self.length.shift.val();
        self.rescaler.raw.next = self.raw.read_data.val();
        self.rescaler.quad.next = self.quad.val();
        self.words_later.d.next = self.enters.val();
        self.operands_later.d.next = self.words_later.q.val();
        self.words.next = self.rescaler.words.val();
        self.words_valid.next = self.words_later.q.val();
        self.operands.next = self.rescaler.operands.val();
        self.operands_valid.next = self.operands_later.q.val();
        self.shift.next = self.length.shift.val();
        self.saturations.next = self.rescaler.saturations.val();
    }
}
