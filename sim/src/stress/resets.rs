//! Resets at the cycles of a frame.

use super::testbench::{Burst, Testbench};

/// While one frame after the other is taken at full speed, a reset falls on a cycle of the first one, from its first code
/// to its last beat; then a frame alone must be right and in time. All those cycles where `cycles` of simulation
/// allow it, else as many, evenly spaced.
pub(super) fn resets(bench: &mut Testbench, random: &mut fastrand::Rng, cycles: u64) {
    let total = bench.sample(0).cycles.total;
    // Up to the reset half a frame in the mean, the reset short in most, and a whole frame after it.
    let affordable = (cycles / (2 * total)).clamp(1, total);
    bench.outcome().possible_reset_cycles = total;
    for index in 0..affordable {
        if !bench.can_continue() {
            return;
        }
        let offset = index * total / affordable;
        let end = bench.cycle() + offset;
        // The first frame is the one whose cycles are counted; the others come as they may.
        let mut sample = 0;
        while bench.send_until(&Burst::whole(bench.sample(sample), sample), end) {
            sample = random.usize(..bench.sample_count());
        }
        // As often short as long: 1, 2 … 3, 4 … 7 cycles are alike likely.
        let octave = 1u64 << random.u32(..=total.ilog2());
        let held = (octave + random.u64(..octave)).min(total);
        bench.reset(held, random);
        let outcome = bench.outcome();
        outcome.resets += 1;
        outcome.longest_reset = outcome.longest_reset.max(held);
        let after = random.usize(..bench.sample_count());
        bench.send_alone(&Burst::whole(bench.sample(after), after));
    }
}
