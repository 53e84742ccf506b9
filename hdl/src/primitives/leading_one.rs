//! Selects a constant by the position of the leading one of a vector, without a ripple from bit to bit.

/// Verilog expression of `bits` bits: `value(k)` for the leading one at bit k of `word`, whose top bit is `top`; 0 if
/// no bit of `range` is the leading one. Each bit is gated by the OR of all bits above it.
pub fn by_leading_one(
    word: &str,
    range: std::ops::Range<usize>,
    top: usize,
    bits: usize,
    value: impl Fn(usize) -> usize,
) -> String {
    let term = |k: usize| {
        let first = match k == top {
            true => format!("{word}[{k}]"),
            false => format!("{word}[{k}] && !(|{word}[{top}:{}])", k + 1),
        };
        format!("({{{bits}{{{first}}}}} & {bits}'d{})", value(k))
    };
    let terms: Vec<String> = range.map(term).collect();
    match terms.is_empty() {
        true => format!("{bits}'d0"),
        false => terms.join("\n  | "),
    }
}

#[cfg(test)]
mod tests {
    use super::by_leading_one;

    #[test]
    fn one_term_per_bit() {
        let text = by_leading_one("x", 1..3, 2, 4, |k| 10 + k);
        assert_eq!(text, "({4{x[1] && !(|x[2:2])}} & 4'd11)\n  | ({4{x[2]}} & 4'd12)");
        assert_eq!(by_leading_one("x", 3..3, 2, 4, |k| k), "4'd0");
    }
}
