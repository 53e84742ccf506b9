//! The quads that go into the operand memory of the passes, from the stages that make them.

use dermis_golden::fixed::words::network::MASKED;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::address::counter::count_bits;

block! {
    /// One stage at a time gives quads, which pass on in the same cycle.
    ///
    /// | operands | of |
    /// |---|---|
    /// | `window_quad`, then as many quads of its mask | the first layer |
    /// | `images` | the other layers, and when μ is known |
    /// | `sheared` | a step |
    ///
    /// The mask of a window is kept until its last quad has been given, then it follows in consecutive cycles.
    #[derive(Clone, Copy)]
    pub struct OperandSource {
        data: usize,
        /// Width of an operand.
        operand: usize,
        /// Width of a word of the window.
        limb: usize,
        /// Quads of a window.
        window: usize,
    }
    ports OperandSourcePorts {
        clock;
        reset;
        /// Operands of `estimate`, `data_bits` each, signed; valid with `images_valid`.
        in images: 4 * data;
        /// `images` holds a quad.
        in images_valid;
        /// High limbs of a contact's window, signed; valid with `window_valid`.
        in window_quad: 4 * limb;
        /// Folded mask of the same quad, in units of the word of a masked taxel, signed; valid with `window_valid`.
        in mask: 4 * MASK_BITS;
        /// `window_quad` and `mask` hold a quad.
        in window_valid;
        /// Operands of `shear`, `data_bits` each, signed; valid with `sheared_valid`.
        in sheared: 4 * data;
        /// `sheared` holds a quad.
        in sheared_valid;
        /// A quad of operands, `operand_bits` each, signed; valid with `valid`.
        out quad: 4 * operand;
        /// `quad` holds a quad.
        out valid;
        /// It is one of a window or its mask.
        out of_window;
    }
}

/// Width of a field of the mask: one word of 0 or 1, signed, and the growth of the sum.
pub const MASK_BITS: usize = 4;

impl OperandSource {
    /// For the operands of `model`, if each contact has a μ of its own.
    pub fn of_model(model: &Model) -> Option<Self> {
        let formats = model.formats();
        formats.window_quads.map(|window| OperandSource {
            data: formats.data_bits as usize,
            operand: formats.operand_bits() as usize,
            limb: (formats.fold_bits - formats.input_low_bits) as usize,
            window,
        })
    }

    /// Four signed fields of `bits` bits as operands, times 2^`shift`.
    fn operands<'k>(&self, quad: Expr<'k>, bits: usize, shift: usize) -> Expr<'k> {
        let field =
            |lane: usize| quad.slice(lane * bits, bits).signed().shift_left(shift).resize(self.operand).unsigned();
        concat(&[3, 2, 1, 0].map(field))
    }
}

impl Block for OperandSource {
    fn build<'k>(&self, k: &'k Builder, io: OperandSourcePorts<Inside<'k>>) {
        let (quads, images_valid, window_valid) = (self.window, io.images_valid, io.window_valid);
        let place = k.state("place", Type::unsigned(count_bits(quads)), io.rst, 0);
        let masks = k.state("masks", Type::unsigned(1), io.rst, 0);
        let last = k.wire("last", place.is(quads as u64 - 1));
        k.when(window_valid | *masks, || place.set(last.mux(k.constant(place.bits(), 0), place.plus(1))));
        k.when((window_valid | *masks) & last, || masks.set(window_valid));
        let memory = k.memory("mask_of", quads, 4 * MASK_BITS, Contents::Undefined);
        memory.write(window_valid, *place, io.mask);
        let kept = memory.read(*place);
        let masked = MASKED.trailing_zeros() as usize;
        let mask = self.operands(kept, MASK_BITS, masked);
        let window = self.operands(io.window_quad, self.limb, 0);
        let made = self.operands(images_valid.mux(io.images, io.sheared), self.data, 0);
        io.quad.set(window_valid.mux(window, masks.mux(mask, made)));
        let of_window = io.of_window.set(window_valid | *masks);
        io.valid.set(of_window | images_valid | io.sheared_valid);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const BLOCK: OperandSource = OperandSource { data: 14, operand: 18, limb: 17, window: 5 };

    /// Inputs in the order of the block.
    struct Sources {
        shape: OperandSource,
        /// Masks of the window so far; `None` before the first reset.
        masks: Option<Vec<Word>>,
        /// Index of the mask that passes on, once the window is complete.
        next: Option<usize>,
    }

    impl Reference for Sources {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [images, window, sheared] = [2, 5, 7].map(|input| inputs[input].number() == 1);
            let OperandSource { data, operand, limb, .. } = self.shape;
            let mask = self.masks.as_ref().zip(self.next).map(|(masks, next)| {
                Word::of_fields(&[0, 1, 2, 3].map(|lane| masks[next].signed(lane, MASK_BITS) * MASKED), operand)
            });
            let wide =
                |quad: Word, bits: usize| Word::of_fields(&[0, 1, 2, 3].map(|lane| quad.signed(lane, bits)), operand);
            let read = wide(inputs[3], limb);
            let [image, step] = [1, 6].map(|input: usize| wide(inputs[input], data));
            let made = [(window, read), (images, image), (sheared, step)];
            let made = made.into_iter().find_map(|(given, quad)| given.then_some(quad));
            let bit = |value: bool| self.masks.as_ref().map(|_| value.into());
            vec![mask.or(made), bit(window || mask.is_some()), bit(mask.or(made).is_some())]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let quads = self.shape.window;
            if let (true, Some(masks)) = (inputs[5].number() == 1, &mut self.masks) {
                masks.push(inputs[4]);
                self.next = (masks.len() == quads).then_some(0);
            } else if let (Some(next), Some(masks)) = (self.next, &mut self.masks) {
                self.next = (next + 1 < quads).then_some(next + 1);
                if self.next.is_none() {
                    masks.clear();
                }
            }
            if inputs[0].number() == 1 {
                (self.masks, self.next) = (Some(Vec::new()), None);
            }
        }
    }

    /// Windows with gaps, after each a pause in which its mask leaves, then quads of the others, one at a time.
    fn stimulus(shape: OperandSource) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(9);
        let mut all = Vec::new();
        let mut put = |random: &mut fastrand::Rng, rst: bool, given: Option<usize>| {
            let quad = |random: &mut fastrand::Rng| random_word(random, 4 * shape.data);
            let mask = Word::of_fields(&[(); 4].map(|()| random.i64(-2..=4)), MASK_BITS);
            let given = |one: usize| Word::from(given == Some(one));
            all.push(vec![
                rst.into(),
                quad(random),
                given(1),
                random_word(random, 4 * shape.limb),
                mask,
                given(2),
                quad(random),
                given(3),
            ]);
        };
        for round in 0..80 {
            put(&mut random, round % 9 == 0, None);
            let quads = shape.window;
            for _ in 0..if round % 9 == 8 { random.usize(..=quads) } else { quads } {
                put(&mut random, false, Some(2));
                (0..random.usize(..4)).for_each(|_| put(&mut random, false, None));
            }
            (0..if round % 9 == 8 { 0 } else { quads }).for_each(|_| put(&mut random, false, None));
            for _ in 0..12 {
                let one = [None, Some(1), Some(3)][random.usize(..3)];
                put(&mut random, false, one.filter(|_| round % 9 < 8));
            }
        }
        all
    }

    #[test]
    fn quads_of_one_stage_at_a_time_pass_on() {
        let mut sources = Sources { shape: BLOCK, masks: None, next: None };
        check(&kernel_of(&BLOCK), &stimulus(BLOCK), &mut sources);
    }
}
