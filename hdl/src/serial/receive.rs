//! Stage `receive`: taxels row-major into the frame buffer; magnitude and signs are gathered as they arrive.
//!
//! As in the parallel engine ([`crate::stages::Receive`]), with a buffer of single taxels in place of quads.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::words::formats::Formats;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{count_bits, Counter, Dff, FrameStats, Ram, Stream};

block! {
    /// ```text
    /// s_axis --> frame buffer --> word (one cycle after read_address)
    ///       \--> magnitude, positive, negative
    /// ```
    /// `full` is high from the frame's last beat until `free`; the gathered values are valid for the same time. Framing
    /// as in the parallel engine: an early `tlast` drops the frame, a missing one is only recorded, both set `framing`
    /// until `reported`.
    pub struct Receive {
        /// Width of a code in bits.
        bits: usize,
        /// Taxels of a frame.
        taxels: usize,
        /// Noise floor in codes.
        floor: i32,
    }
    ports ReceivePorts {
        clock;
        reset;
        /// A taxel's code, `input_bits` wide, two's complement; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: bits;
        /// A beat is accepted in this cycle.
        out accept;
        /// The frame buffer holds a whole frame; high until `free`.
        out full;
        /// The frame has been read: the buffer may be overwritten.
        in free;
        /// Row-major index of the taxel to read; taken in every cycle.
        in read_address: count_bits(*taxels);
        /// Its code, signed; one cycle after `read_address`.
        out word: bits;
        /// OR of the codes' magnitudes, `input_bits` − 1 wide; valid while `full`.
        out magnitude: bits - 1;
        /// A code is above the noise floor; valid while `full`.
        out positive;
        /// A code is below minus the noise floor; valid while `full`.
        out negative;
        /// `tlast` was early or missing since the last `reported`.
        out framing;
        /// Clears `framing`.
        in reported;
    }
}

impl Receive {
    /// For frames of `4 · formats.quads` taxels and a noise floor of `floor` codes.
    pub fn new(formats: &Formats, floor: i32) -> Self {
        Receive { bits: formats.input_bits as usize, taxels: 4 * formats.quads, floor }
    }
}

impl Block for Receive {
    fn build<'k>(&self, k: &'k Builder, io: ReceivePorts<Inside<'k>>) {
        let taxels = k.instance("taxels", Counter::new(self.taxels));
        let frame = Ram::new(self.taxels, 1, self.bits).holding([Holds::Frame { case: 0, lane: 0 }]);
        let frame = k.instance("frame", frame);
        let stats = k.instance("stats", FrameStats::new(self.bits, Some(self.floor), 1));
        let whole = k.instance("whole", Dff {});
        let broken = k.instance("broken", Dff {});

        io.s_axis.ready.set(!whole.q & !io.rst);
        let taken = k.wire("taken", io.s_axis.valid & !whole.q & !io.rst);
        let early = k.wire("early", taken & io.s_axis.last & !taxels.last);
        io.accept.set(taken);

        taxels.enable.set(taken);
        taxels.clear.set(io.rst | early);
        frame.write_address.set(taxels.value);
        frame.write_data.set(io.s_axis.data);
        frame.write.set(taken);
        frame.read.set(k.constant(1, 1));
        frame.read_address.set(io.read_address);
        io.word.set(frame.read_data);

        stats.accept.set(taken);
        stats.clear.set(io.rst | io.free | early);
        [stats.part, stats.select, stats.floor].iter().for_each(|input| input.set(k.constant(1, 0)));
        stats.code.set(io.s_axis.data);
        io.magnitude.set(stats.magnitude);
        io.positive.set(stats.positive);
        io.negative.set(stats.negative);

        io.full.set(whole.q);
        whole.d.set((whole.q | (taken & taxels.last)) & !io.free & !io.rst);
        io.framing.set(broken.q);
        let missing = taken & taxels.last & !io.s_axis.last;
        broken.d.set(((broken.q & !io.reported) | early | missing) & !io.rst);
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::receive::receive;
    use dermis_golden::fixed::Model;

    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, MemoryReference, Reference};
    use crate::language::Change;
    use crate::scenes::model;
    use crate::stages::Reception;
    use crate::wire::Word;

    struct Buffer<'a> {
        model: &'a Model,
        reception: Reception,
        memory: MemoryReference<i32>,
    }

    impl<'a> Buffer<'a> {
        fn new(model: &'a Model) -> Self {
            let memory = MemoryReference::new(model.scene.sensor.taxels(), 1);
            Buffer { model, reception: Reception::new(model), memory }
        }
    }

    impl Reference for Buffer<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let bits = self.model.formats().input_bits as usize;
            let whole = self.reception.is_whole();
            let stats = whole.then(|| receive(&self.reception.codes, self.model.noise_floor()));
            vec![
                Some((inputs[0].number() == 0 && !whole).into()),
                Some(self.reception.accepted(inputs).is_some().into()),
                Some(whole.into()),
                self.memory.shown().map(|code| Word::of_fields(&[code.into()], bits)),
                stats.map(|stats| stats.magnitude.into()),
                stats.map(|stats| stats.positive.into()),
                stats.map(|stats| stats.negative.into()),
                Some(self.reception.framing.into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [free, reported] = [4, 6].map(|input| inputs[input].number() == 1);
            let (at, code) = (self.reception.codes.len(), self.reception.accepted(inputs));
            self.memory.clock(Some(inputs[5].number() as usize), code.map(|code| (at, code)));
            self.reception.clock(inputs, free, reported);
        }
    }

    #[test]
    fn frames_are_written_and_their_statistics_gathered() {
        let model = model(
            4,
            6,
            "[hardware]\nboard = \"icebreaker\"\n[search]\nnoise_floor_MPa = 0.002\n[input]\nfull_scale_MPa = 1.0\n",
        );
        let mut random = fastrand::Rng::with_seed(8);
        let mut buffer = Buffer::new(&model);
        let cycle = |cycle: usize| {
            let beat = buffer.reception.beat(&mut random, cycle);
            let free = buffer.reception.is_whole() && random.u8(..40) == 0;
            let address = random.u64(..model.scene.sensor.taxels() as u64);
            let inputs = [&beat[..], &[free.into(), address.into(), (random.u8(..20) == 0).into()]].concat();
            buffer.clock(&inputs);
            inputs
        };
        let stimulus: Vec<Vec<Word>> = (0..5000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            subject_of!(
                Receive::new(model.formats(), model.noise_floor()),
                changes,
                inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, read_address, reported],
                outputs [s_axis_tready, accept, full, word, magnitude, positive, negative, framing],
            )
        };
        let defects = [
            Change::value("", "stats__clear", |k| k.named("rst") | k.named("free")),
            Change::value("", "broken__d", |k| k.named("early")),
        ];
        check_with_defects(subject, &stimulus, || Buffer::new(&model), &defects);
    }
}
