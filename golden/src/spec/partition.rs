//! Partition: the array divided into equal rectangles, each with its own forces and ratio of shear to normal force.
//!
//! Subarray (i, j) of an R × C partition covers rows i·rows/R … and columns j·cols/C …; both divisions must be exact.
//!
//! | quantity | shape | meaning |
//! |---|---|---|
//! | case 0, 1, 2, 3 | 1×1, 2×2, 1×2, 2×1 | subarrays along the rows × along the columns, as in the paper |
//! | gather | rows·cols of the array → of the subarray | row-major in both |

use crate::spec::sensor::{Sensor, MIN_SIDE};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Subarrays along the rows and along the columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Grid {
    /// Number of rows of subarrays.
    pub rows: usize,
    /// Number of columns of subarrays.
    pub cols: usize,
}

/// How the array is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Case {
    /// Equal rectangles, the same for every frame.
    Grid(Grid),
    /// The best of the paper's cases, chosen per frame, among those in which every loaded subarray meets the condition.
    Adaptive,
    /// One region per contact.
    Contacts,
}

impl Case {
    /// Case 0: the whole array as one subarray.
    pub const WHOLE: Case = Case::Grid(Grid { rows: 1, cols: 1 });

    /// The paper's case 0 to 3, `None` for any other number.
    pub fn numbered(number: i64) -> Option<Case> {
        let (rows, cols) = match number {
            0 => (1, 1),
            1 => (2, 2),
            2 => (1, 2),
            3 => (2, 1),
            _ => return None,
        };
        Some(Case::Grid(Grid { rows, cols }))
    }

    /// Number of rectangles along rows and columns; `None` where it depends on the frame.
    pub fn grid(self) -> Option<Grid> {
        match self {
            Case::Grid(grid) => Some(grid),
            Case::Adaptive | Case::Contacts => None,
        }
    }
}

impl FromStr for Case {
    type Err = String;

    /// A case by its name: `0` to `3`, rows × columns as `4x2` or `4×2`, `adaptive`, `contacts`.
    fn from_str(name: &str) -> Result<Case, String> {
        let numbered = || Case::numbered(name.parse().ok()?);
        let grid = || {
            let (rows, cols) = name.split_once(['x', '×'])?;
            Some(Case::Grid(Grid { rows: rows.parse().ok()?, cols: cols.parse().ok()? }))
        };
        match name {
            "adaptive" => Ok(Case::Adaptive),
            "contacts" => Ok(Case::Contacts),
            _ => numbered().or_else(grid).ok_or_else(|| "0 to 3, rows x columns as 4x2, adaptive or contacts".into()),
        }
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Case::Grid(grid) => match (grid.rows, grid.cols) {
                (1, 1) => write!(f, "0"),
                (2, 2) => write!(f, "1"),
                (1, 2) => write!(f, "2"),
                (2, 1) => write!(f, "3"),
                (rows, cols) => write!(f, "{rows}×{cols}"),
            },
            Case::Adaptive => write!(f, "adaptive"),
            Case::Contacts => write!(f, "contacts"),
        }
    }
}

/// The array cannot be divided that way.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PartitionError {
    /// The number of subarrays does not divide the rows or columns, or leaves subarrays of a single line.
    #[error("{parts} subarrays do not divide {lines} {direction} into equal parts of at least 2")]
    NotDividing {
        /// `rows` or `cols`.
        direction: &'static str,
        /// Number of rows or columns of the array.
        lines: usize,
        /// Number of subarrays along them.
        parts: usize,
    },
    /// The partition depends on the frame and has no fixed rectangles.
    #[error("partition {case} depends on the frame")]
    DependsOnFrame {
        /// The case asked for.
        case: Case,
    },
}

/// A rectangle of taxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subarray {
    /// First row in the array.
    pub row0: usize,
    /// First column in the array.
    pub col0: usize,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
}

/// The subarrays of a case, row-major.
///
/// ```
/// use dermis_golden::{spec::partition::{subarrays, Case}, spec::scene::Scene};
///
/// let sensor = Scene::builtin("sensor-1")?.sensor;
/// // The paper's case 1: 2 × 2 subarrays of 5 × 5 taxels.
/// let parts = subarrays("1".parse::<Case>()?, &sensor)?;
/// assert_eq!((parts.len(), parts[3].row0, parts[3].col0, parts[3].rows), (4, 5, 5, 5));
/// // Each taxel is in exactly one subarray.
/// let mut taxels: Vec<usize> = parts.iter().flat_map(|part| part.indices(&sensor)).collect();
/// taxels.sort();
/// assert!(taxels.into_iter().eq(0..100));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`PartitionError`] if the counts do not divide the array or the case depends on the frame.
pub fn subarrays(case: Case, sensor: &Sensor) -> Result<Vec<Subarray>, PartitionError> {
    let grid = case.grid().ok_or(PartitionError::DependsOnFrame { case })?;
    let rows = part("rows", sensor.rows, grid.rows)?;
    let cols = part("cols", sensor.cols, grid.cols)?;
    let at = |i: usize, j: usize| Subarray { row0: i * rows, col0: j * cols, rows, cols };
    Ok((0..grid.rows).flat_map(|i| (0..grid.cols).map(move |j| at(i, j))).collect())
}

