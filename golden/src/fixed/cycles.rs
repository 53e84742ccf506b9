//! Cycle counts of the parallel engine (the serial one's are in [`serial`]) at full speed: input one beat a cycle, output always ready.
//!
//! The hardware's schedule replayed on paper: each stage's latency is a named constant here and a pipeline there, and the co-simulation
//! asserts that both agree to the cycle. With Q quads, G groups of rows, K rows in the last group:
//! ```text
//! fold     Q + 6                                from the last input beat to the first product
//! pass     the kept columns of each product, at most Q, waiting until a step's operand has been finished
//! rescale  v_00 is replayed once its exponent is known: Q more
//! search   7 coarse sweeps of Q, at least (Q + 19)/2; the eighth and 7 halvings of Q + 22; one of Q + 7
//!          (the last alone when nothing is searched)
//! next     1 from a subarray's completion to the passes of the one after it, which go on while it is searched
//! choose   2, where the case is chosen per frame
//! send     begins with the last subarray's first value: 9 to the first beat, then one beat a cycle
//! ```

use serde::Serialize;

use super::choose;
use super::formats::HALVINGS;
use super::model::Model;
use super::schedule::schedule;
use super::search::COARSE_CENTRES;
use super::serial;
use crate::board::EngineKind;

/// From the last input beat to the cycle in which the frame starts.
pub const ACCEPT: u64 = 3;
/// `fold` beyond its Q quads: start, frame buffer, normalise, butterfly, memory.
const FOLD: u64 = 6;
/// From a product's issue to the first row of its accumulators: addresses 1, memories 2, selection 1, lanes 5.
const LANES: u64 = 9;
/// More of them where columns are left out: the list of columns is a memory of its own.
const COLUMNS: u64 = 2;
/// From a row to its operand being readable: rescaler, operand memory.
const OPERAND: u64 = 5;
/// From the last raw row of v_00 to its first replayed row.
const REPLAY: u64 = 3;
/// From the last row to the search's start: rescaler, unfold, memory.
const UNFOLD: u64 = 6;
/// From a sweep's beginning to its judgement, beyond its Q quads: memory 2, Taylor 4, candidates 2, score 6, judge 6.
const SELECTION_LATENCY: u64 = 20;
/// From a subarray's completion to the start of its search.
const HAND_OVER: u64 = 2;
/// From the search's start, or a judgement that is waited for, to the next sweep: the move, where it leads, the sweep.
pub const SET_UP: u64 = 3;
/// Quads that a judged sweep lasts at least: its sums are weighed meanwhile.
pub const SHORTEST_SWEEP: u64 = 4;
/// The last sweep beyond its Q quads.
const LAST_SWEEP: u64 = 7;
/// From a subarray's values to their sending, where nothing is searched.
const UNSEARCHED: u64 = 3;
/// From a subarray's completion, once the search is free, to the start of the next one's passes.
const NEXT: u64 = 1;
/// From the last subarray's first value, which stands Q cycles before their end, to the first beat on the output.
const SEND: u64 = 13;

/// How long a frame takes, in clock cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Cycles {
    /// From the last input beat to the first output beat.
    pub first_output: u64,
    /// From the last input beat to the last output beat, status included.
    pub latency: u64,
    /// From the first input beat to the last output beat, both included.
    pub total: u64,
    /// From one output beat to the next.
    pub interval: u64,
}

/// From a coarse sweep of so many quads to the next: a sweep is judged before the next but one, which may write over its
/// source.
pub fn coarse_period(quads: u64) -> u64 {
    let quads = quads.max(SHORTEST_SWEEP);
    quads.max((quads + SELECTION_LATENCY).div_ceil(2))
}

impl Cycles {
    /// The counts of a frame of `model` with every subarray searched, the longest there are.
    pub fn longest(model: &Model) -> Self {
        Cycles::of(model, &vec![true; model.parts.len()])
    }

