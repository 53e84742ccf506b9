//! A counter whose limit depends on the case, and expressions for values that depend on the case.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Expr};
use crate::primitives::address::counter::{count_bits, kernel};
use crate::wire::Wire;

/// As [`Counter`](super::counter::Counter), with the limit of case `which`. When `which` changes, the count must be below the
/// new limit, or be cleared before it is enabled again.
#[derive(dermis_hdl_derive::Block)]
pub struct CaseCounter {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case; where it changes, the count is below the new limit or is cleared before `enable`.
    pub which: Wire<In>,
    /// Sets the count to 0 at the clock edge, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// Advances the count at the clock edge; from the last value to 0.
    pub enable: Signal<In, Bit>,
    /// The count, unsigned; valid from the first `clear` on.
    pub value: Wire<Out>,
    /// The count is at its last value, the limit of the case − 1; combinational.
    pub last: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(CaseCounter, clock clk, inputs [which, clear, enable], outputs [value, last]);

impl CaseCounter {
    /// `limits[case]` is the number of counts of each case; 0 is taken as 1.
    pub fn new(limits: &[usize]) -> Self {
        let (which, bits) = (count_bits(limits.len()), count_bits(largest(limits)));
        let block = CaseCounter {
            clk: Default::default(),
            which: Wire::new(which),
            clear: Default::default(),
            enable: Default::default(),
            value: Wire::new(bits),
            last: Default::default(),
            kernel: Body::default(),
        };
        let ends: Vec<usize> = limits.iter().map(|&limit| limit.max(1) - 1).collect();
        block.bind(kernel(bits, |k, bits| value_by_case(k, k.input("which", which), &ends, bits)))
    }
}

/// The largest of `limits`, 1 if there are none.
pub fn largest(limits: &[usize]) -> usize {
    limits.iter().copied().max().unwrap_or(1)
}

/// The value of case `which`, of `bits` bits; a constant where all are equal.
pub fn value_by_case<'k>(k: &'k Builder, which: Expr<'k>, values: &[usize], bits: usize) -> Expr<'k> {
    let constants: Vec<Expr> = values.iter().map(|&value| k.constant(bits, value as u64)).collect();
    expression_by_case(which, &constants).unwrap_or(k.constant(bits, 0))
}

/// The one of `values` for case `which`; the first without a selection where all are equal. `None` without values.
pub fn expression_by_case<'k>(which: Expr<'k>, values: &[Expr<'k>]) -> Option<Expr<'k>> {
    let (&first, rest) = values.split_first()?;
    let arms: Vec<(u64, Expr)> = (1..).zip(rest.iter().copied()).collect();
    let equal = rest.iter().all(|value| value.is_same(first));
    Some(if equal { first } else { which.case(&arms, first) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives::address::counter::tests::counts;

    #[test]
    fn values_wrap_at_the_limit_of_the_case() {
        counts(CaseCounter::new(&[5, 11]).kernel.kernel(), &[5, 11]);
    }
}
