//! Products with constants as sums of shifts, which take no multiplier: those are reserved for the passes.

use crate::language::{Builder, Expr};

/// `constant` · `value` of `bits` bits, modulo 2^`bits`.
pub fn times<'k>(k: &'k Builder, value: Expr<'k>, constant: usize, bits: usize) -> Expr<'k> {
    let shifts = (0..usize::BITS as usize).filter(|bit| constant >> bit & 1 == 1);
    let sum = shifts.map(|bit| value.shift_left(bit)).reduce(|sum, term| sum + term);
    sum.map_or(k.constant(bits, 0), |sum| sum.resize(bits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Pipeline};
    use crate::language::Body;
    use crate::wire::Word;

    #[test]
    fn products_are_exact_modulo_their_width() {
        const BITS: usize = 6;
        // Constant and width of the product: wider than it, as wide, narrower.
        const PRODUCTS: [(usize, usize); 5] = [(0, 4), (1, 6), (5, 12), (12, 10), (127, 8)];
        let k = Builder::combinational("constant_product");
        let value = k.input("value", BITS);
        let names = PRODUCTS.map(|(constant, bits)| (format!("by_{constant}"), bits));
        for (&(constant, bits), (name, _)) in PRODUCTS.iter().zip(&names) {
            k.wire(name, times(&k, value, constant, bits));
        }
        let outputs = names.each_ref().map(|(name, bits)| (name.as_str(), *bits));
        let body = Body::new(k.finish(), &[("value", BITS)], &outputs);
        let of = |inputs: &[Word]| {
            PRODUCTS.map(|(constant, bits)| Some(Word::from(inputs[0].number() * constant as u64 % (1 << bits)))).into()
        };
        let all: Vec<Vec<Word>> = (0..1 << BITS).map(|value: u64| vec![value.into()]).collect();
        check(body.kernel(), &all, &mut Pipeline::new(0, PRODUCTS.len(), of));
    }
}
