//! Identity of the board and counters of received and dropped packets, in one memory.

use dermis_golden::wire::link::{Counters, Identity};

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::count_bits;

block! {
    /// Memory of 32 entries of two bytes: the first twelve bytes of the identity from entry 0, the other twelve from 8,
    /// the counters, in the order of [`Counters`], from 16.
    ///
    /// An event of a packet is counted in the three cycles after it (read, add, write), with a register between memory
    /// and adder in four; while `hold` is high it waits, because the two bytes of a counter are being read. `entry` is
    /// not valid meanwhile. Counters wrap. Reset clears one counter per cycle and has to last at least eight cycles.
    pub struct CounterRam {
        /// The identity by entry, the first byte of each in the low bits.
        words: Vec<(usize, u64)>,
        /// There is a register between memory and adder.
        registered: bool,
    }
    ports CounterRamPorts {
        clock;
        /// Synchronous reset, active high for at least eight cycles.
        in rst;
        /// A packet was accepted in this cycle.
        in taken;
        /// One bit per cause for which a packet is dropped: framing, CRC, unknown type, length; each high for the cycle
        /// of its event.
        in fault: EVENTS - 2;
        /// A packet was dropped in this cycle because earlier ones are not answered yet.
        in overrun;
        /// Counting is postponed.
        in hold;
        /// Entry to read, 5 bits; taken while no event is being counted.
        in address: 5;
        /// The entry, 16 bits; one cycle after `address`, while `entry_valid` is high.
        out entry: 16;
        /// `entry` is that of `address`, and no counter is changing.
        out entry_valid;
    }
}

const ENTRIES: usize = 32;
/// Entry of the first counter.
const COUNTS: usize = 16;
/// Entries cleared by reset: the counters, and two unused ones.
const KINDS: usize = 8;
const EVENTS: usize = Counters::BYTES / 2;

impl CounterRam {
    /// Answers requests for the identity with `identity`; with the register between memory and adder if `registered`.
    pub fn new(identity: &Identity, registered: bool) -> Self {
        CounterRam { words: words(identity), registered }
    }
}

/// The identity by entry, the first byte of each in the low bits.
fn words(identity: &Identity) -> Vec<(usize, u64)> {
    let word = |(at, pair): (usize, &[u8])| (at % 6 + 8 * (at / 6), u64::from(u16::from_le_bytes([pair[0], pair[1]])));
    identity.to_bytes().chunks(2).enumerate().map(word).collect()
}

/// Cycles in which a count keeps `entry` from being valid: read, if `registered` the register, add, write.
fn cycles(registered: bool) -> usize {
    3 + usize::from(registered)
}

impl Block for CounterRam {
    fn build<'k>(&self, k: &'k Builder, io: CounterRamPorts<Inside<'k>>) {
        let memory = k.memory("memory", ENTRIES, 16, Contents::Words(self.words.clone())).style("block").unchecked();
        let which = k.register("which", Type::unsigned(count_bits(KINDS)));
        let due = k.state("due", Type::unsigned(1), io.rst, 0);
        let counted = k.register("counted", Type::unsigned(cycles(self.registered)));
        let counted =
            counted.comment("Pipeline of a count: a bit for each cycle, of which the second last one writes.");
        let (entry, raised) = (io.entry.register(), k.register("raised", Type::unsigned(16)));

