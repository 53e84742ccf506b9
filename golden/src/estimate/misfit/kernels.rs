//! Kernels: stress per force on a cell with its μ, for each distance of taxel from cell, and products with it as convolutions.
//!
//! ```text
//! K(μ) = Kz + μ1 Kx + μ2 Ky        stress(taxel) = Σ K(taxel − cell; μ of the cell) p(cell)
//! ```
//! A matrix of cells and taxels has the same entries, each many times: of 48 × 48 taxels it is 21 MB, and its kernel 36 kB. Taxels
//! lie in rows as long as those of a kernel, with a gap behind them: then those of all rows and their entries for a cell are one slice
//! each.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: μ of each cell | taxels × 2 | – |
//! | in: forces on cells | taxels | N |
//! | out: stress on taxels | rows with gaps | MPa |
//! | in, out: the transposed product | rows with gaps, taxels | – |

use crate::physics::influence::{at_distance, table};
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use pulp::Simd;

/// Lengths are multiples of the lanes that a processor may have in single precision.
const LANES: usize = 16;

/// Rows of taxels with gaps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    rows: usize,
    cols: usize,
}

impl Rows {
    /// Entries from one row to the next: the distances in columns, of either sign.
    fn stride(&self) -> usize {
        2 * self.cols - 1
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        (self.rows * self.stride()).next_multiple_of(LANES)
    }

    /// These values of taxels, row-major; 0 in the gaps.
    pub fn with_gaps(&self, values: impl IntoIterator<Item = f32>) -> Vec<f32> {
        let (mut all, mut values) = (vec![0.0; self.len()], values.into_iter());
        for row in all.chunks_mut(self.stride()).take(self.rows) {
            row.iter_mut().zip(values.by_ref().take(self.cols)).for_each(|(own, value)| *own = value);
        }
        all
    }
}

/// The kernels along x, y and z of an array.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    rows: Rows,
    axes: [Vec<f32>; 3],
}

/// The kernels of the μ that cells have.
pub(super) struct CellKernels {
    pub rows: Rows,
    kernels: Vec<Vec<f32>>,
    /// The kernel of each cell, and its entry that belongs to the first taxel.
    cells: Vec<[usize; 2]>,
}

impl Kernels {
    /// Those of an array on a medium.
    pub fn new(sensor: &Sensor, medium: Medium) -> Kernels {
        let (rows, influence) = (Rows { rows: sensor.rows, cols: sensor.cols }, table(sensor, medium));
        let [down, right] = [sensor.rows, sensor.cols].map(|count| count as isize - 1);
        let distances = || (-down..=down).flat_map(move |down| (-right..=right).map(move |right| [down, right]));
        // The last cell begins with its own entry in the middle.
        let length = (sensor.rows - 1) * rows.stride() + sensor.cols - 1 + rows.len();
        let axis = |axis: usize| {
            let own = distances().map(|at| at_distance(&influence, sensor.cols, at)[axis] as f32);
            own.chain(std::iter::repeat(0.0)).take(length).collect()
        };
        Kernels { rows, axes: [0, 1, 2].map(axis) }
    }

    /// Those of cells with this μ each, row-major.
    pub fn of_cells(&self, mu: &[[f64; 2]]) -> CellKernels {
        let Rows { rows, cols } = self.rows;
        let mut distinct: Vec<[f64; 2]> = Vec::new();
        let cell = |(index, mu): (usize, &[f64; 2])| {
            let known = distinct.iter().position(|own| own == mu).unwrap_or_else(|| {
                distinct.push(*mu);
                distinct.len() - 1
            });
            [known, (rows - 1 - index / cols) * self.rows.stride() + cols - 1 - index % cols]
        };
        let cells = mu.iter().enumerate().map(cell).collect();
        let [x, y, z] = &self.axes;
        let kernel = |mu: &[f64; 2]| {
            let [u, v] = mu.map(|mu| mu as f32);
            z.iter().zip(x).zip(y).map(|((z, x), y)| z + u * x + v * y).collect()
        };
        CellKernels { rows: self.rows, kernels: distinct.iter().map(kernel).collect(), cells }
    }
}

impl CellKernels {
    /// The same with the magnitude of each entry.
    pub fn magnitudes(&self) -> CellKernels {
        let kernels = self.kernels.iter().map(|kernel| kernel.iter().map(|own| own.abs()).collect()).collect();
        CellKernels { rows: self.rows, kernels, cells: self.cells.clone() }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// The entries that belong to the taxels.
    #[inline(always)]
    fn entries<S: Simd>(&self, [kernel, first]: [usize; 2]) -> &[S::f32s] {
        S::as_simd_f32s(&self.kernels[kernel][first..][..self.rows.len()]).0
    }

    /// The stress that forces cause, in `stress`, whose gaps have no meaning then. Cells without a force take no time.
    #[inline(always)]
    pub fn stress<S: Simd>(&self, simd: S, forces: &[f32], stress: &mut [f32]) {
        let (stress, _) = S::as_mut_simd_f32s(stress);
        stress.fill(simd.splat_f32s(0.0));
        for (cell, force) in self.cells.iter().zip(forces).filter(|(_, force)| **force != 0.0) {
            let force = simd.splat_f32s(*force);
            for (taxels, entries) in stress.iter_mut().zip(self.entries::<S>(*cell)) {
                *taxels = simd.mul_add_e_f32s(force, *entries, *taxels);
            }
        }
    }

    /// The transposed product: for each cell Σ K(taxel − cell) of(taxel), in `cells`; `of` is 0 in its gaps.
    #[inline(always)]
    pub fn transposed<S: Simd>(&self, simd: S, of: &[f32], cells: &mut [f32]) {
        let (of, _) = S::as_simd_f32s(of);
        let zero = simd.splat_f32s(0.0);
        let (own, rest) = self.cells.as_chunks::<4>();
        let (sums, rest_sums) = cells.as_chunks_mut::<4>();
        // Four at a time, so that none waits for the sum of the one before.
        for (own, sums) in own.iter().zip(sums) {
            let [a, b, c, d] = own.map(|cell| self.entries::<S>(cell));
            let mut all = (zero, zero, zero, zero);
            for ((((of, a), b), c), d) in of.iter().zip(a).zip(b).zip(c).zip(d) {
                all.0 = simd.mul_add_e_f32s(*of, *a, all.0);
                all.1 = simd.mul_add_e_f32s(*of, *b, all.1);
                all.2 = simd.mul_add_e_f32s(*of, *c, all.2);
                all.3 = simd.mul_add_e_f32s(*of, *d, all.3);
            }
            sums[0] = simd.reduce_sum_f32s(all.0);
            sums[1] = simd.reduce_sum_f32s(all.1);
            sums[2] = simd.reduce_sum_f32s(all.2);
            sums[3] = simd.reduce_sum_f32s(all.3);
        }
        for (own, sum) in rest.iter().zip(rest_sums) {
            let mut all = zero;
            for (of, entries) in of.iter().zip(self.entries::<S>(*own)) {
                all = simd.mul_add_e_f32s(*of, *entries, all);
            }
            *sum = simd.reduce_sum_f32s(all);
        }
    }
}
