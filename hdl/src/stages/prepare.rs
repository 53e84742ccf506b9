//! Stage `prepare`: images of tables, calibration and averaging before `receive`, as far as the scene has them.
//!
//! Of several arrays each has a zero, gain, drift and mean of its own, and tables if they are written; the array of a frame or of an
//! image of tables is that of its first beat.
//!
//! Where zeros run, port `frames` says above the number of frames whether one is at its limit ([`FrameMarks`]).

use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Outside};
use crate::primitives::{
    through, Arrays, Average, AveragePorts, Beats, Calibrate, CalibratePorts, CoefficientPlaces, FrameArray,
    FrameMarks, Load, LoadPorts, Stream, PAIR_BITS, THRESHOLD_BITS, VERSION_WORD_BITS,
};

block! {
    /// Codes in, words of the frame buffer out.
    pub struct Prepare {
        stream_bits: usize,
        input_bits: usize,
        floor_bits: usize,
        marks: FrameMarks,
        arrays: Arrays,
        coefficients: CoefficientPlaces,
        /// Tables are written.
        load: Option<Load>,
        /// There are several arrays.
        frame_array: Option<FrameArray>,
        /// Zero and gain of each taxel.
        calibrate: Option<Calibrate>,
        average: Option<Average>,
    }
    ports PreparePorts {
        clock;
        reset;
        /// No frame is in the engine behind this stage.
        in idle;
        /// A taxel's code, or a byte of an image ([`Load`]), `stream_bits` wide; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: (*stream_bits, arrays.bits);
        /// A taxel's word, `input_bits` wide, two's complement; valid with `m_axis_tvalid`.
        source<Stream> m_axis: (*input_bits, arrays.bits);
        /// Number of frames in a sliding mean, in an adaptive one with the number of its window above, otherwise one bit, 0; valid with `m_axis_tvalid`.
        out frames: marks.bits();
        /// Reset of the engine: `rst`, or tables are written; with several arrays `rst`.
        out restart;
        /// Writes `coefficient_data` to lanes `coefficient_pair` of word `coefficient_word` of the coefficient memory; only with `restart`.
        out coefficient_write;
        /// Word of the memory; valid with `coefficient_write`.
        out coefficient_word: coefficients.word_bits();
        /// Pair of lanes; valid with `coefficient_write`.
        out coefficient_pair: coefficients.pair_bits();
        /// The coefficients of two lanes; valid with `coefficient_write`.
        out coefficient_data: PAIR_BITS;
        /// Noise floor in codes, unsigned, where it is written, else one bit, 0; valid unless `restart`, of several arrays that of the
        /// word on `m_axis_tdata`.
        out noise_floor: written_bits(load.is_some(), *floor_bits);
        /// Of several arrays whose tables are written that of the frame whose forces are sent.
        in sent_array: if load.is_some() { arrays.bits } else { 0 };
        /// Threshold in force LSBs, 32 bits, where it is written, else 0; valid unless `restart`, of several arrays a cycle after
        /// `sent_array`.
        out threshold: THRESHOLD_BITS;
        /// Version of the tables, of several arrays those of `sent_array`, and whether the last were refused, where they are written,
        /// else 0; valid unless `restart`.
        out version: VERSION_WORD_BITS;
        /// These tables are not whole.
        out incomplete;
    }
}

/// Width of a word that is written, else of a constant 0.
fn written_bits(written: bool, bits: usize) -> usize {
    if written {
        bits
    } else {
        1
    }
}

impl Prepare {
    /// With the input options of `model`; `None` where codes are the words of the frame buffer.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (formats, taxels) = (model.formats(), model.scene.sensor.taxels());
        let bits = formats.code_bits as usize;
        let marks = FrameMarks::new(model);
        let load = Load::of_plan(model);
        let arrays = Arrays::of_model(model);
        let frame_array = FrameArray::new(arrays, taxels);
        let calibrate = Calibrate::new(&model.prepare, taxels, bits, model.has_writable_tables(), arrays);
        let average = Average::new([taxels, bits], &model.prepare, marks, model.has_writable_tables(), arrays);
        let prepares = load.is_some() || calibrate.is_some() || average.is_some() || frame_array.is_some();
        prepares.then(|| Prepare {
            stream_bits: model.stream_bits() as usize,
            input_bits: formats.input_bits as usize,
            floor_bits: model.floor_bits() as usize,
            marks,
            arrays,
            coefficients: CoefficientPlaces::new(model),
            load,
            frame_array,
            calibrate,
            average,
        })
    }
}

