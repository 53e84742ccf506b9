//! Cycle counts of the parallel engine at full speed: one input beat per cycle, output always ready. The serial
//! engine's are in [`serial`].
//!
//! The latency of each stage is a named constant here and a pipeline in the hardware; the co-simulation asserts that
//! both agree to the cycle. With Q quads, G groups of rows, K rows in the last group:
//! ```text
//! fold     8                                    from the start of a subarray to the first product: the passes read the
//!          input while it is written, later by as many quads as products with left-out columns are ahead
//! pass     the kept columns of each product, at most Q, waiting until a step's operand has been finished, or, where
//!          it is read as it is written, begun; a pause after each accumulation
//! rescale  v_00 is replayed once its exponent is known: Q more
//! network  after v_00 the columns of each layer and its bias, for each group of rows; the next layer waits for all rows;
//!          steps of relax wait for μ
//! search   with S = 4 Q / W steps for W taxels per cycle, and a cycle more in each latency below for W < 4:
//!          7 coarse sweeps of S, at least (S + 21)/2; the eighth and 7 halvings of S + 24; one of S + 8
//!          (the last alone when nothing is searched)
//! next     1 from a subarray's completion to the passes of the one after it, which go on while it is searched
//! choose   2, where the case is chosen per frame
//! input    of several rows of subarrays the passes begin with the first row; the first subarray is handed over when the
//!          whole frame has arrived
//! send     begins with the first subarray's values: 13 to the first beat, 14 where each contact has a μ, then one beat a
//!          cycle; a beat waits for the first value of its subarray
//! ```

use serde::Serialize;

use super::contact_cycles::{ContactCycles, ContactTiming};
use super::contents::{CasePlan, Plan};
use super::serial;
use super::timeline::{whole, Timeline, RELAX, UNFOLD};
use crate::fixed::stages::choose;
use crate::fixed::stages::search::COARSE_CENTRES;
use crate::fixed::stages::send::LABELS_PER_BEAT;
use crate::fixed::words::formats::{Formats, HALVINGS};
use crate::spec::board::EngineKind;
use crate::spec::quads::Quads;

/// Cycles from the last input beat to the start of the frame.
pub const ACCEPT: u64 = 3;
/// Cycles for the choice of a step's taxels, where a quad takes several.
const SPLIT: u64 = 1;
/// Cycles from the start of a sweep to its best candidate, beyond its steps: memory 3, Taylor shift 4, candidates 2,
/// score 7, comparison 6.
const SELECTION_LATENCY: u64 = 22;
/// Cycles from the completion of a subarray's passes to the start of its search.
const HAND_OVER: u64 = 2;
/// Cycles from the start of the search, or from a best candidate that the next sweep depends on, to the next sweep.
pub const SET_UP: u64 = 3;
/// Shortest sweep that is scored, in steps: its score bias is computed meanwhile.
pub const SHORTEST_SWEEP: u64 = 4;
/// Latency of the last sweep beyond its steps.
const LAST_SWEEP: u64 = 8;
/// Cycles from a subarray's values to the sending of them, where nothing is searched.
const UNSEARCHED: u64 = 3;
/// Cycles from the values of a frame with contacts to the sending of them, beyond one for each contact that there may be: the
/// status of the taxels of no contact, and two until they can be requested.
const CONTACT_STATUS: u64 = 2;
/// Cycles from the last force, or a beat of labels, to the next beat of labels: a label per cycle, and their memory.
pub(super) const LABELS: u64 = LABELS_PER_BEAT as u64 + 5;
/// Cycles from the hand-over of a subarray to the search until the passes of the next one start.
pub(super) const NEXT: u64 = 1;
/// Cycles from the beginning of a subarray's values to the output of a force of it.
pub(super) const SEND: u64 = 15;
/// Cycles from the start of a subarray, beyond its Q quads, until the frame buffer is free.
pub(super) const FOLDED: u64 = 2;

/// Duration of a frame in clock cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Cycles {
    /// Cycles from the last input beat to the first output beat.
    pub first_output: u64,
    /// Cycles from the last input beat to the last output beat, status included.
    pub latency: u64,
    /// Cycles from the first input beat to the last output beat, both included.
    pub total: u64,
    /// Least number of cycles from one output beat to the next.
    pub beat_interval: u64,
}

/// Cycles by which a search of fewer taxels per cycle is later than one of whole quads.
pub fn split_latency(formats: &Formats) -> u64 {
    match formats.search_width {
        Quads::LANES => 0,
        _ => SPLIT,
    }
}