/// Rows or columns per subarray, if the division is exact.
fn part(direction: &'static str, lines: usize, parts: usize) -> Result<usize, PartitionError> {
    if parts == 0 || !lines.is_multiple_of(parts) || lines / parts < MIN_SIDE {
        return Err(PartitionError::NotDividing { direction, lines, parts });
    }
    Ok(lines / parts)
}

impl Subarray {
    /// The subarray as a sensor of its own, with the pitch and thickness of the array.
    pub fn sensor(&self, whole: &Sensor) -> Sensor {
        Sensor { rows: self.rows, cols: self.cols, ..whole.clone() }
    }

    /// Row-major indices in the array of the subarray's taxels, in the subarray's row-major order.
    pub fn indices(self, whole: &Sensor) -> impl Iterator<Item = usize> {
        let cols = whole.cols;
        (self.row0..self.row0 + self.rows)
            .flat_map(move |row| (self.col0..self.col0 + self.cols).map(move |col| row * cols + col))
    }

    /// Row-major indices in the subarray of those of `taxels` ([row, col] in the array) that lie in it.
    pub fn local_indices(&self, taxels: &[[usize; 2]]) -> Vec<usize> {
        let place = |[row, col]: [usize; 2]| {
            let (row, col) = (row.checked_sub(self.row0)?, col.checked_sub(self.col0)?);
            (row < self.rows && col < self.cols).then_some(row * self.cols + col)
        };
        taxels.iter().filter_map(|taxel| place(*taxel)).collect()
    }

    /// The subarray's values, row-major in it, out of `values` of the array.
    pub fn gather<T: Copy>(&self, whole: &Sensor, values: &[T]) -> Vec<T> {
        self.indices(whole).map(|index| values[index]).collect()
    }

    /// Writes `part`, row-major in the subarray, to its positions in `values` of the array.
    pub fn scatter<T: Copy>(&self, whole: &Sensor, part: &[T], values: &mut [T]) {
        for (index, &value) in self.indices(whole).zip(part) {
            values[index] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sensor(rows: usize, cols: usize) -> Sensor {
        Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    #[test]
    fn cases_by_hand() {
        let names: Vec<_> = (0..4).filter_map(Case::numbered).map(|c| c.to_string()).collect();
        assert_eq!(names, ["0", "1", "2", "3"]);
        assert_eq!(Case::numbered(4), None);
        assert_eq!("1".parse(), Ok(Case::Grid(Grid { rows: 2, cols: 2 })));
        for case in ["5x2", "5×2", "adaptive", "contacts"] {
            assert_eq!(case.parse::<Case>().unwrap().to_string(), case.replace('x', "×"));
        }
        assert!(["4", "x", "2x", "-1x2", "finest"].iter().all(|name| name.parse::<Case>().is_err()));
        let parts = subarrays(Case::Grid(Grid { rows: 1, cols: 2 }), &sensor(4, 6)).unwrap();
        assert_eq!(parts[1], Subarray { row0: 0, col0: 3, rows: 4, cols: 3 });
        let values: Vec<usize> = (0..24).collect();
        assert_eq!(parts[1].gather(&sensor(4, 6), &values)[..4], [3, 4, 5, 9]);
    }

    #[test]
    fn rejects_uneven_divisions() {
        let uneven = subarrays(Case::Grid(Grid { rows: 2, cols: 1 }), &sensor(5, 4));
        let expected = PartitionError::NotDividing { direction: "rows", lines: 5, parts: 2 };
        assert_eq!(uneven, Err(expected));
        assert!(subarrays(Case::Grid(Grid { rows: 0, cols: 1 }), &sensor(5, 4)).is_err());
        assert!(subarrays(Case::Adaptive, &sensor(4, 4)).is_err());
    }

    proptest! {
        #[test]
        fn scatter_undoes_gather(rows in 1usize..4, cols in 1usize..4, m in 2usize..5, n in 2usize..5) {
            let sensor = sensor(rows * m, cols * n);
            let values: Vec<usize> = (1..=sensor.taxels()).collect();
            let mut rebuilt = vec![0; values.len()];
            for part in subarrays(Case::Grid(Grid { rows, cols }), &sensor).unwrap() {
                part.scatter(&sensor, &part.gather(&sensor, &values), &mut rebuilt);
            }
            prop_assert_eq!(rebuilt, values);
        }
    }
}
