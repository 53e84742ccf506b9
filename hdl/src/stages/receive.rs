//! Stage `receive`: taxels row-major into the frame buffer; magnitude and signs are gathered as they arrive.
//!
//! One beat per cycle while the buffer is free. A frame ends with its last taxel, whatever `tlast` says: an early
//! `tlast` drops the frame, and the next beat starts a new one; a missing `tlast` is only recorded. Both set `framing`
//! until `reported`.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::{CasePlan, Model};
use dermis_golden::spec::quads::Quads;

use super::Choose;
use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{count_bits, frame_quads, BitDelay, Delay, Dff, FrameStats, InputMask, Ram, Scan, Stream};

block! {
    /// ```text
    /// s_axis --> frame buffer --> quad (two cycles after quad_address)
    ///       \--> magnitude, positive, negative
    /// ```
    /// `full` is high from two cycles after the frame's last beat until `free`; the gathered values of a subarray are valid from
    /// two cycles after its last beat.
    pub struct Receive {
        /// Width of a code.
        bits: usize,
        /// Cases of which one is chosen per frame.
        cases: usize,
        /// Quads of a frame and subarrays, both of the largest case.
        quads: usize,
        parts: usize,
        floor_bits: usize,
        buffers: Buffers,
    }
    ports ReceivePorts {
        clock;
        reset;
        /// A taxel's code, `input_bits` wide, two's complement; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: bits;
        /// A beat is accepted in this cycle.
        out accept;
        /// The accepted code, 0 for a dead taxel and for tension of a unipolar array; valid with `accept`.
        out taken_word: bits;
        /// The taxel accepted is the last of a row of subarrays.
        out row_end;
        /// The beat accepted ends its frame early: the frame is dropped.
        out dropped;
        /// The frame buffer holds a whole frame, and `case_index` is its case; high until `free`.
        out full;
        /// The frame has been read: the buffer may be overwritten.
        in free;
        /// Index of the chosen case; valid with `full`, 0 where there is one case.
        out case_index: count_bits(*cases);
        /// Address of the quad to read, over all subarrays; sampled in every cycle.
        in quad_address: count_bits(*quads);
        /// Four codes, `input_bits` each, signed; two cycles after `quad_address`.
        out quad: 4 * bits;
        /// Index of the subarray for `magnitude`, `positive` and `negative`; combinational.
        in part: count_bits(*parts);
        /// Noise floor in codes, unsigned, where it is written, else one bit; constant between resets, valid from one on.
        in floor: floor_bits;
        /// OR of the magnitudes of the subarray's codes, `input_bits` − 1 wide; valid from two cycles after its last code
        /// until `free`.
        out magnitude: bits - 1;
        /// A code of the subarray is above the noise floor; valid as `magnitude` is.
        out positive;
        /// A code of the subarray is below minus the noise floor; valid as `magnitude` is.
        out negative;
        /// `tlast` was early or missing since the last `reported`.
        out framing;
        /// Clears `framing`.
        in reported;
    }
}

/// Where frames are stored.
enum Buffers {
    /// In the layout of one case.
    One(Box<Buffer>),
    /// In those of several cases, one of which is chosen per frame.
    Several(Choose, Vec<Receive>),
}

/// The parts of a frame buffer.
struct Buffer {
    scan: Scan,
    input_mask: Option<InputMask>,
    frame: Ram,
    stats: FrameStats,
}

impl Receive {
    /// For the frames of `model`.
    pub fn new(model: &Model) -> Self {
        if !model.chooses() {
            return Receive::of_case(model, 0);
        }
        let buffers = (0..model.cases().len()).map(|case| Receive::of_case(model, case)).collect();
        Receive::with(model, model.cases(), Buffers::Several(Choose::new(model), buffers))
    }

    /// For frames in the layout of the case of index `case`.
    fn of_case(model: &Model, case: usize) -> Self {
        let cases = std::slice::from_ref(&model.cases()[case]);
        let (bits, taxels) = (model.formats().input_bits as usize, model.scene.sensor.taxels());
        let lanes = (0..Quads::LANES).map(|lane| Holds::Frame { case, lane });
        let buffer = Buffer {
            scan: Scan::new(cases, Quads::LANES),
            input_mask: InputMask::new(bits, taxels, &model.dead, model.scene.input.unipolar),
            frame: Ram::new(frame_quads(cases), Quads::LANES, bits).holding(lanes).registered(),
            stats: FrameStats::new(bits, model.built_in_floor(), cases[0].parts.len()),
        };
        Receive::with(model, cases, Buffers::One(Box::new(buffer)))
    }

    fn with(model: &Model, cases: &[CasePlan], buffers: Buffers) -> Self {
        Receive {
            bits: model.formats().input_bits as usize,
            cases: cases.len(),
            quads: frame_quads(cases),
            parts: cases.iter().map(|case| case.parts.len()).max().unwrap_or(1),
            floor_bits: model.floor_bits() as usize,
            buffers,
        }
    }
}

impl Block for Receive {
    fn build<'k>(&'k self, k: &'k Builder, io: ReceivePorts<Inside<'k>>) {
        match &self.buffers {
            Buffers::One(buffer) => self.build_buffer(k, io, buffer),
            Buffers::Several(choose, buffers) => Receive::build_banks(k, io, choose, buffers),
        }
    }
}

