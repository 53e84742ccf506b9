//! The coefficient check, `hardware.coefficient_check = "signature"`: whether the coefficient memory still holds the
//! generated coefficients.
//!
//! For each word (all lanes wide) that the passes of a [section](crate::fixed::words::schedule::sections) read, the parity of the
//! word's bits advances a 32-bit signature
//! ```text
//! s ← (2 s mod 2³²) ⊕ (POLYNOMIAL where s ≥ 2³¹) ⊕ parity         START before the section's first word
//! ```
//! If it differs from the generated value after the last word of any section, the subarray's status has
//! [`COEFFICIENTS`](crate::result::flags::COEFFICIENTS). The forces are sent all the same.
//!
//! Why a signature: a coefficient fills the 18 bits of a block RAM's word, so a parity bit per word of the lanes would
//! cost another block RAM, or LUTs that grow with the number of words. A signature needs no memory and no cycle,
//! whatever the number of lanes and words, and also detects a correct word read from a wrong address.
//!
//! A flipped bit inverts the parity at each read t of its word out of T reads in total, and so changes the signature by
//! Σ x^(T−t) modulo the polynomial. For a word read once or twice this is never zero; for more reads it can be, with a
//! probability of 2⁻³²: [`undetected`] lists such words. The list of columns and the schedule are not covered.

use super::contents::CasePlan;
use crate::fixed::words::formats::MULTIPLIER_BITS;
use crate::fixed::words::schedule::{sections, Section};

/// The polynomial of CRC-32 without its highest power, x³².
pub const POLYNOMIAL: u32 = 0x04c1_1db7;
/// Initial signature; not zero, so that missing words of even parity are detected.
pub const START: u32 = u32::MAX;

/// The signature after a word with this `parity`.
pub fn step(signature: u32, parity: bool) -> u32 {
    signature << 1 ^ if signature >> 31 == 1 { POLYNOMIAL } else { 0 } ^ u32::from(parity)
}

/// Whether a word, one 18-bit coefficient per lane, has an odd number of ones.
pub fn parity(word: &[i64]) -> bool {
    let ones = |coefficient: &i64| (coefficient & ((1 << MULTIPLIER_BITS) - 1)).count_ones();
    word.iter().map(ones).sum::<u32>() % 2 == 1
}

/// Addresses in the coefficient memory in the order in which the passes of a section of one case read them.
fn read_addresses(case: &CasePlan, section: &Section) -> Vec<usize> {
    let storage = &case.storage;
    let of = |matrix, group| {
        let first = storage.address_of(matrix, group);
        first..first + storage.columns_of(matrix, group).len()
    };
    let steps = section.accumulations.iter().flat_map(|(_, products)| {
        let groups = storage.groups_of(products);
        (0..groups).flat_map(move |group| products.iter().map(move |product| (product.matrix, group)))
    });
    steps.flat_map(|(matrix, group)| of(matrix, group)).collect()
}

/// The signature after all words that the passes of a section read.
pub fn signature(case: &CasePlan, section: &Section) -> u32 {
    let words = case.memory();
    let parities: Vec<bool> = words.iter().map(|word| parity(word)).collect();
    read_addresses(case, section).into_iter().fold(START, |s, address| step(s, parities[address - case.storage.base]))
}

/// Addresses of one case where a flipped bit would not change the signature: never read, or the changes cancel.
pub fn undetected(case: &CasePlan) -> Vec<usize> {
    let mut undetected = vec![true; case.storage.words()];
    for section in sections(&case.formats) {
        let mut changes = vec![0u32; case.storage.words()];
        // The change of the signature that an inverted parity at this read causes at the end.
        let mut change = 1;
        for address in read_addresses(case, &section).into_iter().rev() {
            changes[address - case.storage.base] ^= change;
            change = step(change, false);
        }
        undetected.iter_mut().zip(changes).for_each(|(own, change)| *own &= change == 0);
    }
    (0..undetected.len()).filter(|&index| undetected[index]).map(|index| index + case.storage.base).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::plan::cases::planned;
    use crate::spec::scene::Scene;

    #[test]
    fn by_hand() {
        assert_eq!((step(0, true), step(1, false), step(1 << 31, false)), (1, 2, POLYNOMIAL));
        assert_eq!((parity(&[1, 2]), parity(&[1, -1, 0]), parity(&[-1, 0])), (false, true, false));
    }

    #[test]
    fn no_word_of_the_shipped_scenes_is_unseen() {
        for name in ["sensor-1", "sensor-2", "sensor-3", "eight-by-eight"] {
            let plan = planned(&Scene::builtin(name).unwrap()).unwrap();
            assert_eq!(undetected(plan.first()), [0; 0], "{name}");
        }
    }

    #[test]
    fn a_flipped_bit_changes_the_signature() {
        let mut plan = planned(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
        let section = &sections(plan.formats())[0];
        let right = signature(plan.first(), section);
        assert_eq!(signature(plan.first(), section), right);
        plan.first_mut().quantised.ax.flips[0].parity[2][5] ^= 4;
        assert_ne!(signature(plan.first(), section), right);
    }
}
