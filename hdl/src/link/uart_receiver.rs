//! UART receiver: from the line to bytes.

use super::phase::Phase;
use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// Two registers against metastability, then the majority of three samples. After a falling edge, ten bits are
    /// sampled in their middle: the start bit half a bit later, which must still be low, eight data bits, and the stop
    /// bit. A byte without stop bit is `broken`; the next one starts only after the line has been idle again.
    ///
    /// `valid` and `broken` are pulses of one cycle; `data` is stable until the first data bit of the next byte.
    pub struct UartReceiver {
        /// Bit timing on the line.
        timing: Phase,
    }
    ports UartReceiverPorts {
        clock;
        reset;
        /// The line, high when idle; asynchronous to the clock.
        in line;
        /// The byte received last; valid with `valid`.
        out data: 8;
        /// A byte was received in this cycle.
        out valid;
        /// A byte without stop bit was received in this cycle.
        out broken;
    }
}

/// Bits from start bit to stop bit.
const BITS: u64 = 10;

impl UartReceiver {
    /// For `baud` bit/s at a clock of `clock_hz` Hz.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        UartReceiver { timing: Phase::new(baud, clock_hz) }
    }
}

impl Block for UartReceiver {
    fn build<'k>(&self, k: &'k Builder, io: UartReceiverPorts<Inside<'k>>) {
        let bit = Type::unsigned(1);
        let samples = k.register("samples", Type::unsigned(5));
        let armed = k.state("armed", bit, io.rst, 0);
        let sampled =
            k.register("sampled", bit).comment("Bit, shift and stop are registered to shorten the route to the data.");
        let (shifts, stops) = (k.register("shifts", bit), k.state("stops", bit, io.rst, 0));
        let left = k.state("left", Type::unsigned(4), io.rst, 0);
        let phase = k.register("phase", Type::unsigned(self.timing.fraction));
        let data = io.data.register();
        let (valid, broken) = (io.valid.state(io.rst, 0), io.broken.state(io.rst, 0));

        let [a, b, c] = [4, 3, 2].map(|at| samples.at(at));
        let level = k.wire("level", (a & b) | (a & c) | (b & c));
        let idle = k.wire("idle", left.is(0));
        let sum = k.wire("sum", *phase + k.constant(self.timing.fraction, self.timing.increment));
        let tick = k.wire("tick", !idle & sum.top());
        let (first, last) = (left.is(BITS), left.is(1));
        samples.set(samples.low(4).concat(io.line));
        phase.set(idle.mux(k.constant(self.timing.fraction, self.timing.half), sum.low(self.timing.fraction)));
        sampled.set(level);
        shifts.set(tick & !first & !last);
        stops.set(tick & last);
        k.when(*shifts, || data.set(sampled.concat(data.slice(1, 7))));
        valid.set(*stops & *sampled);
        broken.set(*stops & !*sampled);
        k.when(tick, || left.set((first & level).mux(k.constant(4, 0), left.minus(1))));
        k.when(idle, || armed.set(level));
        k.when(idle & *armed & !level, || left.set(k.constant(4, BITS)));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference, Subject};
    use crate::wire::Word;

    pub const BAUD: u32 = 1_000_000;
    pub const CLOCK_HZ: u32 = 9_300_000;

    /// Samples bits in their middle, with the time in fractions of a bit.
    #[derive(Default)]
    pub struct Sampler {
        line: Vec<bool>,
        armed: bool,
        /// Bits still to come, time since the last one, bits so far.
        frame: Option<(u64, u64, u64)>,
        /// What the last samples said: a byte, or a byte without stop bit; one cycle later on the outputs.
        said: [Option<(bool, u8)>; 2],
        reset: bool,
    }

    impl Reference for Sampler {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let [_, now] = self.said;
            vec![
                now.filter(|(right, _)| *right).map(|(_, byte)| Word::from(u64::from(byte))),
                bit(now.is_some_and(|(right, _)| right)),
                bit(now.is_some_and(|(right, _)| !right)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let timing = Phase::new(BAUD, CLOCK_HZ);
            let before = |cycles: usize| self.line.len().checked_sub(cycles).is_some_and(|at| self.line[at]);
            let level = [3, 4, 5].into_iter().filter(|&cycles| before(cycles)).count() >= 2;
            let idle = self.frame.is_none();
            self.said = [None, self.said[0]];
            self.frame = match self.frame {
                None if self.armed && !level => Some((BITS, timing.half, 0)),
                None => None,
                Some((left, time, bits)) => match (left, time + timing.increment) {
                    (left, time) if time < 2 * timing.half => Some((left, time, bits)),
                    (BITS, _) if level => None,
                    (1, _) => {
                        self.said[0] = Some((level, (bits >> 1) as u8));
                        None
                    }
                    (left, time) => Some((left - 1, time - 2 * timing.half, bits | u64::from(level) << (BITS - left))),
                },
            };
            if idle {
                self.armed = level;
            }
            self.line.push(inputs[1].number() == 1);
            if inputs[0].number() == 1 {
                let line = std::mem::take(&mut self.line);
                *self = Sampler { reset: true, line, ..Sampler::default() };
            }
        }
    }

    /// Bytes with rates up to 2 % off, glitches, missing stop bits, pauses, resets: the inputs reset and line.
    pub fn stimulus(bytes: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(9);
        let mut levels = vec![true; 30];
        for _ in 0..bytes {
            let byte = u64::from(random.u8(..));
            let word = byte << 1 | u64::from(random.u8(..8) > 0) << 9;
            let cycles = f64::from(CLOCK_HZ) / f64::from(BAUD) * (0.98 + 0.04 * random.f64());
            let count = (10.0 * cycles) as usize;
            levels.extend((0..count).map(|at| word >> (at as f64 / cycles) as u64 & 1 == 1));
            levels.extend(vec![true; random.usize(..30)]);
            if random.bool() {
                levels.extend(vec![false; random.usize(1..4)]);
                levels.extend(vec![true; random.usize(10..20)]);
            }
        }
        let noisy = levels.into_iter().enumerate().map(|(cycle, level)| {
            let rst = cycle < 2 || random.u16(..3000) == 0;
            vec![Word::from(rst), Word::from(level ^ (random.u8(..60) == 0))]
        });
        noisy.collect()
    }

    #[test]
    fn bytes_are_sampled_in_the_middle_of_their_bits() {
        let (block, all) = (UartReceiver::new(BAUD, CLOCK_HZ), stimulus(300));
        check(&kernel_of(&block), &all, &mut Sampler::default());
        let outputs = Subject::from(&kernel_of(&block)).simulated(&all);
        let count = |k: usize| outputs.iter().filter(|outputs| outputs[k].number() == 1).count();
        assert!(count(1) > 150 && count(2) > 10, "{} bytes, {} broken", count(1), count(2));
    }
}
