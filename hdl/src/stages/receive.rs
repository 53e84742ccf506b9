//! Stage `receive`: taxels row-major into the frame buffer; magnitude and signs are gathered as they arrive.
//!
//! One beat per cycle while the buffer is free. A frame ends with its last taxel, whatever `tlast` says: an early
//! `tlast` drops the frame, and the next beat starts a new one; a missing `tlast` is only recorded. Both set `framing`
//! until `reported`.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::{CasePlan, Model};
use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::ports::{has_ports, ports};
use crate::primitives::{
    count_bits, frame_quads, largest, BitDelay, Delay, Dff, FrameStats, InputMask, LaneBroadcast, Ram, Scan,
};
use crate::wire::Wire;

/// ```text
/// s_axis --> frame buffer --> quad (two cycles after quad_address)
///       \--> magnitude, positive, negative
/// ```
/// `full` is high from two cycles after the frame's last beat until `free`; the gathered values of a subarray are valid from
/// two cycles after its last beat.
#[derive(dermis_hdl_derive::Block)]
pub struct Receive {
    ports: ReceivePorts,
    scan: RustHdl<Scan>,
    input_mask: RustHdl<InputMask>,
    broadcast: RustHdl<LaneBroadcast>,
    frame: RustHdl<Ram>,
    stats: RustHdl<FrameStats>,
    stats_enable: RustHdl<BitDelay>,
    stats_part: RustHdl<Delay>,
    stats_code: RustHdl<Delay>,
    stats_address: RustHdl<Delay>,
    stats_mask: RustHdl<Delay>,
    clears: RustHdl<Dff>,
    whole: RustHdl<Dff>,
    complete: RustHdl<Dff>,
    broken: RustHdl<Dff>,
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
        /// The accepted code, 0 for a dead taxel and for tension of a unipolar array; valid with `accept`.
        pub taken_word: Wire<Out>,
        /// The taxel accepted is the last of a row of subarrays.
        pub row_end: Signal<Out, Bit>,
        /// The beat accepted ends its frame early: the frame is dropped.
        pub dropped: Signal<Out, Bit>,
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
        /// Noise floor in codes, ≥ 0, where it is written, else one bit; constant between resets, valid from one on.
        pub floor: Wire<In>,
        /// OR of the magnitudes of the subarray's codes, `input_bits` − 1 wide; valid from two cycles after its last code
        /// until `free`.
        pub magnitude: Wire<Out>,
        /// A code of the subarray is above the noise floor; valid as `magnitude` is.
        pub positive: Signal<Out, Bit>,
        /// A code of the subarray is below minus the noise floor; valid as `magnitude` is.
        pub negative: Signal<Out, Bit>,
        /// `tlast` was early or missing since the last `reported`.
        pub framing: Signal<Out, Bit>,
        /// Clears `framing`.
        pub reported: Signal<In, Bit>,
    }
}

