//! Status fields: where the words of a status hold what.

use crate::spec::partition::Case;
use crate::spec::scene::{CoefficientCheck, EstimatorKind, MeanKind, Scene};

/// Beats of a status.
pub const STATUS_BEATS: usize = 3;
/// Words of a beat: fx, fy, fz.
const WORDS: usize = 3;

/// What a scene asks for, so that its hardware's status has a field; without it the field is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Every hardware has the field.
    Always,
    /// The whole array is searched for one μ.
    WholeSearch,
    /// The coefficient memory is checked.
    CoefficientCheck,
    /// The codes of a frame are checked.
    CodeCheck,
    /// Each contact has a μ of its own.
    Contacts,
    /// One of several cases is chosen for each frame.
    Adaptive,
    /// The mean of the frames slides.
    SlidingMean,
    /// It is adaptive.
    AdaptiveMean,
    /// Zeros follow the readings.
    RunningZero,
    /// Tables are written at run time.
    WritableTables,
    /// The hardware scans the array itself.
    Scan,
}

impl Feature {
    /// Whether the hardware of `scene` has it; the scene of a plan, whose case is that built.
    pub fn is_in(self, scene: &Scene) -> bool {
        match self {
            Feature::Always => true,
            Feature::WholeSearch => {
                let searched = scene.hardware_estimator() == EstimatorKind::Search && scene.search.mu_max > 0.0;
                searched && scene.partition.case == Case::WHOLE
            }
            Feature::CodeCheck => scene.checks_codes(),
            Feature::CoefficientCheck => scene.hardware.coefficient_check == CoefficientCheck::Signature,
            Feature::Contacts => scene.partition.case == Case::Contacts,
            Feature::Adaptive => scene.partition.case == Case::Adaptive,
            Feature::SlidingMean => scene.input.slides(),
            Feature::AdaptiveMean => scene.input.mean == MeanKind::Adaptive,
            Feature::RunningZero => scene.input.running_zero().is_some(),
            Feature::WritableTables => scene.hardware.has_writable_tables(),
            Feature::Scan => scene.hardware.adc_scan.is_some(),
        }
    }

    /// The field of the scene that asks for it, with its value; empty for [`Feature::Always`].
    pub fn setting(self) -> &'static str {
        match self {
            Feature::Always => "",
            Feature::WholeSearch => "a search, `partition.case = 0`",
            Feature::CodeCheck => "`hardware.code_check = \"on\"`",
            Feature::CoefficientCheck => "`hardware.coefficient_check = \"signature\"`",
            Feature::Contacts => "`partition.case = \"contacts\"`",
            Feature::Adaptive => "`partition.case = \"adaptive\"`",
            Feature::SlidingMean => "`input.mean = \"sliding\"`, `\"adaptive\"`",
            Feature::AdaptiveMean => "`input.mean = \"adaptive\"`",
            Feature::RunningZero => "`input.zero = \"running\"`",
            Feature::WritableTables => "`hardware.tables = \"writable\"`",
            Feature::Scan => "`hardware.source = \"adc-scan\"`",
        }
    }
}

/// A field of a status: some bits of one of its words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusField {
    /// Name.
    pub name: &'static str,
    /// Index of the beat, below [`STATUS_BEATS`].
    pub beat: usize,
    /// Index of the word in the beat: 0 fx, 1 fy, 2 fz.
    pub word: usize,
    /// Lowest bit, below 32.
    pub low: u32,
    /// Number of bits, 1 to 32.
    pub bits: u32,
    /// What the scene must ask for.
    pub feature: Feature,
    /// Meaning, in words.
    pub meaning: &'static str,
}

impl StatusField {
    /// The field `name` at `[beat, word]`, of `bits` bits from bit `low` on.
    pub const fn new(
        name: &'static str,
        [beat, word]: [usize; 2],
        [low, bits]: [u32; 2],
        feature: Feature,
        meaning: &'static str,
    ) -> Self {
        StatusField { name, beat, word, low, bits, feature, meaning }
    }

    /// A bit of the word of flags, fz of the first beat.
    pub const fn flag(name: &'static str, low: u32, feature: Feature, meaning: &'static str) -> Self {
        StatusField::new(name, [0, 2], [low, 1], feature, meaning)
    }

    /// Index of the field's word among those of a status, three of each beat.
    pub const fn index(&self) -> usize {
        WORDS * self.beat + self.word
    }

    /// The field's bits in its word.
    pub const fn mask(&self) -> u32 {
        u32::MAX >> (u32::BITS - self.bits) << self.low
    }

    /// The field in the beats of a status.
    pub fn get(&self, beats: &[[i32; WORDS]]) -> u32 {
        let word = beats.get(self.beat).map_or(0, |beat| beat[self.word] as u32);
        (word & self.mask()) >> self.low
    }

    /// Puts the low bits of `value` into the beats of a status.
    pub fn put(&self, beats: &mut [[i32; WORDS]], value: u32) {
        if let Some(beat) = beats.get_mut(self.beat) {
            let others = beat[self.word] as u32 & !self.mask();
            beat[self.word] = (others | value << self.low & self.mask()) as i32;
        }
    }

    /// Name and content of the field's entry in the manifest: the mask of a bit, or the lowest bit of a number; none for a
    /// number that every hardware has.
    pub fn manifest_entry(&self) -> Option<(String, u32)> {
        match (self.bits, self.feature) {
            (1, _) => Some((self.name.to_owned(), self.mask())),
            (_, Feature::Always) => None,
            _ => Some((format!("{}_shift", self.name), self.low)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_put_beside_the_others() {
        let field = StatusField::new("few", [1, 2], [30, 2], Feature::Always, "");
        let whole = StatusField::new("all", [0, 0], [0, 32], Feature::Always, "");
        let mut beats = [[0, 0, 0], [0, 0, 5], [0, 0, 0]];
        field.put(&mut beats, 7);
        whole.put(&mut beats, (-3i32) as u32);
        assert_eq!(beats, [[-3, 0, 0], [0, 0, 0xc000_0005u32 as i32], [0, 0, 0]]);
        assert_eq!((field.get(&beats), whole.get(&beats) as i32), (3, -3));
        field.put(&mut beats, 0);
        assert_eq!(beats[1], [0, 0, 5]);
        assert_eq!((field.mask(), whole.mask()), (3 << 30, u32::MAX));
        // Beats that are missing have nothing.
        assert_eq!(field.get(&beats[..1]), 0);
    }
}
