//! Rounding half up after a barrel shifter.

use crate::language::{Builder, Expr};

/// `moved`, signed, with half an LSB as its lowest bit, rounded half up to `word` bits; and whether that does not fit.
///
/// The fit is tested in parallel with the rounding, not after it: the bits above the word must be sign bits once the
/// carry from the low bits has been added.
pub fn rounded<'k>(k: &'k Builder, moved: Expr<'k>, word: usize) -> (Expr<'k>, Expr<'k>) {
    let half_up = k.wire("half_up", moved.low(word + 1).plus(1)).slice(1, word);
    let carry = k.wire("carry", moved.low(word).all());
    let above = k.wire("above", moved.slice(word, moved.bits() - word));
    let over = above.bits() - 1;
    (half_up, carry.mux(!above.slice(1, over).all(), above.any() & !above.all()))
}

/// Verilog that declares `half_up` and assigns `clips`. `moved` is signed, of `bits` bits, with half an LSB as its
/// lowest bit; bits 1 … `word` of `half_up` are its value rounded half up, and `clips` is high if that does not fit
/// `word` bits. Indented by four.
///
/// The fit is tested in parallel with the rounding, not after it: the bits above the word must be sign bits once the
/// carry from the low bits has been added.
pub fn half_up(bits: usize, word: usize, clips: &str) -> String {
    format!(
        "    wire [{word}:0] half_up = moved[{word}:0] + {width}'d1;
    wire carry = &moved[{word_end}:0];
    wire [{over}:0] above = moved[{end}:{word}];
    assign {clips} = carry ? !(&above[{over}:1]) : (|above && !(&above));
",
        width = word + 1,
        word_end = word - 1,
        over = bits - 1 - word,
        end = bits - 1,
    )
}
