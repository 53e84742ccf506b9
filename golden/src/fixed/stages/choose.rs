//! Stage `choose`: the partition case for a frame, chosen among the cases built while the frame is received.
//!
//! A boundary between subarrays cuts a contact where the stress beside it exceeds a quarter of the frame's largest. The
//! finest case, in the order 1, 2, 3, whose boundaries cut nothing and whose loaded subarrays all meet the scene's
//! condition is chosen; else case 0, the whole array, which is always possible:
//! ```text
//! cut(case) = max |c| beside its boundaries > max(max |c| >> CUT_SHIFT, noise floor)
//! ```
//! "Beside" means two rows on each side of the boundary of cases 1 and 3, two columns on each side of the boundary of
//! cases 1 and 2; |c| is the ones' complement magnitude of [`magnitude_bits`].
//!
//! This is the hardware's rule. The golden model's `adaptive` ([`crate::result::reconstruct`]) first finds the contacts, solves
//! every case and takes the one nearest to them, which hardware cannot do before it has solved the frame. Median e_t of
//! 60 drawn frames solved by the floating-point model (`cargo test --release -p dermis-tests --test integration
//! the_choice_is_measured -- --nocapture`, which also prints the other shares):
//!
//! | scene | contacts | case 0 | 1 | 2 | 3 | hardware's rule | golden `adaptive` |
//! |---|---|---:|---:|---:|---:|---:|---:|
//! | eight-by-eight | 1 | 1.5 % | 97 % | 35 % | 33 % | 1.5 % | 1.5 % |
//! | sensor-1 | 1 | 1.2 % | 100 % | 52 % | 18 % | 1.6 % | 1.2 % |
//! | sensor-1 | 2, 3 | 75 % | 121 % | 126 % | 58 % | 73 % | 65 % |
//! | sensor-3, 20 frames | 1 | 0.6 % | 21 % | 6.1 % | 1.9 % | 0.7 % | 0.6 % |
//! | sensor-3 | 2 to 4 | 75 % | 47 % | 71 % | 46 % | 49 % | 34 % |
//!
//! Where a single contact is expected, case 0 alone is as good and smaller; the choice is for arrays that see one
//! contact or several. A smaller share (a larger shift) takes case 0 more often: better by up to 0.4 points for one
//! contact, worse by 6 points and more for several. A larger share gains 1 point for several contacts and loses as much
//! for one.
//!
//! | in | codes after `prepare`, row-major, `input_bits` signed |
//! |---|---|
//! | out | index of the case in the order built, case 0 first |

use crate::fixed::words::arith::magnitude_bits;
use crate::spec::partition::Grid;
use crate::spec::scene::Condition;
use crate::spec::sensor::Sensor;

/// Fraction of the frame's largest code from which stress beside a boundary counts as a contact, as a right shift.
pub const CUT_SHIFT: u32 = 2;
/// Number of rows or columns on each side of a boundary that are examined.
pub const BOUNDARY_LINES: usize = 2;
/// Clock cycles that the choice adds between a frame's last code and its first product: position and magnitude, maxima,
/// comparison, choice.
pub const LATENCY: u64 = 2;

/// Statistics of a frame, gathered while it is received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameStats {
    /// Largest magnitude of a code.
    pub peak: u64,
    /// Largest magnitude in the rows beside the horizontal boundary.
    pub middle_rows: u64,
    /// Largest magnitude in the columns beside the vertical boundary.
    pub middle_cols: u64,
    /// Per quarter of the array (upper left, upper right, lower left, lower right): some code is above the noise floor;
    /// some code is below its negative.
    pub signs: [[bool; 2]; 4],
}

/// Whether row (or column) `line` of `lines` is beside the boundary in the middle.
pub fn is_beside_boundary(line: usize, lines: usize) -> bool {
    (2 * line + 1).abs_diff(lines) < 2 * BOUNDARY_LINES
}

impl FrameStats {
    /// Adds the code of taxel `index` (row-major in the array); `floor` is the noise floor in codes.
    pub fn add(&mut self, sensor: &Sensor, index: usize, code: i32, floor: i32) {
        let (row, col) = (index / sensor.cols, index % sensor.cols);
        let magnitude = magnitude_bits(i64::from(code));
        self.peak = self.peak.max(magnitude);
        if is_beside_boundary(row, sensor.rows) {
            self.middle_rows = self.middle_rows.max(magnitude);
        }
        if is_beside_boundary(col, sensor.cols) {
            self.middle_cols = self.middle_cols.max(magnitude);
        }
        let quarter = 2 * usize::from(2 * row >= sensor.rows) + usize::from(2 * col >= sensor.cols);
        self.signs[quarter][0] |= code > floor;
        self.signs[quarter][1] |= code < -floor;
    }

