//! Stage `prepare`: images of tables, calibration and averaging before `receive`; what the scene does not use is wires.
//!
//! Where zeros run, port `frames` says above the number of frames whether one is at its limit ([`FrameMarks`]).

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{Average, Calibrate, FrameMarks, Load, THRESHOLD_BITS, VERSION_WORD_BITS};
use crate::wire::Wire;

/// Codes in, words of the frame buffer out.
#[derive(dermis_hdl_derive::Block)]
pub struct Prepare {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// No frame is in the engine behind this stage.
    pub idle: Signal<In, Bit>,
    /// A taxel's code, or a byte of an image ([`Load`]), `stream_bits` wide; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's word, `input_bits` wide, two's complement; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The word is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Number of frames in a sliding mean; valid with `m_axis_tvalid`. Otherwise one bit, 0.
    pub frames: Wire<Out>,
    /// Reset of the engine: `rst`, or tables are written.
    pub restart: Signal<Out, Bit>,
    /// Writes `coefficient_data` to lanes `coefficient_pair` of word `coefficient_word` of the coefficient memory; only with `restart`.
    pub coefficient_write: Signal<Out, Bit>,
    /// Word of the memory; valid with `coefficient_write`.
    pub coefficient_word: Wire<Out>,
    /// Pair of lanes; valid with `coefficient_write`.
    pub coefficient_pair: Wire<Out>,
    /// The coefficients of two lanes; valid with `coefficient_write`.
    pub coefficient_data: Wire<Out>,
    /// Noise floor in codes, where it is written, else one bit, 0; valid unless `restart`.
    pub noise_floor: Wire<Out>,
    /// Threshold in force LSBs, 32 bits, where it is written, else 0; valid unless `restart`.
    pub threshold: Wire<Out>,
    /// Version of the tables and whether the last were refused, where they are written, else 0; valid unless `restart`.
    pub version: Wire<Out>,
    /// The tables are not whole.
    pub incomplete: Signal<Out, Bit>,
    load: RustHdl<Load>,
    /// Zero and gain of each taxel.
    pub calibrate: RustHdl<Calibrate>,
    average: RustHdl<Average>,
}

impl Prepare {
    /// With the input options of `model`.
    pub fn new(model: &Model) -> Self {
        let (formats, taxels) = (model.formats(), model.scene.sensor.taxels());
        let bits = formats.code_bits as usize;
        let load = RustHdl::new(Load::new(model));
        let (power, mean) = (model.prepare.average, model.prepare.mean);
        let average = RustHdl::new(Average::new(taxels, bits, power, mean, FrameMarks::new(model)));
        Prepare {
            clk: Default::default(),
            rst: Default::default(),
            idle: Default::default(),
            s_axis_tdata: Wire::new(model.stream_bits() as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(formats.input_bits as usize),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            frames: Wire::new(average.frames.width()),
            restart: Default::default(),
            coefficient_write: Default::default(),
            coefficient_word: Wire::new(load.coefficient_word.width()),
            coefficient_pair: Wire::new(load.coefficient_pair.width()),
            coefficient_data: Wire::new(load.coefficient_data.width()),
            noise_floor: Wire::new(model.floor_bits() as usize),
            threshold: Wire::new(THRESHOLD_BITS),
            version: Wire::new(VERSION_WORD_BITS),
            incomplete: Default::default(),
            load,
            calibrate: RustHdl::new(Calibrate::new(&model.prepare, taxels, bits, model.has_writable_tables())),
            average,
        }
    }
}

impl Logic for Prepare {
    #[hdl_gen]
    fn update(&mut self) {
        self.load.clk.next = self.clk.val();
        self.load.rst.next = self.rst.val();
        self.load.idle.next = self.idle.val();
        self.restart.next = self.load.restart.val();
        self.coefficient_write.next = self.load.coefficient_write.val();
        self.coefficient_word.next = self.load.coefficient_word.val();
        self.coefficient_pair.next = self.load.coefficient_pair.val();
        self.coefficient_data.next = self.load.coefficient_data.val();
        self.noise_floor.next = self.load.noise_floor.val();
        self.threshold.next = self.load.threshold.val();
        self.version.next = self.load.version.val();
        self.incomplete.next = self.load.incomplete.val();
        self.load.s_axis_tdata.next = self.s_axis_tdata.val();
        self.load.s_axis_tvalid.next = self.s_axis_tvalid.val();
        self.load.s_axis_tlast.next = self.s_axis_tlast.val();
        self.s_axis_tready.next = self.load.s_axis_tready.val();
        self.calibrate.clk.next = self.clk.val();
        self.calibrate.rst.next = self.load.restart.val();
        self.calibrate.write.next = self.load.write.val();
        self.calibrate.write_taxel.next = self.load.taxel.val();
        self.calibrate.write_entry.next = self.load.entry.val();
        self.calibrate.incomplete.next = self.load.incomplete.val();
        self.average.clk.next = self.clk.val();
        self.average.rst.next = self.load.restart.val();
        self.calibrate.s_axis_tdata.next = self.load.m_axis_tdata.val();
        self.calibrate.s_axis_tvalid.next = self.load.m_axis_tvalid.val();
        self.calibrate.s_axis_tlast.next = self.load.m_axis_tlast.val();
        self.load.m_axis_tready.next = self.calibrate.s_axis_tready.val();
        self.average.s_axis_tdata.next = self.calibrate.m_axis_tdata.val();
        self.average.s_axis_tvalid.next = self.calibrate.m_axis_tvalid.val();
        self.average.s_axis_tlast.next = self.calibrate.m_axis_tlast.val();
        self.calibrate.m_axis_tready.next = self.average.s_axis_tready.val();
        self.m_axis_tdata.next = self.average.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.average.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.average.m_axis_tlast.val();
        self.average.m_axis_tready.next = self.m_axis_tready.val();
        self.frames.next = self.average.frames.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{
        block_subject, check, check_with_defects, random_word, random_words, Pipeline, Reference, Subject,
    };
    use crate::language::Change;
    use crate::primitives::{Sums, Table};
    use crate::scenes::model;
    use crate::wire::Word;

    /// Calibration, then the sums. Inputs of the stage and of both: reset, data, valid, last, ready.
    struct Prepared {
        table: Table,
        sums: Sums,
    }

    impl Prepared {
        fn new(model: &Model) -> Self {
            let (input, bits) = (&model.prepare, model.formats().code_bits as usize);
            let zero = input.zero.as_deref().unwrap();
            let sums = Sums::new(zero.len(), bits, input.average);
            Prepared { table: Table::new(zero, input.gain.as_deref(), bits), sums }
        }

        /// The inputs of calibration and sums.
        fn inputs(&mut self, inputs: &[Word]) -> [Vec<Word>; 2] {
            // Whether the sums take a word does not depend on the word.
            let ready = self.sums.outputs(inputs)[3].unwrap_or_default();
            let table = [&inputs[..4], &[ready], &[Word::default(); 4]].concat();
            let [valid, last, data] = [1, 2, 3].map(|output| self.table.outputs(&table)[output].unwrap_or_default());
            [table, vec![inputs[0], data, valid, last, inputs[4]]]
        }
    }

    impl Reference for Prepared {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [table, sums] = self.inputs(inputs);
            let sums = self.sums.outputs(&sums);
            // Without writable tables.
            let constant = [Some(Word::default()); 8];
            [&self.table.outputs(&table)[..1], &sums[..3], &sums[4..], &[Some(inputs[0])], &constant].concat()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [table, sums] = self.inputs(inputs);
            self.table.clock(&table);
            self.sums.clock(&sums);
        }
    }

