//! Stage `send`: forces, then status, on the output stream.
//!
//! Forces are sent row-major over the array, one beat per taxel, `{fz, fy, fx}`; then [`STATUS_BEATS`] beats for each
//! subarray of the chosen case, row-major. Saturations of `forces`, the contact flag and the cycles are those of the
//! whole frame, the same for every subarray:
//!
//! [`Status`] lists the fields of its words, except the bits of flags, which are in the rows of [`crate::result::flags`];
//! [`status_fields`] gives all of them, from which the manifest and the guide's table are made.
//!
//! With a μ for each contact there are [`label_beats`] between forces and status, and the status of each of
//! `partition.max_contacts` contacts follows, the contact with the largest load first; those beyond the last have neither
//! condition nor μ.
//!
//! With a network the score is a word of two ln σ instead, that of μ1 in the lower half, in 1/384, σ in units of mu_max
//! ([`ln_sigma_word`]); the saturations of `estimate` and `relax` are counted with those of `rescale`.

use super::load::VERSION_BITS;
use crate::result::flags::{Feature, Flag, FlagSet, StatusField};

pub use crate::result::flags::STATUS_BEATS;

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

/// A number that a field of the status holds.
trait Value {
    /// The number from the field's bits.
    fn of(bits: u32) -> Self;
}

impl Value for bool {
    fn of(bits: u32) -> Self {
        bits != 0
    }
}

impl Value for i32 {
    fn of(bits: u32) -> Self {
        bits as i32
    }
}

impl Value for u32 {
    fn of(bits: u32) -> Self {
        bits
    }
}

/// Defines the status, a row for each field: constant, name and type, `[beat, word]`, `[lowest bit, bits]`, what the scene must
/// ask for, meaning.
macro_rules! status {
    ($($constant:ident $field:ident: $kind:ident = $at:expr, $bits:expr, $feature:ident, $meaning:literal;)*) => {
        /// The decoded status of a subarray, or of a contact, in one frame.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Status {
            $(#[doc = concat!($meaning, ".")] pub $field: $kind,)*
            /// The flags whose [own bit](Flag::status_bit) is set.
            pub raised: FlagSet,
        }

        $(
            #[doc = concat!("Field of a status: ", $meaning, ".")]
            pub const $constant: StatusField =
                StatusField::new(stringify!($field), $at, $bits, Feature::$feature, $meaning);
        )*

        /// The fields of a status that are no flag's.
        const FIELDS: &[StatusField] = &[$($constant),*];

        impl Status {
            /// The status as beats `[fx, fy, fz]`.
            pub fn beats(&self) -> [[i32; 3]; STATUS_BEATS] {
                let mut beats = [[0; 3]; STATUS_BEATS];
                $($constant.put(&mut beats, self.$field as u32);)*
                self.raised.put(&mut beats);
                beats
            }

            /// The status from its beats; `None` unless there are [`STATUS_BEATS`] of them.
            pub fn of_beats(beats: &[[i32; 3]]) -> Option<Self> {
                (beats.len() == STATUS_BEATS).then(|| Status {
                    $($field: Value::of($constant.get(beats)),)*
                    raised: FlagSet::of_status(beats),
                })
            }
        }
    };
}

status! {
    POSITION_X position_x: i32 = [0, 0], [0, 32], Always, "μ1* in mu_max/384";
    POSITION_Y position_y: i32 = [0, 1], [0, 32], Always, "μ2* in mu_max/384";
    CONDITION condition: bool = [0, 2], [0, 1], Always, "the subarray or contact meets the condition of the scene";
    FOUND found: bool = [0, 2], [1, 1], Always, "the search found a candidate with Σp > 0; with a network, it gave μ";
    FRAMING framing: bool = [0, 2], [3, 1], Always,
        "since the last frame sent `tlast` came early or was missing, and the frame concerned was dropped";
    CASE case: u32 = [0, 2], [8, 2], Adaptive, "the paper's number of the case that was taken";
    FRAMES frames: u32 = [0, 2], [16, 13], SlidingMean, "number of frames in the mean, of an adaptive one in its longest, up to 2^(k+1) − 1";
    WINDOW window: u32 = [0, 2], [29, 3], AdaptiveMean,
        "index of the window of the mean, in the order of their noise, the least first; the last is the shortest mean";
    SCORE score: i32 = [1, 0], [0, 32], Always,
        "score at μ* in 2^−6 bit, 0 if nothing was found; with a network a word of two ln σ, that of μ1 in the lower half";
    RESCALE rescale: u32 = [1, 1], [0, 32], Always, "right shift of `rescale`";
    NORMALISE normalise: u32 = [1, 2], [0, 16], Always, "left shift of `normalise`";
    TABLES_VERSION tables_version: u32 = [1, 2], [16, VERSION_BITS], WritableTables,
        "version of the tables, 0 for those of the bitstream";
    RESCALE_SATURATIONS rescale_saturations: u32 = [2, 0], [0, 32], Always,
        "number of words saturated in `rescale`, `estimate`, `shear` and `relax`";
    FORCE_SATURATIONS force_saturations: u32 = [2, 1], [0, 32], Always, "number of force words saturated in the frame";
    CYCLES cycles: u32 = [2, 2], [0, 32], Always, "cycles to the first output beat";
}

