//! What a sweep of the search is: the word that accompanies its totals to the judgement.

pub use dermis_golden::fixed::resources::position_bits;
use dermis_golden::fixed::resources::SEARCH_BUFFERS;

use crate::wire::Word;

/// Bits of a squared distance in grid steps of the last level.
pub fn square_bits() -> usize {
    2 * position_bits()
}

/// Bits of a search buffer's number.
pub const BUFFER_BITS: usize = 2;
/// The buffer that holds the polynomials about μ = 0, as they came in.
pub const START: usize = 3;
/// Buffers that sweeps write.
pub const BUFFERS: usize = SEARCH_BUFFERS;

/// One sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sweep {
    /// Centre of the nine candidates, in grid steps.
    pub centre: [i64; 2],
    /// |centre|².
    pub square: i64,
    /// Buffer that holds the polynomials about the centre.
    pub buffer: usize,
    /// It belongs to the coarse grid.
    pub coarse: bool,
    /// The next sweep is set up when this one has been judged.
    pub closes: bool,
}

/// Offset of each field in the word, and the word's bits last: centre x, centre y, square, buffer, coarse, closes.
pub fn offsets() -> [usize; 7] {
    let p = position_bits();
    let buffer = 2 * p + square_bits();
    let coarse = buffer + BUFFER_BITS;
    [0, p, 2 * p, buffer, coarse, coarse + 1, coarse + 2]
}

/// Bits of a sweep's word.
pub fn sweep_bits() -> usize {
    offsets()[6]
}

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

    /// The sweep of a word.
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

/// Verilog that names the fields of the sweep in vector `word`: `<prefix>centre_x`, `centre_y`, `square`, `buffer`,
/// `coarse`, `closes`.
pub fn unpack(word: &str, prefix: &str) -> String {
    let names = ["centre_x", "centre_y", "square", "buffer", "coarse", "closes"];
    let at = offsets();
    names
        .iter()
        .enumerate()
        .map(|(k, name)| match at[k + 1] - at[k] {
            1 => format!("wire {prefix}{name} = {word}[{}];\n", at[k]),
            bits => format!("wire [{}:0] {prefix}{name} = {word}[{}:{}];\n", bits - 1, at[k + 1] - 1, at[k]),
        })
        .collect()
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