    fn subject(model: &Model, changes: &[Change]) -> Subject<'static> {
        block_subject!(
            Prepare::new(model),
            changes,
            inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready, idle],
            outputs [
                s_axis_tready, m_axis_tvalid, m_axis_tdata, m_axis_tlast, frames, restart, noise_floor, threshold, version,
                incomplete, coefficient_write, coefficient_word, coefficient_pair, coefficient_data,
            ],
        )
    }

    #[test]
    fn codes_are_calibrated_then_averaged() {
        let model = model(2, 3, "[input]\naverage = 2\nfull_scale_MPa = 1.0\n");
        let (taxels, bits) = (model.scene.sensor.taxels(), model.formats().code_bits as usize);
        let mut random = fastrand::Rng::with_seed(14);
        let half = 1 << (bits - 1);
        let model = model.with_changed_plan(|plan| {
            plan.prepare.zero = Some((0..taxels).map(|_| random.i32(-half..half)).collect());
            plan.prepare.gain = Some((0..taxels).map(|_| random.i32(-(1 << 17)..1 << 17)).collect());
        });
        let model = model.unwrap();
        let mut beats = 0;
        let cycle = |cycle: usize| {
            let rst = cycle < 3 || random.u16(..400) == 0;
            let [offered, ready] = [(); 2].map(|()| random.u8(..8) > 0);
            // Mostly frames of the right length.
            beats = if rst { 0 } else { beats + usize::from(offered) };
            let last = if random.u8(..60) == 0 { random.bool() } else { beats % taxels == 0 };
            vec![
                rst.into(),
                random_word(&mut random, bits),
                offered.into(),
                last.into(),
                ready.into(),
                random.bool().into(),
            ]
        };
        let stimulus: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
        let defects = [
            Change::value("", "average__rst", |k| k.constant(1, 0)),
            Change::value("", "calibrate__m_axis_tready", |k| k.named("m_axis_tready")),
        ];
        check_with_defects(|changes| subject(&model, changes), &stimulus, || Prepared::new(&model), &defects);
    }

    #[test]
    fn without_options_the_stream_passes() {
        let model = model(2, 3, "");
        let stimulus = random_words(500, &[1, model.formats().code_bits as usize, 1, 1, 1, 1]);
        let of = |inputs: &[Word]| {
            let stream = [4, 2, 1, 3].map(|input| Some(inputs[input]));
            let zero = Some(Word::default());
            stream.into_iter().chain([zero, Some(inputs[0])]).chain([zero; 8]).collect()
        };
        check(subject(&model, &[]), &stimulus, &mut Pipeline::new(0, 14, of));
    }
}
