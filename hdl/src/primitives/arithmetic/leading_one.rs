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
