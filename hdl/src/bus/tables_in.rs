//! Puts the bytes of images of tables, which come from a register, between the frames of the engine's input.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::table_beat;
use crate::wire::Wire;

/// ```text
/// s_axis (frames) --+--> m_axis (engine)
/// octet  -----------'
/// ```
/// A byte waits for the end of the frame under way; from an image's first byte to its last the next frame waits. Without
/// writable tables the stream passes through.
#[derive(dermis_hdl_derive::Block)]
pub struct TablesIn {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `code_bits` wide, signed; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A byte, and above it whether it is the last of its image; valid with `octet_valid`.
    pub octet: Wire<In>,
    /// A byte is offered; it is held until `octet_taken`.
    pub octet_valid: Signal<In, Bit>,
    /// The byte is accepted in this cycle.
    pub octet_taken: Signal<Out, Bit>,
    /// A code, or a byte of an image; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame or image; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    TablesIn,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, octet, octet_valid, m_axis_tready],
    outputs [s_axis_tready, octet_taken, m_axis_tdata, m_axis_tvalid, m_axis_tlast]
);

/// Bits of a byte with the mark of an image's last.
pub(super) const OCTET_BITS: usize = 9;

impl TablesIn {
    /// For codes of `code_bits` bits, with bytes between them if the tables are `writable`.
    pub fn new(code_bits: usize, writable: bool) -> Self {
        let block = TablesIn {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(code_bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            octet: Wire::new(OCTET_BITS),
            octet_valid: Default::default(),
            octet_taken: Default::default(),
            m_axis_tdata: Wire::new(code_bits + usize::from(writable)),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(code_bits, writable))
    }
}

fn kernel(code_bits: usize, writable: bool) -> Kernel {
    let k = Builder::new("tables_in");
    let (rst, data) = (k.input("rst", 1), k.input("s_axis_tdata", code_bits));
    let [given, last] = ["s_axis_tvalid", "s_axis_tlast"].map(|name| k.input(name, 1));
    let (octet, octet_valid) = (k.input("octet", OCTET_BITS), k.input("octet_valid", 1));
    let ready = k.input("m_axis_tready", 1);
    if !writable {
        k.comment("The tables are in the bitstream.");
        k.wire("s_axis_tready", ready);
        k.wire("octet_taken", k.constant(1, 0));
        k.wire("m_axis_tdata", data);
        k.wire("m_axis_tvalid", given);
        k.wire("m_axis_tlast", last);
        return k.finish();
    }
    let bit = Type::unsigned(1);
    let in_frame = k.state("in_frame", bit, rst, 0).comment("A frame has begun and not ended.");
    let in_image = k.state("in_image", bit, rst, 0).comment("An image has begun and not ended.");
    let held = k.state("held", bit, rst, 0).comment("A code was offered and not accepted.");
    let is_byte = k.wire("is_byte", *in_image | (octet_valid & !*in_frame & !*held));
    let code_taken = k.wire("s_axis_tready", ready & !is_byte);
    let octet_taken = k.wire("octet_taken", ready & is_byte & octet_valid);
    let offered = k.wire("m_axis_tvalid", is_byte.mux(octet_valid, given));
    k.wire(
        "m_axis_tdata",
        is_byte.mux(table_beat(&k, octet.low(8), code_bits), data.signed().extend(code_bits + 1).unsigned()),
    );
    k.wire("m_axis_tlast", is_byte.mux(octet.top(), last));
    held.set(offered & !is_byte & !ready);
    k.when(given & code_taken, || in_frame.set(!last));
    k.when(octet_taken, || in_image.set(!octet.top()));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::load;

    use super::*;
    use crate::language::testbench::{check, random_word, random_words, Pipeline, Reference};
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
            self.image || (inputs[5].number() == 1 && !self.frame && !self.held)
        }
    }

    impl Reference for Turns {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [valid, last, offered, ready] = [2, 3, 5, 6].map(|k| inputs[k].number() == 1);
            let byte = self.is_byte(inputs);
            let octet = inputs[4].number();
            let data =
                if byte { load::beats(&[octet as u8], BITS as u32)[0].into() } else { inputs[1].signed(0, BITS) };
            let all = [
                (ready && !byte).into(),
                (ready && byte && offered).into(),
                (if byte { offered } else { valid }).into(),
                Word::of_fields(&[data], BITS + 1),
                (if byte { octet >> 8 == 1 } else { last }).into(),
            ];
            all.map(|word| self.reset.then_some(word)).into()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, offered, ready] = [0, 2, 3, 5, 6].map(|k| inputs[k].number() == 1);
            let byte = self.is_byte(inputs);
            self.held = valid && !byte && !ready;
            if valid && !byte && ready {
                self.frame = !last;
            }
            if offered && byte && ready {
                self.image = inputs[4].number() >> 8 == 0;
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
                let octet = Word::from(random.u64(..256) | u64::from(random.u8(..5) == 0) << 8);
                vec![
                    Word::from(cycle < 2 || random.u16(..700) == 0),
                    random_word(&mut random, BITS),
                    bit(&mut random, 2),
                    bit(&mut random, 6),
                    octet,
                    bit(&mut random, 3),
                    bit(&mut random, 2),
                ]
            })
            .collect();
        check(TablesIn::new(BITS, true).kernel.kernel(), &stimulus, &mut Turns::default());
    }

    #[test]
    fn without_writable_tables_the_stream_passes() {
        let stimulus = random_words(300, &[1, BITS, 1, 1, OCTET_BITS, 1, 1]);
        let of = |inputs: &[Word]| [inputs[6], Word::default(), inputs[1], inputs[2], inputs[3]].map(Some).into();
        check(TablesIn::new(BITS, false).kernel.kernel(), &stimulus, &mut Pipeline::new(0, 5, of));
    }
}
