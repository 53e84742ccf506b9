//! Run: a frame's codes through all stages, in the order of the hardware.
//!
//! ```text
//! prepare ── receive ── choose ── each subarray of the chosen case ── force ── send
//! ```

use super::contacts::FrameContacts;
use super::model::Model;
use super::plan::contact_cycles::ContactTiming;
use super::plan::cycles::{BeatCycles, Cycles};
use super::stages::choose;
use super::stages::forces::{pulls, Force};
use super::stages::load::Outcome;
use super::stages::prepare::Prepared;
use super::stages::receive::mask;
use super::stages::resultants::{Record, Summed};
use super::stages::search::Best;
use super::stages::send::{labels_to_beats, Status};
use super::subarray::{MuStatus, SubarrayTrace};
use crate::result::flags::{Flag, FlagSet};
use crate::spec::board::EngineKind;
use crate::spec::partition::Subarray;

/// The words that one stage passed on for a frame, in the hardware's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The stage's name, that of the tap in the hardware.
    pub name: &'static str,
    /// Words, each a list of signed fields.
    pub words: Vec<Vec<i64>>,
}

/// Everything the hardware computes for one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trace {
    /// Forces `[fx, fy, fz]` in force LSBs, row-major; with `output.forces = "resultants"` the record of each subarray or label.
    pub beats: Vec<[i32; 3]>,
    /// Status beats, three words each ([`send`](super::stages::send)).
    pub status: Vec<[i32; 3]>,
    /// The words of each stage, in pipeline order.
    pub stages: Vec<Stage>,
    /// Cycle counts of the frame at full speed.
    pub cycles: Cycles,
    /// Cycles from the last input beat to each output beat, status included, at full speed.
    pub beat_cycles: Vec<u64>,
    /// What the cycles depend on where each contact has a μ of its own; else `None`.
    pub timing: Option<ContactTiming>,
}

/// Stages that pass on single words, not quads, in the serial engine.
const SINGLE_WORDS: [&str; 4] = ["normalise", "rescale", "unfold", "forces"];

impl Model {
    /// Computes one reconstruction from its `codes`, `code_bits` wide: 2^average frames, each row-major over the array;
    /// with a sliding mean or a running zero all frames since a reset.
    pub fn run(&self, codes: &[i32]) -> Trace {
        let mut prepared = self.prepare.empty();
        self.add(&mut prepared, codes);
        self.run_prepared(&prepared)
    }

    /// Adds frames of codes to `prepared`, as [`Prepare::add`](super::stages::prepare::Prepare::add) does; every stress is 0
    /// while the tables are not whole.
    pub fn add(&self, prepared: &mut Prepared, codes: &[i32]) {
        self.prepare.add(prepared, codes, self.own().outcome == Outcome::Broken);
    }

