//! Frame interval: cycles from one frame to the next where frames follow one another without a gap, every subarray is
//! searched and the receiver is always ready.
//!
//! The longest of these decides, with T taxels, Q quads per subarray, S steps of a sweep and blocks of 2^k frames, one frame
//! where the mean slides:
//! ```text
//! input    2^k T, or T from the last quad that fold has read; with an adaptive mean until the window of the frame has left, 2 T and more
//! pass     the passes of all subarrays, waiting where the search is busy; with several rows of subarrays they begin with
//!          the first row, and the first subarray waits for the rest of the frame
//! search   one subarray after the other
//! frame    all of these, one after the other, where block RAM is too short for frames that overlap
//! send     T and the status beats; the first search of several subarrays waits for it, of one only the last sweep
//! ```
//! The timing follows the hardware cycle by cycle; the co-simulation compares.

use super::contact_cycles::{ContactCycles, ContactTiming};
use super::contents::{CasePlan, Plan};
use super::cycles::{early_values, forces, passes, search, split_latency, Cycles, ACCEPT, FOLDED, LABELS, NEXT, SEND};
use super::serial;
use crate::fixed::stages::{choose, load, resultants};
use crate::spec::board::EngineKind;

/// Cycles from the hand-over of a frame's last subarray, or from the end of the last frame, to the next frame.
const BEGIN: u64 = 2;
/// Cycles from a frame's last output beat until an image rests, and from its last byte until a code is taken, together.
const IMAGE: u64 = 4;
/// Frames after which the interval no longer changes.
const SETTLED: usize = 8;

/// Cycles from one frame's last output beat to that of the next, both solved by `case`.
pub fn frame_interval(plan: &Plan, case: &CasePlan) -> u64 {
    match plan.board.engine {
        EngineKind::Serial => {
            let beats = plan.scene.sensor.taxels() + case.status_beats();
            serial::frame_interval(&case.formats, beats as u64)
        }
        EngineKind::Parallel => {
            parallel(plan, case, &[ContactTiming::longest(plan); SETTLED]).last().copied().unwrap_or_default()
        }
    }
}

/// Cycles from the first input beat to the last output beat of frames of all arrays that come at once, one of each, to an idle engine
/// whose receiver never waits: what the last of them waits at most for its result. Of one array the longest frame.
pub fn longest_wait(plan: &Plan) -> u64 {
    (plan.scene.hardware.arrays as u64 - 1) * slowest_interval(plan) + Cycles::longest(plan).total
}

/// As [`longest_wait`], with the image of the tables of one array anywhere among the frames, whose bytes come as they are taken, one in
/// two cycles: it waits for the frames before it, and those behind it for its end. `None` where tables are not written.
pub fn longest_wait_with_image(plan: &Plan) -> Option<u64> {
    let image = load::REST + IMAGE + 2 * plan.tables()?.image_bytes() as u64;
    let (arrays, total) = (plan.scene.hardware.arrays as u64, Cycles::longest(plan).total);
    // At worst between two frames, of which neither overlaps the other.
    Some(image + if arrays > 1 { (arrays - 2) * slowest_interval(plan) + 2 * total } else { total })
}

/// The frame interval of the case that has the longest.
fn slowest_interval(plan: &Plan) -> u64 {
    plan.cases().iter().map(|case| frame_interval(plan, case)).max().unwrap_or(0)
}

/// The longest of the intervals before the third and each later one of frames that follow one another, each with the contacts
/// of its timing; `None` with fewer than three.
pub fn longest_interval(plan: &Plan, timings: &[ContactTiming]) -> Option<u64> {
    let timings: Vec<Option<ContactTiming>> = timings.iter().copied().map(Some).collect();
    parallel(plan, plan.first(), &timings).into_iter().skip(2).max()
}

/// Cycles between the last output beats of each frame and the one before, from an idle engine on.
fn parallel(plan: &Plan, case: &CasePlan, timings: &[Option<ContactTiming>]) -> Vec<u64> {
    let taxels = plan.scene.sensor.taxels() as u64;
    let search = search(plan, case, true);
    let (quads, parts) = (case.formats.quads as u64, case.parts.len());
    let early = early_values(plan, case);
    // From the end of a send to the end of the values of a search whose last sweep waited for it.
    let last_sweep = case.formats.sweep_steps(case.formats.quads) as u64 + split_latency(&case.formats);
    // Where the case is chosen per frame, a whole array waits as several subarrays do.
    let whole = plan.cases().iter().all(|case| case.parts.len() == 1);
    let choice = if plan.chooses() { choose::LATENCY } else { 0 };
    // Sums of forces leave between the last force and the status.
    let sums = match plan.sends_resultants() {
        true => resultants::LATENCY - 1 + plan.force_beats() as u64,
        false => 0,
    };
    let labels = plan.label_beats() as u64 * LABELS;
    // When the last frame's last code arrived, its search ended, its forces had been sent, the next frame can begin.
    let (mut received, mut searched, mut sent, mut begin) = (0, 0, 0, 0);
    // When a frame whose passes began with its first row of subarrays is complete.
    let after_begin = plan.codes_after_begin() as u64;
    let mut complete = after_begin;
    let mut intervals = Vec::with_capacity(timings.len());
    for &timing in timings {
        let passes = passes(plan, case, timing);
        let contacts = plan.by_contact.as_ref().zip(timing).map(|(own, timing)| ContactCycles::new(case, own, timing));
        let (mut start, mut handed_over) = (begin, 0);
        let mut values = Vec::with_capacity(parts);
        for part in 0..parts {
            // A whole array's values wait for the force memory, the search of several subarrays does.
            let free = if part == 0 && !whole { sent } else { 0 };
            let whole_frame = if part == 0 { complete } else { 0 };
            handed_over = (start + passes).max(searched).max(free).max(whole_frame);
            searched = handed_over + search;
            if whole {
                searched = searched.max(sent + last_sweep);
            }
            values.push(searched - early);
            if part + 1 < parts {
                start = handed_over + NEXT;
            }
        }
        let before = sent;
        let forces = forces(plan, case, &values).last().map_or(0, |last| last + 1);
        sent = forces + SEND + sums + labels + plan.status_beats_of(case) as u64;
        intervals.push(sent - before);
        // Codes that are averaged are taken while the frame buffer is full, the sums are not.
        // Windows are read from the frame buffer until the μ of the last contact is known.
        let free = start + contacts.map_or(quads + FOLDED, |contacts| contacts.free + 1);
        let arriving = taxels * plan.scene.input.frames_per_result() as u64 + plan.prepare.occupied();
        received = (received + arriving).max(free + taxels - 1);
        let passed = if plan.resources.overlaps { handed_over } else { sent };
        complete = received + ACCEPT;
        begin = (complete + choice - after_begin).max(passed + BEGIN);
    }
    intervals
}