        let events = k.wire("events", concat(&[io.overrun, io.fault, io.taken]));
        let counts = k.wire("counts", *due & !io.hold);
        let counter = k.constant(2, (COUNTS / KINDS) as u64).concat(*which);
        entry.set(memory.read(counts.mux(counter, io.address)));
        // A block RAM's output is slow.
        let count = if self.registered { k.delay("count", *entry) } else { *entry };
        raised.set(count.plus(1));
        let writes = cycles(self.registered) - 2;
        memory.write(io.rst | counted.at(writes), counter, io.rst.mux(k.constant(16, 0), *raised));
        let goes_on: Vec<Expr> = (0..writes).rev().map(|cycle| counted.at(cycle) & !io.rst).collect();
        counted.set(concat(&[&[counted.at(writes)], &goes_on[..], &[counts & !io.rst]].concat()));
        due.set(events.any() | (*due & !counts));
        // The number of the event, as each has its own bit.
        let bit = |bit: usize| {
            let of = (0..EVENTS).filter(|event| event >> bit & 1 == 1).map(|event| events.at(event));
            of.reduce(|a, b| a | b).unwrap_or(k.constant(1, 0))
        };
        k.when(events.any(), || which.set(concat(&[bit(2), bit(1), bit(0)])));
        k.when(io.rst, || which.set(which.plus(1)));
        io.entry_valid.set(counted.is(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const IDENTITY: [(usize, u64); 3] = [(0, 0x1234), (5, 0xffff), (13, 7)];

    /// Counters, the event that waits, the cycles of the pipeline that it still takes, the entry read.
    #[derive(Default)]
    struct Table {
        resets: usize,
        runs: bool,
        counters: [u16; KINDS],
        waiting: Option<usize>,
        left: u64,
        entry: Option<u64>,
        registered: bool,
    }

    impl Table {
        fn is_reset(&self) -> bool {
            self.resets >= KINDS
        }
    }

    impl Reference for Table {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let valid = self.left == 0;
            let entry = self.entry.filter(|_| self.is_reset() && valid).map(Word::from);
            vec![entry, self.is_reset().then(|| Word::from(valid))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, taken, fault, overrun, hold, address] = [0, 1, 2, 3, 4, 5].map(|k| inputs[k].number());
            if rst == 1 {
                let before = if self.runs { 0 } else { self.resets };
                *self = Table { resets: before + 1, registered: self.registered, ..Table::default() };
                return;
            }
            self.runs = true;
            let events = taken | fault << 1 | overrun << (EVENTS - 1);
            self.left = self.left.saturating_sub(1);
            let (at, own) = (address as usize, IDENTITY.iter().find(|(at, _)| *at == address as usize));
            self.entry = match at.checked_sub(COUNTS) {
                Some(counter) if counter < EVENTS => Some(u64::from(self.counters[counter])),
                _ => own.map(|(_, word)| *word),
            };
            if let Some(event) = self.waiting.filter(|_| hold == 0) {
                self.counters[event] = self.counters[event].wrapping_add(1);
                (self.waiting, self.left) = (None, cycles(self.registered) as u64);
            }
            if events != 0 {
                self.waiting = Some(events.trailing_zeros() as usize);
            }
        }
    }

    /// Events at least eight cycles apart, which may be held back; entries of the identity and counters.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(15);
        let (mut resets, mut pause) = (KINDS + 2, 0);
        let inputs = |_| {
            if random.u16(..3000) == 0 {
                resets = KINDS + random.usize(..4);
            }
            let rst = resets > 0;
            resets = resets.saturating_sub(1);
            let event = if !rst && pause == 0 { 1u64 << random.usize(..EVENTS) } else { 0 };
            pause = if event > 0 { random.usize(8..20) } else { pause.saturating_sub(1) };
            // An event is counted before the next one.
            let hold = pause > 5 && random.u8(..4) > 0;
            let address = match random.bool() {
                true => COUNTS + random.usize(..EVENTS),
                false => IDENTITY[random.usize(..IDENTITY.len())].0,
            };
            vec![
                Word::from(rst),
                Word::from(event & 1),
                Word::from(event >> 1 & 15),
                Word::from(event >> (EVENTS - 1)),
                Word::from(hold),
                Word::from(address as u64),
            ]
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn events_are_counted_and_the_identity_is_read() {
        for registered in [false, true] {
            let block = CounterRam { words: IDENTITY.to_vec(), registered };
            check(&kernel_of(&block), &stimulus(30_000), &mut Table { registered, ..Table::default() });
        }
    }
}