    /// Computes one reconstruction from the words of the frame buffer.
    pub fn run_prepared(&self, prepared: &Prepared) -> Trace {
        let codes = &mask(&prepared.words, &self.dead, self.scene.input.unipolar);
        let chosen = self.choose(codes);
        let case = &self.cases()[chosen];
        let sensor = &self.scene.sensor;
        let solve = |part: &Subarray| SubarrayTrace::new(self, case, &part.gather(sensor, codes));
        let solved: Vec<SubarrayTrace> = case.parts.iter().map(solve).collect();
        let searched: Vec<bool> = solved.iter().map(|s| s.condition && self.searches()).collect();
        let timing =
            |contacts: &FrameContacts| ContactTiming { segment: contacts.segment_cycles, contacts: contacts.all.len() };
        let timing = solved.iter().find_map(|solved| solved.contacts.as_ref()).map(timing);
        let sending = BeatCycles::new(self, case, &searched, timing);
        let cycles = Cycles::of_beats(self, &sending);
        let number = if self.chooses() { case.number() } else { 0 };
        let frames = self.scene.input.frames_held(prepared.frames).unwrap_or(0) as u32;
        let window = prepared.adaptive.window as u32;

        let mut forces = vec![Force::default(); sensor.taxels()];
        for (part, solved) in case.parts.iter().zip(&solved) {
            part.scatter(sensor, &solved.forces(case, self.threshold()), &mut forces);
        }
        let contact = forces.iter().any(|f| f.words[2] != 0);
        let negative = self.push_limit.is_some_and(|push| pulls(&forces, push));
        let force_saturations = forces.iter().map(|f| f.saturations).sum();
        let beats_of = |s: &SubarrayTrace, mu: MuStatus| {
            let status = Status {
                position_x: mu.position[0],
                position_y: mu.position[1],
                condition: mu.condition,
                found: mu.score.is_some(),
                framing: false,
                case: number,
                frames,
                window,
                raised: prepared.raised
                    | FlagSet::raised([
                        (Flag::NoContact, !contact),
                        (Flag::TooManyContacts, mu.more_contacts),
                        (Flag::ScoreLow, mu.score.zip(self.score_limit).is_some_and(|(score, limit)| score > limit)),
                        (Flag::NegativePressure, negative),
                        (Flag::TablesIncomplete, self.own().outcome == Outcome::Broken),
                        (Flag::TablesRefused, self.own().outcome != Outcome::Whole),
                        (Flag::ZeroLimit, prepared.drift.was_limited() && self.own().outcome != Outcome::Broken),
                    ]),
                score: mu.score.unwrap_or(0),
                rescale: s.rescale,
                normalise: s.normalise,
                tables_version: self.own().version.into(),
                rescale_saturations: s.saturations,
                force_saturations,
                cycles: sending.counted as u32,
            };
            status.beats()
        };
        let most = self.scene.partition.max_contacts;
        let status = solved.iter().flat_map(|s| s.mu_statuses(most).into_iter().flat_map(|mu| beats_of(s, mu)));
        let status = status.collect();
        let labels: Vec<usize> =
            solved.iter().filter_map(|s| s.contacts.as_ref()).flat_map(|c| c.labels.iter().copied()).collect();
        let record = |summed, index: usize| match summed {
            Summed::Subarray => Record::of(sensor, case.parts[index].indices(sensor), &forces),
            Summed::Label => Record::of(sensor, (0..labels.len()).filter(|&taxel| labels[taxel] == index), &forces),
        };
        let choice = if self.chooses() { choose::LATENCY } else { 0 };
        Trace {
            beats: match self.summed() {
                None => forces.iter().map(|f| f.words).chain(labels_to_beats(&labels)).collect(),
                Some(summed) => (0..self.records()).flat_map(|k| record(summed, k).beats(summed)).collect(),
            },
            status,
            stages: self.streams(codes, chosen, &solved),
            cycles: cycles.after_choice(self),
            beat_cycles: sending.beats.into_iter().map(|beat| beat + choice).collect(),
            timing,
        }
    }

    /// The words of each stage that the engine has.
    fn streams(&self, codes: &[i32], chosen: usize, solved: &[SubarrayTrace]) -> Vec<Stage> {
        let quads = |name, stream: fn(&SubarrayTrace) -> &[[i64; 4]]| Stage {
            name,
            words: solved.iter().flat_map(stream).map(|quad| quad.to_vec()).collect(),
        };
        let sweeps = solved.iter().flat_map(|s| &s.found.sweeps);
        let candidate =
            |b: &Best| vec![i64::from(b.position[0]), i64::from(b.position[1]), b.score, i64::from(b.taken)];
        let mut stages = vec![
            Stage { name: "receive", words: codes.iter().map(|&code| vec![i64::from(code)]).collect() },
            Stage { name: "choose", words: vec![vec![chosen as i64]] },
            quads("normalise", |s| &s.streams.normalised),
            quads("fold", |s| &s.streams.folded),
            quads("pass", |s| &s.streams.passed),
            quads("segment", |s| &s.streams.segmented),
            quads("window", |s| &s.streams.windows),
            quads("estimate", |s| &s.streams.estimated),
            quads("shear", |s| &s.streams.sheared),
            quads("rescale", |s| &s.streams.rescaled),
            quads("relax", |s| &s.streams.relaxed),
            quads("unfold", |s| &s.streams.unfolded),
            Stage { name: "search", words: sweeps.map(candidate).collect() },
            quads("forces", |s| &s.found.values),
        ];
        split_values(&mut stages, self.formats().search_width);
        stages.retain(|stage| match stage.name {
            "choose" => self.chooses(),
            "search" => self.searches() || self.board.engine == EngineKind::Serial,
            "estimate" | "relax" => self.has_network(),
            "segment" | "window" | "shear" => self.by_contact.is_some(),
            _ => true,
        });
        as_engine_streams(self.board.engine, stages)
    }
}

/// The values of stage `forces` as a search of `width` taxels per cycle passes them on.
fn split_values(stages: &mut [Stage], width: usize) {
    for stage in stages.iter_mut().filter(|stage| stage.name == "forces") {
        stage.words = stage.words.iter().flat_map(|quad| quad.chunks(width).map(<[i64]>::to_vec)).collect();
    }
}

/// The stages as the board's engine passes them on: the serial engine's single shifter passes on words, not quads.
fn as_engine_streams(engine: EngineKind, mut stages: Vec<Stage>) -> Vec<Stage> {
    if engine == EngineKind::Serial {
        for stage in stages.iter_mut().filter(|stage| SINGLE_WORDS.contains(&stage.name)) {
            stage.words = stage.words.iter().flatten().map(|&word| vec![word]).collect();
        }
    }
    stages
}
