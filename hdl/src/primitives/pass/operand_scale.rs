//! Operands of the MAC lanes times μ, for the steps of `relax`.

use dermis_golden::fixed::stages::pass::POSITION_SHIFT;
use dermis_golden::fixed::words::formats::MULTIPLIER_BITS;

use crate::block;
use crate::language::{concat, Block, Builder, Inside};
use crate::primitives::pass::pass_program::FACTOR_BITS;
use crate::primitives::search::sweep::position_bits;

block! {
    /// Operands in; the same, times the position of μ1 or μ2 over 512 and rounded half up if `factor` says so,
    /// [`SCALE_LATENCY`] cycles later. For a network that gives one μ.
    #[derive(Default)]
    pub struct OperandScale {}
    ports OperandScalePorts {
        clock;
        /// Operand of each lane group, four times 18 bits, signed; taken in every cycle.
        in operands: 4 * M;
        /// 0 = unchanged, 1 = times μ1, 2 = times μ2; valid with `operands`.
        in factor: FACTOR_BITS;
        /// Position of μ1 in mu_max/384, signed; valid with a `factor` of 1.
        in position_x: position_bits();
        /// Position of μ2 in mu_max/384, signed; valid with a `factor` of 2.
        in position_y: position_bits();
        /// The operands, four times 18 bits, signed.
        out scaled: 4 * M;
    }
}

const M: usize = MULTIPLIER_BITS as usize;
/// Cycles from `operands` to `scaled`.
pub const SCALE_LATENCY: usize = 3;

impl Block for OperandScale {
    fn build<'k>(&self, k: &'k Builder, io: OperandScalePorts<Inside<'k>>) {
        k.comment("Operands and μ are registered in front of the multipliers: both come from far away.");
        let taken = k.delay("taken", io.operands);
        let position = k.delay("position", io.factor.at(1).mux(io.position_y.signed(), io.position_x.signed()));
        let scales = k.delay("scales", k.delay("multiplies", io.factor.any()));
        let kept = k.delay("kept", taken);
        let scaled = |parity: usize| {
            let operand = taken.slice(parity * M, M).signed();
            let product = k.delay(&format!("product_{parity}"), operand * position);
            let rounded = product.round_shift(POSITION_SHIFT as usize).low(M);
            scales.mux(rounded.unsigned(), kept.slice(parity * M, M))
        };
        io.scaled.delay(concat(&[3, 2, 1, 0].map(scaled)));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::pass::scaled;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Pipeline};
    use crate::wire::Word;

    #[test]
    fn operands_are_multiplied_by_the_position_of_their_axis() {
        let mut random = fastrand::Rng::with_seed(21);
        let mut inputs = |_| {
            let operands = [(); 4].map(|()| random.i64(-(1 << (M - 1))..1 << (M - 1)));
            let [x, y] = [(); 2].map(|()| Word::of_fields(&[random.i64(-384..=384)], position_bits()));
            vec![Word::of_fields(&operands, M), random.u64(..3).into(), x, y]
        };
        let stimulus: Vec<Vec<Word>> = (0..3000).map(&mut inputs).collect();
        let of = |inputs: &[Word]| {
            let operands = [0, 1, 2, 3].map(|parity| inputs[0].signed(parity, M));
            let position = |input: usize| inputs[input].signed(0, position_bits());
            let all = match inputs[1].number() {
                0 => operands,
                1 => scaled(operands, position(2)),
                _ => scaled(operands, position(3)),
            };
            vec![Some(Word::of_fields(&all, M))]
        };
        check(&kernel_of(&OperandScale {}), &stimulus, &mut Pipeline::new(SCALE_LATENCY, 1, of));
    }
}
