//! Stage `unfold`: words from the butterfly to the coefficients of the taxels' polynomials, and their sum.

use dermis_golden::fixed::plan::serial::{polynomials, word_bits};
use dermis_golden::fixed::words::formats::Formats;
use dermis_golden::fixed::words::schedule::{vectors, EXPONENTS};

use super::{bits_of, one_of};
use crate::block;
use crate::language::{Block, Builder, Inside, Type};
use crate::primitives::count_bits;

block! {
    /// Words of v_ij, one vector after the other, to words of the polynomial memory. Polynomial 0 is the sum,
    /// polynomial 1 + p the taxel at place p; coefficient v_ij of a polynomial is at 4j + i.
    pub struct Unfold {
        /// Width of a word from the butterfly, of a taxel's coefficient and of a word of the memory.
        transformed: usize,
        taxel: usize,
        data: usize,
        /// Width of a polynomial's number.
        place: usize,
        taxels: u64,
        /// Number of the v_ij.
        vectors: usize,
    }
    ports UnfoldPorts {
        clock;
        reset;
        /// A frame starts: the words of v_00 come next.
        in start;
        /// A word from the butterfly, signed, places in order; valid with `valid`.
        in transformed: transformed;
        /// `transformed` is valid.
        in valid;
        /// A taxel's coefficient, `vector_bits` + 2 wide, signed; valid with `taxel_valid`.
        out taxel: taxel;
        /// `taxel` is valid.
        out taxel_valid;
        /// Write `data` to the polynomial memory.
        out write;
        /// `{0, polynomial, coefficient}`: lower region; valid with `write`.
        out address: 1 + place + 4;
        /// Coefficient of a taxel or of the sum, signed; valid with `write`.
        out data: data;
    }
}

impl Unfold {
    /// With the widths of `formats`; words from the butterfly have `transformed` bits.
    pub fn new(formats: &Formats, transformed: usize) -> Self {
        Unfold {
            transformed,
            taxel: formats.vector_bits as usize + 2,
            data: word_bits(formats),
            place: count_bits(polynomials(formats)),
            taxels: 4 * formats.quads as u64,
            vectors: vectors(formats.degree),
        }
    }
}

/// Position 4j + i of coefficient v_ij in its polynomial.
fn code(vector: usize) -> usize {
    let (i, j) = EXPONENTS[vector];
    (4 * j + i) as usize
}

impl Block for Unfold {
    fn build<'k>(&self, k: &'k Builder, io: UnfoldPorts<Inside<'k>>) {
        let Unfold { taxel, data, place, taxels, vectors, .. } = *self;
        let bits = count_bits(vectors + 1);
        let begins = k.wire("begins", io.start | io.rst);
        let word = k.register("word", Type::unsigned(taxel));
        let bit = Type::unsigned(1);
        let (valid_then, closing) = (k.state("valid_then", bit, io.rst, 0), k.state("closing", bit, io.rst, 0));
        let polynomial = k.state("polynomial", Type::unsigned(place), begins, 1);
        let vector = k.state("vector", Type::unsigned(bits), begins, 0);
        let sum = k.state("sum", Type::unsigned(data), begins, 0);

        let last = k.wire("last", *valid_then & polynomial.is(taxels));
        let of = |of: &dyn Fn(usize) -> usize, width: usize| {
            bits_of(width, |bit| {
                let set: Vec<usize> = (0..vectors).filter(|&vector| of(vector) >> bit & 1 == 1).collect();
                one_of(k, *vector, &set)
            })
        };
        let degree = k.wire("degree", of(&|vector| (EXPONENTS[vector].0 + EXPONENTS[vector].1) as usize, 2));
        k.comment("An extra bit on the right keeps the half LSB for the rounding.");
        let doubled = io.transformed.concat(k.constant(1, 0)).signed();
        let half = k.wire("half", doubled.shift_right_by(degree.concat(k.constant(1, 0))).unsigned().plus(1));
        let wider = k.wire("wider", word.signed().extend(data).unsigned());
        word.set(half.slice(1, taxel));
        valid_then.set(io.valid);
        closing.set(last);
        k.when(*valid_then, || {
            polynomial.set(last.mux(k.constant(place, 1), polynomial.plus(1)));
            sum.set((*sum + wider).low(data));
        });
        k.when(*closing, || {
            vector.set(vector.plus(1));
            sum.set(k.constant(data, 0));
        });
        io.taxel.set(*word);
        io.taxel_valid.set(*valid_then);
        io.write.set(*valid_then | *closing);
        let zero = k.constant(place, 0);
        let own = closing.mux(zero, *polynomial).concat(of(&code, 4));
        io.address.set(k.constant(1, 0).concat(own));
        io.data.set(closing.mux(*sum, wider));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::round_shift;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const SIZES: Unfold = Unfold { transformed: 22, taxel: 22, data: 27, place: 4, taxels: 12, vectors: 10 };

    /// Words of the vector so far; whether the last one has just come, or the sum is written.
    #[derive(Default)]
    struct Vectors {
        vector: usize,
        words: Vec<i64>,
        new: bool,
        closing: bool,
        reset: bool,
    }

    impl Reference for Vectors {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let writes = self.new || self.closing;
            let word = if self.closing { self.words.iter().sum() } else { self.words.last().copied().unwrap_or(0) };
            let place = if self.closing { 0 } else { self.words.len() };
            let (i, j) = EXPONENTS[self.vector % EXPONENTS.len()];
            let address = (place as u64) << 4 | u64::from(4 * j + i);
            vec![
                self.words.last().filter(|_| self.new).map(|&word| Word::of_fields(&[word], SIZES.taxel)),
                bit(self.new),
                bit(writes),
                (self.reset && writes).then(|| Word::from(address)),
                (self.reset && writes).then(|| Word::of_fields(&[word], SIZES.data)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, start, valid] = [0, 1, 3].map(|k| inputs[k].number() == 1);
            if self.closing {
                (self.words, self.vector) = (Vec::new(), self.vector + 1);
            }
            self.closing = self.new && self.words.len() == SIZES.taxels as usize;
            self.new = valid;
            if valid {
                let (i, j) = EXPONENTS[self.vector % EXPONENTS.len()];
                self.words.push(round_shift(inputs[2].signed(0, SIZES.transformed), 2 * (i + j)));
            }
            if rst || start {
                *self = Vectors { reset: self.reset || rst, ..Vectors::default() };
            }
        }
    }

    /// Frames of ten vectors in bursts of four words, with a pause after each vector; resets.
    #[test]
    fn coefficients_and_their_sum_have_their_places() {
        let mut random = fastrand::Rng::with_seed(25);
        let cycle = |rst: bool, start: bool, valid: bool, word: i64| {
            vec![Word::from(rst), Word::from(start), Word::of_fields(&[word], SIZES.transformed), Word::from(valid)]
        };
        let mut all = vec![cycle(true, false, false, 0); 2];
        for _ in 0..25 {
            all.push(cycle(false, true, false, 0));
            for _ in 0..SIZES.vectors {
                for _ in 0..SIZES.taxels {
                    let valid = |random: &mut fastrand::Rng| random.i64(-(1 << 21)..1 << 21) >> random.u8(..20);
                    all.push(cycle(false, false, true, valid(&mut random)));
                    (0..random.u8(..3)).for_each(|_| all.push(cycle(false, false, false, 0)));
                }
                (0..4).for_each(|_| all.push(cycle(false, false, false, 0)));
            }
            if random.bool() {
                all.push(cycle(true, false, false, 0));
            }
        }
        check(&kernel_of(&SIZES), &all, &mut Vectors::default());
    }
}
