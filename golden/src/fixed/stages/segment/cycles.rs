//! Cycles of the hardware of `segment`, which follow from the counts of a segmentation.
//!
//! With n taxels in R rows and C columns, Q quads, t taps of both windows along a line, b basins:
//!
//! | step | cycles |
//! |---|---|
//! | unpack: quads to words, row-major | 7 Q |
//! | smooth along the rows, along the columns | R t₀ + 7, C t₁ + 7 |
//! | climb: the steepest neighbour of each taxel | 10 n + 6 |
//! | clear the table of b basins | (b + 1)(b + 2)/2 |
//! | follow the steps to the maxima | 3 for each reading: of each taxel; twice of each with a step; once per walk |
//! | borders: loads and saddles | 5 n + 3, and 3 for each pair of neighbours in different basins |
//! | join: for each round with B basins the smallest load | B + 4 |
//! | … then its saddles, if it is small | 3 (B + 1) + 2 |
//! | … or those of all pairs | 4 B + 3 B (B − 1)/2 + 4 |
//! | … and the joining of a pair | 4 B + 3 |
//! | order: for each of the remaining the largest load | B + 6 |
//! | … then settle the contact of every basin | 68 |
//! | label the quads and add the moments | 20 Q + 4 |
//! | middle: for each contact its row and column | 2 (row + column) + 9 |

use crate::estimate::segment::{neighbours, Basins, Join, Segmenter, BASINS, NONE, WEIGHT_BITS, WORD_BITS};
use crate::spec::quads::Quads;
use crate::spec::sensor::Sensor;

/// Width of a tap in the memory of the hardware: a weight up to one.
pub const TAP_BITS: usize = WEIGHT_BITS as usize + 1;
/// Largest number of contacts of the hardware.
pub const MOST: usize = 8;
/// Cycles from the start to the first step, and from the last to the end.
const ENDS: u64 = 2;

/// The segmentation of an array, as the hardware does it.
#[derive(Clone, Copy, Debug)]
pub struct Segmentation<'a> {
    /// The array.
    pub sensor: &'a Sensor,
    /// Its constants.
    pub segmenter: &'a Segmenter,
    /// Largest number of contacts, at most [`MOST`].
    pub most: usize,
}

/// What the cycles of a segmentation depend on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Number of basins.
    pub basins: usize,
    /// Number of taxels that are no maxima.
    pub steps: usize,
    /// Number of walks, each from a taxel up to the first whose basin is known.
    pub walks: usize,
    /// Number of pairs of neighbours in different basins.
    pub borders: usize,
    /// The joinings.
    pub joins: Vec<Join>,
    /// Number of contacts, before some are left out.
    pub contacts: usize,
    /// Row and column of the middle of each contact that remains.
    pub middles: Vec<[usize; 2]>,
}

impl Counts {
    /// Of a segmentation of `sensor` that found `basins` and these middles.
    pub fn of(sensor: &Sensor, basins: &Basins, middles: &[[usize; 2]]) -> Self {
        let taxels = 0..basins.steps.len();
        let mut known: Vec<bool> = basins.steps.iter().enumerate().map(|(taxel, next)| taxel == *next).collect();
        let steps = known.iter().filter(|known| !**known).count();
        let mut walks = 0;
        for mut taxel in taxels.clone() {
            walks += usize::from(!known[taxel]);
            while !std::mem::replace(&mut known[taxel], true) {
                taxel = basins.steps[taxel];
            }
        }
        let ahead = |taxel: usize| neighbours(sensor, taxel).filter(move |&other| other > taxel);
        let differ = |taxel: usize| ahead(taxel).filter(|&other| basins.basins[other] != basins.basins[taxel]).count();
        Counts {
            basins: basins.basins.iter().copied().max().unwrap_or(NONE),
            steps,
            walks,
            borders: taxels.map(differ).sum(),
            joins: basins.joins.clone(),
            contacts: basins.segments.count,
            middles: middles.to_vec(),
        }
    }
}

/// Cycles of a round of joining with `basins` basins: of the search for a pair, `small` or not, and of its joining.
fn round(basins: usize, small: bool, joins: bool) -> u64 {
    let pairs = if small { 3 * (basins + 1) + 2 } else { 4 * basins + 3 * basins * basins.saturating_sub(1) / 2 + 4 };
    (basins + 4 + pairs + if joins { 4 * basins + 3 } else { 0 }) as u64
}

/// Cycles of the order of `contacts` contacts, and of the contacts of all basins.
fn order(contacts: usize) -> u64 {
    (1..=contacts as u64).map(|left| left + 6).sum::<u64>() + 68
}

