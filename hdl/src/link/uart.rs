//! UART: between the bytes of the link and its two lines.

use dermis_golden::wire::link::Identity;
use rust_hdl::prelude::*;

use super::{UartReceiver, UartTransmitter};
use crate::wire::Wire;

/// [`UartReceiver`] and [`UartTransmitter`] side by side.
#[derive(dermis_hdl_derive::Block)]
pub struct Uart {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Line from the host, high when idle; asynchronous to the clock.
    pub uart_rx: Signal<In, Bit>,
    /// Line to the host, high when idle.
    pub uart_tx: Signal<Out, Bit>,
    /// The byte received last; valid with `valid`.
    pub data: Wire<Out>,
    /// A byte was received in this cycle.
    pub valid: Signal<Out, Bit>,
    /// A byte without stop bit was received in this cycle.
    pub broken: Signal<Out, Bit>,
    /// A byte to send; valid with `send_valid`.
    pub send_data: Wire<In>,
    /// `send_data` is offered; held until `send_ready`.
    pub send_valid: Signal<In, Bit>,
    /// The byte is accepted in this cycle.
    pub send_ready: Signal<Out, Bit>,
    receiver: UartReceiver,
    transmitter: UartTransmitter,
}

impl Uart {
    /// For the bit rate and the clock of `identity`.
    pub fn new(identity: &Identity) -> Self {
        Uart {
            clk: Default::default(),
            rst: Default::default(),
            uart_rx: Default::default(),
            uart_tx: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            broken: Default::default(),
            send_data: Wire::new(8),
            send_valid: Default::default(),
            send_ready: Default::default(),
            receiver: UartReceiver::new(identity.bit_rate, identity.clock_hz),
            transmitter: UartTransmitter::new(identity.bit_rate, identity.clock_hz),
        }
    }
}

impl Logic for Uart {
    #[hdl_gen]
    fn update(&mut self) {
        self.receiver.clk.next = self.clk.val();
        self.transmitter.clk.next = self.clk.val();
        self.receiver.rst.next = self.rst.val();
        self.transmitter.rst.next = self.rst.val();
        self.receiver.line.next = self.uart_rx.val();
        self.data.next = self.receiver.data.val();
        self.valid.next = self.receiver.valid.val();
        self.broken.next = self.receiver.broken.val();
        self.transmitter.data.next = self.send_data.val();
        self.transmitter.valid.next = self.send_valid.val();
        self.send_ready.next = self.transmitter.ready.val();
        self.uart_tx.next = self.transmitter.line.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, Reference};
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
            block_subject!(
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
