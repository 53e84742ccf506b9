//! Balance: the normal forces of a frame, those below zero counted several times; a sum below zero is the flag `negative-pressure` of
//! the bit-true model ([`pulls`](dermis_golden::fixed::stages::forces::pulls)).

use dermis_golden::estimate::deviations::MOST_PUSH;
use dermis_golden::fixed::words::formats::FORCE_BITS;
use dermis_golden::fixed::Model;

use crate::language::{Expr, Type};
use crate::primitives::count_bits;

/// Width of a force.
const WORD: usize = FORCE_BITS as usize;
/// Width of the times that a force is counted.
const PUSH_BITS: usize = (MOST_PUSH.ilog2() + 1) as usize;

/// The sum of one scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Balance {
    /// Times that a force below zero is counted, 1 to [`MOST_PUSH`].
    pub push: u32,
    /// Number of forces of a frame.
    pub taxels: usize,
}

impl Balance {
    /// That of the forces of `model`; `None` where it has no limit.
    pub fn of_model(model: &Model) -> Option<Balance> {
        model.push_limit.map(|push| Balance { push, taxels: model.scene.sensor.taxels() })
    }

    /// Type of the sum, which no frame exceeds.
    pub fn ty(self) -> Type {
        Type::signed(WORD + PUSH_BITS + count_bits(self.taxels))
    }

    /// What the signed force word `z` adds to the sum. Shifted sums, no multiplier.
    pub fn weighed<'k>(self, z: Expr<'k>) -> Expr<'k> {
        let bits = WORD + PUSH_BITS;
        let shifted = (0..PUSH_BITS).filter(|bit| self.push >> bit & 1 == 1).map(|bit| z.shift_left(bit).resize(bits));
        let times = shifted.reduce(|sum, one| (sum + one).resize(bits));
        let once = z.resize(bits);
        z.top().mux(times.unwrap_or(once), once)
    }

    /// The sum `so_far` with one that [`Balance::weighed`] gave.
    pub fn sum<'k>(self, so_far: Expr<'k>, weighed: Expr<'k>) -> Expr<'k> {
        let bits = self.ty().bits;
        (so_far + weighed.resize(bits)).resize(bits)
    }
}
