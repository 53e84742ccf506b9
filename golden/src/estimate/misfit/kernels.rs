//! Kernels: stress per force on a cell with its μ, for each distance of taxel from cell, and products with it as convolutions.
//!
//! ```text
//! K(μ) = Kz + μ1 Kx + μ2 Ky        stress(taxel) = Σ K(taxel − cell; μ of the cell) p(cell)
//! ```
//! A matrix of cells and taxels has the same entries, each many times: cells of one column of the array have the same, shifted by
//! rows. So there is a list of entries for each column, and those of a cell are a slice of it, one for each taxel, row-major: of
//! 48 × 48 taxels 0.9 MB in place of 21 MB.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: μ of each cell | taxels × 2 | – |
//! | in: forces on cells | taxels | N |
//! | out: stress on taxels | taxels, padded | MPa |
//! | in, out: the transposed product | taxels, padded; taxels | – |

use crate::physics::influence::{at_distance, table};
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use pulp::Simd;

/// Lengths are multiples of the lanes that a processor may have in single precision.
const LANES: usize = 16;

/// Values of so many taxels, row-major, followed by zeros up to whole vectors.
pub(super) fn padded(taxels: usize, values: impl IntoIterator<Item = f32>) -> Vec<f32> {
    let mut all = vec![0.0; taxels.next_multiple_of(LANES)];
    all.iter_mut().zip(values.into_iter().take(taxels)).for_each(|(own, value)| *own = value);
    all
}

/// The kernels along x, y and z of an array.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    rows: usize,
    cols: usize,
    axes: [Vec<f32>; 3],
}

/// The kernels of the μ that cells have.
pub(super) struct CellKernels {
    kernels: Vec<Vec<f32>>,
    /// The kernel of each cell, and its entry that belongs to the first taxel.
    cells: Vec<[usize; 2]>,
}

impl Kernels {
    /// Those of an array on a medium.
    pub fn new(sensor: &Sensor, medium: Medium) -> Kernels {
        let (rows, cols, influence) = (sensor.rows, sensor.cols, table(sensor, medium));
        let unpadded = Kernels { rows, cols, axes: Default::default() };
        let entries = |axis: usize| {
            let of_column = |col: usize| {
                let distances = (0..(2 * rows - 1) * cols)
                    .map(move |at| [(at / cols) as isize - (rows as isize - 1), (at % cols) as isize - col as isize]);
                let own = distances.map(|at| at_distance(&influence, cols, at)[axis] as f32);
                own.chain(std::iter::repeat(0.0)).take(unpadded.column()).collect::<Vec<f32>>()
            };
            (0..cols).flat_map(of_column).collect()
        };
        Kernels { axes: [0, 1, 2].map(entries), ..unpadded }
    }

    /// Entries from those of one column of cells to those of the next.
    fn column(&self) -> usize {
        (self.rows - 1) * self.cols + (self.rows * self.cols).next_multiple_of(LANES)
    }

    /// Those of cells with this μ each, row-major.
    pub fn of_cells(&self, mu: &[[f64; 2]]) -> CellKernels {
        let mut distinct: Vec<[f64; 2]> = Vec::new();
        let cell = |(index, mu): (usize, &[f64; 2])| {
            let known = distinct.iter().position(|own| own == mu).unwrap_or_else(|| {
                distinct.push(*mu);
                distinct.len() - 1
            });
            let (row, col) = (index / self.cols, index % self.cols);
            [known, col * self.column() + (self.rows - 1 - row) * self.cols]
        };
        let cells = mu.iter().enumerate().map(cell).collect();
        let [x, y, z] = &self.axes;
        let kernel = |mu: &[f64; 2]| {
            let [u, v] = mu.map(|mu| mu as f32);
            z.iter().zip(x).zip(y).map(|((z, x), y)| z + u * x + v * y).collect()
        };
        CellKernels { kernels: distinct.iter().map(kernel).collect(), cells }
    }
}

