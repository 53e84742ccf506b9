//! Cells: the grid on which a pressure is estimated, finer than the taxels, and the stress that its cells cause.
//!
//! A pressure that is smooth over a length ℓ needs cells of at most 0.7 ℓ. The offsets taxel − cell form a regular grid
//! of half cell sides, mirror images of each other, so that one table holds the influence of every cell on every taxel.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: sensor, medium, ℓ | – | mm |
//! | out: cells per taxel | 2 | along x and y |
//! | out: influence | taxels × cells × 3 | MPa/N, along x, y and z on the cell |

use crate::physics::influence::CellInfluence;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;

/// Largest side of a cell in units of ℓ.
const SIDE: f64 = 0.7;

/// The cells of an array.
pub(crate) struct Cells {
    /// The array.
    pub sensor: Sensor,
    /// The cells as an array of their own, with the sensor's thickness.
    pub grid: Sensor,
    /// Cells per taxel along x and y.
    per_taxel: [usize; 2],
    /// Influence for each distance, row-major in the distances along y and x.
    table: Vec<[f64; 3]>,
}

impl Cells {
    /// Cells of at most 0.7 `length_mm` for an array under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium, length_mm: f64) -> Cells {
        let split = |pitch: f64| (pitch / (SIDE * length_mm)).ceil().max(1.0) as usize;
        let [fx, fy] = [split(sensor.pitch_x_mm), split(sensor.pitch_y_mm)];
        let grid = Sensor {
            rows: sensor.rows * fy,
            cols: sensor.cols * fx,
            pitch_x_mm: sensor.pitch_x_mm / fx as f64,
            pitch_y_mm: sensor.pitch_y_mm / fy as f64,
            thickness_mm: sensor.thickness_mm,
        };
        let side = [grid.pitch_x_mm, grid.pitch_y_mm];
        let influence = CellInfluence::new(side, sensor.thickness_mm, medium);
        // A taxel with an even number of cells has its centre on their border: all distances are odd in half sides.
        let distance =
            |step: usize, per_taxel: usize| step as f64 + if per_taxel.is_multiple_of(2) { 0.5 } else { 0.0 };
        let at = |index: usize| {
            let (row, col) = (index / grid.cols, index % grid.cols);
            influence.at([distance(col, fx) * side[0], distance(row, fy) * side[1]])
        };
        let table = (0..grid.taxels()).map(at).collect();
        Cells { sensor: sensor.clone(), grid, per_taxel: [fx, fy], table }
    }

    /// Stress in MPa on a taxel per N along x, y and z on a cell.
    pub fn influence(&self, taxel: usize, cell: usize) -> [f64; 3] {
        let [fx, fy] = self.per_taxel;
        let (row, col) = (taxel / self.sensor.cols, taxel % self.sensor.cols);
        let (cell_row, cell_col) = (cell / self.grid.cols, cell % self.grid.cols);
        // Twice the distance in cell sides.
        let twice = |line: usize, cell: usize, per_taxel: usize| {
            (2 * line * per_taxel + per_taxel - 1) as isize - 2 * cell as isize
        };
        let (along_x, along_y) = (twice(col, cell_col, fx), twice(row, cell_row, fy));
        let step = |twice: isize| twice.unsigned_abs() / 2;
        let [x, y, z] = self.table[step(along_y) * self.grid.cols + step(along_x)];
        [if along_x < 0 { -x } else { x }, if along_y < 0 { -y } else { y }, z]
    }

    /// The taxel above whose area a cell lies.
    pub fn taxel_of(&self, cell: usize) -> usize {
        let [fx, fy] = self.per_taxel;
        (cell / self.grid.cols / fy) * self.sensor.cols + cell % self.grid.cols / fx
    }

    /// Centre of a cell in mm from the array's centre, [x, y].
    pub fn position_mm(&self, cell: usize) -> [f64; 2] {
        self.grid.position_mm(cell / self.grid.cols, cell % self.grid.cols)
    }

    /// Centre of a taxel in mm from the array's centre, [x, y].
    pub fn taxel_mm(&self, taxel: usize) -> [f64; 2] {
        self.sensor.position_mm(taxel / self.sensor.cols, taxel % self.sensor.cols)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor() -> Sensor {
        Sensor { rows: 3, cols: 4, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 }
    }

    /// The table agrees with the kernel at every offset, for an even and an odd number of cells per taxel.
    #[test]
    fn influence_of_every_cell() {
        for medium in [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.48 }] {
            let cells = Cells::new(&sensor(), medium, 2.0);
            assert_eq!(cells.per_taxel, [2, 3]);
            let side = [cells.grid.pitch_x_mm, cells.grid.pitch_y_mm];
            let direct = CellInfluence::new(side, 3.0, medium);
            for taxel in 0..12 {
                for cell in 0..cells.grid.taxels() {
                    let ([x, y], [u, v]) = (cells.taxel_mm(taxel), cells.position_mm(cell));
                    let (got, wanted) = (cells.influence(taxel, cell), direct.at([x - u, y - v]));
                    assert!((0..3).all(|k| (got[k] - wanted[k]).abs() < 1e-12), "{taxel} {cell}: {got:?} {wanted:?}");
                }
            }
        }
    }

    #[test]
    fn every_taxel_has_its_cells() {
        let cells = Cells::new(&sensor(), Medium::HalfSpace, 2.0);
        let mut counts = [0; 12];
        (0..cells.grid.taxels()).for_each(|cell| counts[cells.taxel_of(cell)] += 1);
        assert_eq!(counts, [6; 12]);
    }
}
