//! SLIP decoder: from the bytes of the link to the bytes of packets.

use dermis_golden::wire::link::slip::{END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

/// The byte after an escape is decoded from its last two bits; `spoiled` reports bytes that must not follow an escape.
const _: () = assert!(matches!([ESC_END % 4, ESC_ESC % 4, ESC_IDLE % 4], [0, 1, 2..=3]));

block! {
    /// Resolves SLIP escapes, with a latency of one cycle; IDLE bytes are skipped. A receiver resynchronises at the
    /// next END.
    #[derive(Default)]
    pub struct SlipDecoder {}
    ports SlipDecoderPorts {
        clock;
        reset;
        /// A received byte; valid with `valid`.
        in data: 8;
        /// A byte was received in this cycle.
        in valid;
        /// A byte was received with an error in this cycle.
        in broken;
        /// A byte of a packet; valid with `content_valid`.
        out content: 8;
        /// `content` holds a byte.
        out content_valid;
        /// END was received: the packet is complete; high for one cycle.
        out packet_end;
        /// A byte of the packet was lost; high for one cycle.
        out spoiled;
    }
}

impl Block for SlipDecoder {
    fn build<'k>(&self, k: &'k Builder, io: SlipDecoderPorts<Inside<'k>>) {
        let escaped = k.state("escaped", Type::unsigned(1), io.rst, 0);
        let content = io.content.register();
        let [content_valid, packet_end, spoiled] =
            [io.content_valid, io.packet_end, io.spoiled].map(|output| output.state(io.rst, 0));
        let byte = |byte: u8| k.constant(8, byte.into());
        let is = |byte: u8| io.data.is(byte.into());
        let (is_end, is_escape, is_idle) =
            (k.wire("is_end", is(END)), k.wire("is_escape", is(ESC)), k.wire("is_idle", is(IDLE)));
        let stands = k.wire("stands", is(ESC_END) | is(ESC_ESC) | is(ESC_IDLE));
        let special = io.data.at(1).mux(byte(IDLE), io.data.at(0).mux(byte(ESC), byte(END)));
        content.set((!*escaped).mux(io.data, special));
        content_valid.set(io.valid & !is_end & !is_idle & escaped.mux(stands, !is_escape));
        packet_end.set(io.valid & is_end);
        spoiled.set(io.broken | (io.valid & *escaped & !stands & !is_end & !is_idle));
        k.when(io.valid & !is_idle, || escaped.set(is_escape & !*escaped));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::wire::link::slip::{unescape, SPECIAL};

    use super::*;
    use crate::language::kernel_of;
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
        check(&kernel_of(&SlipDecoder::default()), &all, &mut Meaning::default());
    }
}
