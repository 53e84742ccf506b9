//! Resets at the cycles of a frame.

use super::line::{Burst, Line};

/// While one frame after the other is taken at full speed, a reset falls on a cycle of the first one, from its first code
/// to its last beat; then a frame alone must be right and in time. All those cycles where `cycles` of simulation
/// allow it, else as many, evenly spaced.
pub(super) fn resets(line: &mut Line, random: &mut fastrand::Rng, cycles: u64) {
    let total = line.sample(0).cycles.total;
    // Up to the reset half a frame in the mean, the reset short in most, and a whole frame after it.
    let affordable = (cycles / (2 * total)).clamp(1, total);
    line.outcome().reset_places = total;
    for index in 0..affordable {
        if !line.runs() {
            return;
        }
        let place = index * total / affordable;
        let end = line.cycle() + place;
        // The first frame is the one whose cycles are counted; the others come as they may.
        let mut sample = 0;
        while line.send_until(&Burst::whole(line.sample(sample), sample), end) {
            sample = random.usize(..line.samples());
        }
        // As often short as long: 1, 2 … 3, 4 … 7 cycles are alike likely.
        let octave = 1u64 << random.u32(..=total.ilog2());
        let held = (octave + random.u64(..octave)).min(total);
        line.reset(held, random);
        let outcome = line.outcome();
        outcome.resets += 1;
        outcome.longest_reset = outcome.longest_reset.max(held);
        let after = random.usize(..line.samples());
        line.send_alone(&Burst::whole(line.sample(after), after));
    }
}
