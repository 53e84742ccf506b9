//! Stage `fold`: the frame's normalised quads to parities, into the input memory of the passes.
//!
//! One quad per cycle: frame buffer (2 cycles), `normalise` (2), butterfly (1), memory.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{
    count_bits, frame_quads, largest, BitDelay, Butterfly, CaseCounter, CaseEqual, Counter, Delay, Dff, Ram,
};
use crate::wire::Wire;

/// Reads the quads of a subarray from the frame buffer; they pass `normalise` and the butterfly on their way to the
/// input memory.
#[derive(LogicBlock)]
pub struct Fold {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A new frame: reading restarts at the frame's first quad.
    pub begin_frame: Signal<In, Bit>,
    /// Fold the next subarray.
    pub start: Signal<In, Bit>,
    /// The subarray is the frame's last.
    pub last_part: Signal<In, Bit>,
    /// Address of the quad to read from the frame buffer, over all subarrays; steps in every cycle after `start` until
    /// the subarray is read.
    pub quad_address: Wire<Out>,
    /// The frame's last quad was read in the cycle before: the frame buffer is free.
    pub free: Signal<Out, Bit>,
    /// Four normalised codes, `input_bits` each, signed; four cycles after `quad_address`.
    pub normalised: Wire<In>,
    /// `normalised` holds a quad.
    pub normalised_valid: Signal<Out, Bit>,
    /// Four parities, two bits wider, signed; valid with `folded_valid`, one cycle after `normalised`.
    pub folded: Wire<Out>,
    /// `folded` holds a quad.
    pub folded_valid: Signal<Out, Bit>,
    /// The products may begin: what they read next is in the input memory; high for one cycle.
    pub readable: Signal<Out, Bit>,
    /// Address of the quad to read from the input memory; sampled in every cycle.
    pub read_address: Wire<In>,
    /// Four parities of that quad, signed; two cycles after `read_address`.
    pub read_quad: Wire<Out>,
    quads: CaseCounter,
    lead: CaseEqual,
    frame_quads: Counter,
    running: Dff,
    normalised_later: BitDelay,
    folded_later: BitDelay,
    begins: BitDelay,
    frees: BitDelay,
    address: Delay,
    butterfly: Butterfly,
    memory: Ram,
    ending: Signal<Local, Bit>,
}

impl Fold {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let bits = model.formats().input_bits as usize;
        let limits: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let frame_quads = frame_quads(model.cases());
        let leads: Vec<usize> = model.cases().iter().map(|case| case.storage.lead).collect();
        let quads = largest(&limits);
        let address = count_bits(quads);
        Fold {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(limits.len())),
            begin_frame: Default::default(),
            start: Default::default(),
            last_part: Default::default(),
            quad_address: Wire::new(count_bits(frame_quads)),
            free: Default::default(),
            normalised: Wire::new(4 * bits),
            normalised_valid: Default::default(),
            folded: Wire::new(4 * (bits + 2)),
            folded_valid: Default::default(),
            readable: Default::default(),
            read_address: Wire::new(address),
            read_quad: Wire::new(4 * (bits + 2)),
            quads: CaseCounter::new(&limits),
            lead: CaseEqual::new(&leads, address),
            frame_quads: Counter::new(frame_quads),
            running: Default::default(),
            normalised_later: BitDelay::new(4),
            folded_later: BitDelay::new(1),
            begins: BitDelay::new(6),
            frees: BitDelay::new(1),
            address: Delay::new(address, 5),
            butterfly: Butterfly::new(bits),
            memory: Ram::new(quads, 1, 4 * (bits + 2)).holding([Holds::Folded]).registered(),
            ending: Default::default(),
        }
    }
}

impl Logic for Fold {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.frame_quads.clk.next = self.clk.val();
        self.running.clk.next = self.clk.val();
        self.normalised_later.clk.next = self.clk.val();
        self.folded_later.clk.next = self.clk.val();
        self.begins.clk.next = self.clk.val();
        self.frees.clk.next = self.clk.val();
        self.address.clk.next = self.clk.val();
        self.butterfly.clk.next = self.clk.val();
        self.memory.clk.next = self.clk.val();
        self.normalised_later.rst.next = self.rst.val();
        self.folded_later.rst.next = self.rst.val();
        self.begins.rst.next = self.rst.val();
        self.frees.rst.next = self.rst.val();

        self.quads.which.next = self.which.val();
        self.lead.which.next = self.which.val();
        self.lead.value.next = self.quads.value.val();
        self.quads.clear.next = self.start.val();
        self.quads.enable.next = self.running.q.val();
        self.ending.next = self.running.q.val() & self.quads.last.val();
        self.running.d.next = (self.start.val() | (self.running.q.val() & !self.quads.last.val())) & !self.rst.val();
        self.frame_quads.clear.next = self.begin_frame.val();
        self.frame_quads.enable.next = self.running.q.val();
        self.quad_address.next = self.frame_quads.value.val();
        comment!("Registered: the frame buffer is far away");
        self.frees.d.next = self.ending.val() & self.last_part.val();
        self.free.next = self.frees.q.val();

        self.normalised_later.d.next = self.running.q.val();
        self.folded_later.d.next = self.normalised_later.q.val();
        self.normalised_valid.next = self.normalised_later.q.val();
        self.butterfly.quad.next = self.normalised.val();
        self.folded.next = self.butterfly.sums.val();
        self.folded_valid.next = self.folded_later.q.val();

        self.address.d.next = self.quads.value.val();
        self.memory.write.next = self.folded_later.q.val().into();
        self.memory.write_address.next = self.address.q.val();
        self.memory.write_data.next = self.butterfly.sums.val();
        self.memory.read.next = true;
        self.memory.read_address.next = self.read_address.val();
        self.read_quad.next = self.memory.read_data.val();
        comment!("Products read the input while it is written");
        self.begins.d.next = self.running.q.val() & self.lead.equal.val();
        self.readable.next = self.begins.q.val();
    }
}
