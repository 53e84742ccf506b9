//! Magnitude and signs of each subarray, gathered while the frame arrives.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Expr, Kernel, Type};
use crate::primitives::address::case_counter::expression_by_case;
use crate::primitives::address::counter::count_bits;
use crate::wire::Wire;

/// For each subarray: the OR of the magnitudes of its accepted codes, and whether any code was above the noise floor or
/// below its negative. `select` chooses the subarray whose values are on the outputs.
#[derive(dermis_hdl_derive::Block)]
pub struct FrameStats {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Clears the values of all subarrays, with priority over `accept`.
    pub clear: Signal<In, Bit>,
    /// `code` and `part` are valid and taken in.
    pub accept: Signal<In, Bit>,
    /// A code, `bits` wide, two's complement; valid with `accept`.
    pub code: Wire<In>,
    /// Index of the code's subarray; valid with `accept`.
    pub part: Wire<In>,
    /// Index of the subarray on the outputs; combinational.
    pub select: Wire<In>,
    /// Noise floor in codes, ≥ 0, where it is written, else one bit; constant between resets, valid from one on.
    pub floor: Wire<In>,
    /// OR of the ones' complement magnitudes of subarray `select`, one bit narrower than a code; includes a code from
    /// the cycle after its `accept`.
    pub magnitude: Wire<Out>,
    /// A code of subarray `select` was above the noise floor.
    pub positive: Signal<Out, Bit>,
    /// A code of subarray `select` was below minus the noise floor.
    pub negative: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    FrameStats,
    clock clk,
    inputs [clear, accept, code, part, select, floor],
    outputs [magnitude, positive, negative]
);

impl FrameStats {
    /// For codes of `bits` bits, a noise floor of `floor` codes, or if there is none, of port `floor`, and `parts` subarrays.
    pub fn new(bits: usize, floor: Option<i32>, parts: usize) -> Self {
        let block = FrameStats {
            clk: Default::default(),
            clear: Default::default(),
            accept: Default::default(),
            code: Wire::new(bits),
            part: Wire::new(count_bits(parts)),
            select: Wire::new(count_bits(parts)),
            floor: Wire::new(floor_bits(floor, bits)),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(bits, floor, parts))
    }
}

/// The ones' complement magnitude of a signed code, one bit narrower.
pub(crate) fn magnitude_of(code: Expr<'_>) -> Expr<'_> {
    let bits = code.bits() - 1;
    code.low(bits) ^ code.top().repeat(bits)
}

/// Whether a signed code is above the noise floor of `floor` codes, and whether it is below minus the noise floor; without a
/// number the floor is that of `written`, as wide as the code.
pub(crate) fn beyond<'k>(k: &'k Builder, code: Expr<'k>, floor: Option<i32>, written: Expr<'k>) -> [Expr<'k>; 2] {
    let (code, bits) = (code.signed(), code.bits());
    let [most, least] = match floor {
        // A floor beyond the code's range is clamped to its end, which no code exceeds either.
        Some(floor) => {
            let floor = i64::from(floor).min((1 << (bits - 1)) - 1);
            [floor, -floor].map(|limit| k.signed_constant(bits, limit))
        }
        None => [written.signed(), (k.signed_constant(bits, 0) - written.signed()).resize(bits)],
    };
    [most.less(code), code.less(least)]
}

/// Width of port `floor`.
fn floor_bits(floor: Option<i32>, bits: usize) -> usize {
    floor.map_or(bits, |_| 1)
}

fn kernel(bits: usize, floor: Option<i32>, parts: usize) -> Kernel {
    let k = Builder::new("frame_stats");
    let (clear, accept, code) = (k.input("clear", 1), k.input("accept", 1), k.input("code", bits));
    let (part, select) = (k.input("part", count_bits(parts)), k.input("select", count_bits(parts)));
    let written = k.input("floor", floor_bits(floor, bits));
    let magnitude = k.wire("own_magnitude", magnitude_of(code));
    let [above, below] = beyond(&k, code, floor, written);
    let (above, below) = (k.wire("above", above), k.wire("below", below));
    // Each the OR over the accepted codes of a subarray.
    for (name, value) in [("magnitude", magnitude), ("positive", above), ("negative", below)] {
        let of = |number: usize| {
            let held = k.state(&format!("{name}_of{number}"), Type::unsigned(value.bits()), clear, 0);
            let own = if parts == 1 { accept } else { accept & part.is(number as u64) };
            k.when(own, || held.set(*held | value));
            *held
        };
        let all: Vec<Expr> = (0..parts).map(of).collect();
        k.wire(name, expression_by_case(select, &all).unwrap_or(value));
    }
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith::magnitude_bits;

    use super::*;
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
            } else if inputs[1].number() == 1 {
                if let Some(seen) = self.each.get_mut(inputs[3].number() as usize) {
                    *seen =
                        (seen.0 | magnitude_bits(code), seen.1 | (code > self.floor), seen.2 | (code < -self.floor));
                }
            }
        }
    }

    #[test]
    fn codes_of_each_subarray_are_gathered() {
        for (floor, parts, written) in [(7, 3, false), (255, 1, false), (100, 4, false), (31, 2, true), (255, 1, true)]
        {
            let floor_bits = if written { BITS } else { 1 };
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
            check(block.kernel.kernel(), &stimulus, &mut seen);
        }
    }
}
