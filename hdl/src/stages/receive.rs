//! Stage `receive`: taxels row-major into the frame buffer; magnitude and signs are gathered as they arrive.
//!
//! One beat per cycle while the buffer is free. A frame ends with its last taxel, whatever `tlast` says: an early
//! `tlast` drops the frame, and the next beat starts a new one; a missing `tlast` is only recorded. Both set `framing`
//! until `reported`.

use dermis_golden::fixed::resources::Holds;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::ports::{has_ports, ports};
use crate::primitives::{
    count_bits, frame_quads, largest, BitDelay, DeadTaxelMask, Delay, Dff, FrameStats, LaneBroadcast, Ram, Scan,
};
use crate::wire::Wire;

/// ```text
/// s_axis --> frame buffer --> quad (two cycles after quad_address)
///       \--> magnitude, positive, negative
/// ```
/// `full` is high from two cycles after the frame's last beat until `free`; the gathered values are valid for the same
/// time.
#[derive(LogicBlock)]
pub struct Receive {
    ports: ReceivePorts,
    scan: Scan,
    blank: DeadTaxelMask,
    spread: LaneBroadcast,
    frame: Ram,
    gather: FrameStats,
    gathers: BitDelay,
    gathered_part: Delay,
    gathered_code: Delay,
    gathered_address: Delay,
    gathered_mask: Delay,
    clears: Dff,
    whole: Dff,
    complete: Dff,
    broken: Dff,
    taken: Signal<Local, Bit>,
    early: Signal<Local, Bit>,
}

ports! {
    /// Ports of a stage that receives frames.
    pub struct ReceivePorts {
        /// Clock; registers change on its rising edge.
        pub clk: Signal<In, Clock>,
        /// Synchronous reset, active high.
        pub rst: Signal<In, Bit>,
        /// A taxel's code, `input_bits` wide, two's complement; valid with `s_axis_tvalid`.
        pub s_axis_tdata: Wire<In>,
        /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
        pub s_axis_tvalid: Signal<In, Bit>,
        /// The block accepts a beat in this cycle.
        pub s_axis_tready: Signal<Out, Bit>,
        /// The beat is the last of its frame; valid with `s_axis_tvalid`.
        pub s_axis_tlast: Signal<In, Bit>,
        /// A beat is accepted in this cycle.
        pub accept: Signal<Out, Bit>,
        /// The accepted code, 0 for a dead taxel; valid with `accept`.
        pub taken_word: Wire<Out>,
        /// The frame buffer holds a whole frame, and `which` is its case; high until `free`.
        pub full: Signal<Out, Bit>,
        /// The frame has been read: the buffer may be overwritten.
        pub free: Signal<In, Bit>,
        /// Index of the chosen case; valid with `full`, 0 where there is one case.
        pub which: Wire<Out>,
        /// Address of the quad to read, over all subarrays; sampled in every cycle.
        pub quad_address: Wire<In>,
        /// Four codes, `input_bits` each, signed; two cycles after `quad_address`.
        pub quad: Wire<Out>,
        /// Index of the subarray for `magnitude`, `positive` and `negative`; combinational.
        pub part: Wire<In>,
        /// OR of the magnitudes of the subarray's codes, `input_bits` − 1 wide; valid while `full`.
        pub magnitude: Wire<Out>,
        /// A code of the subarray is above the noise floor; valid while `full`.
        pub positive: Signal<Out, Bit>,
        /// A code of the subarray is below minus the noise floor; valid while `full`.
        pub negative: Signal<Out, Bit>,
        /// `tlast` was early or missing since the last `reported`.
        pub framing: Signal<Out, Bit>,
        /// Clears `framing`.
        pub reported: Signal<In, Bit>,
    }
}

impl ReceivePorts {
    /// For frames that are read in the layout of any of `cases`.
    pub(super) fn new(cases: &[Model]) -> Self {
        let bits = cases[0].formats.input_bits as usize;
        let parts: Vec<usize> = cases.iter().map(|case| case.parts.len()).collect();
        ReceivePorts {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            accept: Default::default(),
            taken_word: Wire::new(bits),
            full: Default::default(),
            free: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            quad_address: Wire::new(count_bits(frame_quads(cases))),
            quad: Wire::new(4 * bits),
            part: Wire::new(count_bits(largest(&parts))),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            framing: Default::default(),
            reported: Default::default(),
        }
    }
}

has_ports!(Receive: ReceivePorts);