impl ReceivePorts {
    /// For frames that are read in the layout of any of `cases`, and a noise floor of `floor_bits` bits.
    pub(super) fn new(cases: &[CasePlan], floor_bits: u32) -> Self {
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
            row_end: Default::default(),
            dropped: Default::default(),
            full: Default::default(),
            free: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            quad_address: Wire::new(count_bits(frame_quads(cases))),
            quad: Wire::new(4 * bits),
            part: Wire::new(count_bits(largest(&parts))),
            floor: Wire::new(floor_bits as usize),
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
    /// For frames in the layout of the case of index `case`.
    pub fn new(model: &Model, case: usize) -> Self {
        let own = &model.cases()[case];
        let bits = own.formats.input_bits as usize;
        let count = own.parts.len();
        let quads = count * own.formats.quads;
        let taxels = model.scene.sensor.taxels();
        Receive {
            ports: ReceivePorts::new(std::slice::from_ref(own), model.floor_bits()),
            scan: RustHdl::new(Scan::new(std::slice::from_ref(own), Quads::LANES)),
            input_mask: RustHdl::new(InputMask::new(bits, taxels, &model.dead, model.scene.input.unipolar)),
            broadcast: RustHdl::new(LaneBroadcast::new(bits)),
            frame: RustHdl::new(
                Ram::new(quads, 4, bits).holding((0..4).map(|lane| Holds::Frame { case, lane })).registered(),
            ),
            stats: RustHdl::new(FrameStats::new(bits, model.built_in_floor(), count)),
            stats_enable: RustHdl::new(BitDelay::new(1)),
            stats_part: RustHdl::new(Delay::new(count_bits(count), 1)),
            stats_code: RustHdl::new(Delay::new(bits, 1)),
            stats_address: RustHdl::new(Delay::new(count_bits(quads), 1)),
            stats_mask: RustHdl::new(Delay::new(4, 1)),
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
        self.input_mask.clk.next = self.clk.val();
        self.frame.clk.next = self.clk.val();
        self.stats.clk.next = self.clk.val();
        self.stats_enable.clk.next = self.clk.val();
        self.stats_enable.rst.next = self.rst.val();
        self.stats_part.clk.next = self.clk.val();
        self.stats_code.clk.next = self.clk.val();
        self.stats_address.clk.next = self.clk.val();
        self.stats_mask.clk.next = self.clk.val();
        self.clears.clk.next = self.clk.val();
        self.whole.clk.next = self.clk.val();
        self.complete.clk.next = self.clk.val();
        self.broken.clk.next = self.clk.val();

        self.s_axis_tready.next = !self.whole.q.val() & !self.rst.val();
        self.taken.next = self.s_axis_tvalid.val() & !self.whole.q.val() & !self.rst.val();
        self.early.next = self.taken.val() & self.s_axis_tlast.val() & !self.scan.last.val();
        self.accept.next = self.taken.val();
        self.row_end.next = self.scan.row_end.val();
        self.dropped.next = self.early.val();

        self.which.next = false.into();
        self.scan.which.next = false.into();
        self.scan.enable.next = self.taken.val();
        self.scan.clear.next = self.rst.val() | self.early.val();
        self.input_mask.enable.next = self.taken.val();
        self.input_mask.clear.next = self.rst.val() | self.early.val();
        self.input_mask.word.next = self.s_axis_tdata.val();
        self.taken_word.next = self.input_mask.kept.val();
        self.stats_code.d.next = self.input_mask.kept.val();
        self.stats_mask.d.next = self.scan.mask.val();
        self.stats_address.d.next = self.scan.address.val();
        self.broadcast.word.next = self.stats_code.q.val();
        self.broadcast.mask.next = self.stats_mask.q.val();
        self.broadcast.enable.next = self.stats_enable.q.val();
        self.frame.write_address.next = self.stats_address.q.val();
        self.frame.write_data.next = self.broadcast.quad.val();
        self.frame.write.next = self.broadcast.write.val();
        self.frame.read.next = true;
        self.frame.read_address.next = self.quad_address.val();
        self.quad.next = self.frame.read_data.val();

        self.stats_enable.d.next = self.taken.val() & !self.early.val();
        self.stats_part.d.next = self.scan.part.val();
        self.stats.accept.next = self.stats_enable.q.val();
        self.clears.d.next = self.rst.val() | self.free.val() | self.early.val();
        self.stats.clear.next = self.clears.q.val();
        self.stats.part.next = self.stats_part.q.val();
        self.stats.floor.next = self.floor.val();
        self.stats.select.next = self.part.val();
        self.stats.code.next = self.stats_code.q.val();
        self.magnitude.next = self.stats.magnitude.val();
        self.positive.next = self.stats.positive.val();
        self.negative.next = self.stats.negative.val();

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

#[cfg(test)]
pub(crate) mod tests {
    use dermis_golden::fixed::stages::receive::receive;

    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, MemoryReference, Reference};
    use crate::language::Change;
    use crate::scenes::{model, Place};
    use crate::wire::Word;

    /// The frame that arrives at a frame buffer of any layout.
    pub(crate) struct Reception {
        model: Model,
        /// The codes accepted, 0 for dead taxels.
        pub(crate) codes: Vec<i32>,
        /// `tlast` was early or missing.
        pub(crate) framing: bool,
    }

    impl Reception {
        pub(crate) fn new(model: &Model) -> Self {
            Reception { model: model.clone(), codes: Vec::new(), framing: false }
        }

        /// All taxels have been accepted, and the buffer has not been freed.
        pub(crate) fn is_whole(&self) -> bool {
            self.codes.len() == self.model.scene.sensor.taxels()
        }

        /// The code that is accepted; inputs: reset, code, valid, last.
        pub(crate) fn accepted(&self, inputs: &[Word]) -> Option<i32> {
            let bits = self.model.formats().input_bits as usize;
            let taken = inputs[2].number() == 1 && inputs[0].number() == 0 && !self.is_whole();
            let code = inputs[1].signed(0, bits) as i32;
            let dead = self.model.dead.contains(&self.codes.len());
            let tension = self.model.scene.input.unipolar && code < 0;
            taken.then_some(if dead || tension { 0 } else { code })
        }

        /// A clock edge with the same inputs. Gives the taxel that goes to the buffer and its code.
        pub(crate) fn clock(&mut self, inputs: &[Word], free: bool, reported: bool) -> Option<(usize, i32)> {
            let taken = self.accepted(inputs);
            let last = inputs[3].number() == 1;
            self.framing &= !reported;
            if let Some(code) = taken {
                self.codes.push(code);
                self.framing |= last != self.is_whole();
            }
            let (early, taxel) = (last && !self.is_whole(), self.codes.len());
            if inputs[0].number() == 1 {
                *self = Reception::new(&self.model);
            } else if free || (taken.is_some() && early) {
                self.codes.clear();
            }
            taken.filter(|_| !early).map(|code| (taxel - 1, code))
        }

        /// Random beats, `tlast` wrong every now and then, and resets: the first four inputs.
        pub(crate) fn beat(&self, random: &mut fastrand::Rng, cycle: usize) -> [Word; 4] {
            let rst = cycle < 2 || random.u16(..700) == 0;
            let last = (self.codes.len() + 1 == self.model.scene.sensor.taxels()) ^ (random.u8(..150) == 0);
            let bits = self.model.formats().input_bits as usize;
            // Small ones are within the noise.
            let code = Word::of_fields(&[random.i64(..) >> (64 - bits) >> random.usize(..bits)], bits);
            [rst.into(), code, (random.u8(..4) > 0).into(), last.into()]
        }
    }

    struct Buffer {
        reception: Reception,
        /// Index of the case in whose layout frames are stored.
        case: usize,
        /// The whole frame is in the buffer.
        full: bool,
        /// The taxel accepted in the cycle before, and its code.
        taxel: Option<(usize, i32)>,
        lanes: [MemoryReference<i32>; 4],
    }

    impl Buffer {
        fn case(&self) -> &CasePlan {
            &self.reception.model.cases()[self.case]
        }

        fn new(model: &Model, case: usize) -> Self {
            let quads = frame_quads(&model.cases()[case..][..1]);
            let lanes = [(); 4].map(|()| MemoryReference::new(quads, 2));
            Buffer { reception: Reception::new(model), case, full: false, taxel: None, lanes }
        }
    }

    impl Reference for Buffer {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let (model, taken) = (&self.reception.model, self.reception.accepted(inputs));
            let bits = model.formats().input_bits as usize;
            let code = |code: i32, bits: usize| Word::of_fields(&[i64::from(code)], bits);
            let ready = inputs[0].number() == 0 && !self.reception.is_whole();
            let lanes: Option<Vec<i64>> = self.lanes.iter().map(|lane| lane.shown().map(i64::from)).collect();
            let part = self.case().parts.get(inputs[6].number() as usize).filter(|_| self.full);
            let stats = part.map(|part| {
                let codes: Vec<i32> = part.indices(&model.scene.sensor).map(|at| self.reception.codes[at]).collect();
                receive(&codes, model.noise_floor)
            });
            let next = self.reception.codes.len() + 1;
            let row_end = next.is_multiple_of(self.case().layout().rows * model.scene.sensor.cols);
            let dropped = inputs[3].number() == 1 && next < model.scene.sensor.taxels();
            vec![
                Some(ready.into()),
                Some(taken.is_some().into()),
                taken.map(|taken| code(taken, bits)),
                Some((taken.is_some() && row_end).into()),
                Some((taken.is_some() && dropped).into()),
                Some(self.full.into()),
                Some(0.into()),
                lanes.map(|lanes| Word::of_fields(&lanes, bits)),
                stats.map(|stats| stats.magnitude.into()),
                stats.map(|stats| stats.positive.into()),
                stats.map(|stats| stats.negative.into()),
                Some(self.reception.framing.into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, free, reported] = [0, 4, 7].map(|input| inputs[input].number() == 1);
            let taxel = self.taxel.map(|(taxel, code)| (Place::of(self.case(), taxel), code));
            for (lane, memory) in self.lanes.iter_mut().enumerate() {
                let written = taxel.as_ref().filter(|(place, _)| place.mask >> lane & 1 == 1);
                memory.clock(Some(inputs[5].number() as usize), written.map(|(place, code)| (place.quad, *code)));
            }
            self.full = self.reception.is_whole() && !free && !rst;
            self.taxel = self.reception.clock(inputs, free, reported);
        }
    }

    #[test]
    fn frames_are_written_as_quads_and_their_statistics_gathered() {
        let noise = "[search]\nnoise_floor_MPa = 0.002\n[input]\nfull_scale_MPa = 1.0\n";
        // The second of two cases, and a sensor with dead taxels.
        let parts = model(10, 14, &format!("[partition]\ncases = [0, 1]\n{noise}"));
        let dead = model(5, 7, &format!("{noise}dead = [[0, 3], [4, 6]]\n"));
        assert!(parts.noise_floor > 0 && dead.dead.len() == 2);
        let tables = noise.replace("[input]", "[hardware]\ntables = \"writable\"\n[input]");
        let written = model(4, 5, &tables).with_changed_plan(|plan| plan.noise_floor += 17).unwrap();
        for (model, case, defect) in [
            (written, 0, Change::value("", "stats__floor", |k| k.constant(20, (1 << 19) - 1))),
            (parts, 1, Change::value("", "stats_part__d", |k| k.named("part"))),
            (dead, 0, Change::value("", "input_mask__clear", |k| k.named("rst"))),
        ] {
            let mut random = fastrand::Rng::with_seed(7);
            let mut buffer = Buffer::new(&model, case);
            let count = buffer.case().parts.len();
            let quads = count * buffer.case().formats.quads;
            let floor = Word::from(model.built_in_floor().map_or(model.noise_floor, |_| 0) as u64);
            let cycle = |cycle: usize| {
                let beat = buffer.reception.beat(&mut random, cycle);
                let free = buffer.full && random.u8(..40) == 0;
                let [address, part] = [quads, count].map(|limit| Word::from(random.u64(..limit as u64)));
                let inputs = [&beat[..], &[free.into(), address, part, (random.u8(..20) == 0).into(), floor]].concat();
                buffer.clock(&inputs);
                inputs
            };
            let stimulus: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
            let subject = |changes: &[Change]| {
                block_subject!(
                    Receive::new(&model, case),
                    changes,
                    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, quad_address, part, reported, floor],
                    outputs [
                        s_axis_tready, accept, taken_word, row_end, dropped, full, which, quad, magnitude, positive,
                        negative, framing
                    ],
                )
            };
            check_with_defects(subject, &stimulus, || Buffer::new(&model, case), &[defect]);
        }
    }
}
