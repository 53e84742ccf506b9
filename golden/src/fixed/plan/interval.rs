//! Frame interval: cycles from one frame to the next where frames follow one another without a gap, every subarray is
//! searched and the receiver is always ready.
//!
//! The longest of these decides, with T beats per frame and Q quads per subarray:
//! ```text
//! input    T, from the last quad that fold has read
//! pass     the passes of all subarrays, waiting where the search is busy
//! search   one subarray after the other
//! frame    all of these, one after the other, where block RAM is too short for frames that overlap
//! send     T and the status beats; before a frame of several subarrays is searched, or its values leave a whole array
//! ```
//! The timing follows the hardware cycle by cycle; the co-simulation compares.

use super::contents::{CasePlan, Plan};
use super::cycles::{forces, passes, search, ACCEPT, FOLDED, NEXT, SEND};
use super::serial;
use crate::board::EngineKind;

/// Cycles from the hand-over of a frame's last subarray, or from the end of the last frame, to the next frame.
const BEGIN: u64 = 2;
/// Frames after which the interval no longer changes.
const SETTLED: usize = 8;

/// Cycles from one frame's last output beat to that of the next, both solved by `case`.
pub fn frame_interval(plan: &Plan, case: &CasePlan) -> u64 {
    match plan.board.engine {
        EngineKind::Serial => serial::frame_interval(&case.formats, beats(plan, case)),
        EngineKind::Parallel => parallel(plan, case),
    }
}

/// Beats that the force stage sends for a frame; sums of forces are formed behind it.
fn beats(plan: &Plan, case: &CasePlan) -> u64 {
    (plan.scene.sensor.taxels() + case.status_beats()) as u64
}

fn parallel(plan: &Plan, case: &CasePlan) -> u64 {
    let taxels = (plan.scene.sensor.taxels() as u64) << plan.prepare.average;
    let (passes, search) = (passes(case), search(plan, case, true));
    let (quads, parts) = (case.formats.quads as u64, case.parts.len());
    let early = if plan.searches() { quads } else { 0 };
    // When the search ended, the last frame's forces had been sent, the next frame can begin.
    let (mut searched, mut sent, mut begin) = (0, 0, 0);
    let mut interval = 0;
    for _ in 0..SETTLED {
        let (mut start, mut handed_over) = (begin, 0);
        let mut values = Vec::with_capacity(parts);
        for part in 0..parts {
            // A whole array's values wait for the force memory, the search of several subarrays does.
            let free = if part == 0 && parts > 1 { sent } else { 0 };
            handed_over = (start + passes).max(searched).max(free);
            searched = handed_over + search;
            if part == 0 && parts == 1 {
                searched = searched.max(sent + quads);
            }
            values.push(searched - early);
            if part + 1 < parts {
                start = handed_over + NEXT;
            }
        }
        let before = sent;
        let forces = forces(plan, case, &values).last().map_or(0, |last| last + 1);
        sent = forces + SEND + case.status_beats() as u64;
        interval = sent - before;
        let received = start + quads + FOLDED + taxels + ACCEPT + plan.prepare.latency();
        let passed = if plan.resources.overlaps { handed_over } else { sent };
        begin = received.max(passed + BEGIN);
    }
    interval
}
