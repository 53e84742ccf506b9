//! SLIP encoder: from the bytes of packets to the bytes of the link.

use dermis_golden::wire::link::slip::{END, ESC, ESC_END, ESC_ESC, ESC_IDLE, IDLE};

use crate::block;
use crate::language::{Block, Builder, Inside, Type};

block! {
    /// Escapes bytes as SLIP requires; with `border`, an END between packets is sent unescaped.
    ///
    /// With many lanes the block has two extra registers, because the link's pins may be far from the packer: whether a
    /// byte is escaped is known one cycle after the byte, and `content_ready` comes one cycle after the link accepted
    /// it.
    pub struct SlipEncoder {
        /// There are the two extra registers.
        registered: bool,
    }
    ports SlipEncoderPorts {
        clock;
        reset;
        /// A byte of a packet; valid with `content_valid`.
        in content: 8;
        /// Send an END in place of `content`; valid with `content_valid`.
        in border;
        /// A byte or an END is offered; held until `content_ready`.
        in content_valid;
        /// The byte is accepted; with registers, one cycle after the link took its last part.
        out content_ready;
        /// A byte for the link; valid with `valid`.
        out data: 8;
        /// `data` is offered; held until `ready`.
        out valid;
        /// The link accepts the byte in this cycle.
        in ready;
    }
}

impl SlipEncoder {
    /// With the two extra registers if `registered`.
    pub fn new(registered: bool) -> Self {
        SlipEncoder { registered }
    }
}

impl Block for SlipEncoder {
    fn build<'k>(&self, k: &'k Builder, io: SlipEncoderPorts<Inside<'k>>) {
        let bit = Type::unsigned(1);
        let second = k.state("second", bit, io.rst, 0);
        let byte = |byte: u8| k.constant(8, byte.into());
        let is_end = k.wire("is_end", io.content.equals(byte(END)));
        let is_escape = k.wire("is_escape", io.content.equals(byte(ESC)));
        let found = k.wire("found", !io.border & (is_end | is_escape | io.content.equals(byte(IDLE))));
        let registers = self.registered.then(|| {
            (k.register("special", bit), k.state("stands", bit, io.rst, 0), io.content_ready.state(io.rst, 0))
        });
        let (special, stands) = registers.map_or((found, io.content_valid), |(special, stands, _)| (*special, *stands));
        let taken = k.wire("taken", stands & io.ready & (!special | *second));
        match registers {
            None => {
                io.content_ready.set(taken);
            }
            Some((special, stands, content_ready)) => {
                special.set(found);
                stands.set(io.content_valid & !taken & !*content_ready);
                content_ready.set(taken);
            }
        }
        let after = is_end.mux(byte(ESC_END), is_escape.mux(byte(ESC_ESC), byte(ESC_IDLE)));
        io.data.set(io.border.mux(byte(END), (!special).mux(io.content, (!*second).mux(byte(ESC), after))));
        io.valid.set(stands);
        k.when(stands & io.ready, || second.set(special & !*second));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::wire::link::slip::{escape, SPECIAL};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// The bytes of the link for a byte of the packet, one after the other.
    struct Parts {
        /// There are the two extra registers.
        registered: bool,
        sent: usize,
        /// With registers: the byte is known, and whether it was taken in the cycle before.
        stands: bool,
        was_taken: bool,
        reset: bool,
    }

    impl Parts {
        fn new(registered: bool) -> Self {
            Parts { registered, sent: 0, stands: false, was_taken: false, reset: false }
        }

        /// The bytes of the link; whether one is offered; whether its last is accepted in this cycle.
        fn state(&self, inputs: &[Word]) -> (Vec<u8>, bool, bool) {
            let byte = inputs[1].number() as u8;
            let parts = match escape(byte) {
                _ if inputs[2].number() == 1 => vec![END],
                Some(after) => vec![ESC, after],
                None => vec![byte],
            };
            let stands = if self.registered { self.stands } else { inputs[3].number() == 1 };
            let taken = stands && inputs[4].number() == 1 && self.sent + 1 == parts.len();
            (parts, stands, taken)
        }
    }

    impl Reference for Parts {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let (parts, stands, taken) = self.state(inputs);
            let data = parts.get(self.sent).filter(|_| stands).map(|&byte| Word::from(u64::from(byte)));
            let content_ready = Word::from(if self.registered { self.was_taken } else { taken });
            let defined = |word| self.reset.then_some(word);
            vec![
                defined(content_ready),
                data.filter(|_| self.reset && inputs[0].number() == 0),
                defined(Word::from(stands)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let (_, stands, taken) = self.state(inputs);
            let goes = stands && inputs[4].number() == 1;
            self.sent = if taken { 0 } else { self.sent + usize::from(goes) };
            (self.stands, self.was_taken) = (inputs[3].number() == 1 && !taken && !self.was_taken, taken);
            if inputs[0].number() == 1 {
                *self = Parts { reset: true, ..Parts::new(self.registered) };
            }
        }
    }

    /// Bytes, every other one special, held until they are accepted; pauses, stalls, resets.
    fn stimulus(cycles: usize, registered: bool) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(7);
        let mut parts = Parts::new(registered);
        let mut offered = vec![Word::default(); 3];
        let mut all = Vec::new();
        for cycle in 0..cycles {
            let rst = cycle < 2 || random.u8(..) == 0;
            if rst || offered[2].number() == 0 {
                let byte = if random.bool() { SPECIAL[random.usize(..3)].0 } else { random.u8(..) };
                let valid = !rst && random.u8(..4) > 0;
                offered = vec![Word::from(u64::from(byte)), Word::from(random.u8(..8) == 0), Word::from(valid)];
            }
            let mut inputs = vec![Word::from(rst)];
            inputs.extend(&offered);
            inputs.push(Word::from(random.bool()));
            let accepted = if registered { parts.was_taken } else { parts.state(&inputs).2 };
            if accepted {
                offered[2] = Word::default();
            }
            parts.clock(&inputs);
            all.push(inputs);
        }
        all
    }

    #[test]
    fn each_byte_leaves_as_itself_or_as_its_escape() {
        for registered in [false, true] {
            let block = SlipEncoder::new(registered);
            check(&kernel_of(&block), &stimulus(6000, registered), &mut Parts::new(registered));
        }
    }
}
