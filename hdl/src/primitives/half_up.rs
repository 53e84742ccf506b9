//! Rounding of what a barrel shifter leaves, as Verilog.

/// Declares, of the signed `moved` of `bits` bits whose lowest is half an LSB, `half_up`, whose bits 1 … `word` are the
/// value rounded half up in `word` bits, and assigns to `clips` whether it does not fit; the text is indented by four.
///
/// Whether it fits is told beside the rounding, not after it: what is above the word must be sign bits once the carry out of
/// the low bits has come in.
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
