//! Sensor: number, pitch and depth of the taxels of an array.
//!
//! Taxel (r, c) has index r·cols + c and lies at
//! ((c − (cols − 1)/2)·pitch_x, (r − (rows − 1)/2)·pitch_y), at depth h = thickness.
//!
//! | quantity | shape | unit | range |
//! |---|---|---|---|
//! | rows, cols | scalar | taxels | 2 … 256 |
//! | pitch, thickness | scalar | mm | above 0, up to 10⁶ |
//! | pitch over pitch | scalar | – | 1/16 … 16 |
//! | thickness over pitch | scalar | – | 1/1000 … 1000 |

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use thiserror::Error;

/// Minimum rows or columns: a single line of taxels cannot resolve shear across it.
pub const MIN_SIDE: usize = 2;
/// Maximum rows or columns; checked before anything of the array's size is allocated.
pub const MAX_SIDE: usize = 256;
/// Largest pitch or thickness in mm.
pub const MAX_LENGTH_MM: f64 = 1e6;
/// Largest ratio of the two pitches: the estimator `evidence` divides the larger one into cells of the size of the smaller.
pub const MAX_PITCH_RATIO: f64 = 16.0;
/// Largest ratio of a pitch to the thickness, and of the thickness to a pitch: beyond it the taxels tell nothing of each
/// other, or everything.
pub const MAX_DEPTH_RATIO: f64 = 1e3;

/// A regular rectangular array of taxels under an elastic cover.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sensor {
    /// Number of rows, along y.
    pub rows: usize,
    /// Number of columns, along x.
    pub cols: usize,
    /// Distance of neighbouring columns in mm.
    pub pitch_x_mm: f64,
    /// Distance of neighbouring rows in mm.
    pub pitch_y_mm: f64,
    /// Depth of the taxels under the surface in mm.
    pub thickness_mm: f64,
}

/// A size or length is out of range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{field} = {value} is not allowed: {allowed}")]
pub struct SensorError {
    /// The field's name.
    pub field: &'static str,
    /// The value found.
    pub value: f64,
    /// The allowed values, in words.
    pub allowed: String,
}

impl Sensor {
    /// Number of taxels.
    pub fn taxels(&self) -> usize {
        self.rows * self.cols
    }

    /// Σ b·area in N of a stress in MPa, row-major: the normal force without any estimator. On half-space and layer alike
    /// shear adds nothing to it.
    pub fn sum_of_stress_N(&self, stress_MPa: &[f64]) -> f64 {
        stress_MPa.iter().sum::<f64>() * self.pitch_x_mm * self.pitch_y_mm
    }

    /// Position of a taxel's centre in mm, [x, y], from the array's centre.
    pub fn position_mm(&self, row: usize, col: usize) -> [f64; 2] {
        let from_middle = |index: usize, count: usize| index as f64 - (count as f64 - 1.0) / 2.0;
        [from_middle(col, self.cols) * self.pitch_x_mm, from_middle(row, self.rows) * self.pitch_y_mm]
    }

    /// Half of the array's size along x and along y, in mm.
    pub fn half_mm(&self) -> [f64; 2] {
        [self.cols as f64 * self.pitch_x_mm / 2.0, self.rows as f64 * self.pitch_y_mm / 2.0]
    }

    /// Whether a taxel, by its row-major index, is in an outermost row or column.
    pub fn is_border(&self, index: usize) -> bool {
        let (row, col) = (index / self.cols, index % self.cols);
        row == 0 || row + 1 == self.rows || col == 0 || col + 1 == self.cols
    }

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`SensorError`] for the first field out of range, in the order of the struct.
    pub fn check(&self) -> Result<(), SensorError> {
        for (field, value) in [("rows", self.rows), ("cols", self.cols)] {
            if !(MIN_SIDE..=MAX_SIDE).contains(&value) {
                let allowed = format!("a whole number from {MIN_SIDE} to {MAX_SIDE}");
                let value = value as f64;
                return Err(SensorError { field, value, allowed });
            }
        }
        let lengths =
            [("pitch_x_mm", self.pitch_x_mm), ("pitch_y_mm", self.pitch_y_mm), ("thickness_mm", self.thickness_mm)];
        for (field, value) in lengths {
            // NaN fails the comparison, too.
            if !(value > 0.0 && value <= MAX_LENGTH_MM) {
                let allowed = format!("above 0, at most {MAX_LENGTH_MM} mm");
                return Err(SensorError { field, value, allowed });
            }
        }
        let ratios = [
            ("pitch_y_mm", self.pitch_y_mm, "pitch_x_mm", self.pitch_x_mm, MAX_PITCH_RATIO),
            ("thickness_mm", self.thickness_mm, "pitch_x_mm", self.pitch_x_mm, MAX_DEPTH_RATIO),
            ("thickness_mm", self.thickness_mm, "pitch_y_mm", self.pitch_y_mm, MAX_DEPTH_RATIO),
        ];
        for (field, value, other, length, most) in ratios {
            if value.max(length) / value.min(length) > most {
                let allowed = format!("from 1/{most} to {most} times {other} = {length}");
                return Err(SensorError { field, value, allowed });
            }
        }
        Ok(())
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}×{} taxels, pitch {}×{} mm, thickness {} mm",
            self.rows, self.cols, self.pitch_x_mm, self.pitch_y_mm, self.thickness_mm
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor() -> Sensor {
        Sensor { rows: 10, cols: 5, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    #[test]
    fn positions_by_hand() {
        let sensor = sensor();
        assert_eq!(sensor.taxels(), 50);
        assert_eq!(sensor.position_mm(0, 0), [-4.0, -18.0]);
        assert_eq!(sensor.position_mm(9, 2), [0.0, 18.0]);
    }

    #[test]
    fn prints_size_pitch_thickness() {
        let text = sensor().to_string();
        assert_eq!(text, "10×5 taxels, pitch 2×4 mm, thickness 3 mm");
    }

    #[test]
    fn refuses_what_is_out_of_range() {
        assert_eq!(sensor().check(), Ok(()));
        let bad = [
            Sensor { rows: 1, ..sensor() },
            Sensor { cols: 257, ..sensor() },
            Sensor { pitch_x_mm: 0.0, ..sensor() },
            Sensor { pitch_y_mm: f64::NAN, ..sensor() },
            Sensor { thickness_mm: f64::INFINITY, ..sensor() },
            Sensor { pitch_x_mm: 1e-300, ..sensor() },
            Sensor { pitch_x_mm: 1000.0, pitch_y_mm: 1e-12, thickness_mm: 1000.0, ..sensor() },
            Sensor { pitch_x_mm: 1.0, pitch_y_mm: 0.001, thickness_mm: 1.0, ..sensor() },
            Sensor { thickness_mm: 1e-3, ..sensor() },
            Sensor { thickness_mm: 1e4, ..sensor() },
        ];
        let fields = [
            "rows",
            "cols",
            "pitch_x_mm",
            "pitch_y_mm",
            "thickness_mm",
            "pitch_y_mm",
            "pitch_y_mm",
            "pitch_y_mm",
            "thickness_mm",
            "thickness_mm",
        ];
        assert_eq!(bad.len(), fields.len());
        for (sensor, field) in bad.iter().zip(fields) {
            assert_eq!(sensor.check().unwrap_err().field, field);
        }
    }
}