    /// The counts of a frame of `model`, of a scene of several cases a frame of case 0; `searched` says of each
    /// subarray whether it is searched.
    pub fn of(model: &Model, searched: &[bool]) -> Self {
        if model.board.engine == EngineKind::Serial {
            return serial::cycles(model, searched.contains(&true));
        }
        let taxels = model.scene.sensor.taxels() as u64;
        let quads = model.formats.quads as u64;
        let chained = COARSE_CENTRES.len() as u64 - 1;
        let awaited = 1 + u64::from(HALVINGS);
        let sweeps =
            chained * coarse_period(quads) + awaited * (quads.max(SHORTEST_SWEEP) + SELECTION_LATENCY + SET_UP);
        let search = |&searching: &bool| match model.searches() {
            true => HAND_OVER + SET_UP + if searching { sweeps } else { 0 } + quads + LAST_SWEEP,
            false => UNSEARCHED,
        };
        // A subarray is handed over when it is complete and the one before has been searched.
        let (mut complete, mut searched_at) = (0, 0);
        for searching in searched {
            complete += passes(model);
            let handed_over = complete.max(searched_at);
            searched_at = handed_over + search(searching);
            complete = handed_over + NEXT;
        }
        // Out of a search the last subarray's values leave while they come.
        let early = if model.searches() { quads } else { 0 };
        // Sums leave once the last force is in them.
        let choice = if model.chooses() { choose::LATENCY } else { 0 };
        let first_output =
            choice + model.prepare.latency() + ACCEPT + searched_at - early + SEND + model.resultants_delay();
        let latency = first_output + (model.force_beats() + model.status_beats()) as u64 - 1;
        Cycles { first_output, latency, total: (taxels << model.prepare.average) + latency, interval: 1 }
    }
}

/// From a subarray's start to its last coefficient in the search memory.
fn passes(model: &Model) -> u64 {
    timeline(model).last_row + UNFOLD
}

/// Share of the multiplications that the lanes do of those they could, from a subarray's first product to its last.
pub fn lane_utilisation(model: &Model) -> f64 {
    if model.board.engine == EngineKind::Serial {
        return serial::lane_utilisation(model);
    }
    let Timeline { first_issue, last_issue, products, .. } = timeline(model);
    let lanes = 4 * model.formats.lanes_per_parity as u64;
    products as f64 / ((last_issue + 1 - first_issue) * lanes) as f64
}

/// When a subarray's products are issued, in cycles from its start.
struct Timeline {
    first_issue: u64,
    last_issue: u64,
    /// Multiplications by a row of the subarray; the last group of rows may leave lanes without one.
    products: u64,
    /// When the last row leaves the lanes.
    last_row: u64,
}

fn timeline(model: &Model) -> Timeline {
    let (formats, storage) = (&model.formats, &model.storage);
    let quads = formats.quads as u64;
    let last_rows = quads - (formats.groups as u64 - 1) * formats.lanes_per_parity as u64;
    let lanes = LANES + if storage.listed { COLUMNS } else { 0 };
    let first_issue = quads + FOLD;
    let (mut now, mut products_done) = (first_issue, 0);
    let mut finished: Vec<u64> = Vec::new();
    let mut last_row = 0;
    for (k, products) in schedule(formats).iter().enumerate() {
        for group in 0..formats.groups {
            for product in products {
                if k > 0 {
                    now = now.max(finished[product.operand_index()]);
                }
                let columns = storage.columns_of(product.matrix, group).len() as u64;
                let rows = if group + 1 == formats.groups { last_rows } else { formats.lanes_per_parity as u64 };
                products_done += 4 * columns * rows;
                now += columns;
            }
        }
        last_row = now - 1 + lanes + last_rows - 1;
        if k == 0 {
            last_row += REPLAY - 1 + quads;
        }
        finished.push(last_row + OPERAND);
    }
    Timeline { first_issue, last_issue: now - 1, products: products_done, last_row }
}
