//! Stage `send`: forces, then status, on the output stream.
//!
//! Forces are sent row-major over the array, one beat per taxel, `{fz, fy, fx}`; then [`STATUS_BEATS`] beats for each
//! subarray of the chosen case, row-major. Saturations of `forces`, the contact flag and the cycles are those of the
//! whole frame, the same for every subarray:
//!
//! | beat | fx word | fy word | fz word |
//! |---|---|---|---|
//! | 0 | μ1 in mu_max/384 | μ2 in mu_max/384 | flags, see [`Status`] |
//! | 1 | score, 2^−6 | right shift of `rescale` | left shift of `normalise`; from bit 16 on the [version](Status::tables) of the tables |
//! | 2 | saturations of `rescale` | saturations of `forces` | cycles to the first output beat, see [`Status::cycles`] |
//!
//! With a μ for each contact there are [`label_beats`] between forces and status, and the status of each of
//! `partition.max_contacts` contacts follows, the contact with the largest load first; those beyond the last have neither
//! condition nor μ.
//!
//! With a network the score is a word of two ln σ instead, that of μ1 in the lower half, in 1/384, σ in units of mu_max
//! ([`ln_sigma_word`]); the saturations of `estimate` and `relax` are counted with those of `rescale`.

use serde::Serialize;

use super::load::VERSION_BITS;

/// Status beats per subarray after the forces.
pub const STATUS_BEATS: usize = 3;

/// Flag bit: the centroid condition of the scene is met.
pub const FLAG_CONDITION: u32 = 1;
/// Flag bit: the search found a candidate with Σp > 0; with a network, it gave μ.
pub const FLAG_FOUND: u32 = 1 << 1;
/// Flag bit: no taxel's |fz| reaches the threshold, or all are zero.
pub const FLAG_NO_CONTACT: u32 = 1 << 2;
/// Flag bit: since the last frame sent, `tlast` came early or was missing and the frame concerned was dropped.
pub const FLAG_FRAMING: u32 = 1 << 3;
/// Flag bit: the coefficient memory does not hold the generated coefficients; only with `hardware.coefficient_check =
/// "signature"` ([`crate::fixed::plan::check`]).
pub const FLAG_COEFFICIENTS: u32 = 1 << 4;
/// Flag bit: there are more contacts than get a μ; only with `partition.case = "contacts"`.
pub const FLAG_MORE_CONTACTS: u32 = 1 << 5;
/// Flag bit: the tables are not whole, and every stress is taken as 0; only with `hardware.tables = "writable"`
/// ([`load`](super::load)).
pub const FLAG_TABLES: u32 = 1 << 6;
/// Flag bit: a sample of the frame was at an end of the converter's range; only with `hardware.source = "adc-scan"`, as the next
/// ([`scan`](super::scan)).
pub const FLAG_RAIL: u32 = 1 << 7;
/// Flag bit: a sample of the frame named another channel than that asked for.
pub const FLAG_CHANNEL: u32 = 1 << 10;
/// Position of the paper's case number, 2 bits, among the flags; 0 where a scene has one case.
pub const CASE_SHIFT: u32 = 8;
/// Position of the version of the tables beside the shift of `normalise`.
pub const TABLES_SHIFT: u32 = 16;
/// Bit above the version: the last image was refused.
pub const TABLES_REFUSED: u16 = 1 << VERSION_BITS;
/// Position of the number of frames in a sliding mean, 13 bits, among the flags; 0 where the mean does not slide.
pub const FRAMES_SHIFT: u32 = 16;

/// Width of a label on the stream: 0 or the number of a contact.
pub const LABEL_BITS: u32 = 4;
/// Labels in a word of a beat, the first in the lowest bits.
const LABELS_PER_WORD: usize = (32 / LABEL_BITS) as usize;
/// Labels in a beat.
pub const LABELS_PER_BEAT: usize = 3 * LABELS_PER_WORD;

/// Number of beats with the labels of so many taxels.
pub fn label_beats(taxels: usize) -> usize {
    taxels.div_ceil(LABELS_PER_BEAT)
}

/// The beats with these labels, row-major, each below 16; zeros after the last.
pub fn labels_to_beats(labels: &[usize]) -> Vec<[i32; 3]> {
    let word = |labels: &[usize]| {
        let place = |(at, label): (usize, &usize)| (*label as u32) << (LABEL_BITS as usize * at);
        labels.iter().enumerate().map(place).fold(0, |word, label| word | label) as i32
    };
    let words: Vec<i32> = labels.chunks(LABELS_PER_WORD).map(word).collect();
    let beat = |words: &[i32]| std::array::from_fn(|k| words.get(k).copied().unwrap_or(0));
    words.chunks(3).map(beat).collect()
}