impl Block for Prepare {
    fn build<'k>(&self, k: &'k Builder, io: PreparePorts<Inside<'k>>) {
        let load = k.instance("load", self.load.as_ref());
        let frame_array = k.instance("frame_array", self.frame_array.as_ref());
        let calibrate = k.instance("calibrate", self.calibrate.as_ref());
        let average = k.instance("average", self.average.as_ref());
        match &load {
            None => without_tables(k, &io, calibrate.as_ref()),
            Some(load) => {
                // An adaptive mean takes no codes while a frame is in it.
                let adapts = self.average.as_ref().is_some_and(Average::adapts);
                let waits = average.as_ref().filter(|_| adapts).map(|average| average.s_axis.ready);
                let idle = waits.map_or(io.idle, |takes| io.idle & takes);
                tables(k, &io, load, calibrate.as_ref(), idle);
            }
        }
        let codes = through!(io.s_axis.inward(), load);
        let array = frame_array.map_or(io.s_axis.array, |frame| {
            frame.s_axis_tid.set(io.s_axis.array);
            frame.taken.set(codes.valid & *codes.ready);
            frame.tlast.set(codes.last);
            frame.array
        });
        let words = through!(Beats { array, ..codes }, calibrate);
        io.frames.set(match &average {
            Some(average) => average.frames,
            None if self.marks.limited => words.data.top(),
            None => k.constant(1, 0),
        });
        let words = through!(words, average);
        if let Some(load) = load.as_ref().filter(|_| self.arrays.bits > 0) {
            tables_of_arrays(k, &io, load, words.array, calibrate.as_ref(), average.as_ref());
        }
        Beats { data: words.data.low(self.input_bits), ..words }.connect(&io.m_axis);
    }
}

/// Of several arrays those whose tables are written and read; the words that leave are of `array`.
fn tables_of_arrays<'k>(
    k: &'k Builder,
    io: &PreparePorts<Inside<'k>>,
    load: &LoadPorts<Outside<'k>>,
    array: Expr<'k>,
    calibrate: Option<&CalibratePorts<Outside<'k>>>,
    average: Option<&AveragePorts<Outside<'k>>>,
) {
    load.floor_array.set(array);
    load.sent_array.set(io.sent_array);
    k.unused([load.anew, load.array]);
    if let Some(calibrate) = calibrate {
        load.calibrated_array.set(calibrate.incomplete_array);
        calibrate.write_array.set(load.array);
        calibrate.anew.set(load.anew);
    }
    if let Some(average) = average {
        average.anew.set(load.anew);
    }
}

/// What [`Load`] writes goes to calibration and out; while it writes, the rest is reset. It begins where no frame is under way, `idle`.
fn tables<'k>(
    k: &'k Builder,
    io: &PreparePorts<Inside<'k>>,
    load: &LoadPorts<Outside<'k>>,
    calibrate: Option<&CalibratePorts<Outside<'k>>>,
    idle: Expr<'k>,
) {
    load.rst.set(io.rst);
    load.idle.set(idle);
    k.reset_instances(load.restart);
    io.restart.set(load.restart);
    io.coefficient_write.set(load.coefficient_write);
    io.coefficient_word.set(load.coefficient_word);
    io.coefficient_pair.set(load.coefficient_pair);
    io.coefficient_data.set(load.coefficient_data);
    io.noise_floor.set(load.noise_floor);
    io.threshold.set(load.threshold);
    io.version.set(load.version);
    io.incomplete.set(load.incomplete);
    k.unused([load.write, load.taxel, load.entry, load.calibrates_nothing]);
    if let Some(calibrate) = calibrate {
        calibrate.write.set(load.write);
        calibrate.write_taxel.set(load.taxel);
        calibrate.write_entry.set(load.entry);
        calibrate.incomplete.set(load.calibrates_nothing);
    }
}

/// Nothing is written.
fn without_tables<'k>(k: &'k Builder, io: &PreparePorts<Inside<'k>>, calibrate: Option<&CalibratePorts<Outside<'k>>>) {
    io.restart.set(io.rst);
    let coefficients = [io.coefficient_write, io.coefficient_word, io.coefficient_pair, io.coefficient_data];
    for output in coefficients.into_iter().chain([io.noise_floor, io.threshold, io.version, io.incomplete]) {
        output.set(k.constant(output.bits(), 0));
    }
    if let Some(calibrate) = calibrate {
        for input in [calibrate.write, calibrate.write_taxel, calibrate.write_entry, calibrate.incomplete] {
            input.set(k.constant(input.bits(), 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, Reference, Subject};
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
        subject_of!(
            Prepare::of_model(model).unwrap(),
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
}
