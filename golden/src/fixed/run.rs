//! Run: a frame's codes through all stages, in the order of the hardware.
//!
//! ```text
//! prepare ── receive ── choose ── each subarray of the chosen case ── force ── send
//! ```

use super::contacts::Contacts;
use super::model::Model;
use super::plan::cycles::{BeatCycles, Cycles};
use super::stages::choose;
use super::stages::forces::Force;
use super::stages::prepare::Prepared;
use super::stages::receive::mask;
use super::stages::resultants::{self, sums};
use super::stages::search::Best;
use super::stages::send::{
    labels_to_beats, ln_sigma_word, Status, CASE_SHIFT, FLAG_CONDITION, FLAG_FOUND, FLAG_MORE_CONTACTS,
    FLAG_NO_CONTACT, FRAMES_SHIFT,
};
use super::subarray::{Streams, SubarrayTrace};
use crate::board::EngineKind;
use crate::partition::Subarray;

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
    /// Forces `[fx, fy, fz]` in force LSBs, row-major; with `output.forces = "resultants"` the sums of each subarray.
    pub beats: Vec<[i32; 3]>,
    /// Status beats, three words each ([`send`](super::stages::send)).
    pub status: Vec<[i32; 3]>,
    /// The words of each stage, in pipeline order.
    pub stages: Vec<Stage>,
    /// Cycle counts of the frame at full speed.
    pub cycles: Cycles,
    /// Cycles from the last input beat to each output beat, status included, at full speed.
    pub beat_cycles: Vec<u64>,
}

/// Stages that pass on single words, not quads, in the serial engine.
const SINGLE_WORDS: [&str; 4] = ["normalise", "rescale", "unfold", "forces"];

impl Model {
    /// Computes one reconstruction from its `codes`, `code_bits` wide: 2^average frames, each row-major over the array;
    /// with a sliding mean all frames since a reset.
    pub fn run(&self, codes: &[i32]) -> Trace {
        self.run_prepared(&self.prepare.run(codes))
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
        let cycles = Cycles::of_case(self, case, &searched);
        let sending = BeatCycles::new(self, case, &searched);
        let number = if self.chooses() { case.number() } else { 0 };
        let frames = self.scene.input.frames_held(prepared.frames).unwrap_or(0) as u32;

        let mut forces = vec![Force::default(); sensor.taxels()];
        for (part, solved) in case.parts.iter().zip(&solved) {
            part.scatter(sensor, &solved.forces(case, self.threshold), &mut forces);
        }
        let contact = forces.iter().any(|f| f.words[2] != 0);
        let force_saturations = forces.iter().map(|f| f.saturations).sum();
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let common = |s: &SubarrayTrace| Status {
            flags: flag(!contact, FLAG_NO_CONTACT) | number << CASE_SHIFT | frames << FRAMES_SHIFT,
            rescale: s.rescale,
            normalise: s.normalise,
            rescale_saturations: s.saturations,
            force_saturations,
            cycles: sending.counted as u32,
            ..Status::default()
        };
        let of = |s: &SubarrayTrace, position: [i32; 2], condition: bool, score: Option<i32>| Status {
            position,
            flags: common(s).flags | flag(condition, FLAG_CONDITION) | flag(score.is_some(), FLAG_FOUND),
            score: score.unwrap_or(0),
            ..common(s)
        };
        let of_contact = |s: &SubarrayTrace, contacts: &Contacts, slot: usize| {
            let own = contacts.all.get(slot).map_or_else(
                || common(s),
                |contact| {
                    let score = contact.condition.then(|| ln_sigma_word(contact.ln_sigma));
                    of(s, contact.position, contact.condition, score)
                },
            );
            Status { flags: own.flags | flag(contacts.overflow, FLAG_MORE_CONTACTS), ..own }
        };
        let all_of = |s: &SubarrayTrace| -> Vec<Status> {
            match &s.contacts {
                Some(contacts) => {
                    (0..self.scene.partition.max_contacts).map(|slot| of_contact(s, contacts, slot)).collect()
                }
                None => vec![of(s, s.found.position, s.condition, s.found.score.map(|score| score as i32))],
            }
        };
        let status = solved.iter().flat_map(all_of).flat_map(|status| status.beats()).collect();
        let labels = solved.iter().filter_map(|s| s.contacts.as_ref()).flat_map(|c| labels_to_beats(&c.labels));
        let quads = |name, stream: fn(&SubarrayTrace) -> &[[i64; 4]]| Stage {
            name,
            words: solved.iter().flat_map(stream).map(|quad| quad.to_vec()).collect(),
        };
        let later = |name, stream: fn(&Streams) -> &[[i64; 4]]| Stage {
            name,
            words: solved.iter().flat_map(|s| stream(&s.streams)).map(|quad| quad.to_vec()).collect(),
        };
        let sweeps = solved.iter().flat_map(|s| &s.found.sweeps);
        let candidate =
            |b: &Best| vec![i64::from(b.position[0]), i64::from(b.position[1]), b.score, i64::from(b.taken)];
        let mut stages = vec![
            Stage { name: "receive", words: codes.iter().map(|&code| vec![i64::from(code)]).collect() },
            Stage { name: "choose", words: vec![vec![chosen as i64]] },
            quads("normalise", |s| &s.normalised),
            quads("fold", |s| &s.folded),
            later("pass", |s| &s.passed),
            later("segment", |s| &s.segmented),
            later("window", |s| &s.windows),
            later("estimate", |s| &s.estimated),
            later("shear", |s| &s.sheared),
            later("rescale", |s| &s.rescaled),
            later("relax", |s| &s.relaxed),
            later("unfold", |s| &s.unfolded),
            Stage { name: "search", words: sweeps.map(candidate).collect() },
            quads("forces", |s| &s.found.values),
        ];
        split_values(&mut stages, self.formats().search_width);
        let choice = if self.chooses() { choose::LATENCY } else { 0 };
        stages.retain(|stage| match stage.name {
            "choose" => self.chooses(),
            "estimate" | "relax" => self.has_network(),
            "segment" | "window" | "shear" => self.by_contact.is_some(),
            "search" => self.by_contact.is_none(),
            _ => true,
        });
        Trace {
            beats: match self.sends_resultants() {
                false => forces.iter().map(|f| f.words).chain(labels).collect(),
                true => case.parts.iter().flat_map(|part| resultants::beats(&sums(sensor, part, &forces))).collect(),
            },
            status,
            stages: as_engine_streams(self.board.engine, stages),
            cycles: cycles.after_choice(self),
            beat_cycles: sending.beats.into_iter().map(|beat| beat + choice).collect(),
        }
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
