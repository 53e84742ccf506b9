//! Stage `scan`, in the place of a stream of codes: the samples of converters that the hardware reads itself.
//!
//! ```text
//! code = ⌊ Σ of n samples · 2^a / n + 1/2 ⌋,  a = code_bits − 1 − magnitude bits of the converter
//! ```
//! | word | bits | LSB |
//! |---|---|---|
//! | sample: tag, result | `tag_bits`, `bits`, straight binary | full range / 2^bits |
//! | code | `code_bits` signed | full scale / 2^(code_bits − 1) |
//!
//! The sum keeps all its bits and is shifted before the one rounding. A mean alone would hide a sample at the end of the
//! range among others that are not: one such sample makes the code the end of its own range, and raises
//! [`Flag::Saturated`]. The lower end of a unipolar converter is no stress and raises nothing. A sample
//! whose tag names another channel makes the code the upper end, and raises [`Flag::WrongChannel`].
//! Dead taxels raise nothing.

use crate::fixed::words::arith::round_shift;
use crate::result::flags::{Flag, FlagSet};
use crate::spec::adc::{AdcScan, Converter};

/// The codes of a scan, and its flags.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Scanned {
    /// A code per taxel, row-major, `code_bits` signed.
    pub codes: Vec<i32>,
    /// `saturated` and `wrong-channel`, if raised; bits of the frame's status.
    pub flags: FlagSet,
}

/// Codes in a beat of the output stream.
pub const CODES_PER_BEAT: usize = 3;

/// The beats with which a frame ends where a scan has writable tables: its codes, row-major, three in each, sign-extended; places
/// beyond the array are 0.
pub fn beats(codes: &[i32]) -> Vec<[i32; CODES_PER_BEAT]> {
    let of = |codes: &[i32]| std::array::from_fn(|at| codes.get(at).copied().unwrap_or_default());
    codes.chunks(CODES_PER_BEAT).map(of).collect()
}

/// Left shift of a sum of samples before it is rounded, ≥ 0 where the scene is supported.
pub fn alignment(converter: &Converter, code_bits: u32) -> u32 {
    code_bits - 1 - converter.magnitude_bits()
}

/// The largest code; the smallest is its negative.
pub fn rail(code_bits: u32) -> i32 {
    (1 << (code_bits - 1)) - 1
}

/// The code of a taxel on channel `channel` from the answers of its samples, tag above result, and its flags.
pub fn code(scan: &AdcScan, code_bits: u32, channel: usize, answers: impl Iterator<Item = u32>) -> (i32, FlagSet) {
    let converter = &scan.converter;
    let most = (1u32 << converter.bits) - 1;
    let middle = if converter.bipolar { 1i64 << (converter.bits - 1) } else { 0 };
    let (mut sum, mut high, mut low, mut other) = (0, false, false, false);
    for answer in answers {
        let result = answer & most;
        sum += i64::from(result) - middle;
        high |= result == most;
        low |= converter.bipolar && result == 0;
        other |= converter.tag_bits > 0 && answer >> converter.bits != channel as u32;
    }
    let flags = FlagSet::raised([(Flag::Saturated, high || low), (Flag::WrongChannel, other)]);
    let mean = round_shift(sum << alignment(converter, code_bits), scan.average);
    match (high || other, low) {
        (true, _) => (rail(code_bits), flags),
        (_, true) => (-rail(code_bits), flags),
        // Within the codes: no sample is beyond those at the ends.
        _ => (mean as i32, flags),
    }
}

/// The codes of an array from its `answers`, in the order of the wire: by row, channel, sample, converter. `dead` taxels
/// are row-major indices.
pub fn scan(scan: &AdcScan, code_bits: u32, dead: &[usize], answers: &[u32]) -> Scanned {
    let (count, samples) = (scan.converters, scan.samples());
    let mut scanned = Scanned::default();
    for (group, answers) in answers.chunks(count * samples).enumerate() {
        for own in 0..count {
            let of_taxel = answers.iter().skip(own).step_by(count).copied();
            let (code, flags) = code(scan, code_bits, group % scan.channels, of_taxel);
            if !dead.contains(&scanned.codes.len()) {
                scanned.flags = scanned.flags | flags;
            }
            scanned.codes.push(code);
        }
    }
    scanned
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::adc::CONVERTERS;

    fn spec(converter: usize, converters: usize, average: u32) -> AdcScan {
        AdcScan {
            converter: CONVERTERS[converter],
            converters,
            channels: 2,
            sclk_MHz: 10.0,
            row_settling_us: 0.0,
            channel_settling_us: 0.0,
            average,
            period_us: 1000.0,
        }
    }

    fn of(scan: &AdcScan, bits: u32, channel: usize, answers: &[u32]) -> (i32, Vec<Flag>) {
        let (code, flags) = code(scan, bits, channel, answers.iter().copied());
        (code, flags.iter().collect())
    }

    #[test]
    fn unipolar_by_hand() {
        let max = spec(0, 1, 1);
        // 12 bits to 14: a = 1; (5 + 6) · 2 / 2.
        assert_eq!(of(&max, 14, 3, &[0x3005, 0x3006]), (11, vec![]));
        // To 13: a = 0; 11 / 2 rounds half up.
        assert_eq!(of(&max, 13, 3, &[0x3005, 0x3006]), (6, vec![]));
        assert_eq!(of(&max, 13, 0, &[0, 0]), (0, vec![]));
        // One of two at the upper end.
        assert_eq!(of(&max, 13, 0, &[0xfff, 0]), (4095, vec![Flag::Saturated]));
        assert_eq!(of(&max, 13, 0, &[0xffe, 0xffe]), (4094, vec![]));
        // One of two names channel 2.
        assert_eq!(of(&max, 13, 3, &[0x3005, 0x2005]), (4095, vec![Flag::WrongChannel]));
        assert_eq!(of(&max, 20, 3, &[0xffff, 0x3005]), ((1 << 19) - 1, vec![Flag::Saturated, Flag::WrongChannel]));
    }

    #[test]
    fn bipolar_by_hand() {
        let ads = spec(1, 1, 1);
        assert_eq!(of(&ads, 16, 1, &[0x8000, 0x7ffd]), (-1, vec![]));
        assert_eq!(of(&ads, 18, 1, &[0x8000, 0x7ffd]), (-6, vec![]));
        assert_eq!(of(&ads, 16, 1, &[0x8000, 0]), (-32767, vec![Flag::Saturated]));
        assert_eq!(of(&ads, 16, 1, &[0xffff, 0]), (32767, vec![Flag::Saturated]));
        assert_eq!(of(&ads, 16, 1, &[1, 1]), (-32767, vec![]));
    }

    #[test]
    fn columns_follow_channels_then_converters() {
        let two = spec(0, 2, 0);
        let answers = [0x0001, 0x0002, 0x1003, 0x1fff, 0x0005, 0x0006, 0x0007, 0x1008];
        let all = scan(&two, 13, &[], &answers);
        assert_eq!(all.codes, [1, 2, 3, 4095, 5, 6, 4095, 8]);
        assert!(all.flags.iter().eq([Flag::Saturated, Flag::WrongChannel]));
        assert_eq!(scan(&two, 13, &[3, 6], &answers), Scanned { flags: FlagSet::default(), ..all });
    }
}
