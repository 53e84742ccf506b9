//! Selects a constant by the position of the leading one of a vector, without a ripple from bit to bit.

use crate::language::{Builder, Expr};

/// `value(k)` of `bits` bits for the leading one at bit k of `word`; 0 if no bit of `range` is the leading one. Each bit
/// is gated by the OR of all bits above it.
pub fn by_leading_one<'k>(
    k: &'k Builder,
    word: Expr<'k>,
    range: std::ops::Range<usize>,
    bits: usize,
    value: impl Fn(usize) -> usize,
) -> Expr<'k> {
    let first = |at: usize| match word.bits() - 1 - at {
        0 => word.at(at),
        above => word.at(at) & !word.slice(at + 1, above).any(),
    };
    let term = |at: usize| first(at).repeat(bits) & k.constant(bits, value(at) as u64);
    range.map(term).reduce(|all, term| all | term).unwrap_or(k.constant(bits, 0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block;
    use crate::language::testbench::{check, Pipeline};
    use crate::language::{kernel_of, Block, Inside};
    use crate::wire::Word;

    const BITS: usize = 9;
    const RANGE: std::ops::Range<usize> = 2..BITS;

    fn value(at: usize) -> usize {
        (3 * at + 5) % 16
    }

    block! {
        struct LeadingOne {}
        ports LeadingOnePorts {
            /// The word.
            in word: BITS;
            /// The constant of its leading one.
            out value: 4;
        }
    }

    impl Block for LeadingOne {
        fn build<'k>(&self, k: &'k Builder, io: LeadingOnePorts<Inside<'k>>) {
            io.value.set(by_leading_one(k, io.word, RANGE, 4, value));
        }
    }

    #[test]
    fn every_word_selects_the_constant_of_its_leading_one() {
        let of = |inputs: &[Word]| {
            let leading = inputs[0].number().checked_ilog2().map(|at| at as usize).filter(|at| RANGE.contains(at));
            vec![Some(Word::from(leading.map_or(0, value) as u64))]
        };
        let all: Vec<Vec<Word>> = (0..1 << BITS).map(|word: u64| vec![word.into()]).collect();
        check(&kernel_of(&LeadingOne {}), &all, &mut Pipeline::new(0, 1, of));
    }
}