/// The labels of so many taxels from their beats.
pub fn labels_of_beats(beats: &[[i32; 3]], taxels: usize) -> Vec<usize> {
    let of_word = |word: &i32| {
        let word = *word as u32;
        (0..LABELS_PER_WORD).map(move |at| (word >> (LABEL_BITS as usize * at) & ((1 << LABEL_BITS) - 1)) as usize)
    };
    beats.iter().flatten().flat_map(of_word).take(taxels).collect()
}

/// Width of ln σ in the word of two.
pub const LN_SIGMA_BITS: u32 = 16;

/// The word of two ln σ, [x, y].
pub fn ln_sigma_word([x, y]: [i32; 2]) -> i32 {
    y << LN_SIGMA_BITS | x & ((1 << LN_SIGMA_BITS) - 1)
}

/// The two ln σ of a word.
pub fn ln_sigma_of_word(word: i32) -> [i32; 2] {
    [i32::from(word as i16), word >> LN_SIGMA_BITS]
}

/// The decoded status of a subarray in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Status {
    /// μ* in units of mu_max / 384.
    pub position: [i32; 2],
    /// OR of the `FLAG_*` bits; with several cases, also the paper's number of the chosen case from bit [`CASE_SHIFT`]
    /// on; with a sliding mean, the number of frames that it holds from bit [`FRAMES_SHIFT`] on.
    pub flags: u32,
    /// Score at μ* in LSBs of 2^−6 bit, 0 if the search found nothing; with a network the word of two ln σ.
    pub score: i32,
    /// Right shift of `rescale`.
    pub rescale: u32,
    /// Left shift of `normalise`, below 2^16.
    pub normalise: u32,
    /// Version of the tables, 15 bits, 0 for those of the bitstream; [`TABLES_REFUSED`] if the last image was refused.
    #[serde(skip_serializing_if = "is_zero")]
    pub tables: u16,
    /// Number of words saturated in `rescale`.
    pub rescale_saturations: u32,
    /// Number of force words saturated.
    pub force_saturations: u32,
    /// Cycles to the first output beat, from the frame's last beat into `receive`, with several rows of subarrays from the last
    /// of the first row, without those in which the rest is awaited; for a frame that waited in the buffer, from the cycle
    /// before its computation started.
    pub cycles: u32,
}

fn is_zero(version: &u16) -> bool {
    *version == 0
}

impl Status {
    /// The status as beats `[fx, fy, fz]`.
    pub fn beats(&self) -> [[i32; 3]; STATUS_BEATS] {
        [
            [self.position[0], self.position[1], self.flags as i32],
            [self.score, self.rescale as i32, (u32::from(self.tables) << TABLES_SHIFT | self.normalise) as i32],
            [self.rescale_saturations as i32, self.force_saturations as i32, self.cycles as i32],
        ]
    }

    /// The status from its beats; `None` unless there are [`STATUS_BEATS`] of them.
    pub fn of_beats(beats: &[[i32; 3]]) -> Option<Self> {
        let &[[x, y, flags], [score, rescale, normalise], [rescale_saturations, force_saturations, cycles]] = beats
        else {
            return None;
        };
        Some(Status {
            position: [x, y],
            flags: flags as u32,
            score,
            rescale: rescale as u32,
            normalise: normalise as u32 & ((1 << TABLES_SHIFT) - 1),
            tables: (normalise as u32 >> TABLES_SHIFT) as u16,
            rescale_saturations: rescale_saturations as u32,
            force_saturations: force_saturations as u32,
            cycles: cycles as u32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ln_sigma_read_back() {
        for pair in [[-1200, 190], [3, -2688], [0, -1]] {
            assert_eq!(ln_sigma_of_word(ln_sigma_word(pair)), pair);
        }
    }

    #[test]
    fn labels_read_back() {
        for taxels in [1, 24, 25, 400] {
            let labels: Vec<usize> = (0..taxels).map(|taxel| taxel * 7 % 9).collect();
            let beats = labels_to_beats(&labels);
            assert_eq!((beats.len(), labels_of_beats(&beats, taxels)), (label_beats(taxels), labels));
        }
        assert_eq!(labels_to_beats(&[8, 1, 0, 0, 0, 0, 0, 15, 2]), [[0xf000_0018u32 as i32, 2, 0]]);
    }

    #[test]
    fn beats_read_back() {
        let status =
            Status { position: [-3, 384], flags: 5, score: -70_000, normalise: 3, tables: 0x8005, ..Status::default() };
        assert_eq!(Status::of_beats(&status.beats()), Some(status));
        assert_eq!(Status::of_beats(&[[0; 3]]), None);
    }
}
