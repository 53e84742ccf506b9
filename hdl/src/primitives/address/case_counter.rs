//! A counter whose limit depends on the case, and expressions for values that depend on the case.

use crate::block;
use crate::language::{Block, Builder, Expr, Inside};
use crate::primitives::address::counter::{count, count_bits};

block! {
    /// As [`Counter`](super::counter::Counter), with the limit of case `case_index`. When `case_index` changes, the count must be below the
    /// new limit, or be cleared before it is enabled again.
    pub struct CaseCounter {
        limits: Vec<usize>,
    }
    ports CaseCounterPorts {
        clock;
        /// Index of the case; where it changes, the count is below the new limit or is cleared before `enable`.
        in case_index: count_bits(limits.len());
        /// Sets the count to 0 at the clock edge, with priority over `enable`.
        in clear;
        /// Advances the count at the clock edge; from the last value to 0.
        in enable;
        /// The count, unsigned; valid from the first `clear` on.
        out value: count_bits(largest(limits));
        /// The count is at its last value, the limit of the case − 1; combinational.
        out last;
    }
}

impl CaseCounter {
    /// `limits[case]` is the number of counts of each case; 0 is taken as 1.
    pub fn new(limits: &[usize]) -> Self {
        CaseCounter { limits: limits.to_vec() }
    }
}

impl Block for CaseCounter {
    fn build<'k>(&self, k: &'k Builder, io: CaseCounterPorts<Inside<'k>>) {
        let ends: Vec<usize> = self.limits.iter().map(|&limit| limit.max(1) - 1).collect();
        let end = value_by_case(k, io.case_index, &ends, io.value.bits());
        count(k, [io.clear, io.enable], end, [io.value, io.last]);
    }
}

/// The largest of `limits`, 1 if there are none.
pub fn largest(limits: &[usize]) -> usize {
    limits.iter().copied().max().unwrap_or(1)
}

/// The value of case `case_index`, of `bits` bits; a constant where all are equal.
pub fn value_by_case<'k>(k: &'k Builder, case_index: Expr<'k>, values: &[usize], bits: usize) -> Expr<'k> {
    let constants: Vec<Expr> = values.iter().map(|&value| k.constant(bits, value as u64)).collect();
    expression_by_case(case_index, &constants).unwrap_or(k.constant(bits, 0))
}

/// The one of `values` for case `case_index`; the first without a selection where all are equal. `None` without values.
pub fn expression_by_case<'k>(case_index: Expr<'k>, values: &[Expr<'k>]) -> Option<Expr<'k>> {
    let (&first, rest) = values.split_first()?;
    let arms: Vec<(u64, Expr)> = (1..).zip(rest.iter().copied()).collect();
    let equal = rest.iter().all(|value| value.is_same(first));
    Some(if equal { first } else { case_index.case(&arms, first) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::primitives::address::counter::tests::counts;

    #[test]
    fn values_wrap_at_the_limit_of_the_case() {
        counts(&kernel_of(&CaseCounter::new(&[5, 11])), &[5, 11]);
    }
}