/// Cycles from the start of a coarse sweep over `quads` quads to the start of the next. The best candidate of a sweep
/// is known before the sweep after the next, which may overwrite its source.
pub fn coarse_period(formats: &Formats, quads: usize) -> u64 {
    let steps = (formats.sweep_steps(quads) as u64).max(SHORTEST_SWEEP);
    steps.max((steps + SELECTION_LATENCY + split_latency(formats)).div_ceil(2))
}

/// Cycles from a subarray's first value to the beginning of the values for those that read them row-major: no taxel is
/// read before its value.
pub fn values_delay(case: &CasePlan) -> usize {
    case.layout().row_major_delay(case.formats.search_width)
}

impl Cycles {
    /// The counts of a frame whose subarrays are all searched: the largest counts.
    pub fn longest(plan: &Plan) -> Self {
        Cycles::of(plan, &vec![true; plan.parts().len()])
    }

    /// The counts of a frame; with several cases those of case 0 and of the choice between them. `searched[k]` says
    /// whether subarray k is searched.
    pub fn of(plan: &Plan, searched: &[bool]) -> Self {
        Cycles::of_case(plan, plan.first(), searched).after_choice(plan)
    }

    /// The counts of a frame that `case` solves, all its subarrays searched, without the choice of the case.
    pub fn longest_of_case(plan: &Plan, case: &CasePlan) -> Self {
        Cycles::of_case(plan, case, &vec![true; case.parts.len()])
    }

    /// The counts of a frame that `case` solves, without the choice of the case; `searched[k]` says whether subarray k
    /// is searched; of contacts the largest counts.
    pub fn of_case(plan: &Plan, case: &CasePlan, searched: &[bool]) -> Self {
        Cycles::of_beats(plan, &BeatCycles::new(plan, case, searched, ContactTiming::longest(plan)))
    }

    /// The counts of a frame whose beats leave in these cycles, without the choice of the case.
    pub(in crate::fixed) fn of_beats(plan: &Plan, sending: &BeatCycles) -> Self {
        let codes = (plan.scene.sensor.taxels() * plan.scene.input.frames_per_result()) as u64;
        let beat_interval = if plan.board.engine == EngineKind::Serial { serial::BEAT } else { 1 };
        let [first_output, latency] =
            [sending.beats.first(), sending.beats.last()].map(|beat| beat.copied().unwrap_or(0));
        Cycles { first_output, latency, total: codes + latency, beat_interval }
    }

    /// The counts with those of the choice, where the hardware chooses among several cases.
    pub(in crate::fixed) fn after_choice(mut self, plan: &Plan) -> Self {
        if plan.chooses() {
            for count in [&mut self.first_output, &mut self.latency, &mut self.total] {
                *count += choose::LATENCY;
            }
        }
        self
    }
}

/// When a frame's output beats leave, at full speed, without the choice of the case.
#[derive(Default)]
pub(in crate::fixed) struct BeatCycles {
    /// Cycles that the status states: from the arrival behind `prepare` of the last code with which the passes may begin to
    /// the first force, without those in which the rest of the frame is awaited.
    pub counted: u64,
    /// Cycles from the last input beat to each output beat, status included.
    pub beats: Vec<u64>,
}

impl BeatCycles {
    /// Of a frame that `case` solves; `searched[k]` says whether subarray k is searched, `timing` what was found of contacts.
    pub fn new(plan: &Plan, case: &CasePlan, searched: &[bool], timing: Option<ContactTiming>) -> Self {
        let count = plan.force_beats() + plan.status_beats_of(case);
        if plan.board.engine == EngineKind::Serial {
            let first = serial::first_output(&case.formats, searched.contains(&true));
            let beats = (0..count as u64).map(|beat| first + beat * serial::BEAT).collect();
            return BeatCycles { counted: first - plan.prepare.latency(), beats };
        }
        let after_begin = plan.codes_after_begin() as u64;
        let values_of = |received: u64| values(plan, case, searched, timing, received);
        // The first force is requested with the first value.
        let counted = values_of(0).first().copied().unwrap_or(0) + ACCEPT + SEND;
        let before = plan.prepare.latency();
        // From the last input beat: no force comes before the whole frame has.
        let forces: Vec<u64> = forces(plan, case, &values_of(after_begin))
            .iter()
            .map(|force| before + (force + ACCEPT + SEND - after_begin))
            .collect();
        let last = forces.last().copied().unwrap_or(0);
        let beats = match plan.sends_resultants() {
            // They are sent once the last force has been added.
            true => (last + 1 + plan.resultants_delay() - forces.len() as u64..).take(count).collect(),
            false => {
                let labels = (1..=plan.label_beats() as u64).map(|beat| last + beat * LABELS);
                let sent: Vec<u64> = forces.into_iter().chain(labels).collect();
                let next = sent.last().map_or(0, |beat| beat + 1);
                sent.into_iter().chain(next..).take(count).collect()
            }
        };
        BeatCycles { counted, beats }
    }
}

