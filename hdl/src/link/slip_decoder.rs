//! SLIP decoder: from the bytes of the link to the bytes of packets.

use dermis_golden::wire::link::slip::{END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// The byte after an escape is decoded from its last two bits; `spoiled` reports bytes that must not follow an escape.
const _: () = assert!(matches!([ESC_END % 4, ESC_ESC % 4, ESC_IDLE % 4], [0, 1, 2..=3]));

/// Resolves SLIP escapes, with a latency of one cycle; IDLE bytes are skipped. A receiver resynchronises at the next
/// END.
#[derive(dermis_hdl_derive::Block)]
pub struct SlipDecoder {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A received byte; valid with `valid`.
    pub data: Wire<In>,
    /// A byte was received in this cycle.
    pub valid: Signal<In, Bit>,
    /// A byte was received with an error in this cycle.
    pub broken: Signal<In, Bit>,
    /// A byte of a packet; valid with `content_valid`.
    pub content: Wire<Out>,
    /// `content` holds a byte.
    pub content_valid: Signal<Out, Bit>,
    /// END was received: the packet is complete; high for one cycle.
    pub packet_end: Signal<Out, Bit>,
    /// A byte of the packet was lost; high for one cycle.
    pub spoiled: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    SlipDecoder,
    clock clk,
    inputs [rst, data, valid, broken],
    outputs [content, content_valid, packet_end, spoiled]
);

impl Default for SlipDecoder {
    fn default() -> Self {
        let block = SlipDecoder {
            clk: Default::default(),
            rst: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            broken: Default::default(),
            content: Wire::new(8),
            content_valid: Default::default(),
            packet_end: Default::default(),
            spoiled: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel())
    }
}

fn kernel() -> Kernel {
    let k = Builder::new("slip_decoder");
    let (rst, data) = (k.input("rst", 1), k.input("data", 8));
    let (valid, broken) = (k.input("valid", 1), k.input("broken", 1));
    let bit = Type::unsigned(1);
    let escaped = k.state("escaped", bit, rst, 0);
    let content = k.register("content", Type::unsigned(8));
    let [content_valid, packet_end, spoiled] =
        ["content_valid", "packet_end", "spoiled"].map(|name| k.state(name, bit, rst, 0));
    let byte = |byte: u8| k.constant(8, byte.into());
    let is = |byte: u8| data.is(byte.into());
    let (is_end, is_escape, is_idle) =
        (k.wire("is_end", is(END)), k.wire("is_escape", is(ESC)), k.wire("is_idle", is(IDLE)));
    let stands = k.wire("stands", is(ESC_END) | is(ESC_ESC) | is(ESC_IDLE));
    let special = data.at(1).mux(byte(IDLE), data.at(0).mux(byte(ESC), byte(END)));
    content.set((!*escaped).mux(data, special));
    content_valid.set(valid & !is_end & !is_idle & escaped.mux(stands, !is_escape));
    packet_end.set(valid & is_end);
    spoiled.set(broken | (valid & *escaped & !stands & !is_end & !is_idle));
    k.when(valid & !is_idle, || escaped.set(is_escape & !*escaped));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::wire::link::slip::{unescape, SPECIAL};

    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// What the bytes so far mean.
    #[derive(Default)]
    struct Meaning {
        escaped: bool,
        content: Option<u8>,
        end: bool,
        spoiled: bool,
        reset: bool,
    }

    impl Reference for Meaning {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let content = self.content.map(|byte| Word::from(u64::from(byte)));
            vec![content, bit(self.content.is_some()), bit(self.end), bit(self.spoiled)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, data, valid, broken] = [0, 1, 2, 3].map(|k| inputs[k].number());
            (self.content, self.end, self.spoiled) = (None, false, broken == 1);
            match (data as u8, self.escaped) {
                _ if valid == 0 => {}
                (IDLE, _) => {}
                (END, _) => (self.end, self.escaped) = (true, false),
                (ESC, false) => self.escaped = true,
                (byte, false) => self.content = Some(byte),
                (byte, true) => {
                    self.content = unescape(byte);
                    self.spoiled |= self.content.is_none();
                    self.escaped = false;
                }
            }
            if rst == 1 {
                *self = Meaning { reset: true, ..Meaning::default() };
            }
        }
    }

    #[test]
    fn any_bytes_are_read_as_rfc_1055_and_idle_say() {
        let mut random = fastrand::Rng::with_seed(8);
        let cycle = |cycle: usize| {
            let (special, after) = SPECIAL[random.usize(..3)];
            let byte = [special, after, ESC, random.u8(..)][random.usize(..4)];
            vec![
                Word::from(cycle < 2 || random.u8(..) == 0),
                Word::from(u64::from(byte)),
                Word::from(random.u8(..4) > 0),
                Word::from(random.u8(..16) == 0),
            ]
        };
        let all: Vec<Vec<Word>> = (0..6000).map(cycle).collect();
        check(SlipDecoder::default().kernel.kernel(), &all, &mut Meaning::default());
    }
}