impl Receive {
    fn build_buffer<'k>(&'k self, k: &'k Builder, io: ReceivePorts<Inside<'k>>, buffer: &'k Buffer) {
        let scan = k.instance("scan", &buffer.scan);
        let input_mask = k.instance("input_mask", buffer.input_mask.as_ref());
        let frame = k.instance("frame", &buffer.frame);
        let stats = k.instance("stats", &buffer.stats);
        let stats_enable = k.instance("stats_enable", BitDelay::new(1));
        let stats_part = k.instance("stats_part", Delay::new(count_bits(self.parts), 1));
        let stats_code = k.instance("stats_code", Delay::new(self.bits, 1));
        let stats_address = k.instance("stats_address", Delay::new(count_bits(self.quads), 1));
        let stats_mask = k.instance("stats_mask", Delay::new(Quads::LANES, 1));
        let clears = k.instance("clears", Dff {});
        let whole = k.instance("whole", Dff {});
        let complete = k.instance("complete", Dff {});
        let broken = k.instance("broken", Dff {});

        io.s_axis.ready.set(!whole.q & !io.rst);
        let taken = k.wire("taken", io.s_axis.valid & !whole.q & !io.rst);
        let early = k.wire("early", taken & io.s_axis.last & !scan.last);
        io.accept.set(taken);
        io.row_end.set(scan.row_end);
        io.dropped.set(early);

        io.case_index.set(k.constant(1, 0));
        scan.case_index.set(k.constant(1, 0));
        scan.enable.set(taken);
        scan.clear.set(io.rst | early);
        let word = input_mask.map_or(io.s_axis.data, |mask| {
            mask.enable.set(taken);
            mask.clear.set(io.rst | early);
            mask.word.set(io.s_axis.data);
            mask.kept
        });
        io.taken_word.set(word);
        stats_code.d.set(word);
        stats_mask.d.set(scan.mask);
        stats_address.d.set(scan.address);
        frame.write_address.set(stats_address.q);
        frame.write_data.set(stats_code.q.repeat(Quads::LANES));
        frame.write.set(stats_mask.q & stats_enable.q.repeat(Quads::LANES));
        frame.read.set(k.constant(1, 1));
        frame.read_address.set(io.quad_address);
        io.quad.set(frame.read_data);
        k.unused([scan.lane]);

        stats_enable.d.set(taken & !early);
        stats_part.d.set(scan.part);
        stats.accept.set(stats_enable.q);
        clears.d.set(io.rst | io.free | early);
        stats.clear.set(clears.q);
        stats.part.set(stats_part.q);
        stats.floor.set(io.floor);
        stats.select.set(io.part);
        stats.code.set(stats_code.q);
        io.magnitude.set(stats.magnitude);
        io.positive.set(stats.positive);
        io.negative.set(stats.negative);

        io.full.set(complete.q);
        complete.d.set(whole.q & !io.free & !io.rst);
        whole.d.set((whole.q | (taken & scan.last)) & !io.free & !io.rst);
        io.framing.set(broken.q);
        broken.d.set(((broken.q & !io.reported) | early | (taken & scan.last & !io.s_axis.last)) & !io.rst);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use dermis_golden::fixed::stages::receive::receive;

    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, MemoryReference, Reference};
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

    pub(crate) struct FrameBuffer {
        pub(crate) reception: Reception,
        /// Index of the case in whose layout frames are stored.
        case: usize,
        /// The whole frame is in the buffer.
        full: bool,
        /// The taxel accepted in the cycle before, and its code.
        taxel: Option<(usize, i32)>,
        lanes: [MemoryReference<i32>; 4],
    }

    impl FrameBuffer {
        fn case(&self) -> &CasePlan {
            &self.reception.model.cases()[self.case]
        }

        pub(crate) fn new(model: &Model, case: usize) -> Self {
            let quads = frame_quads(&model.cases()[case..][..1]);
            let lanes = [(); 4].map(|()| MemoryReference::new(quads, 2));
            FrameBuffer { reception: Reception::new(model), case, full: false, taxel: None, lanes }
        }
    }

    impl Reference for FrameBuffer {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let (model, taken) = (&self.reception.model, self.reception.accepted(inputs));
            let bits = model.formats().input_bits as usize;
            let code = |code: i32, bits: usize| Word::of_fields(&[i64::from(code)], bits);
            let ready = inputs[0].number() == 0 && !self.reception.is_whole();
            let lanes: Option<Vec<i64>> = self.lanes.iter().map(|lane| lane.shown().map(i64::from)).collect();
            let part = self.case().parts.get(inputs[6].number() as usize).filter(|_| self.full);
            let stats = part.map(|part| {
                let codes: Vec<i32> = part.indices(&model.scene.sensor).map(|at| self.reception.codes[at]).collect();
                receive(&codes, model.noise_floor())
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
        assert!(parts.noise_floor() > 0 && dead.dead.len() == 2);
        let tables = noise.replace("[input]", "[hardware]\ntables = \"writable\"\n[input]");
        let written = model(4, 5, &tables).with_changed_plan(|plan| plan.own_mut().noise_floor += 17).unwrap();
        for (model, case, defect) in [
            (written, 0, Change::value("", "stats__floor", |k| k.constant(19, (1 << 19) - 1))),
            (parts, 1, Change::value("", "stats_part__d", |k| k.named("part"))),
            (dead, 0, Change::value("", "input_mask__clear", |k| k.named("rst"))),
        ] {
            let mut random = fastrand::Rng::with_seed(7);
            let mut buffer = FrameBuffer::new(&model, case);
            let count = buffer.case().parts.len();
            let quads = count * buffer.case().formats.quads;
            let floor = Word::from(model.built_in_floor().map_or(model.noise_floor(), |_| 0) as u64);
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
                subject_of!(
                    Receive::of_case(&model, case),
                    changes,
                    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, quad_address, part, reported, floor],
                    outputs [
                        s_axis_tready, accept, taken_word, row_end, dropped, full, case_index, quad, magnitude, positive,
                        negative, framing
                    ],
                )
            };
            check_with_defects(subject, &stimulus, || FrameBuffer::new(&model, case), &[defect]);
        }
    }
}