/// The sum of an entry of four vectors times a factor each.
#[inline(always)]
fn four<S: Simd>(simd: S, factors: [S::f32s; 4], [a, b, c, d]: [S::f32s; 4], sum: S::f32s) -> S::f32s {
    let sum = simd.mul_add_e_f32s(factors[0], a, sum);
    let sum = simd.mul_add_e_f32s(factors[1], b, sum);
    let sum = simd.mul_add_e_f32s(factors[2], c, sum);
    simd.mul_add_e_f32s(factors[3], d, sum)
}

impl CellKernels {
    /// The same with the magnitude of each entry.
    pub fn magnitudes(&self) -> CellKernels {
        let kernels = self.kernels.iter().map(|kernel| kernel.iter().map(|own| own.abs()).collect()).collect();
        CellKernels { kernels, cells: self.cells.clone() }
    }

    /// Number of cells, as many as taxels.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// The entries that belong to the taxels.
    #[inline(always)]
    fn entries<S: Simd>(&self, [kernel, first]: [usize; 2]) -> &[S::f32s] {
        S::as_simd_f32s(&self.kernels[kernel][first..][..self.cells().next_multiple_of(LANES)]).0
    }

    /// The stress that forces cause, in `stress`, which has no meaning behind the last taxel. Cells without a force take no time.
    #[inline(always)]
    pub fn stress<S: Simd>(&self, simd: S, forces: &[f32], stress: &mut [f32]) {
        let (stress, _) = S::as_mut_simd_f32s(stress);
        stress.fill(simd.splat_f32s(0.0));
        let mut loaded = self.cells.iter().zip(forces).filter(|(_, force)| **force != 0.0);
        // Four at a time, so that the stress is read and written once for them; the last may be fewer.
        while let Some(first) = loaded.next() {
            let others = [loaded.next(), loaded.next(), loaded.next()];
            let own = [Some(first), others[0], others[1], others[2]].map(|own| own.unwrap_or((first.0, &0.0)));
            let factors = own.map(|(_, force)| simd.splat_f32s(*force));
            let [a, b, c, d] = own.map(|(cell, _)| self.entries::<S>(*cell));
            for ((((taxels, a), b), c), d) in stress.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *taxels = four(simd, factors, [*a, *b, *c, *d], *taxels);
            }
        }
    }

    /// The transposed product: for each cell Σ K(taxel − cell) value(taxel), in `cells`; `values` are 0 behind the last taxel.
    #[inline(always)]
    pub fn transposed<S: Simd>(&self, simd: S, values: &[f32], cells: &mut [f32]) {
        let (values, _) = S::as_simd_f32s(values);
        let zero = simd.splat_f32s(0.0);
        let (fours, rest) = self.cells.as_chunks::<4>();
        let (sums, rest_sums) = cells.as_chunks_mut::<4>();
        // Four at a time, so that none waits for the sum of the one before.
        for (four, sums) in fours.iter().zip(sums) {
            let [a, b, c, d] = four.map(|cell| self.entries::<S>(cell));
            let mut totals = (zero, zero, zero, zero);
            for ((((value, a), b), c), d) in values.iter().zip(a).zip(b).zip(c).zip(d) {
                totals.0 = simd.mul_add_e_f32s(*value, *a, totals.0);
                totals.1 = simd.mul_add_e_f32s(*value, *b, totals.1);
                totals.2 = simd.mul_add_e_f32s(*value, *c, totals.2);
                totals.3 = simd.mul_add_e_f32s(*value, *d, totals.3);
            }
            sums[0] = simd.reduce_sum_f32s(totals.0);
            sums[1] = simd.reduce_sum_f32s(totals.1);
            sums[2] = simd.reduce_sum_f32s(totals.2);
            sums[3] = simd.reduce_sum_f32s(totals.3);
        }
        for (cell, sum) in rest.iter().zip(rest_sums) {
            let mut totals = zero;
            for (value, entries) in values.iter().zip(self.entries::<S>(*cell)) {
                totals = simd.mul_add_e_f32s(*value, *entries, totals);
            }
            *sum = simd.reduce_sum_f32s(totals);
        }
    }
}
