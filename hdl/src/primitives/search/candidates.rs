//! Values of p at the nine candidates of the 3×3 grid about the centre.

use dermis_golden::fixed::words::schedule::EXPONENTS;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside};
use crate::primitives::search::polynomial_word::PolynomialWord;

block! {
    /// Polynomials in; nine values per lane two cycles later. Value k = 3·(y + 1) + (x + 1) of lane l is field 9·l + k,
    /// as wide as the constant coefficient. First cycle: for each power of y, the three values over x; second cycle:
    /// their combination over y. 21 adders per lane at degree 3.
    pub struct Candidates {
        layout: PolynomialWord,
    }
    ports CandidatesPorts {
        clock;
        /// One polynomial per lane, in the layout given; a new word may come each cycle.
        in word: layout.bits();
        /// Nine signed values per lane; [`LATENCY`] cycles after `word`.
        out values: 9 * layout.lanes * layout.widths[0];
    }
}

/// Cycles from `word` to `values`.
pub const LATENCY: usize = 2;

impl Candidates {
    /// For polynomials in `layout`.
    pub fn new(layout: &PolynomialWord) -> Self {
        Candidates { layout: layout.clone() }
    }
}

impl Block for Candidates {
    fn build<'k>(&self, k: &'k Builder, io: CandidatesPorts<Inside<'k>>) {
        let lane = |lane| k.scope(&format!("lane_{lane}"), || values_of_lane(k, &self.layout, io.word, lane));
        let values: Vec<Expr> = (0..self.layout.lanes).flat_map(lane).collect();
        io.values.set(concat(&values.into_iter().rev().collect::<Vec<_>>()));
    }
}

/// An even and an odd part, of which each may be absent: the values of their polynomial at −1, 0 and 1, where the even
/// part at 0 is `constant`.
fn at_three<'k>(constant: Expr<'k>, even: Expr<'k>, odd: Option<Expr<'k>>) -> [Expr<'k>; 3] {
    match odd {
        Some(odd) => [(even - odd).low(even.bits()), constant.unsigned(), (even + odd).low(even.bits())],
        None => [even, constant, even].map(Expr::unsigned),
    }
}

/// The nine values of one lane, row-major.
fn values_of_lane<'k>(k: &'k Builder, layout: &PolynomialWord, word: Expr<'k>, lane: usize) -> Vec<Expr<'k>> {
    let bits = layout.widths[0];
    let coefficient = |exponents: (u32, u32)| {
        let index = EXPONENTS.iter().position(|&e| e == exponents).filter(|&index| index < layout.widths.len());
        index.map(|index| layout.coefficient(word, index, lane).resize(bits).unsigned())
    };
    let sum = |a: Expr<'k>, b: Option<Expr<'k>>| b.map_or(a, |b| (a + b).low(bits));
    // Terms of y^j at x = −1, 0, 1.
    let row = |j: u32| {
        let constant = coefficient((0, j))?;
        let even = k.wire(&format!("even_{j}"), sum(constant, coefficient((2, j))));
        let odd = coefficient((1, j)).map(|term| k.wire(&format!("odd_{j}"), sum(term, coefficient((3, j)))));
        let values = at_three(constant, even, odd);
        Some(std::array::from_fn::<_, 3, _>(|x| k.delay(&format!("row_{j}_{x}"), values[x])))
    };
    let rows = [0, 1, 2, 3].map(row);
    let columns = [0, 1, 2].map(|x| {
        let of = |j: usize| rows[j].map(|row: [Expr; 3]| row[x]);
        let constant = of(0).unwrap_or(k.constant(bits, 0));
        let level = k.wire(&format!("level_{x}"), sum(constant, of(2)));
        let slope = of(1).map(|term| k.wire(&format!("slope_{x}"), sum(term, of(3))));
        at_three(constant, level, slope)
    });
    (0..9).map(|n| k.delay(&format!("value_{n}"), columns[n % 3][n / 3])).collect()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::candidates;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    fn is_the_polynomial(lanes: usize, widths: &[u32]) {
        let layout = PolynomialWord::new(lanes, widths);
        let block = Candidates::new(&layout);
        let bits = widths[0] as usize;
        let expected = |inputs: &[Word]| {
            let values: Vec<i64> = (0..lanes).flat_map(|lane| candidates(&layout.get(&inputs[0], lane))).collect();
            vec![Some(Word::of_fields(&values, bits))]
        };
        check(&kernel_of(&block), &random_words(500, &[layout.bits()]), &mut Pipeline::new(LATENCY, 1, expected));
    }

    /// Degrees 3, 2 and 1; words of all widths, so that sums wrap.
    #[test]
    fn values_are_those_of_the_polynomial() {
        is_the_polynomial(4, &[27, 26, 26, 25, 25, 25, 20, 22, 21, 20]);
        is_the_polynomial(1, &[34, 30, 31, 35, 29, 28]);
        is_the_polynomial(2, &[19, 18, 17]);
    }
}
