//! The engines against the bit-true model, at full output speed: when each beat leaves, and what it holds.

use std::collections::VecDeque;

use dermis_golden::fixed::Model;

use super::Engine;
use crate::language::testbench::{check_with_defects, random_word, variants, Reference};
use crate::language::Change;
use crate::scenes::{learned, model};
use crate::simulate::design;
use crate::wire::Word;

/// Width of a component of a force, in bits.
const COMPONENT: usize = 32;

/// A frame after the other, the receiver always ready. Inputs: reset, code, whether it is offered, whether it is the last.
/// Outputs: ready, whether a beat is offered, the beat, whether it is the last.
pub(crate) struct Frames {
    model: Model,
    /// Whether there was a reset: before, nothing is defined.
    begun: bool,
    /// The codes of the frame that arrives.
    codes: Vec<i32>,
    /// Beats of the frame that is computed: cycles until each leaves, and what it holds.
    beats: VecDeque<(u64, Word)>,
}

impl Frames {
    pub(crate) fn new(model: Model) -> Self {
        Frames { model, begun: false, codes: Vec::new(), beats: VecDeque::new() }
    }

    fn code_bits(&self) -> usize {
        self.model.formats().code_bits as usize
    }

    /// The beats of the frame whose last code arrives in this cycle.
    fn compute(&mut self) {
        let trace = self.model.run(&std::mem::take(&mut self.codes));
        let words =
            trace.beats.iter().chain(&trace.status).map(|beat| Word::of_fields(&beat.map(i64::from), COMPONENT));
        self.beats = trace.beat_cycles.into_iter().zip(words).collect();
    }
}

impl Reference for Frames {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let leaves = self.beats.front().filter(|(cycles, _)| *cycles == 0).map(|(_, word)| *word);
        let receives = self.begun && self.beats.is_empty() && inputs[0].number() == 0;
        vec![
            receives.then(|| Word::from(true)),
            self.begun.then(|| Word::from(leaves.is_some())),
            leaves,
            leaves.map(|_| Word::from(self.beats.len() == 1)),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, valid] = [0, 2].map(|k| inputs[k].number() == 1);
        if self.beats.front().is_some_and(|(cycles, _)| *cycles == 0) {
            self.beats.pop_front();
        }
        if rst {
            (self.begun, self.codes, self.beats) = (true, Vec::new(), VecDeque::new());
        } else if valid {
            self.codes.push(inputs[1].signed(0, self.code_bits()) as i32);
            if self.codes.len() == self.model.scene.sensor.taxels() {
                self.compute();
            }
        }
        self.beats.iter_mut().for_each(|(cycles, _)| *cycles -= 1);
    }
}

/// An engine as the subject of a test, its ports in the order of [`Frames`].
macro_rules! engine_subject {
    ($engine:expr, $changes:expr) => {
        $crate::language::testbench::subject_of!(
            $engine,
            $changes,
            inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
            outputs [s_axis_tready, m_axis_tvalid, m_axis_tdata, m_axis_tlast],
        )
    };
}
pub(crate) use engine_subject;

/// Random frames with gaps, each after the last beat of the one before; some are cut off by a reset, while they arrive or
/// are computed.
pub(crate) fn stimulus(model: &Model, frames: usize) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(16);
    let (mut reference, bits) = (Frames::new(model.clone()), model.formats().code_bits as usize);
    let taxels = model.scene.sensor.taxels();
    let mut stimulus: Vec<Vec<Word>> = Vec::new();
    let mut put = |reference: &mut Frames, rst: bool, code: Option<i64>, last: bool| {
        let word = Word::of_fields(&[code.unwrap_or_default()], bits);
        let inputs = vec![rst.into(), word, code.is_some().into(), last.into(), true.into()];
        reference.clock(&inputs);
        stimulus.push(inputs);
    };
    (0..4).for_each(|_| put(&mut reference, true, None, false));
    for frame in 0..frames {
        let cut = (frame % 3 == 1).then(|| random.usize(1..20 * taxels));
        let small = random.usize(..bits);
        let (mut sent, mut cycles) = (0, 0);
        while (sent < taxels || !reference.beats.is_empty()) && cut.is_none_or(|cut| cycles < cut) {
            let code = random_word(&mut random, bits).signed(0, bits) >> small;
            let code = (sent < taxels && random.u8(..4) > 0).then_some(code);
            put(&mut reference, false, code, sent + 1 == taxels);
            sent += usize::from(code.is_some());
            cycles += 1;
        }
        if cut.is_some() {
            (0..4).for_each(|_| put(&mut reference, true, None, false));
        }
    }
    stimulus
}

