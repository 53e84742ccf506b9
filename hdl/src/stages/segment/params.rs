//! Sizes and tables of the circuit.

use dermis_golden::fixed::stages::segment::cycles::Segmentation;

use crate::primitives::count_bits;

/// Sizes of the circuit.
#[derive(Clone, Debug)]
pub(super) struct SegmentParams {
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Rows and columns of quads.
    pub(super) quads: [usize; 2],
    /// Largest number of contacts.
    pub(super) most: usize,
    /// Width of a lane of the quads that come in.
    pub(super) lane: usize,
    /// Lowest bit of a word in it.
    pub(super) low: usize,
    /// Width of a smoothed word.
    pub(super) smoothed: usize,
    /// Width of a load or a moment.
    pub(super) sum: usize,
    /// Inverse distances of neighbours along x, along y, of diagonal ones.
    pub(super) slopes: [u64; 3],
    /// For each axis the taps of a line in their order: weight; `{end of the line, window moves on, last of the place}`.
    pub(super) taps: [Vec<(u64, u64)>; 2],
}

impl SegmentParams {
    /// Of a segmentation whose quads have lanes of `lane` bits, words from bit `low` on.
    pub(super) fn new(segmentation: &Segmentation, lane: usize, low: usize) -> Self {
        let (sensor, quads) = (segmentation.sensor, segmentation.quads());
        let taps = |axis: usize| {
            let places = segmentation.taps(axis);
            let moves = |place: usize| places.get(place + 1).is_some_and(|next| next.0 > places[place].0);
            let of_place = |(place, (_, weights)): (usize, &(usize, &[i64]))| {
                let (last, ends, moves) = (weights.len() - 1, place + 1 == places.len(), moves(place));
                let flag = |flag: bool, at: usize| u64::from(flag) << at;
                let tap = |(k, weight): (usize, &i64)| {
                    (*weight as u64, flag(k == last, 0) | flag(moves, 1) | flag(k == last && ends, 2))
                };
                weights.iter().enumerate().map(tap).collect::<Vec<_>>()
            };
            places.iter().enumerate().flat_map(of_place).collect::<Vec<_>>()
        };
        SegmentParams {
            rows: sensor.rows,
            cols: sensor.cols,
            quads: [quads.quad_rows(), quads.quad_cols()],
            most: segmentation.most,
            lane,
            low,
            smoothed: segmentation.smoothed_bits() as usize,
            sum: segmentation.sum_bits() as usize,
            slopes: segmentation.segmenter.slopes.map(|slope| slope as u64),
            taps: [taps(0), taps(1)],
        }
    }

    pub(super) fn taxels(&self) -> usize {
        self.rows * self.cols
    }

    pub(super) fn quad_count(&self) -> usize {
        self.quads[0] * self.quads[1]
    }

    /// Number of taps along a line of each axis.
    pub(super) fn tap_counts(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.taps[axis].len())
    }

    /// Width of the contact of a taxel, 0 for none.
    pub(super) fn label(&self) -> usize {
        count_bits(self.most + 1)
    }
}
