//! Description of a sweep of the search: the word that travels beside its totals to their comparison.

pub use dermis_golden::fixed::plan::resources::position_bits;
use dermis_golden::fixed::plan::resources::SEARCH_BUFFERS;

use crate::language::Expr;
#[cfg(test)]
use crate::wire::Word;

/// Width of a squared distance in grid steps of the last level, in bits.
pub fn square_bits() -> usize {
    2 * position_bits()
}

/// Width of the number of a search buffer, in bits.
pub const BUFFER_BITS: usize = 2;
/// Number of the buffer that holds the polynomials about μ = 0, as `unfold` delivers them.
pub const START: usize = 3;
/// Number of buffers that sweeps write.
pub const BUFFERS: usize = SEARCH_BUFFERS;

/// Bit offset of each field in the word: centre x, centre y, square, buffer, coarse, closes; last the width of the
/// word.
pub fn offsets() -> [usize; 7] {
    let p = position_bits();
    let buffer = 2 * p + square_bits();
    let coarse = buffer + BUFFER_BITS;
    [0, p, 2 * p, buffer, coarse, coarse + 1, coarse + 2]
}

/// Width of a sweep's word, in bits.
pub fn sweep_bits() -> usize {
    offsets()[6]
}

/// The fields of a sweep's word.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'k> {
    /// Centre of the nine candidates, x and y in grid steps, signed.
    pub centre: [Expr<'k>; 2],
    /// |centre|².
    pub square: Expr<'k>,
    /// Buffer that holds the polynomials about the centre.
    pub buffer: Expr<'k>,
    /// The sweep belongs to the coarse grid.
    pub coarse: Expr<'k>,
    /// The next sweep is set up only after the comparison of this one.
    pub closes: Expr<'k>,
}

impl<'k> Fields<'k> {
    /// The fields of `word`.
    pub fn of(word: Expr<'k>) -> Self {
        let [x, y, square, buffer, coarse, closes, _] = offsets();
        Fields {
            centre: [x, y].map(|offset| word.slice(offset, position_bits()).signed()),
            square: word.slice(square, square_bits()),
            buffer: word.slice(buffer, BUFFER_BITS),
            coarse: word.at(coarse),
            closes: word.at(closes),
        }
    }
}

/// One sweep in plain integers, for references; fields as of [`Fields`].
#[cfg(test)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sweep {
    /// Centre of the nine candidates, x and y in grid steps.
    pub centre: [i64; 2],
    /// |centre|².
    pub square: i64,
    /// Buffer that holds the polynomials about the centre.
    pub buffer: usize,
    /// The sweep belongs to the coarse grid.
    pub coarse: bool,
    /// The next sweep is set up only after the comparison of this one.
    pub closes: bool,
}

#[cfg(test)]
impl Sweep {
    /// The sweep as a word.
    pub fn word(&self) -> Word {
        let [x, y, square, buffer, coarse, closes, _] = offsets();
        let mut word = Word::default();
        word.set(x, position_bits(), self.centre[0] as u64);
        word.set(y, position_bits(), self.centre[1] as u64);
        word.set(square, square_bits(), self.square as u64);
        word.set(buffer, BUFFER_BITS, self.buffer as u64);
        word.set(coarse, 1, u64::from(self.coarse));
        word.set(closes, 1, u64::from(self.closes));
        word
    }

    /// The sweep that `word` describes.
    pub fn of_word(word: &Word) -> Self {
        let [_, _, square, buffer, coarse, closes, _] = offsets();
        Sweep {
            centre: [0, 1].map(|axis| word.signed(axis, position_bits())),
            square: word.field(square, square_bits()) as i64,
            buffer: word.field(buffer, BUFFER_BITS) as usize,
            coarse: word.field(coarse, 1) == 1,
            closes: word.field(closes, 1) == 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_gives_its_sweep_back() {
        let sweep = Sweep { centre: [-384, 127], square: 163_585, buffer: 2, coarse: false, closes: true };
        assert_eq!(Sweep::of_word(&sweep.word()), sweep);
    }
}
