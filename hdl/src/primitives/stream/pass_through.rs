//! A stage that the scene omits: its stream passes through on wires.

use crate::language::{Builder, Expr, Output};

/// Connects `m_axis` to `s_axis`: data, `tvalid`, `tlast` and, against them, `tready`. The data of `m_axis` are the low bits
/// of those of `s_axis`. `why` is a comment that says what is omitted, on one line.
pub fn pass_through<'k>(k: &'k Builder, why: &str, inputs: [Expr<'k>; 4], outputs: [Output<'k>; 4]) {
    k.comment(why);
    for (input, output) in inputs.into_iter().zip(outputs) {
        output.set(input.low(output.bits()));
    }
}

#[cfg(test)]
mod tests {
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::primitives::RegisterSlice;
    use crate::wire::Word;

    #[test]
    fn beats_and_their_handshake_pass_unchanged() {
        const BITS: usize = 70;
        let of = |inputs: &[Word]| inputs[1..].iter().map(|&word| Some(word)).collect();
        let stimulus = random_words(300, &[1, BITS, 1, 1, 1]);
        check(&kernel_of(&RegisterSlice::new(BITS, false)), &stimulus, &mut Pipeline::new(0, 4, of));
    }
}
