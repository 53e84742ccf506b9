//! Experiment `reset`: resets at every cycle of a frame.

use super::testbench::{Burst, Testbench};

/// Sends frames back to back at full speed and resets the device at a cycle of the first frame, between its first code
/// and its last beat; then a frame alone must be right and in time. Repeats this for every cycle of the frame, or for
/// evenly spaced ones where `cycles` of simulation do not suffice.
pub(super) fn resets(bench: &mut Testbench, random: &mut fastrand::Rng, cycles: u64) {
    let total = bench.sample(0).cycles.total;
    // A run takes half a frame on average up to the reset, mostly a short reset, and a whole frame after it.
    let affordable = (cycles / (2 * total)).clamp(1, total);
    bench.outcome().possible_reset_cycles = total;
    for index in 0..affordable {
        if !bench.can_continue() {
            return;
        }
        let offset = index * total / affordable;
        let end = bench.cycle() + offset;
        // The reset's cycle counts from the start of sample 0; random samples follow it.
        let mut burst = Burst::whole(bench.sample(0), 0);
        while bench.send_until(&burst, end) {
            burst = bench.any(random);
        }
        // Logarithmic distribution: 1, 2 … 3, 4 … 7, … cycles are equally likely.
        let octave = 1u64 << random.u32(..=total.ilog2());
        let held = (octave + random.u64(..octave)).min(total);
        bench.reset(held, random);
        let outcome = bench.outcome();
        outcome.resets += 1;
        outcome.longest_reset = outcome.longest_reset.max(held);
        bench.send_alone(&bench.any(random));
    }
}
