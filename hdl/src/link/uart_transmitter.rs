//! UART transmitter: from bytes to the line.

use super::phase::Phase;
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

block! {
    /// Start bit, eight data bits, stop bit. A byte is accepted when `valid` and `ready` are both high.
    pub struct UartTransmitter {
        /// Bit timing on the line.
        timing: Phase,
    }
    ports UartTransmitterPorts {
        clock;
        reset;
        /// The byte; valid with `valid`.
        in data: 8;
        /// `data` is offered; held until `ready`.
        in valid;
        /// The byte is accepted in this cycle.
        out ready;
        /// The line, high when idle.
        out line;
    }
}

/// Bits from start bit to stop bit.
const BITS: usize = 10;

impl UartTransmitter {
    /// For `baud` bit/s at a clock of `clock_hz` Hz.
    pub fn new(baud: u32, clock_hz: u32) -> Self {
        UartTransmitter { timing: Phase::new(baud, clock_hz) }
    }
}

impl Block for UartTransmitter {
    fn build<'k>(&self, k: &'k Builder, io: UartTransmitterPorts<Inside<'k>>) {
        let left = k.state("left", Type::unsigned(4), io.rst, 0);
        let phase = k.register("phase", Type::unsigned(self.timing.fraction));
        let shift = k.register("shift", Type::unsigned(BITS));
        let line = io.line.state(io.rst, 1).initially(1);
        let line = line.comment("Idle after configuration: a low line would be a start bit.");
        let (one, zero) = (k.constant(1, 1), k.constant(1, 0));
        let ready = io.ready.set(left.is(0));
        let sum = k.wire("sum", *phase + k.constant(self.timing.fraction, self.timing.increment));
        let tick = sum.top();
        phase.set(ready.mux(k.constant(self.timing.fraction, 0), sum.low(self.timing.fraction)));
        k.when(tick, || {
            shift.set(one.concat(shift.slice(1, BITS - 1)));
            left.set(left.minus(1));
        });
        k.when(ready, || {
            shift.set(concat(&[one, io.data, zero]));
            left.set(io.valid.mux(k.constant(4, BITS as u64), k.constant(4, 0)));
        });
        line.set(ready | shift.at(0));
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::link::uart_receiver::tests::{BAUD, CLOCK_HZ};
    use crate::wire::Word;

    /// The byte that is sent and the cycles since it was accepted; the line one cycle later.
    #[derive(Default)]
    pub struct Sending {
        byte: Option<(u8, u64)>,
        line: Option<bool>,
    }

    impl Reference for Sending {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.line.map(Word::from), self.line.map(|_| Word::from(self.byte.is_none()))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let timing = Phase::new(BAUD, CLOCK_HZ);
            let bits = |cycles: u64| cycles * timing.increment / (2 * timing.half);
            let level = |(byte, cycles): (u8, u64)| (u64::from(byte) << 1 | 1 << 9) >> bits(cycles) & 1 == 1;
            self.line = Some(self.byte.is_none_or(level));
            self.byte = match self.byte {
                Some((byte, cycles)) => Some((byte, cycles + 1)).filter(|(_, cycles)| bits(*cycles) < BITS as u64),
                None => (inputs[2].number() == 1).then(|| (inputs[1].number() as u8, 0)),
            };
            if inputs[0].number() == 1 {
                *self = Sending { byte: None, line: Some(true) };
            }
        }
    }

    #[test]
    fn start_bit_eight_bits_and_stop_bit_have_the_rate_of_the_line() {
        let mut random = fastrand::Rng::with_seed(10);
        let cycle = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..1000) == 0;
            vec![Word::from(rst), Word::from(u64::from(random.u8(..))), Word::from(random.u8(..8) == 0)]
        };
        let all: Vec<Vec<Word>> = (0..8000).map(cycle).collect();
        check(&kernel_of(&UartTransmitter::new(BAUD, CLOCK_HZ)), &all, &mut Sending::default());
    }
}
