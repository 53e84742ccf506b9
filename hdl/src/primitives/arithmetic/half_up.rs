//! Rounding half up and saturation after a barrel shifter.

use crate::language::{Builder, Expr};

/// `moved`, signed, with half an LSB as its lowest bit, rounded half up to `word` bits; and whether that does not fit.
///
/// The fit is tested in parallel with the rounding, not after it: the bits above the word must be sign bits once the
/// carry from the low bits has been added.
pub fn rounded<'k>(k: &'k Builder, moved: Expr<'k>, word: usize) -> (Expr<'k>, Expr<'k>) {
    let half_up = k.wire("half_up", moved.low(word + 1).plus(1)).slice(1, word);
    let carry = k.wire("carry", moved.low(word).all());
    let above = k.wire("above", moved.slice(word, moved.bits() - word));
    let carried = !above.slice(1, above.bits() - 1).all();
    (half_up, carry.mux(carried, above.any() & !above.all()))
}

/// [`rounded`], saturated to the most positive or most negative word where it does not fit; and whether that was so.
pub fn saturate<'k>(k: &'k Builder, moved: Expr<'k>, word: usize) -> (Expr<'k>, Expr<'k>) {
    let (half_up, clips) = rounded(k, moved, word);
    let clips = k.wire("clips", clips);
    let sign = moved.top();
    (clips.mux(sign.concat((!sign).repeat(word - 1)), half_up), clips)
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::words::arith;

    use super::*;
    use crate::block;
    use crate::language::testbench::{check, Pipeline};
    use crate::language::{kernel_of, Block, Inside};
    use crate::wire::Word;

    const MOVED: usize = 9;

    block! {
        struct HalfUp {
            word: usize,
        }
        ports HalfUpPorts {
            /// The number, with half an LSB.
            in moved: MOVED;
            /// The word.
            out value: word;
            /// The number does not fit.
            out clipped;
        }
    }

    impl Block for HalfUp {
        fn build<'k>(&self, k: &'k Builder, io: HalfUpPorts<Inside<'k>>) {
            let (value, clips) = saturate(k, io.moved, self.word);
            io.value.set(value);
            io.clipped.set(clips);
        }
    }

    #[test]
    fn every_value_is_rounded_half_up_and_saturated() {
        for word in [4, 7] {
            let of = |inputs: &[Word]| {
                let half_up = arith::round_shift(inputs[0].signed(0, MOVED), 1);
                let (value, clipped) = arith::saturate(half_up, word as u32);
                vec![Some(Word::of_fields(&[value], word)), Some(clipped.into())]
            };
            let all: Vec<Vec<Word>> = (0..1 << MOVED).map(|moved: u64| vec![moved.into()]).collect();
            check(&kernel_of(&HalfUp { word }), &all, &mut Pipeline::new(0, 2, of));
        }
    }
}
