//! Products with constants as sums of shifts, which take no multiplier: those are reserved for the passes.

use crate::language::{Builder, Expr};

/// `constant` · `value` of `bits` bits, modulo 2^`bits`.
pub fn times<'k>(k: &'k Builder, value: Expr<'k>, constant: usize, bits: usize) -> Expr<'k> {
    let shifts = (0..usize::BITS as usize).filter(|bit| constant >> bit & 1 == 1);
    let sum = shifts.map(|bit| value.shift_left(bit)).reduce(|sum, term| sum + term);
    sum.map_or(k.constant(bits, 0), |sum| sum.resize(bits))
}
