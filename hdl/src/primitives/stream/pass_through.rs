//! A stage that the scene omits: its stream passes through on wires.

use crate::language::Builder;

/// A kernel of `block` that connects `m_axis` to `s_axis`, of `bits` bits each; `why` is a comment that says what is
/// omitted, on one line.
pub fn wires(block: &str, bits: usize, why: &str) -> Builder {
    low_wires(block, [bits; 2], why)
}

/// The same where `m_axis` takes but the low bits: bits of `s_axis` and `m_axis`.
pub fn low_wires(block: &str, [bits, low]: [usize; 2], why: &str) -> Builder {
    let k = Builder::new(block);
    k.comment(why);
    k.input("rst", 1);
    k.wire("m_axis_tdata", k.input("s_axis_tdata", bits).low(low));
    let handshake =
        [("s_axis_tvalid", "m_axis_tvalid"), ("s_axis_tlast", "m_axis_tlast"), ("m_axis_tready", "s_axis_tready")];
    for (from, to) in handshake {
        k.wire(to, k.input(from, 1));
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::language::Body;
    use crate::wire::Word;

    #[test]
    fn beats_and_their_handshake_pass_unchanged() {
        const BITS: usize = 70;
        let inputs =
            [("rst", 1), ("s_axis_tdata", BITS), ("s_axis_tvalid", 1), ("s_axis_tlast", 1), ("m_axis_tready", 1)];
        let outputs = [("m_axis_tdata", BITS), ("m_axis_tvalid", 1), ("m_axis_tlast", 1), ("s_axis_tready", 1)];
        let body = Body::new(wires("omitted", BITS, "Nothing to do.").finish(), &inputs, &outputs);
        let of = |inputs: &[Word]| inputs[1..].iter().map(|&word| Some(word)).collect();
        let stimulus = random_words(300, &inputs.map(|(_, bits)| bits));
        check(body.kernel(), &stimulus, &mut Pipeline::new(0, outputs.len(), of));
    }
}
