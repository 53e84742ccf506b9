//! Products with constants as sums of shifts, which take no multiplier: those are reserved for the passes.

/// Verilog expression of `value · constant`, truncated to the width of `value`; `constant` is at least 1.
pub fn times(value: &str, constant: usize) -> String {
    let terms: Vec<String> = (0..usize::BITS)
        .filter(|bit| constant >> bit & 1 == 1)
        .map(|bit| if bit == 0 { value.to_string() } else { format!("({value} << {bit})") })
        .collect();
    format!("({})", terms.join(" + "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_term_per_bit() {
        assert_eq!(times("x", 1), "(x)");
        assert_eq!(times("x", 12), "((x << 2) + (x << 3))");
    }
}
