//! Taylor shift along one axis: polynomials of up to four coefficients about a centre moved by −1, 0 or 1, one
//! coefficient per cycle.

use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

block! {
    /// ```text
    /// word (c3, c2, c1, c0) --> s0 --> s1 --> s2 --> s3 --> moved (c0, c1, c2, c3 about the new centre)
    /// ```
    /// Horner's scheme as a systolic chain: register k runs k cycles behind and accumulates the values that pass it, so
    /// that all four are complete when c0 has arrived. They leave in the next four cycles, each before its register
    /// restarts. `element` counts the cycles of a polynomial, `top` is its degree; coefficients above the degree are
    /// ignored, and the outputs in their place are undefined.
    pub struct Horner {
        bits: usize,
    }
    ports HornerPorts {
        clock;
        /// Coefficient 3 − `element` of the polynomial that enters, signed; taken in every cycle.
        in word: bits;
        /// Cycle of the polynomial, 0..=3; valid in every cycle.
        in element: 2;
        /// Degree of the polynomial that enters; valid with `word`.
        in top: 2;
        /// The centre moves.
        in moves;
        /// By −1 instead of +1; valid with `moves`.
        in down;
        /// Coefficient `element` of the previous polynomial about the new centre, signed; combinational from `element`,
        /// in the four cycles after that polynomial's last coefficient.
        out moved: bits;
    }
}

impl Horner {
    /// For coefficients of `bits` bits.
    pub fn new(bits: usize) -> Self {
        Horner { bits }
    }
}

impl Block for Horner {
    fn build<'k>(&self, k: &'k Builder, io: HornerPorts<Inside<'k>>) {
        let bits = self.bits;
        let [s0, s1, s2, s3] = ["s0", "s1", "s2", "s3"].map(|name| k.register(name, Type::unsigned(bits)));
        let inverted = k.wire("inverted", concat(&vec![io.down; bits]));
        k.comment("Zero at the start of a polynomial; complement, with a carry, where the centre moves by -1.");
        // Register `at` takes coefficient 3 − element + at.
        for (at, (register, incoming)) in [(&s0, io.word), (&s1, *s0), (&s2, *s1)].into_iter().enumerate() {
            let starts = io.element.equals((k.constant(2, (3 + at as u64) % 4) - io.top).low(2));
            let adds = k.wire(&format!("adds{at}"), io.moves & !starts);
            let kept = adds.mux(**register ^ inverted, k.constant(bits, 0));
            let sum = (incoming + kept + (adds & io.down)).low(bits);
            match at {
                0 => register.set(sum),
                1 => k.when(io.element.any(), || register.set(sum)),
                _ => k.when(io.element.at(1), || register.set(sum)),
            }
        }
        k.when(io.element.is(3), || s3.set(*s2));
        io.moved.set(io.element.case(&[(0, *s0), (1, *s1), (2, *s2)], *s3));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const BITS: usize = 30;

    /// Whole polynomials, moved by the binomial theorem.
    #[derive(Default)]
    struct Polynomials {
        entering: [i64; 4],
        moved: Option<(usize, [i64; 4])>,
    }

    impl Reference for Polynomials {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let element = inputs[1].number() as usize;
            let moved = self.moved.filter(|(top, _)| element <= *top);
            vec![moved.map(|(_, moved)| Word::of_fields(&[moved[element]], BITS))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [element, top] = [1, 2].map(|k| inputs[k].number() as usize);
            self.entering[3 - element] = if 3 - element <= top { inputs[0].signed(0, BITS) } else { 0 };
            if element == 3 {
                let by = inputs[3].number() as i64 * (1 - 2 * inputs[4].number() as i64);
                let [c0, c1, c2, c3] = self.entering;
                let square = by * by;
                let moved =
                    [c0 + by * c1 + square * c2 + by * c3, c1 + 2 * by * c2 + 3 * square * c3, c2 + 3 * by * c3, c3];
                self.moved = Some((top, moved));
            }
        }
    }

    #[test]
    fn the_centre_of_polynomials_back_to_back_moves() {
        let mut random = fastrand::Rng::with_seed(3);
        let polynomial = |_| {
            let [moves, down] = [random.bool(), random.bool()].map(Word::from);
            let top = Word::from(random.u64(..4));
            // Words above the degree are arbitrary.
            let cycle = |element| {
                let word = Word::of_fields(&[random.i64(-(1 << 23)..1 << 23)], BITS);
                vec![word, Word::from(element), top, moves, down]
            };
            (0..4).map(cycle).collect::<Vec<_>>()
        };
        let all: Vec<Vec<Word>> = (0..1000).flat_map(polynomial).collect();
        check(&kernel_of(&Horner::new(BITS)), &all, &mut Polynomials::default());
    }
}
