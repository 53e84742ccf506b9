//! The name of a scene as an identifier of Verilog and C.

/// The name with an underscore in place of every character but ASCII letters and digits, in lower case if asked. Two scenes never share
/// one: where a character other than a hyphen is replaced, or a letter changes its case, the CRC-32 of the name is behind it.
///
/// ```
/// use dermis_golden::spec::scene::identifier;
///
/// assert_eq!(identifier("sensor-1", false), "sensor_1");
/// assert_eq!(identifier("sensor 1", false), "sensor_1_e295a19e");
/// assert_ne!(identifier("Sensor-1", true), identifier("sensor-1", true));
/// ```
pub fn identifier(name: &str, lower_case: bool) -> String {
    let case = |c: char| if lower_case { c.to_ascii_lowercase() } else { c };
    let own: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { case(c) } else { '_' }).collect();
    let is_alone = |c: char| c == '-' || (c.is_ascii_alphanumeric() && case(c) == c);
    match name.chars().all(is_alone) {
        true => own,
        false => format!("{own}_{:08x}", crc32fast::hash(name.as_bytes())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_that_differ_give_identifiers_that_differ() {
        const CHARACTERS: [char; 8] = ['a', 'A', '1', '-', '_', '.', ' ', 'é'];
        let mut names = vec![String::new()];
        for _ in 0..4 {
            names = names.iter().flat_map(|name| CHARACTERS.map(|c| format!("{name}{c}"))).collect();
            for lower_case in [false, true] {
                let all: BTreeSet<String> = names.iter().map(|name| identifier(name, lower_case)).collect();
                assert_eq!(all.len(), names.len(), "{lower_case}");
                let plain =
                    |c: char| c.is_ascii_digit() || c == '_' || c.is_ascii_lowercase() || (!lower_case && c == 'A');
                assert!(all.iter().all(|own| own.chars().all(plain)), "{all:?}");
            }
        }
    }
}
