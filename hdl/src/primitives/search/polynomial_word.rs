//! Layout of polynomials in a word: coefficient by coefficient, each for all lanes.

use dermis_golden::fixed::stages::search::Polynomial;

use crate::language::{concat, Expr};
use crate::wire::Word;

/// Layout of `lanes` polynomials in one word: coefficient k of lane l is `widths[k]` bits at `offset(k) + l·widths[k]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolynomialWord {
    /// Number of polynomials in the word.
    pub lanes: usize,
    /// Width of each coefficient in bits, signed.
    pub widths: Vec<usize>,
}

impl PolynomialWord {
    /// Layout of `lanes` polynomials with coefficients of `widths` bits.
    pub fn new(lanes: usize, widths: &[u32]) -> Self {
        PolynomialWord { lanes, widths: widths.iter().map(|&w| w as usize).collect() }
    }

    /// Bit offset of coefficient `k` of lane 0.
    pub fn offset(&self, k: usize) -> usize {
        self.widths[..k].iter().sum::<usize>() * self.lanes
    }

    /// Width of the whole word.
    pub fn bits(&self) -> usize {
        self.offset(self.widths.len())
    }

    /// The polynomial of `lane` in `word`; coefficients beyond the degree are 0.
    pub fn get(&self, word: &Word, lane: usize) -> Polynomial {
        std::array::from_fn(|k| match self.widths.get(k) {
            Some(&bits) => {
                let raw = word.field(self.offset(k) + lane * bits, bits);
                (raw << (64 - bits)) as i64 >> (64 - bits)
            }
            None => 0,
        })
    }

    /// Writes the polynomial of `lane` into `word`.
    pub fn put(&self, word: &mut Word, lane: usize, polynomial: &Polynomial) {
        for (k, &bits) in self.widths.iter().enumerate() {
            word.set(self.offset(k) + lane * bits, bits, polynomial[k] as u64);
        }
    }

    /// Coefficient `k` of `lane` in `word`, signed.
    pub fn coefficient<'k>(&self, word: Expr<'k>, k: usize, lane: usize) -> Expr<'k> {
        word.slice(self.offset(k) + lane * self.widths[k], self.widths[k]).signed()
    }

    /// The word of `polynomials`, one list of coefficients per lane.
    pub fn join<'k>(&self, polynomials: &[Vec<Expr<'k>>]) -> Expr<'k> {
        let each = (0..self.widths.len()).flat_map(|k| polynomials.iter().map(move |polynomial| polynomial[k]));
        concat(&each.rev().collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::language::{kernel_of, Block, Builder, Inside};

    #[test]
    fn coefficients_of_all_lanes_lie_side_by_side() {
        let layout = PolynomialWord::new(3, &[20, 7, 43]);
        assert_eq!((layout.offset(1), layout.offset(2), layout.bits()), (60, 81, 210));
        let mut word = Word::default();
        let polynomials: [Polynomial; 3] =
            [[1, -2, 3], [-4, 63, -6], [7, -64, 9]].map(|[a, b, c]| [a, b, c, 0, 0, 0, 0, 0, 0, 0]);
        polynomials.iter().enumerate().for_each(|(lane, polynomial)| layout.put(&mut word, lane, polynomial));
        assert_eq!([0, 1, 2].map(|lane| layout.get(&word, lane)), polynomials);
        // Coefficient 1 of lane 2, by hand.
        assert_eq!(word.field(3 * 20 + 2 * 7, 7), 64);
    }

    block! {
        /// Two polynomials change places.
        struct Exchange {
            layout: PolynomialWord,
        }
        ports ExchangePorts {
            /// Two polynomials.
            in word: layout.bits();
            /// The polynomial of lane 1 in lane 0 and that of lane 0 in lane 1; combinational.
            out exchanged: layout.bits();
        }
    }

    impl Block for Exchange {
        fn build<'k>(&self, _: &'k Builder, io: ExchangePorts<Inside<'k>>) {
            let coefficient = |n, lane| self.layout.coefficient(io.word, n, lane).unsigned();
            let lane = |lane: usize| (0..3).map(|n| coefficient(n, lane)).collect();
            io.exchanged.set(self.layout.join(&[lane(1), lane(0)]));
        }
    }

    #[test]
    fn a_kernel_takes_polynomials_apart_and_joins_them() {
        let layout = PolynomialWord::new(2, &[20, 7, 33]);
        let of = |inputs: &[Word]| {
            let mut exchanged = Word::default();
            // Offset and width of the coefficients of lane 0.
            for (offset, bits) in [(0, 20), (40, 7), (54, 33)] {
                exchanged.set(offset, bits, inputs[0].field(offset + bits, bits));
                exchanged.set(offset + bits, bits, inputs[0].field(offset, bits));
            }
            vec![Some(exchanged)]
        };
        let stimulus = random_words(300, &[layout.bits()]);
        check(&kernel_of(&Exchange { layout }), &stimulus, &mut Pipeline::new(0, 1, of));
    }
}
