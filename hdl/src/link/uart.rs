//! UART: between the bytes of the link and its two lines.

use dermis_golden::wire::link::Identity;

use super::{UartReceiver, UartTransmitter};
use crate::block;
use crate::language::{Block, Builder, Inside};

block! {
    /// [`UartReceiver`] and [`UartTransmitter`] side by side.
    pub struct Uart {
        /// Bit rate of the line in bit/s.
        bit_rate: u32,
        /// Clock in Hz.
        clock_hz: u32,
    }
    ports UartPorts {
        clock;
        reset;
        /// Line from the host, high when idle; asynchronous to the clock.
        in uart_rx;
        /// Line to the host, high when idle.
        out uart_tx;
        /// The byte received last; valid with `valid`.
        out data: 8;
        /// A byte was received in this cycle.
        out valid;
        /// A byte without stop bit was received in this cycle.
        out broken;
        /// A byte to send; valid with `send_valid`.
        in send_data: 8;
        /// `send_data` is offered; held until `send_ready`.
        in send_valid;
        /// The byte is accepted in this cycle.
        out send_ready;
    }
}

impl Uart {
    /// For the bit rate and the clock of `identity`.
    pub fn new(identity: &Identity) -> Self {
        Uart { bit_rate: identity.bit_rate, clock_hz: identity.clock_hz }
    }
}

impl Block for Uart {
    fn build<'k>(&self, k: &'k Builder, io: UartPorts<Inside<'k>>) {
        let receiver = k.instance("receiver", UartReceiver::new(self.bit_rate, self.clock_hz));
        let transmitter = k.instance("transmitter", UartTransmitter::new(self.bit_rate, self.clock_hz));
        receiver.line.set(io.uart_rx);
        io.data.set(receiver.data);
        io.valid.set(receiver.valid);
        io.broken.set(receiver.broken);
        transmitter.data.set(io.send_data);
        transmitter.valid.set(io.send_valid);
        io.send_ready.set(transmitter.ready);
        io.uart_tx.set(transmitter.line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::link::uart_receiver::tests::{stimulus, Sampler, BAUD, CLOCK_HZ};
    use crate::link::uart_transmitter::tests::Sending;
    use crate::wire::Word;

    /// Both directions, which do not know of each other. Inputs: reset, line, byte to send, whether there is one.
    #[derive(Default)]
    struct Both {
        receiver: Sampler,
        transmitter: Sending,
    }

    impl Reference for Both {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let sent = self.transmitter.outputs(&[inputs[0], inputs[2], inputs[3]]);
            [sent, self.receiver.outputs(&inputs[..2])].concat()
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.transmitter.clock(&[inputs[0], inputs[2], inputs[3]]);
            self.receiver.clock(&inputs[..2]);
        }
    }

    #[test]
    fn bytes_go_both_ways_at_once() {
        let mut random = fastrand::Rng::with_seed(13);
        let mut send = || [Word::from(u64::from(random.u8(..))), Word::from(random.u8(..8) == 0)];
        let all: Vec<Vec<Word>> = stimulus(100).into_iter().map(|inputs| [&inputs[..], &send()].concat()).collect();
        let mut identity = Identity::default();
        (identity.bit_rate, identity.clock_hz) = (BAUD, CLOCK_HZ);
        let subject = |changes: &[Change]| {
            subject_of!(
                Uart::new(&identity),
                changes,
                inputs [rst, uart_rx, send_data, send_valid],
                outputs [uart_tx, send_ready, data, valid, broken],
            )
        };
        let defects = [Change::value("", "transmitter__rst", |k| k.constant(1, 0))];
        check_with_defects(subject, &all, Both::default, &defects);
    }
}
