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
    /// Stress in MPa per N along z, x and y: for each line of cells within a taxel and each distance in taxels, first along y,
    /// then along x. The entries of the taxels of a row follow each other.
    influence: [Vec<f64>; 3],
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
        let by_point = CellInfluence::new(side, sensor.thickness_mm, medium);
        // A taxel with an even number of cells has its centre on their border: all distances are odd in half sides.
        let distance =
            |step: usize, per_taxel: usize| step as f64 + if per_taxel.is_multiple_of(2) { 0.5 } else { 0.0 };
        let at = |index: usize| {
            let (row, col) = (index / grid.cols, index % grid.cols);
            by_point.in_table([distance(col, fx) * side[0], distance(row, fy) * side[1]])
        };
        // The other quadrants are mirror images.
        let quadrant: Vec<[f64; 3]> = (0..grid.taxels()).map(at).collect();
        let [along_x, along_y] =
            [(sensor.cols, fx), (sensor.rows, fy)].map(|(lines, per_taxel)| twice(lines, per_taxel));
        let mut influence = [const { Vec::new() }; 3];
        for y in &along_y {
            for x in &along_x {
                let step = |twice: &isize| twice.unsigned_abs() / 2;
                let [own_x, own_y, own_z] = quadrant[step(y) * grid.cols + step(x)];
                let signed = |along: &isize, value: f64| if *along < 0 { -value } else { value };
                let values = [own_z, signed(x, own_x), signed(y, own_y)];
                influence.iter_mut().zip(values).for_each(|(table, value)| table.push(value));
            }
        }
        Cells { sensor: sensor.clone(), grid, per_taxel: [fx, fy], influence }
    }

    /// Whether every influence is a finite number, and the largest along z is above 0.
    pub fn is_representable(&self) -> bool {
        let [along_z, ..] = &self.influence;
        self.influence.iter().flatten().all(|own| own.is_finite()) && along_z.iter().any(|own| *own > 0.0)
    }

    /// Number of distances in taxels along x, for each line of cells within a taxel.
    fn distances_x(&self) -> usize {
        2 * self.sensor.cols - 1
    }

    /// Where the taxels with these row-major indices are in each table, from the entry of a cell.
    pub fn offsets(&self, taxels: &[usize]) -> Vec<usize> {
        let row = self.per_taxel[0] * self.distances_x();
        taxels.iter().map(|taxel| taxel / self.sensor.cols * row + taxel % self.sensor.cols).collect()
    }

    /// Stress in MPa on the taxels with these [`Cells::offsets`] per N along z, x and y on `cell`, below each other.
    pub fn influence(&self, offsets: &[usize], cell: usize, into: &mut [f64]) {
        let Sensor { rows, cols, .. } = self.sensor;
        let [fx, fy] = self.per_taxel;
        let (row, col) = (cell / self.grid.cols, cell % self.grid.cols);
        let line = (row % fy * (2 * rows - 1) + rows - 1 - row / fy) * fx + col % fx;
        let origin = line * self.distances_x() + cols - 1 - col / fx;
        for (table, into) in self.influence.iter().zip(into.chunks_exact_mut(offsets.len().max(1))) {
            let entries = &table[origin..];
            into.iter_mut().zip(offsets).for_each(|(value, offset)| *value = entries[*offset]);
        }
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

/// Twice the distance taxel − cell in cell sides, for each line of cells within a taxel and each distance of taxels.
fn twice(lines: usize, per_taxel: usize) -> Vec<isize> {
    let (most, sides) = (lines as isize - 1, per_taxel as isize);
    let of = move |within: isize| (-most..=most).map(move |away| 2 * sides * away + sides - 1 - 2 * within);
    (0..sides).flat_map(of).collect()
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
            let taxels = [0, 1, 3, 6, 7, 8, 11];
            let (offsets, mut got) = (cells.offsets(&taxels), [0.0; 21]);
            for cell in 0..cells.grid.taxels() {
                cells.influence(&offsets, cell, &mut got);
                for (k, &taxel) in taxels.iter().enumerate() {
                    let ([x, y], [u, v]) = (cells.taxel_mm(taxel), cells.position_mm(cell));
                    let [own_x, own_y, own_z] = direct.at([x - u, y - v]);
                    let off = [got[k] - own_z, got[7 + k] - own_x, got[14 + k] - own_y];
                    assert!(off.iter().all(|off| off.abs() < 1e-12), "{taxel} {cell}: {off:?}");
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
