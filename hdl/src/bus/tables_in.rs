//! Puts the bytes of images of tables, which come from a register, between the frames of the engine's input.

use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::{table_beat, Arrays, Stream};

block! {
    /// ```text
    /// s_axis (frames) --+--> m_axis (engine)
    /// octet  -----------'
    /// ```
    /// A byte waits for the end of the frame under way; from an image's first byte to its last the next frame waits.
    pub struct TablesIn {
        /// Width of a code.
        code_bits: usize,
        arrays: Arrays,
    }
    ports TablesInPorts {
        clock;
        reset;
        /// A taxel's code, `code_bits` wide, signed; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: (*code_bits, arrays.bits);
        /// A byte, above it whether it is the last of its image, and above that the array of its image; valid with `octet_valid`.
        in octet: OCTET_BITS + arrays.bits;
        /// A byte is offered; it is held until `octet_taken`.
        in octet_valid;
        /// The byte is accepted in this cycle.
        out octet_taken;
        /// A code, or a byte of an image; valid with `m_axis_tvalid`.
        source<Stream> m_axis: (code_bits + 1, arrays.bits);
    }
}

/// Bits of a byte with the mark of an image's last, below the number of its array.
pub(super) const OCTET_BITS: usize = 9;

impl TablesIn {
    /// For codes of `code_bits` bits of the `arrays`, with bytes between them.
    pub fn new(code_bits: usize, arrays: Arrays) -> Self {
        TablesIn { code_bits, arrays }
    }
}

impl Block for TablesIn {
    fn build<'k>(&self, k: &'k Builder, io: TablesInPorts<Inside<'k>>) {
        let bit = Type::unsigned(1);
        let in_frame = k.state("in_frame", bit, io.rst, 0).comment("A frame has begun and not ended.");
        let in_image = k.state("in_image", bit, io.rst, 0).comment("An image has begun and not ended.");
        let held = k.state("held", bit, io.rst, 0).comment("A code was offered and not accepted.");
        let is_byte = k.wire("is_byte", *in_image | (io.octet_valid & !*in_frame & !*held));
        let code_taken = io.s_axis.ready.set(io.m_axis.ready & !is_byte);
        let octet_taken = io.octet_taken.set(io.m_axis.ready & is_byte & io.octet_valid);
        let offered = io.m_axis.valid.set(is_byte.mux(io.octet_valid, io.s_axis.valid));
        io.m_axis.data.set(is_byte.mux(
            table_beat(k, io.octet.low(8), self.code_bits),
            io.s_axis.data.signed().extend(io.m_axis.data.bits()).unsigned(),
        ));
        let last = k.wire("last", io.octet.at(OCTET_BITS - 1));
        io.m_axis.last.set(is_byte.mux(last, io.s_axis.last));
        if self.arrays.bits > 0 {
            io.m_axis.array.set(is_byte.mux(io.octet.slice(OCTET_BITS, self.arrays.bits), io.s_axis.array));
        }
        held.set(offered & !is_byte & !io.m_axis.ready);
        k.when(io.s_axis.valid & code_taken, || in_frame.set(!io.s_axis.last));
        k.when(octet_taken, || in_image.set(!last));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::load;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BITS: usize = 12;

    /// Whether a frame or an image is under way, and whether a code waits.
    #[derive(Default)]
    struct Turns {
        reset: bool,
        frame: bool,
        image: bool,
        held: bool,
    }

    impl Turns {
        fn is_byte(&self, inputs: &[Word]) -> bool {
            self.image || (inputs[6].number() == 1 && !self.frame && !self.held)
        }
    }

    impl Reference for Turns {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [valid, last, offered, ready] = [3, 4, 6, 7].map(|k| inputs[k].number() == 1);
            let byte = self.is_byte(inputs);
            let octet = inputs[5].number();
            let data =
                if byte { load::beats(&[octet as u8], BITS as u32)[0].into() } else { inputs[1].signed(0, BITS) };
            let all = [
                (ready && !byte).into(),
                (ready && byte && offered).into(),
                (if byte { offered } else { valid }).into(),
                Word::of_fields(&[data], BITS + 1),
                (if byte { octet >> 8 & 1 == 1 } else { last }).into(),
                (if byte { octet >> 9 } else { inputs[2].number() }).into(),
            ];
            all.map(|word| self.reset.then_some(word)).into()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, offered, ready] = [0, 3, 4, 6, 7].map(|k| inputs[k].number() == 1);
            let byte = self.is_byte(inputs);
            self.held = valid && !byte && !ready;
            if valid && !byte && ready {
                self.frame = !last;
            }
            if offered && byte && ready {
                self.image = inputs[5].number() >> 8 & 1 == 0;
            }
            if rst {
                *self = Turns { reset: true, ..Turns::default() };
            }
        }
    }

    #[test]
    fn bytes_come_between_frames() {
        let mut random = fastrand::Rng::with_seed(12);
        let stimulus: Vec<Vec<Word>> = (0..20_000)
            .map(|cycle| {
                let bit = |random: &mut fastrand::Rng, of: u8| Word::from(random.u8(..of) == 0);
                let octet = random.u64(..256) | u64::from(random.u8(..5) == 0) << 8 | random.u64(..4) << 9;
                let octet = Word::from(octet);
                vec![
                    Word::from(cycle < 2 || random.u16(..700) == 0),
                    random_word(&mut random, BITS),
                    random_word(&mut random, 2),
                    bit(&mut random, 2),
                    bit(&mut random, 6),
                    octet,
                    bit(&mut random, 3),
                    bit(&mut random, 2),
                ]
            })
            .collect();
        check(&kernel_of(&TablesIn::new(BITS, Arrays { bits: 2 })), &stimulus, &mut Turns::default());
    }
}