impl Status {
    /// The statuses in the status beats of a frame.
    pub fn all(beats: &[[i32; 3]]) -> impl Iterator<Item = Status> + '_ {
        beats.chunks(STATUS_BEATS).filter_map(Status::of_beats)
    }

    /// μ* in units of mu_max / 384, [x, y].
    pub fn position(&self) -> [i32; 2] {
        [self.position_x, self.position_y]
    }

    /// The flags that the status raises: those with a bit of their own, and those that follow from other fields.
    pub fn flags(&self) -> FlagSet {
        let others = [
            (Flag::ConditionUnmet, !self.condition),
            (Flag::NoCompression, self.condition && !self.found),
            (Flag::Saturated, self.rescale_saturations > 0 || self.force_saturations > 0),
        ];
        self.raised | FlagSet::raised(others)
    }
}

/// All fields of a status, those of flags among them, in the order of beats, words and bits.
pub fn status_fields() -> Vec<StatusField> {
    let of_flags = Flag::ALL.into_iter().filter_map(Flag::status_bit);
    let mut all: Vec<StatusField> = FIELDS.iter().copied().chain(of_flags).collect();
    all.sort_by_key(|field| (field.beat, field.word, field.low));
    all
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
        let status = Status {
            position_x: -3,
            position_y: 384,
            condition: true,
            case: 3,
            frames: 8191,
            window: 5,
            score: -70_000,
            normalise: 3,
            tables_version: 5,
            cycles: 77,
            raised: Flag::ALL.into_iter().filter(|flag| flag.status_bit().is_some()).collect(),
            ..Status::default()
        };
        let beats = status.beats();
        assert_eq!(Status::of_beats(&beats), Some(status));
        assert_eq!(Status::of_beats(&beats[..1]), None);
        // Condition; no_contact, coefficients, more_contacts, tables, rail; case; wrong_channel, score_low, zero_limit, clipped,
        // line_fault, negative_pressure; frames; window.
        let flags = 1 | 1 << 2 | 0b1111 << 4 | 3 << 8 | 63 << 10 | 8191 << 16 | 5u32 << 29;
        assert_eq!(beats, [[-3, 384, flags as i32], [-70_000, 0, 0x8005_0003u32 as i32], [0, 0, 77]]);
    }

    /// A field written alone changes only its bits, and reads back: no two fields share a bit.
    #[test]
    fn fields_do_not_overlap() {
        let all = status_fields();
        for word in all.iter().map(|field| [field.beat, field.word]) {
            let of_word = all.iter().filter(|field| [field.beat, field.word] == word);
            let bits: u32 = of_word.clone().map(|field| field.bits).sum();
            assert_eq!(of_word.fold(0, |mask, field| mask | field.mask()).count_ones(), bits, "{word:?}");
        }
        // In the manifest and in C.
        let mut names: Vec<&str> = all.iter().map(|field| field.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
        // None of the three words of a beat is without a field.
        assert_eq!(all.iter().filter(|field| field.low == 0).count(), STATUS_BEATS * 3);
    }

    /// Each flag is raised by its bit alone, the others by what they follow from.
    #[test]
    fn each_flag_of_a_status_is_raised() {
        let good = Status { condition: true, found: true, ..Status::default() };
        assert_eq!(good.flags(), FlagSet::default());
        for flag in Flag::ALL {
            let mut beats = good.beats();
            let Some(bit) = flag.status_bit() else { continue };
            bit.put(&mut beats, 1);
            assert!(Status::of_beats(&beats).unwrap().flags().iter().eq([flag]), "{flag:?}");
        }
        let of = |status: Status| status.flags().iter().collect::<Vec<_>>();
        assert_eq!(of(Status { condition: false, ..good }), [Flag::ConditionUnmet]);
        assert_eq!(of(Status { found: false, ..good }), [Flag::NoCompression]);
        assert_eq!(of(Status { force_saturations: 1, ..good }), [Flag::Saturated]);
        assert_eq!(of(Status { rescale_saturations: 1, ..good }), [Flag::Saturated]);
    }
}
