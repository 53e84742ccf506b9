//! Smooth terms: what a drifted zero, a warm side or a bent base add to the readings.
//!
//! ```text
//! 1 | x, y | x² − ⅓, xy, y² − ⅓          x, y from −1 to 1 over the array
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor, taxel | – | row-major |
//! | out: offset, slopes, bends | [`TERMS`] | – |

use crate::spec::sensor::Sensor;

/// Number of terms.
pub(crate) const TERMS: usize = 6;

/// The terms on a taxel.
pub(crate) fn terms(sensor: &Sensor, taxel: usize) -> [f64; TERMS] {
    let along = |index: usize, count: usize| 2.0 * index as f64 / (count - 1) as f64 - 1.0;
    let (x, y) = (along(taxel % sensor.cols, sensor.cols), along(taxel / sensor.cols, sensor.rows));
    [1.0, x, y, x * x - 1.0 / 3.0, x * y, y * y - 1.0 / 3.0]
}
