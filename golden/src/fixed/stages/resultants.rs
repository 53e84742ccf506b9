//! Stage `resultants`: a record of sums for each subarray or contact, instead of a force per taxel.
//!
//! Over the taxels of a subarray, with X = 2·col − (cols − 1) and Y = 2·row − (rows − 1) of the whole array, in half
//! pitches from its centre, and fz⁺ = max(fz, 0) as the golden model's centre of pressure has it:
//! ```text
//! Σ fx    Σ fy    Σ fz    Σ fz⁺    Σ X fz⁺    Σ Y fz⁺           centre = (Σ X fz⁺, Σ Y fz⁺) / Σ fz⁺ · pitch / 2
//! ```
//! With a μ for each contact a record is that of a label, and has also what the moments about the array's centre need:
//! ```text
//! Σ X fz    Σ Y fz    Σ X fy    Σ Y fx    number of taxels      moment = (Σ Y fz, −Σ X fz, Σ X fy − Σ Y fx) · pitch / 2
//! ```
//! Exact 64-bit integers, sent as two words with the low one first, then the number of taxels as one: [`Summed::beats`]
//! beats for each record, before the status. Subarrays are sent row-major; of labels first 0, that of the taxels of no
//! contact, then the contacts, that with the largest load first. The host divides.

use super::forces::Force;
use crate::spec::sensor::Sensor;

/// Largest number of sums in a record.
pub const SUMS: usize = 10;
/// Width of X and Y in bits: |2·255 − 255| and a sign.
pub const POSITION_BITS: u32 = 9;
/// Width of a sum in bits: a force word, 2^16 taxels, and X or Y.
pub const SUM_BITS: u32 = 32 + 16 + POSITION_BITS;
/// Cycles from the last force to the first beat.
pub const LATENCY: u64 = 4;

/// The group of taxels that a record sums: a subarray, or a contact's label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Summed {
    /// Those of a subarray.
    Subarray,
    /// Those of a label: of a contact, or of none.
    Label,
}

impl Summed {
    /// Number of sums, the first of those of [`Record::sums`].
    pub fn sums(self) -> usize {
        match self {
            Summed::Subarray => 6,
            Summed::Label => SUMS,
        }
    }

    /// Whether the number of taxels follows the sums.
    pub fn counts(self) -> bool {
        self == Summed::Label
    }

    /// Number of output beats of a record.
    pub fn beats(self) -> usize {
        (2 * self.sums() + usize::from(self.counts())) / 3
    }
}

/// The sums over some taxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// `[Σ fx, Σ fy, Σ fz, Σ fz⁺, Σ X fz⁺, Σ Y fz⁺, Σ X fz, Σ Y fz, Σ X fy, Σ Y fx]`; those that were not sent are 0.
    pub sums: [i64; SUMS],
    /// Number of taxels; 0 if it was not sent.
    pub taxels: usize,
}

impl Record {
    /// Of these taxels; `forces` are the array's, row-major.
    pub fn of(sensor: &Sensor, taxels: impl Iterator<Item = usize>, forces: &[Force]) -> Record {
        let mut record = Record::default();
        for index in taxels {
            record.add(half_pitches(sensor, index), forces[index].words);
        }
        record
    }

    /// Adds the force of a taxel, `[fx, fy, fz]`, at `[X, Y]`.
    pub fn add(&mut self, [x, y]: [i64; 2], force: [i32; 3]) {
        let [fx, fy, fz] = force.map(i64::from);
        let pressed = fz.max(0);
        let values = [fx, fy, fz, pressed, x * pressed, y * pressed, x * fz, y * fz, x * fy, y * fx];
        self.sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        self.taxels += 1;
    }

    /// The record as output beats.
    pub fn beats(&self, summed: Summed) -> Vec<[i32; 3]> {
        let sums = self.sums[..summed.sums()].iter().flat_map(|sum| [*sum as i32, (sum >> 32) as i32]);
        let words: Vec<i32> = sums.chain(summed.counts().then_some(self.taxels as i32)).collect();
        words.chunks_exact(3).map(|words| [words[0], words[1], words[2]]).collect()
    }

    /// The record from its beats; `None` unless there are [`Summed::beats`] of them.
    pub fn of_beats(summed: Summed, beats: &[[i32; 3]]) -> Option<Record> {
        let words: Vec<i32> = beats.iter().flatten().copied().collect();
        let sum = |k: usize| i64::from(words[2 * k + 1]) << 32 | i64::from(words[2 * k] as u32);
        (beats.len() == summed.beats()).then(|| Record {
            sums: std::array::from_fn(|k| if k < summed.sums() { sum(k) } else { 0 }),
            taxels: if summed.counts() { words[2 * summed.sums()] as u32 as usize } else { 0 },
        })
    }
}

/// X and Y of taxel `index` of the array, in half pitches from its centre.
pub fn half_pitches(sensor: &Sensor, index: usize) -> [i64; 2] {
    let from_centre = |at: usize, count: usize| 2 * at as i64 - (count as i64 - 1);
    [from_centre(index % sensor.cols, sensor.cols), from_centre(index / sensor.cols, sensor.rows)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beats_read_back_and_moments_are_by_hand() {
        let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
        let force = |words| Force { words, saturations: 0 };
        let forces = [force([1, -2, 5]), force([0, 0, 7]), force([0, 0, -4]), force([3, i32::MIN, i32::MAX])];
        let record = Record::of(&sensor, 0..4, &forces);
        let [max, min] = [i32::MAX, i32::MIN].map(i64::from);
        // X = −1, 1, −1, 1 and Y = −1, −1, 1, 1; the taxel in tension has no share in those of fz⁺.
        let first = [4, -2 + min, 8 + max, 12 + max, 2 + max, max - 12];
        let moments = [max + 6, max - 16, 2 + min, 2];
        assert_eq!(record, Record { sums: [&first[..], &moments].concat().try_into().unwrap(), taxels: 4 });
        let beats = record.beats(Summed::Label);
        assert_eq!((beats.len(), Record::of_beats(Summed::Label, &beats)), (7, Some(record)));
        let beats = record.beats(Summed::Subarray);
        let sent = Record { sums: [&first[..], &[0; 4]].concat().try_into().unwrap(), taxels: 0 };
        assert_eq!((beats.len(), Record::of_beats(Summed::Subarray, &beats)), (4, Some(sent)));
        assert_eq!(Record::of_beats(Summed::Label, &beats), None);
    }
}
