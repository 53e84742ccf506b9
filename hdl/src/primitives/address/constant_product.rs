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
    use crate::block;
    use crate::language::testbench::{check, Pipeline};
    use crate::language::{concat, kernel_of, Block, Inside};
    use crate::wire::Word;

    const BITS: usize = 6;
    /// Constant and width of the product: wider than it, as wide, narrower.
    const PRODUCTS: [(usize, usize); 5] = [(0, 4), (1, 6), (5, 12), (12, 10), (127, 8)];
    /// Width of the widest product.
    const WIDE: usize = 12;

    block! {
        struct Products {}
        ports ProductsPorts {
            /// The number.
            in value: BITS;
            /// Its products, the first lowest.
            out products: PRODUCTS.len() * WIDE;
        }
    }

    impl Block for Products {
        fn build<'k>(&self, k: &'k Builder, io: ProductsPorts<Inside<'k>>) {
            let product = |&(constant, bits): &(usize, usize)| times(k, io.value, constant, bits).extend(WIDE);
            io.products.set(concat(&PRODUCTS.iter().rev().map(product).collect::<Vec<_>>()));
        }
    }

    #[test]
    fn products_are_exact_modulo_their_width() {
        let of = |inputs: &[Word]| {
            let product =
                |(constant, bits): (usize, usize)| (inputs[0].number() * constant as u64 % (1 << bits)) as i64;
            vec![Some(Word::of_fields(&PRODUCTS.map(product), WIDE))]
        };
        let all: Vec<Vec<Word>> = (0..1 << BITS).map(|value: u64| vec![value.into()]).collect();
        check(&kernel_of(&Products {}), &all, &mut Pipeline::new(0, 1, of));
    }
}