    /// Whether no boundary of a case cuts a contact and its loaded subarrays meet the condition.
    fn is_admissible(&self, grid: Grid, condition: Condition, floor: i32, shift: u32) -> bool {
        let limit = (self.peak >> shift).max(floor.max(0) as u64);
        let cut = (grid.rows > 1 && self.middle_rows > limit) || (grid.cols > 1 && self.middle_cols > limit);
        let unmet = quarters(grid).into_iter().any(|part| {
            let [positive, negative] = [0, 1].map(|sign| part.iter().any(|&quarter| self.signs[quarter][sign]));
            positive != negative
        });
        !(cut || condition == Condition::BothSigns && unmet)
    }

    /// Index in `grids` of the case to solve; `grids[0]` is the whole array.
    pub fn choose(&self, grids: &[Grid], condition: Condition, floor: i32) -> usize {
        self.choose_at(CUT_SHIFT, grids, condition, floor)
    }

    /// [`FrameStats::choose`] with another share than [`CUT_SHIFT`], to measure its effect.
    pub fn choose_at(&self, shift: u32, grids: &[Grid], condition: Condition, floor: i32) -> usize {
        (1..grids.len()).find(|&case| self.is_admissible(grids[case], condition, floor, shift)).unwrap_or(0)
    }
}

/// Indices of the quarters that form each subarray of a case, subarrays row-major.
pub fn quarters(grid: Grid) -> Vec<Vec<usize>> {
    match (grid.rows, grid.cols) {
        (2, 2) => vec![vec![0], vec![1], vec![2], vec![3]],
        (1, 2) => vec![vec![0, 2], vec![1, 3]],
        (2, 1) => vec![vec![0, 1], vec![2, 3]],
        _ => vec![vec![0, 1, 2, 3]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRIDS: [Grid; 4] =
        [Grid { rows: 1, cols: 1 }, Grid { rows: 2, cols: 2 }, Grid { rows: 1, cols: 2 }, Grid { rows: 2, cols: 1 }];

    fn chosen(codes: &[(usize, i32)], condition: Condition, floor: i32) -> usize {
        let sensor = Sensor { rows: 8, cols: 12, pitch_x_mm: 2.0, pitch_y_mm: 2.0, thickness_mm: 1.0 };
        let mut seen = FrameStats::default();
        codes.iter().for_each(|&(index, code)| seen.add(&sensor, index, code, floor));
        seen.choose(&GRIDS, condition, floor)
    }

    #[test]
    fn beside_the_middle_are_two_lines_on_each_side() {
        let lines = |count| (0..count).filter(|&line| is_beside_boundary(line, count)).collect::<Vec<_>>();
        assert_eq!([lines(8), lines(4)], [vec![2, 3, 4, 5], vec![0, 1, 2, 3]]);
    }

    #[test]
    fn what_a_contact_allows() {
        let loaded = Condition::Loaded;
        let at = |row: usize, col: usize| 12 * row + col;
        // A corner; beside the middle columns; beside the middle rows; beside both.
        assert_eq!(chosen(&[(at(0, 0), 1000)], loaded, 0), 1);
        assert_eq!(chosen(&[(at(0, 7), -1000)], loaded, 0), 3);
        assert_eq!(chosen(&[(at(5, 0), 1000)], loaded, 0), 2);
        assert_eq!(chosen(&[(at(3, 4), 1000)], loaded, 0), 0);
        // A quarter of the peak is no contact, one code more is; stress within the noise floor is none.
        assert_eq!(chosen(&[(at(0, 0), 400), (at(3, 4), 100)], loaded, 0), 1);
        assert_eq!(chosen(&[(at(0, 0), 400), (at(3, 4), 101)], loaded, 0), 0);
        assert_eq!(chosen(&[(at(0, 0), 400), (at(3, 4), 101)], loaded, 101), 1);
    }

    #[test]
    fn a_subarray_of_one_sign_is_not_cut_out() {
        let at = |row: usize, col: usize| 12 * row + col;
        // Compression left, tension right, both in the upper half.
        let codes = [(at(0, 0), 1000), (at(0, 11), -900)];
        assert_eq!(chosen(&codes, Condition::Loaded, 0), 1);
        assert_eq!(chosen(&codes, Condition::BothSigns, 0), 3);
        assert_eq!(chosen(&codes[..1], Condition::BothSigns, 0), 0);
    }
}
