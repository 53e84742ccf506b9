//! Verilog for rounding half up after a barrel shifter.

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
