//! Stage `resultants`: one force and its first moments per subarray, instead of a force per taxel.
//!
//! Over the taxels of a subarray, with X = 2·col − (cols − 1) and Y = 2·row − (rows − 1) of the whole array, in half
//! pitches from its centre, and fz⁺ = max(fz, 0) as the golden model's centre of pressure has it:
//! ```text
//! Σ fx    Σ fy    Σ fz    Σ fz⁺    Σ X fz⁺    Σ Y fz⁺           centre = (Σ X fz⁺, Σ Y fz⁺) / Σ fz⁺ · pitch / 2
//! ```
//! Exact 64-bit integers, sent as two words with the low one first: [`BEATS`] beats per subarray, row-major, before the
//! status. The host divides.

use super::forces::Force;
use crate::partition::Subarray;
use crate::sensor::Sensor;

/// Number of sums per subarray.
pub const SUMS: usize = 6;
/// Number of output beats per subarray.
pub const BEATS: usize = 2 * SUMS / 3;
/// Width of X and Y in bits: |2·255 − 255| and a sign.
pub const POSITION_BITS: u32 = 9;
/// Width of a sum in bits: a force word, 2^16 taxels, and X or Y.
pub const SUM_BITS: u32 = 32 + 16 + POSITION_BITS;
/// Cycles from the last force to the first beat.
pub const LATENCY: u64 = 4;

/// The sums of one subarray, `[Σ fx, Σ fy, Σ fz, Σ fz⁺, Σ X fz⁺, Σ Y fz⁺]`; `forces` are the array's, row-major.
pub fn sums(sensor: &Sensor, part: &Subarray, forces: &[Force]) -> [i64; SUMS] {
    let mut sums = [0; SUMS];
    for index in part.indices(sensor) {
        let [x, y] = half_pitches(sensor, index);
        let [fx, fy, fz] = forces[index].words.map(i64::from);
        let pressed = fz.max(0);
        for (sum, value) in sums.iter_mut().zip([fx, fy, fz, pressed, x * pressed, y * pressed]) {
            *sum += value;
        }
    }
    sums
}

/// X and Y of taxel `index` of the array, in half pitches from its centre.
pub fn half_pitches(sensor: &Sensor, index: usize) -> [i64; 2] {
    let from_centre = |at: usize, count: usize| 2 * at as i64 - (count as i64 - 1);
    [from_centre(index % sensor.cols, sensor.cols), from_centre(index / sensor.cols, sensor.rows)]
}

/// The sums as output beats.
pub fn beats(sums: &[i64; SUMS]) -> [[i32; 3]; BEATS] {
    let word = |index: usize| (sums[index / 2] >> (32 * (index % 2))) as i32;
    std::array::from_fn(|beat| std::array::from_fn(|k| word(3 * beat + k)))
}

/// The sums from their beats; `None` unless there are [`BEATS`] of them.
pub fn of_beats(beats: &[[i32; 3]]) -> Option<[i64; SUMS]> {
    let words: Vec<i32> = beats.iter().flatten().copied().collect();
    let sum = |k: usize| i64::from(words[2 * k + 1]) << 32 | i64::from(words[2 * k] as u32);
    (beats.len() == BEATS).then(|| std::array::from_fn(sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beats_read_back_and_moments_are_by_hand() {
        let sensor = Sensor { rows: 2, cols: 2, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: 1.0 };
        let part = Subarray { row0: 0, col0: 0, rows: 2, cols: 2 };
        let force = |words| Force { words, saturations: 0 };
        let forces = [force([1, -2, 5]), force([0, 0, 7]), force([0, 0, -4]), force([3, i32::MIN, i32::MAX])];
        let sums = sums(&sensor, &part, &forces);
        let max = i64::from(i32::MAX);
        // X = −1, 1, −1, 1 and Y = −1, −1, 1, 1; the taxel in tension has no share.
        assert_eq!(sums, [4, -2 + i64::from(i32::MIN), 8 + max, 12 + max, 2 + max, max - 12]);
        assert_eq!(of_beats(&beats(&sums)), Some(sums));
    }
}
