//! Stage `receive`: taxels row-major into the frame buffer, magnitude and signs on the way.
//!
//! As the parallel engine's ([`crate::stages::Receive`]), with a buffer of single taxels in the place of quads.

use dermis_golden::fixed::formats::Formats;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, Counter, Gather, Ram};
use crate::wire::Wire;

/// ```text
/// s_axis --> frame buffer --> word (one cycle after read_address)
///       \--> magnitude, positive, negative
/// ```
/// `full` from the frame's last beat until `free`; the gathered values stand as long. Framing as in the parallel engine:
/// an early `tlast` drops the frame, a missing one is remembered, both raise `framing` until `reported`.
#[derive(LogicBlock)]
pub struct Receive {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A taxel's code.
    pub s_axis_tdata: Wire<In>,
    /// It is offered.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// It is taken.
    pub s_axis_tready: Signal<Out, Bit>,
    /// It is the frame's last.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A beat is accepted in this cycle.
    pub accept: Signal<Out, Bit>,
    /// The frame buffer holds a whole frame.
    pub full: Signal<Out, Bit>,
    /// The frame has been read.
    pub free: Signal<In, Bit>,
    /// Which taxel to read.
    pub read_address: Wire<In>,
    /// Its code, one cycle later.
    pub word: Wire<Out>,
    /// OR of the codes' magnitudes.
    pub magnitude: Wire<Out>,
    /// A code is above the noise floor.
    pub positive: Signal<Out, Bit>,
    /// A code is below minus the noise floor.
    pub negative: Signal<Out, Bit>,
    /// `tlast` was early or missing.
    pub framing: Signal<Out, Bit>,
    /// `framing` has been reported.
    pub reported: Signal<In, Bit>,
    taxels: Counter,
    frame: Ram,
    gather: Gather,
    whole: DFF<Bit>,
    broken: DFF<Bit>,
    taken: Signal<Local, Bit>,
    early: Signal<Local, Bit>,
}

impl Receive {
    /// Frames of four times `formats.quads` taxels, noise floor in codes.
    pub fn new(formats: &Formats, floor: i32) -> Self {
        let (taxels, bits) = (4 * formats.quads, formats.input_bits as usize);
        Receive {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            accept: Default::default(),
            full: Default::default(),
            free: Default::default(),
            read_address: Wire::new(count_bits(taxels)),
            word: Wire::new(bits),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            framing: Default::default(),
            reported: Default::default(),
            taxels: Counter::new(taxels),
            frame: Ram::new(taxels, 1, bits),
            gather: Gather::new(bits, floor, 1),
            whole: Default::default(),
            broken: Default::default(),
            taken: Default::default(),
            early: Default::default(),
        }
    }
}

impl Logic for Receive {
    #[hdl_gen]
    fn update(&mut self) {
        self.taxels.clk.next = self.clk.val();
        self.frame.clk.next = self.clk.val();
        self.gather.clk.next = self.clk.val();
        self.whole.clock.next = self.clk.val();
        self.broken.clock.next = self.clk.val();

        self.s_axis_tready.next = !self.whole.q.val() & !self.rst.val();
        self.taken.next = self.s_axis_tvalid.val() & !self.whole.q.val() & !self.rst.val();
        self.early.next = self.taken.val() & self.s_axis_tlast.val() & !self.taxels.last.val();
        self.accept.next = self.taken.val();

        self.taxels.enable.next = self.taken.val();
        self.taxels.clear.next = self.rst.val() | self.early.val();
        self.frame.write_address.next = self.taxels.value.val();
        self.frame.write_data.next = self.s_axis_tdata.val();
        self.frame.write.next = self.taken.val().into();
        self.frame.read.next = true;
        self.frame.read_address.next = self.read_address.val();
        self.word.next = self.frame.read_data.val();

        self.gather.accept.next = self.taken.val();
        self.gather.clear.next = self.rst.val() | self.free.val() | self.early.val();
        self.gather.part.next = false.into();
        self.gather.select.next = false.into();
        self.gather.code.next = self.s_axis_tdata.val();
        self.magnitude.next = self.gather.magnitude.val();
        self.positive.next = self.gather.positive.val();
        self.negative.next = self.gather.negative.val();

        self.full.next = self.whole.q.val();
        self.whole.d.next =
            (self.whole.q.val() | (self.taken.val() & self.taxels.last.val())) & !self.free.val() & !self.rst.val();
        self.framing.next = self.broken.q.val();
        self.broken.d.next = ((self.broken.q.val() & !self.reported.val())
            | self.early.val()
            | (self.taken.val() & self.taxels.last.val() & !self.s_axis_tlast.val()))
            & !self.rst.val();
    }
}