#[test]
fn beats_leave_in_the_cycles_of_the_model() {
    let several = "[search]\nmu_max = 0.3\n[partition]\nrows = 1\ncols = 2\n";
    for (rows, cols, more) in [(4, 4, "[search]\nmu_max = 0.3\n"), (2, 4, several)] {
        let model = model(rows, cols, more);
        let subject = |changes: &[Change]| engine_subject!(Engine::new(&model), changes);
        let defects = [Change::value("", "search__enabled", |k| k.constant(1, 0))];
        check_with_defects(subject, &stimulus(&model, 7), || Frames::new(model.clone()), &defects);
    }
}

#[test]
fn with_a_network_beats_leave_in_the_cycles_of_the_model() {
    let narrow =
        "mu_max = 0.05\n[fixed]\nlanes = 4\ninput_bits = 18\ndata_bits = 12\ncoef_bits = 12\ninverse_bits = 20\n";
    for (cols, hidden, more) in [(5, vec![13, 7], "mu_max = 0.3\n"), (4, vec![5], narrow)] {
        let model = learned(4, cols, &hidden, more);
        assert!(model.has_network() && !model.searches());
        let subject = |changes: &[Change]| engine_subject!(Engine::new(&model), changes);
        let defects = [
            Change::value("", "estimate__enabled", |k| k.constant(1, 0)),
            Change::value("", "pass__vector_valid", |k| k.constant(1, 0)),
        ];
        check_with_defects(subject, &stimulus(&model, 7), || Frames::new(model.clone()), &defects);
    }
}

#[test]
fn contacts_leave_in_the_cycles_of_the_model() {
    let contacts = "mu_max = 0.3\n[partition]\ncase = \"contacts\"\nmax_contacts = 3\n";
    let narrow = "mu_max = 0.05\n[input]\ndead = [[1, 2]]\n[partition]\ncase = \"contacts\"\n[fixed]\nlanes = 4\n\
                  input_bits = 18\ndata_bits = 12\ncoef_bits = 12\ninverse_bits = 20\n";
    let records = &format!("{contacts}[output]\nforces = \"resultants\"\n");
    let scenes = [(4, 5, vec![7], contacts), (3, 4, vec![5, 4], narrow), (4, 5, vec![7], records)];
    for (rows, cols, hidden, more) in variants(&scenes, 1) {
        let model = learned(*rows, *cols, hidden, more);
        let subject = |changes: &[Change]| engine_subject!(Engine::new(&model), changes);
        let defects = [
            Change::value("", "forces__labels", |k| k.constant(1, 0)),
            Change::value("", "estimate__enabled", |k| k.constant(1, 0)),
            Change::value("", "shear__labels", |k| k.constant(1, 0)),
            Change::value("", "operand_source__mask", |k| k.constant(1, 0)),
        ];
        check_with_defects(subject, &stimulus(&model, 7), || Frames::new(model.clone()), &defects);
    }
}

/// Scenes with and without each stage, of both engines; a case chosen per frame, sums, tables, several subarrays.
#[test]
fn no_block_of_any_scene_is_of_wires_alone() {
    let contacts = "mu_max = 0.3\n[partition]\ncase = \"contacts\"\nmax_contacts = 3\n";
    let plain = [
        "",
        "[search]\nmu_max = 0.0\n",
        "[input]\naverage = 1\n[output]\nforces = \"resultants\"\n",
        "[partition]\nrows = 2\ncols = 2\n",
        "[input]\nfull_scale_MPa = 1.0\ndead = [[1, 2]]\n[hardware]\ntables = \"writable\"\n",
        "[hardware]\nboard = \"icebreaker\"\n",
    ];
    let models = plain.map(|more| model(4, 4, more));
    let learned = [learned(4, 5, &[7], "mu_max = 0.3\n"), learned(4, 5, &[7], contacts)];
    for model in models.iter().chain(&learned) {
        for (path, kernel) in design(model).unwrap().kernels() {
            assert!(!kernel.is_wires(), "{path}");
        }
    }
}