impl Receive {
    /// For frames in the layout of `model`, which is the case of index `case`.
    pub fn new(model: &Model, case: usize) -> Self {
        let bits = model.formats.input_bits as usize;
        let count = model.parts.len();
        let quads = count * model.formats.quads;
        let taxels = model.scene.sensor.taxels();
        Receive {
            ports: ReceivePorts::new(std::slice::from_ref(model)),
            scan: Scan::new(std::slice::from_ref(model)),
            blank: DeadTaxelMask::new(bits, taxels, &model.dead),
            spread: LaneBroadcast::new(bits),
            frame: Ram::new(quads, 4, bits).holding((0..4).map(|lane| Holds::Frame { case, lane })).registered(),
            gather: FrameStats::new(bits, model.noise_floor, count),
            gathers: BitDelay::new(1),
            gathered_part: Delay::new(count_bits(count), 1),
            gathered_code: Delay::new(bits, 1),
            gathered_address: Delay::new(count_bits(quads), 1),
            gathered_mask: Delay::new(4, 1),
            clears: Default::default(),
            whole: Default::default(),
            complete: Default::default(),
            broken: Default::default(),
            taken: Default::default(),
            early: Default::default(),
        }
    }
}

impl Logic for Receive {
    #[hdl_gen]
    fn update(&mut self) {
        self.scan.clk.next = self.clk.val();
        self.blank.clk.next = self.clk.val();
        self.frame.clk.next = self.clk.val();
        self.gather.clk.next = self.clk.val();
        self.gathers.clk.next = self.clk.val();
        self.gathers.rst.next = self.rst.val();
        self.gathered_part.clk.next = self.clk.val();
        self.gathered_code.clk.next = self.clk.val();
        self.gathered_address.clk.next = self.clk.val();
        self.gathered_mask.clk.next = self.clk.val();
        self.clears.clk.next = self.clk.val();
        self.whole.clk.next = self.clk.val();
        self.complete.clk.next = self.clk.val();
        self.broken.clk.next = self.clk.val();

        self.s_axis_tready.next = !self.whole.q.val() & !self.rst.val();
        self.taken.next = self.s_axis_tvalid.val() & !self.whole.q.val() & !self.rst.val();
        self.early.next = self.taken.val() & self.s_axis_tlast.val() & !self.scan.last.val();
        self.accept.next = self.taken.val();

        self.which.next = false.into();
        self.scan.which.next = false.into();
        self.scan.enable.next = self.taken.val();
        self.scan.clear.next = self.rst.val() | self.early.val();
        self.blank.enable.next = self.taken.val();
        self.blank.clear.next = self.rst.val() | self.early.val();
        self.blank.word.next = self.s_axis_tdata.val();
        self.taken_word.next = self.blank.kept.val();
        self.gathered_code.now.next = self.blank.kept.val();
        self.gathered_mask.now.next = self.scan.mask.val();
        self.gathered_address.now.next = self.scan.address.val();
        self.spread.word.next = self.gathered_code.then.val();
        self.spread.mask.next = self.gathered_mask.then.val();
        self.spread.enable.next = self.gathers.then.val();
        self.frame.write_address.next = self.gathered_address.then.val();
        self.frame.write_data.next = self.spread.quad.val();
        self.frame.write.next = self.spread.write.val();
        self.frame.read.next = true;
        self.frame.read_address.next = self.quad_address.val();
        self.quad.next = self.frame.read_data.val();

        self.gathers.now.next = self.taken.val() & !self.early.val();
        self.gathered_part.now.next = self.scan.part.val();
        self.gather.accept.next = self.gathers.then.val();
        self.clears.d.next = self.rst.val() | self.free.val() | self.early.val();
        self.gather.clear.next = self.clears.q.val();
        self.gather.part.next = self.gathered_part.then.val();
        self.gather.select.next = self.part.val();
        self.gather.code.next = self.gathered_code.then.val();
        self.magnitude.next = self.gather.magnitude.val();
        self.positive.next = self.gather.positive.val();
        self.negative.next = self.gather.negative.val();

        self.full.next = self.complete.q.val();
        self.complete.d.next = self.whole.q.val() & !self.free.val() & !self.rst.val();
        self.whole.d.next =
            (self.whole.q.val() | (self.taken.val() & self.scan.last.val())) & !self.free.val() & !self.rst.val();
        self.framing.next = self.broken.q.val();
        self.broken.d.next = ((self.broken.q.val() & !self.reported.val())
            | self.early.val()
            | (self.taken.val() & self.scan.last.val() & !self.s_axis_tlast.val()))
            & !self.rst.val();
    }
}
