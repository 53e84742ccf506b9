//! SPI slave: between the bytes of the link and an SPI controller, whose clock is a domain of its own.

use dermis_golden::wire::link::slip::IDLE;

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// Mode 0, most significant bit first, bytes in both directions at once. Registers `sclk_…` are in the controller's
    /// clock domain:
    ///
    /// ```text
    ///  mosi -> sclk_mosi -> sclk_shift -> sclk_received --(sclk_toggle, 2 registers)--> data, valid
    ///  miso <-----------------'   ^------ sclk_kept <--(offer, 2 registers)------------ offered <- send_data
    ///                                          '-------(sclk_taken, 2 registers)------> send_ready
    /// ```
    /// Receiving: the eighth rising edge stores the byte and flips a toggle. `clk` sees the toggle at its third edge
    /// after that at the latest; the byte stays unchanged for eight periods of `spi_sclk`. An incomplete byte is
    /// dropped.
    ///
    /// Sending: the bits change on falling edges. The eighth rising edge of a byte stores the next one if `clk` offers
    /// one, and acknowledges it; the falling edge then loads it, or IDLE. The stored byte is released only when the
    /// controller has sampled all eight of its bits: if a transaction ends earlier, the next one sends that byte again
    /// from its first bit. The first byte of a transaction is IDLE.
    ///
    /// While `spi_cs_n` is high, edges of `spi_sclk` have no effect: they are for another slave.
    #[derive(Default)]
    pub struct SpiSlave {}
    ports SpiSlavePorts {
        clock;
        /// Synchronous reset, active high: no byte to send is accepted.
        in rst;
        /// The controller's clock.
        in spi_sclk;
        /// Chip select, low during a transaction.
        in spi_cs_n;
        /// Data from the controller, sampled on the rising edge of `spi_sclk`.
        in spi_mosi;
        /// Data to the controller, changes on the falling edge of `spi_sclk`.
        out spi_miso;
        /// The byte received last; valid with `valid`.
        out data: 8;
        /// A byte was received in this cycle.
        out valid;
        /// A byte to send; valid with `send_valid`.
        in send_data: 8;
        /// `send_data` is offered; held until `send_ready`.
        in send_valid;
        /// The byte is accepted in this cycle.
        out send_ready;
    }
}

/// Index of the last bit of a byte.
const LAST: usize = 7;

impl Block for SpiSlave {
    fn build<'k>(&self, k: &'k Builder, io: SpiSlavePorts<Inside<'k>>) {
        let (bit, byte, idle) = (Type::unsigned(1), Type::unsigned(8), u64::from(IDLE));
        let (sclk_bit, sclk_shift, sclk_carries) = k.falling(io.spi_sclk, || {
            let sclk_bit = k.state("sclk_bit", Type::unsigned(3), io.spi_cs_n, 0);
            let sclk_bit = sclk_bit.comment("Controller's clock domain, falling edges; reset between transactions.");
            (sclk_bit, k.state("sclk_shift", byte, io.spi_cs_n, idle), k.state("sclk_carries", bit, io.spi_cs_n, 0))
        });
        let (sclk_mosi, [sclk_received, sclk_kept], sclk_offered, [sclk_toggle, sclk_full, sclk_taken]) =
            k.rising(io.spi_sclk, || {
                let sclk_mosi = k.register("sclk_mosi", bit).comment(
                "Controller's clock domain, rising edges; not reset: the handshake with clk holds across transactions.",
            );
                let bytes = ["sclk_received", "sclk_kept"].map(|name| k.register(name, byte));
                let sclk_offered = k.register("sclk_offered", Type::unsigned(2)).initially(0);
                let bits = ["sclk_toggle", "sclk_full", "sclk_taken"].map(|name| k.register(name, bit).initially(0));
                (sclk_mosi, bytes, sclk_offered, bits)
            });
        let received = k.register("received", Type::unsigned(3)).initially(0).comment("Domain of clk.");
        let (taken, offer) =
            (k.register("taken", Type::unsigned(2)).initially(0), k.register("offer", bit).initially(0));
        let offered = k.register("offered", byte);