impl Segmentation<'_> {
    /// Layout of the array's quads.
    pub fn quads(&self) -> Quads {
        Quads { rows: self.sensor.rows, cols: self.sensor.cols }
    }

    /// For each place along a row (`axis` 0) or a column the weights from its first neighbour within the array to its last,
    /// and the number of the first.
    pub fn taps(&self, axis: usize) -> Vec<(usize, &[i64])> {
        let window = &self.segmenter.windows[axis];
        let count = window.weights.len();
        let at = |(place, weights): (usize, &'_ Vec<i64>)| {
            let first = window.reach.saturating_sub(place);
            (place.saturating_sub(window.reach), first..weights.len().min(count + window.reach - place))
        };
        window.weights.iter().enumerate().map(|place| (at(place).0, &place.1[at(place).1])).collect()
    }

    /// Number of taps along a row (`axis` 0) or a column.
    pub fn tap_count(&self, axis: usize) -> usize {
        self.taps(axis).iter().map(|(_, weights)| weights.len()).sum()
    }

    /// Width of a smoothed word, without a sign: the weights of a place may add up to slightly more than one.
    pub fn smoothed_bits(&self) -> u32 {
        let smoothed = |most: i64, axis: usize| {
            let sum = self.segmenter.windows[axis].weights.iter().map(|weights| weights.iter().sum::<i64>()).max();
            (most * sum.unwrap_or(0) + (1 << (WEIGHT_BITS - 1))) >> WEIGHT_BITS
        };
        let most = [0, 1].into_iter().fold((1 << WORD_BITS) - 1, smoothed);
        i64::BITS - most.max((1 << WORD_BITS) - 1).leading_zeros()
    }

    /// Width of a sum, without a sign: of all smoothed words, of the words times an odd number for each line.
    pub fn sum_bits(&self) -> u32 {
        let (rows, cols) = (self.sensor.rows as u64, self.sensor.cols as u64);
        let all = ((1 << self.smoothed_bits()) - 1) * rows * cols;
        let moment = ((1 << WORD_BITS) - 1) * rows * cols * rows.max(cols).max(2);
        u64::BITS - all.max(moment).leading_zeros()
    }

    /// Cycles from the start to the end.
    pub fn cycles(&self, counts: &Counts) -> u64 {
        let joined = counts.joins.iter().map(|join| round(join.basins, join.small, true)).sum::<u64>();
        let middles = counts.middles.iter().map(|[row, col]| (2 * (row + col) + 9) as u64).sum::<u64>();
        let readings = self.sensor.taxels() + 2 * counts.steps + counts.walks;
        let joining = joined + round(counts.contacts, false, false) + order(counts.contacts);
        self.fixed() + cleared(counts.basins) + 3 * (readings + counts.borders) as u64 + joining + middles
    }

    /// A bound of the cycles: every taxel but the maxima starts a walk, all neighbours are in different basins, all middles are
    /// in the last row and column.
    pub fn longest(&self) -> u64 {
        let (rows, cols, taxels) = (self.sensor.rows, self.sensor.cols, self.sensor.taxels());
        let basins = BASINS.min(taxels);
        let pairs = rows * (cols - 1) + (rows - 1) * cols + 2 * (rows - 1) * (cols - 1);
        let middle = |contacts: usize| (contacts.min(self.most) * (2 * (rows + cols) + 5)) as u64;
        let joining = |contacts: usize| {
            let joined = (contacts + 1..=basins).map(|left| round(left, true, true).max(round(left, false, true)));
            joined.sum::<u64>() + round(contacts, false, false) + order(contacts) + middle(contacts)
        };
        let longest = (0..=basins).map(joining).max().unwrap_or(0);
        self.fixed() + cleared(basins) + 3 * (4 * taxels + pairs) as u64 + longest
    }

    /// Cycles that do not depend on the words.
    fn fixed(&self) -> u64 {
        let (rows, cols, taxels, quads) =
            (self.sensor.rows, self.sensor.cols, self.sensor.taxels(), self.quads().len());
        let smooth = rows * self.tap_count(0) + cols * self.tap_count(1) + 14;
        (7 * quads + smooth + 10 * taxels + 6 + 5 * taxels + 3 + 20 * quads + 4) as u64 + ENDS
    }
}

/// Cycles to clear the table of so many basins.
fn cleared(basins: usize) -> u64 {
    ((basins + 1) * (basins + 2) / 2) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::segment::WIDTH;

    /// Taps cover a line from its first place to its last, in windows that move by at most one place.
    #[test]
    fn taps_are_within_the_array() {
        for (rows, cols) in [(2, 3), (8, 8), (1, 5), (20, 20)] {
            let sensor = Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 1.0, thickness_mm: 3.0 };
            let segmenter = Segmenter::new(&sensor, WIDTH);
            let segmentation = Segmentation { sensor: &sensor, segmenter: &segmenter, most: MOST };
            for (axis, count) in [(0, cols), (1, rows)] {
                let taps = segmentation.taps(axis);
                assert_eq!((taps.len(), taps[0].0), (count, 0));
                for (place, (first, weights)) in taps.iter().enumerate() {
                    let window = &segmenter.windows[axis];
                    assert_eq!(weights.iter().sum::<i64>(), window.weights[place].iter().sum::<i64>());
                    assert_eq!(weights[place - first], window.weights[place][window.reach]);
                    assert!(place == 0 || (taps[place - 1].0..=taps[place - 1].0 + 1).contains(first));
                }
                let (first, weights) = taps[count - 1];
                assert_eq!(first + weights.len(), count);
            }
        }
    }

    /// A row that rises to its right end: the first walk visits all, the other taxels are read once more.
    #[test]
    fn the_counts_of_a_slope() {
        let sensor = Sensor { rows: 1, cols: 6, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 2.0 };
        let words: Vec<i64> = (0..6).map(|col| 1000 * col).collect();
        let basins = Segmenter::new(&sensor, WIDTH).segment(&words);
        let counts = Counts::of(&sensor, &basins, &[[0, 4]]);
        assert_eq!((counts.basins, counts.steps, counts.walks, counts.borders), (1, 5, 1, 0));
        assert_eq!((counts.joins.len(), counts.contacts), (0, 1));
    }
}
