//! Fit: the compressive forces that explain readings best, and what they leave.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: kernels with the μ of each cell | – | MPa/N |
//! | in: readings | taxels | of their peak |
//! | out: norm of what is left | scalar | of their peak |

use super::kernels::{padded, CellKernels};
use pulp::{Arch, Simd, WithSimd};

/// Steps of the projected gradient; with three times as many, the limit of sensor-1's network changes by 1 %.
pub const STEPS: usize = 20;

/// What is read.
pub(super) struct Readings<'a> {
    /// Stress on each taxel, row-major; 0 on those that are dead.
    pub b: &'a [f32],
    /// Which taxels are not dead.
    pub alive: &'a [bool],
    /// Whether tension reads as 0.
    pub unipolar: bool,
}

/// A fit of compressive forces; values of taxels are padded.
pub(super) struct Fit<'a> {
    kernels: &'a CellKernels,
    b: Vec<f32>,
    /// 1 on the taxels that count, else 0.
    alive: Vec<f32>,
    unipolar: bool,
}

impl<'a> Fit<'a> {
    /// The fit of readings.
    pub fn new(kernels: &'a CellKernels, readings: &Readings) -> Fit<'a> {
        let Readings { b, alive, unipolar } = *readings;
        let b = padded(kernels.cells(), b.iter().copied());
        let alive = padded(kernels.cells(), alive.iter().map(|alive| if *alive { 1.0 } else { 0.0 }));
        Fit { kernels, b, alive, unipolar }
    }

    /// |r| of the forces of [`STEPS`] steps.
    pub fn left(self) -> f32 {
        // With the widest instructions that the processor has.
        Arch::new().dispatch(self)
    }

    /// What forces leave, in `left`.
    #[inline(always)]
    fn rest<S: Simd>(&self, simd: S, forces: &[f32], left: &mut [f32]) {
        self.kernels.stress(simd, forces, left);
        for ((left, b), alive) in left.iter_mut().zip(&self.b).zip(&self.alive) {
            let rest = b - *left;
            // Tension reads as 0.
            let counts = if self.unipolar && *b <= 0.0 { rest.min(0.0) } else { rest };
            *left = alive * counts;
        }
    }

    /// Step of the gradient: one over a bound of |K|², the largest sums along rows and along columns.
    #[inline(always)]
    fn step<S: Simd>(&self, simd: S, [taxels, cells]: [&mut [f32]; 2]) -> f32 {
        let largest = |sums: &[f32]| sums.iter().copied().fold(0.0, f32::max);
        let magnitudes = self.kernels.magnitudes();
        let ones = padded(self.kernels.cells(), std::iter::repeat(1.0));
        cells.fill(1.0);
        magnitudes.stress(simd, cells, taxels);
        taxels.iter_mut().zip(&ones).for_each(|(sum, one)| *sum *= one);
        let of_rows = largest(taxels);
        magnitudes.transposed(simd, &ones, cells);
        1.0 / (of_rows * largest(cells))
    }
}

impl WithSimd for Fit<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let zeros = || vec![0.0f32; self.kernels.cells()];
        let (mut left, mut slope) = (vec![0.0; self.b.len()], zeros());
        let step = self.step(simd, [&mut left, &mut slope]);
        let (mut p, mut ahead, mut inertia) = (zeros(), zeros(), 1.0f32);
        for _ in 0..STEPS {
            self.rest(simd, &ahead, &mut left);
            self.kernels.transposed(simd, &left, &mut slope);
            let next = (1.0 + (1.0 + 4.0 * inertia * inertia).sqrt()) / 2.0;
            let share = (inertia - 1.0) / next;
            inertia = next;
            for ((p, ahead), slope) in p.iter_mut().zip(&mut ahead).zip(&slope) {
                let moved = (*ahead + step * slope).max(0.0);
                *ahead = moved + share * (moved - *p);
                *p = moved;
            }
        }
        self.rest(simd, &p, &mut left);
        left.iter().map(|left| left * left).sum::<f32>().sqrt()
    }
}