        let last = k.wire("sclk_last", sclk_bit.is(LAST as u64));
        sclk_mosi.set(io.spi_mosi);
        sclk_offered.set(sclk_offered.at(0).concat(*offer));
        k.when(last, || {
            sclk_received.set(sclk_shift.low(7).concat(io.spi_mosi));
            sclk_toggle.set(!*sclk_toggle);
            sclk_carries.set(*sclk_full);
        });
        let stores = k.wire("sclk_stores", last & (*sclk_carries | !*sclk_full));
        k.when(stores, || {
            sclk_full.set(sclk_offered.at(1).differs(*sclk_taken));
            sclk_taken.set(sclk_offered.at(1));
            sclk_kept.set(*offered);
        });
        sclk_bit.set(sclk_bit.plus(1));
        let next = sclk_full.mux(*sclk_kept, k.constant(8, idle));
        sclk_shift.set((!last).mux(sclk_shift.low(7).concat(*sclk_mosi), next));

        io.spi_miso.set(sclk_shift.top());
        io.data.set(*sclk_received);
        io.valid.set(received.at(1).differs(received.at(2)));
        let send_ready = io.send_ready.set(taken.at(1).equals(*offer));
        received.set(received.low(2).concat(*sclk_toggle));
        taken.set(taken.at(0).concat(*sclk_taken));
        k.when(io.send_valid & send_ready & !io.rst, || {
            offer.set(!*offer);
            offered.set(io.send_data);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::language::{kernel_of, Hierarchy, Run};
    use crate::wire::Word;

    /// The registers of both sides in plain integers.
    #[derive(Default)]
    struct Sides {
        level: bool,
        bit: usize,
        shift: u8,
        carries: bool,
        mosi: bool,
        received: Option<u8>,
        toggle: bool,
        kept: u8,
        full: bool,
        taken: bool,
        seen_offers: [bool; 2],
        toggles: [bool; 3],
        seen_taken: [bool; 2],
        offer: bool,
        offered: u8,
        selected: bool,
    }

    impl Sides {
        fn rises(&mut self, mosi: bool) {
            let [last, seen] = self.seen_offers;
            if self.bit == LAST {
                self.received = Some(self.shift << 1 | u8::from(mosi));
                self.toggle = !self.toggle;
                if self.carries || !self.full {
                    (self.full, self.taken, self.kept) = (seen != self.taken, seen, self.offered);
                }
            }
            (self.mosi, self.seen_offers) = (mosi, [self.offer, last]);
        }

        fn falls(&mut self) {
            self.shift = match self.bit {
                LAST if self.full => self.kept,
                LAST => IDLE,
                _ => self.shift << 1 | u8::from(self.mosi),
            };
            if self.bit == LAST {
                self.carries = self.full;
            }
            self.bit = (self.bit + 1) % (LAST + 1);
        }
    }

    impl Reference for Sides {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [sclk, cs_n, mosi] = [1, 2, 3].map(|k| inputs[k].number() == 1);
            match (self.level, sclk) {
                (false, true) => self.rises(mosi),
                (true, false) => self.falls(),
                _ => {}
            }
            self.level = sclk;
            if cs_n {
                (self.bit, self.shift, self.carries, self.selected) = (0, IDLE, false, true);
            }
            vec![
                self.selected.then(|| Word::from(self.shift >> 7 == 1)),
                self.received.map(|byte| Word::from(u64::from(byte))),
                Some(Word::from(self.toggles[1] != self.toggles[2])),
                Some(Word::from(self.seen_taken[1] == self.offer)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid] = [0, 5].map(|k| inputs[k].number() == 1);
            if valid && !rst && self.seen_taken[1] == self.offer {
                (self.offer, self.offered) = (!self.offer, inputs[4].number() as u8);
            }
            self.toggles = [self.toggle, self.toggles[0], self.toggles[1]];
            self.seen_taken = [self.taken, self.seen_taken[0]];
        }
    }

    /// Transactions of any number of edges, at up to one edge per cycle; edges of the clock between them.
    fn stimulus(cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(13);
        let (mut sclk, mut cs_n, mut speed) = (false, false, 8);
        let inputs = |cycle: usize| {
            if cycle.is_multiple_of(100) {
                speed = random.u8(2..9);
            }
            match cycle {
                0 => {}
                1 => cs_n = true,
                // Chip select changes while the clock is low, and never together with it.
                _ if !sclk && random.u8(..60) == 0 => cs_n = !cs_n,
                _ => sclk ^= random.u8(..8) < speed,
            }
            let bits = [cycle < 2 || random.u16(..1000) == 0, sclk, cs_n, random.bool()].map(Word::from);
            let send = [Word::from(u64::from(random.u8(..))), Word::from(random.bool())];
            bits.into_iter().chain(send).collect()
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn both_clocks_see_what_the_registers_of_the_other_say() {
        check(&kernel_of(&SpiSlave::default()), &stimulus(20_000), &mut Sides::default());
    }

    /// The block, the bytes that the `clk` side has received, and the bytes it still has to send.
    struct Bench {
        block: Run,
        received: Vec<u8>,
        sending: Vec<u8>,
        clock: bool,
    }

    impl Bench {
        fn new(sending: &[u8]) -> Bench {
            let block = Run::new(&Hierarchy::of_kernel(kernel_of(&SpiSlave::default())), &[]);
            let mut bench = Bench { block, received: Vec::new(), sending: sending.to_vec(), clock: false };
            bench.set("spi_cs_n", true);
            bench
        }

        /// Sets an input, and settles.
        fn set(&mut self, port: &str, value: impl Into<Word>) {
            self.block.set(self.block.slot("", port), value.into());
            self.block.settle();
        }

        fn get(&self, port: &str) -> u64 {
            self.block.get(self.block.slot("", port)).number()
        }

        /// Half a cycle of `clk`; the `clk` side reads and writes before a rising edge.
        fn half(&mut self) {
            if !self.clock {
                if self.get("valid") == 1 {
                    self.received.push(self.get("data") as u8);
                }
                self.set("send_valid", !self.sending.is_empty());
                self.set("send_data", u64::from(self.sending.first().copied().unwrap_or(0)));
                if !self.sending.is_empty() && self.get("send_ready") == 1 {
                    self.sending.remove(0);
                }
                self.block.clock();
                self.block.settle();
            }
            self.clock = !self.clock;
        }

        /// A transaction of `edges` edges of the controller's clock, `halves` half cycles of `clk` apart; returns the
        /// complete bytes that the controller has received.
        fn transaction(&mut self, bytes: &[u8], edges: usize, halves: usize) -> Vec<u8> {
            self.set("spi_cs_n", false);
            let (mut seen, mut whole) = (0u32, Vec::new());
            for edge in 0..edges {
                let bit = edge / 2;
                if edge % 2 == 0 {
                    self.set("spi_mosi", bytes[bit / 8] >> (7 - bit % 8) & 1 == 1);
                    seen = seen << 1 | self.get("spi_miso") as u32;
                    whole.extend((bit % 8 == 7).then_some(seen as u8));
                }
                self.set("spi_sclk", edge % 2 == 0);
                (0..halves).for_each(|_| self.half());
            }
            self.set("spi_cs_n", true);
            self.set("spi_sclk", false);
            (0..halves).for_each(|_| self.half());
            whole
        }
    }

    #[test]
    fn bytes_pass_both_ways_at_once_and_none_is_lost_where_a_transaction_ends() {
        let (there, back): (Vec<u8>, Vec<u8>) = ((0..200).collect(), (100..200).collect());
        for halves in [2, 3, 8] {
            for edges in 1..=64 {
                let mut bench = Bench::new(&back);
                let (mut sent, mut seen) = (0, Vec::new());
                while seen.len() < back.len() && sent + 8 < there.len() {
                    // Alternately seven whole bytes, and a transaction of `edges` edges.
                    for edges in [7 * 16, edges] {
                        let bytes = &there[sent..];
                        let whole = bench.transaction(bytes, edges, halves);
                        assert!(whole.first().is_none_or(|first| *first == IDLE), "{edges} edges");
                        // A byte is received at its eighth rising edge.
                        sent += (edges + 1) / 16;
                        seen.extend(whole.into_iter().filter(|byte| *byte != IDLE));
                    }
                }
                (0..6).for_each(|_| bench.half());
                assert_eq!(bench.received, there[..sent], "{edges} edges");
                let wanted: Vec<u8> = back.iter().copied().take(seen.len()).collect();
                assert!(seen == wanted && seen.len() > 80, "{edges} edges: {seen:?}");
            }
        }
    }
}
