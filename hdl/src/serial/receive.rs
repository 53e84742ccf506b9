//! Stage `receive`: taxels row-major into the frame buffer; magnitude and signs are gathered as they arrive.
//!
//! As in the parallel engine ([`crate::stages::Receive`]), with a buffer of single taxels in place of quads.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::words::formats::Formats;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{count_bits, Counter, Dff, FrameStats, Ram};
use crate::wire::Wire;

/// ```text
/// s_axis --> frame buffer --> word (one cycle after read_address)
///       \--> magnitude, positive, negative
/// ```
/// `full` is high from the frame's last beat until `free`; the gathered values are valid for the same time. Framing as
/// in the parallel engine: an early `tlast` drops the frame, a missing one is only recorded, both set `framing` until
/// `reported`.
#[derive(dermis_hdl_derive::Block)]
pub struct Receive {
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
    /// The frame buffer holds a whole frame; high until `free`.
    pub full: Signal<Out, Bit>,
    /// The frame has been read: the buffer may be overwritten.
    pub free: Signal<In, Bit>,
    /// Row-major index of the taxel to read; taken in every cycle.
    pub read_address: Wire<In>,
    /// Its code, signed; one cycle after `read_address`.
    pub word: Wire<Out>,
    /// OR of the codes' magnitudes, `input_bits` − 1 wide; valid while `full`.
    pub magnitude: Wire<Out>,
    /// A code is above the noise floor; valid while `full`.
    pub positive: Signal<Out, Bit>,
    /// A code is below minus the noise floor; valid while `full`.
    pub negative: Signal<Out, Bit>,
    /// `tlast` was early or missing since the last `reported`.
    pub framing: Signal<Out, Bit>,
    /// Clears `framing`.
    pub reported: Signal<In, Bit>,
    taxels: RustHdl<Counter>,
    frame: RustHdl<Ram>,
    stats: RustHdl<FrameStats>,
    whole: RustHdl<Dff>,
    broken: RustHdl<Dff>,
    taken: Signal<Local, Bit>,
    early: Signal<Local, Bit>,
}

impl Receive {
    /// For frames of `4 · formats.quads` taxels and a noise floor of `floor` codes.
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
            taxels: RustHdl::new(Counter::new(taxels)),
            frame: RustHdl::new(Ram::new(taxels, 1, bits).holding([Holds::Frame { case: 0, lane: 0 }])),
            stats: RustHdl::new(FrameStats::new(bits, Some(floor), 1)),
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
        self.stats.clk.next = self.clk.val();
        self.whole.clk.next = self.clk.val();
        self.broken.clk.next = self.clk.val();

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

        self.stats.accept.next = self.taken.val();
        self.stats.clear.next = self.rst.val() | self.free.val() | self.early.val();
        self.stats.part.next = false.into();
        self.stats.select.next = false.into();
        self.stats.floor.next = false.into();
        self.stats.code.next = self.s_axis_tdata.val();
        self.magnitude.next = self.stats.magnitude.val();
        self.positive.next = self.stats.positive.val();
        self.negative.next = self.stats.negative.val();

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

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::receive::receive;
    use dermis_golden::fixed::Model;

    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, MemoryReference, Reference};
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
            let stats = whole.then(|| receive(&self.reception.codes, self.model.noise_floor));
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
            block_subject!(
                Receive::new(model.formats(), model.noise_floor),
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
