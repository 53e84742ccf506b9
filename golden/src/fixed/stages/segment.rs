//! Stage `segment`: from p₀ to the contact of each taxel and the middle of each contact.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p₀ | taxels, row-major | words of the search |
//! | out: contact of each taxel | taxels, row-major | [`NONE`], else 1 … in the order of their loads |
//! | out: middle of each contact | row, column | taxels |
//!
//! The compressive part of p₀ is brought to [`WORD_BITS`] bits and [segmented](crate::estimate::segment). Of more contacts than the
//! scene allows those with the largest loads, sums of the smoothed words, remain; of equal ones the first. The middle is the
//! taxel nearest to the centre of the words that are not smoothed, ties up: (2 Σ w·line + Σ w) / (2 Σ w), rounded down.

pub mod cycles;

use crate::estimate::segment::{Segmenter, NONE, WORD_BITS};
use crate::fixed::words::formats::Formats;
use crate::spec::sensor::Sensor;
use cycles::{Counts, Segmentation};

/// The contacts of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Segmented {
    /// Contact of each taxel, row-major: [`NONE`], else 1 + its index in `middles`.
    pub labels: Vec<usize>,
    /// Row and column of the taxel in the middle of each contact, the contact with the largest load first.
    pub middles: Vec<[usize; 2]>,
    /// Whether there were more contacts or basins than there may be; their taxels have none.
    pub overflow: bool,
    /// Cycles that the hardware takes, from its start to its end.
    pub cycles: u64,
}

/// Right shift from a word of the search to one of the segmentation.
pub fn word_shift(formats: &Formats) -> u32 {
    formats.search_bits[0] - 1 - WORD_BITS
}

/// The word of the segmentation for a p₀ in words of the search.
pub fn word(formats: &Formats, p: i64) -> i64 {
    p.max(0) >> word_shift(formats)
}

/// Segments p₀, of which `words` are the [words](word), row-major, into at most `most` contacts.
pub fn segment(sensor: &Sensor, segmenter: &Segmenter, words: &[i64], most: usize) -> Segmented {
    let basins = segmenter.segment(words);
    let segments = &basins.segments;
    let mut order = basins.by_load();
    order.truncate(most);
    let name = |contact: usize| order.iter().position(|own| *own == contact).map_or(NONE, |index| index + 1);
    let middle = |&contact: &usize| {
        let weight: i64 = segments.taxels(contact).map(|taxel| words[taxel]).sum();
        let of_axis = |line: &dyn Fn(usize) -> usize, lines: usize| {
            let moment: i64 = segments.taxels(contact).map(|taxel| words[taxel] * line(taxel) as i64).sum();
            (1..lines as i64).take_while(|next| 2 * moment + weight >= 2 * weight * next).count()
        };
        [of_axis(&|taxel| taxel / sensor.cols, sensor.rows), of_axis(&|taxel| taxel % sensor.cols, sensor.cols)]
    };
    let middles: Vec<[usize; 2]> = order.iter().map(middle).collect();
    let segmentation = Segmentation { sensor, segmenter, most };
    Segmented {
        labels: segments.labels.iter().map(|label| label.map_or(NONE, name)).collect(),
        overflow: basins.overflow || segments.count > most,
        cycles: segmentation.cycles(&Counts::of(sensor, &basins, &middles)),
        middles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::segment::WIDTH;

    fn array() -> Sensor {
        Sensor { rows: 12, cols: 20, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 2.0 }
    }

    /// Words of cones: row, column, height.
    fn cones(all: &[[i64; 3]]) -> Vec<i64> {
        let at = |k: usize| {
            let [row, col] = [(k / 20) as f64, (k % 20) as f64];
            let cone = |[y, x, top]: &[i64; 3]| {
                (*top as f64 * (1.0 - (row - *y as f64).hypot(col - *x as f64) / 4.0)).max(0.0) as i64
            };
            all.iter().map(cone).sum()
        };
        (0..240).map(at).collect()
    }

    #[test]
    fn contacts_are_in_the_order_of_their_loads() {
        let words = cones(&[[3, 3, 20_000], [8, 15, 60_000], [3, 12, 40_000]]);
        let found = segment(&array(), &Segmenter::new(&array(), WIDTH), &words, 8);
        assert_eq!((found.middles, found.overflow), (vec![[8, 15], [3, 12], [3, 3]], false));
        assert_eq!([[8, 15], [3, 12], [3, 3]].map(|[row, col]| found.labels[row * 20 + col]), [1, 2, 3]);
    }

    #[test]
    fn of_more_contacts_the_largest_remain() {
        let words = cones(&[[3, 3, 20_000], [8, 15, 60_000], [3, 12, 40_000]]);
        let found = segment(&array(), &Segmenter::new(&array(), WIDTH), &words, 2);
        assert_eq!((found.middles.len(), found.overflow), (2, true));
        assert_eq!((found.labels[3 * 20 + 3], found.labels[8 * 20 + 15]), (NONE, 1));
    }

    /// A middle is the nearest taxel, half a taxel goes up.
    #[test]
    fn middles_by_hand() {
        let mut words = vec![0; 240];
        (words[5 * 20 + 4], words[5 * 20 + 5]) = (1000, 1000);
        let middle = |words: &[i64]| segment(&array(), &Segmenter::new(&array(), WIDTH), words, 8).middles;
        assert_eq!(middle(&words), [[5, 5]]);
        words[5 * 20 + 4] = 1001;
        assert_eq!(middle(&words), [[5, 4]]);
    }
}