/// Cycles from the start of a frame to the first value of each subarray, where the frame is complete `received` cycles after
/// what its passes begin with.
fn values(plan: &Plan, case: &CasePlan, searched: &[bool], timing: Option<ContactTiming>, received: u64) -> Vec<u64> {
    let passes = passes(plan, case, timing);
    let early = early_values(plan, case);
    // A subarray is handed to the search when its passes are complete and the search of the one before has ended.
    let (mut complete, mut searched_at) = (0, received);
    let value = |&searching: &bool| {
        complete += passes;
        let handed_over = complete.max(searched_at);
        searched_at = handed_over + search(plan, case, searching);
        complete = handed_over + NEXT;
        searched_at - early
    };
    searched.iter().map(value).collect()
}

/// Cycles from the beginning of a subarray's values to their end: after a search they are sent while they are computed.
pub(super) fn early_values(plan: &Plan, case: &CasePlan) -> u64 {
    match plan.searches() {
        true => (case.formats.sweep_steps(case.formats.quads) - values_delay(case)) as u64,
        false => 0,
    }
}

/// The cycle in which each force is requested, row-major, where the first values of the subarrays come in the cycles
/// `values`: one per cycle, none before the values of its subarray.
pub(super) fn forces(plan: &Plan, case: &CasePlan, values: &[u64]) -> Vec<u64> {
    let (sensor, layout, grid) = (&plan.scene.sensor, case.layout(), case.grid());
    let mut free = 0;
    let taxel = |index: usize| {
        let (row, col) = (index / sensor.cols, index % sensor.cols);
        let begun = values[row / layout.rows * grid.cols + col / layout.cols];
        free = begun.max(free) + 1;
        free - 1
    };
    (0..sensor.taxels()).map(taxel).collect()
}

/// Cycles from the start of a subarray until its passes are complete.
pub(super) fn passes(plan: &Plan, case: &CasePlan, timing: Option<ContactTiming>) -> u64 {
    let CasePlan { formats, storage, .. } = case;
    match (&plan.by_contact, timing) {
        (Some(contacts), Some(timing)) => ContactCycles::new(case, contacts, timing).complete,
        _ => whole(formats, storage).last_row + if formats.has_network() { RELAX } else { 0 } + UNFOLD,
    }
}

/// Cycles from the hand-over of a subarray to the end of its values; `searching`: it is searched.
pub(super) fn search(plan: &Plan, case: &CasePlan, searching: bool) -> u64 {
    let CasePlan { formats, .. } = case;
    let (steps, split) = (formats.sweep_steps(formats.quads) as u64, split_latency(formats));
    let chained = COARSE_CENTRES.len() as u64 - 1;
    let awaited = 1 + u64::from(HALVINGS);
    let scored = steps.max(SHORTEST_SWEEP) + SELECTION_LATENCY + split;
    let sweeps = chained * coarse_period(formats, formats.quads) + awaited * (scored + SET_UP);
    match plan.searches() {
        true => HAND_OVER + SET_UP + if searching { sweeps } else { 0 } + steps + LAST_SWEEP + split,
        // Of contacts the statuses come first.
        false => UNSEARCHED + if plan.contacts() > 0 { CONTACT_STATUS + plan.contacts() as u64 } else { 0 },
    }
}

/// Multiplications done by the lanes, as a fraction of those possible from a subarray's first product to its last; 0 to
/// 1.
pub fn lane_utilisation(plan: &Plan) -> f64 {
    let CasePlan { formats, storage, .. } = plan.first();
    if plan.board.engine == EngineKind::Serial {
        return serial::lane_utilisation(formats);
    }
    let Timeline { first_issue, last_issue, products, .. } = whole(formats, storage);
    let lanes = 4 * formats.lanes_per_parity as u64;
    products as f64 / ((last_issue + 1 - first_issue) * lanes) as f64
}
