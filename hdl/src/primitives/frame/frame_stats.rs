//! Magnitude and signs of each subarray, gathered while the frame arrives.

use crate::block;
use crate::language::{Block, Builder, Expr, Inside, Type};
use crate::primitives::address::case_counter::expression_by_case;
use crate::primitives::address::counter::count_bits;

block! {
    /// For each subarray: the OR of the magnitudes of its accepted codes, and whether any code was above the noise floor or
    /// below its negative. `select` chooses the subarray whose values are on the outputs.
    pub struct FrameStats {
        /// Width of a code in bits.
        bits: usize,
        /// The noise floor in codes; none where it is written.
        noise_floor: Option<i32>,
        /// Number of subarrays.
        parts: usize,
    }
    ports FrameStatsPorts {
        clock;
        /// Clears the values of all subarrays, with priority over `accept`.
        in clear;
        /// `code` and `part` are valid and taken in.
        in accept;
        /// A code, `bits` wide, two's complement; valid with `accept`.
        in code: bits;
        /// Index of the code's subarray; valid with `accept`.
        in part: count_bits(*parts);
        /// Index of the subarray on the outputs; combinational.
        in select: count_bits(*parts);
        /// Noise floor in codes, unsigned, where it is written, else one bit; constant between resets, valid from one on.
        in floor: noise_floor.map_or(bits - 1, |_| 1);
        /// OR of the ones' complement magnitudes of subarray `select`, one bit narrower than a code; includes a code from
        /// the cycle after its `accept`.
        out magnitude: bits - 1;
        /// A code of subarray `select` was above the noise floor.
        out positive;
        /// A code of subarray `select` was below minus the noise floor.
        out negative;
    }
}

impl FrameStats {
    /// For codes of `bits` bits, a noise floor of `floor` codes, or if there is none, of port `floor`, and `parts` subarrays.
    pub fn new(bits: usize, floor: Option<i32>, parts: usize) -> Self {
        FrameStats { bits, noise_floor: floor, parts }
    }
}

impl Block for FrameStats {
    fn build<'k>(&self, k: &'k Builder, io: FrameStatsPorts<Inside<'k>>) {
        let magnitude = k.wire("own_magnitude", magnitude_of(io.code));
        let [above, below] = beyond(k, io.code, self.noise_floor, io.floor);
        let (above, below) = (k.wire("above", above), k.wire("below", below));
        // Each the OR over the accepted codes of a subarray.
        let gathered = [
            ("magnitude", magnitude, io.magnitude),
            ("positive", above, io.positive),
            ("negative", below, io.negative),
        ];
        for (name, value, output) in gathered {
            let of = |number: usize| {
                let held = k.state(&format!("{name}_of{number}"), Type::unsigned(value.bits()), io.clear, 0);
                let own = if self.parts == 1 { io.accept } else { io.accept & io.part.is(number as u64) };
                k.when(own, || held.set(*held | value));
                *held
            };
            let all: Vec<Expr> = (0..self.parts).map(of).collect();
            output.set(expression_by_case(io.select, &all).unwrap_or(value));
        }
    }
}

/// The ones' complement magnitude of a signed code, one bit narrower.
pub(crate) fn magnitude_of(code: Expr<'_>) -> Expr<'_> {
    let bits = code.bits() - 1;
    code.low(bits) ^ code.top().repeat(bits)
}

/// Whether a signed code is above the noise floor of `floor` codes, and whether it is below minus the noise floor; without a
/// number the floor is `written`, unsigned, a bit narrower than the code.
pub(crate) fn beyond<'k>(k: &'k Builder, code: Expr<'k>, floor: Option<i32>, written: Expr<'k>) -> [Expr<'k>; 2] {
    let (code, bits) = (code.signed(), code.bits());
    let [most, least] = match floor {
        // A floor beyond the code's range is clamped to its end, which no code exceeds either.
        Some(floor) => {
            let floor = i64::from(floor).min((1 << (bits - 1)) - 1);
            [floor, -floor].map(|limit| k.signed_constant(bits, limit))
        }
        None => {
            let written = written.extend(bits).signed();
            [written, (k.signed_constant(bits, 0) - written).resize(bits)]
        }
    };
    [most.less(code), code.less(least)]
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::magnitude_bits;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    const BITS: usize = 9;

    /// Magnitude, above, below of each subarray; undefined before the first `clear`.
    struct Seen {
        floor: i64,
        parts: usize,
        each: Vec<(u64, bool, bool)>,
    }

    impl Reference for Seen {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let seen = self.each.get(inputs[4].number() as usize);
            let (magnitude, above, below) = seen.copied().unwrap_or_default();
            [Word::from(magnitude), above.into(), below.into()].map(|word| seen.map(|_| word)).into()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let code = inputs[2].signed(0, BITS);
            if inputs[0].number() == 1 {
                self.each = vec![(0, false, false); self.parts];
            } else if inputs[1].number() == 1
                && let Some(seen) = self.each.get_mut(inputs[3].number() as usize)
            {
                *seen = (seen.0 | magnitude_bits(code), seen.1 | (code > self.floor), seen.2 | (code < -self.floor));
            }
        }
    }

    #[test]
    fn codes_of_each_subarray_are_gathered() {
        for (floor, parts, written) in [(7, 3, false), (255, 1, false), (100, 4, false), (31, 2, true), (255, 1, true)]
        {
            let floor_bits = if written { BITS - 1 } else { 1 };
            let mut stimulus = random_words(4000, &[1, 1, BITS, count_bits(parts), count_bits(parts), floor_bits]);
            for (cycle, inputs) in stimulus.iter_mut().enumerate() {
                inputs[0] = (cycle % 29 == 0).into();
                inputs[5] = Word::from(if written { floor } else { 0 });
                if parts == 1 {
                    (inputs[3], inputs[4]) = Default::default();
                }
            }
            let block = FrameStats::new(BITS, (!written).then_some(floor as i32), parts);
            let mut seen = Seen { floor: floor as i64, parts, each: Vec::new() };
            check(&kernel_of(&block), &stimulus, &mut seen);
        }
    }
}
