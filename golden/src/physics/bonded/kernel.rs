//! Kernel: the stress under a point force on a bonded layer, tabulated once for a Poisson ratio.
//!
//! Lengths in h, d from force to taxel, r = |d|:
//!
//! ```text
//! b h² = Fz gn(r) + (F·d) gs(r)        gn = 1/2π ∫ Hn(q) J0(qr) q dq        gs = 1/2π ∫ Ht(q) J1(qr)/r q dq
//! ```
//!
//! Both are even in r and analytic except for singularities at r = ±i, ±3i, … (Hn and Ht decay as exp(−q)), so
//! Chebyshev series of 20 terms on short pieces represent them to rounding. They are tabulated up to r = 40; beyond,
//! they have decayed as exp(−0.74 r) or faster to below 1e-13 of their peak and are set to zero.
//!
//! The integrals are computed by Gauss–Legendre panels up to q = 44, where q² exp(−q) is below rounding; a panel is at
//! most 2 wide, because the nearest poles of Hn and Ht are at q = ±0.74i, and spans a phase qr of at most 20.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: ν | scalar | – | 0 to below 0.5 |
//! | out: gn, gs | scalars | per h², per h³ | absolute error about 1e-15 |

use super::transfer;
use crate::physics::gauss::rule;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

/// r in units of h from which the kernels are zero.
pub const REACH: f64 = 40.0;
/// r up to which pieces are short, because the singularity at r = ±i is near.
const NEAR: f64 = 6.0;
/// Length of a piece below and above `NEAR`.
const PIECES: [f64; 2] = [0.5, 2.0];
/// Terms of a piece's series.
const TERMS: usize = 20;
/// End of the integrals over q.
const LAST_Q: f64 = 44.0;
/// Nodes of a panel in q.
const NODES: usize = 24;
/// Poisson ratios whose tables are kept, 9 kB each: more than a study has.
const KEPT: usize = 16;

/// Series of gn and gs on one piece.
type Piece = [[f64; TERMS]; 2];

/// The kernels of one Poisson ratio.
#[derive(Clone, Debug)]
pub struct Kernel {
    pieces: Arc<[Piece]>,
}

impl Kernel {
    /// The kernels for a Poisson ratio of 0 to below 0.5. The first call of a process for a ratio tabulates them, which takes
    /// about 0.05 s: as long as the stress of a hundred frames.
    pub fn new(poisson: f64) -> Kernel {
        static KNOWN: Mutex<BTreeMap<u64, Kernel>> = Mutex::new(BTreeMap::new());
        let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = known().get(&poisson.to_bits()) {
            return kernel.clone();
        }
        // Not under the lock: other ratios need not wait.
        let kernel = Kernel::tabulated(poisson);
        let mut known = known();
        if known.len() >= KEPT {
            known.clear();
        }
        known.insert(poisson.to_bits(), kernel.clone());
        kernel
    }

    fn tabulated(poisson: f64) -> Kernel {
        let near = (NEAR / PIECES[0]) as usize;
        let far = ((REACH - NEAR) / PIECES[1]) as usize;
        let starts = (0..near).map(|k| (PIECES[0] * k as f64, PIECES[0]));
        let starts = starts.chain((0..far).map(|k| (NEAR + PIECES[1] * k as f64, PIECES[1])));
        Kernel { pieces: starts.map(|(start, length)| piece(start, length, poisson)).collect() }
    }

    /// gn (per h²) and gs (per h³) at `r` ≥ 0, a distance in units of h.
    pub fn at(&self, r: f64) -> [f64; 2] {
        let (index, place) = if r < NEAR {
            let pieces = r / PIECES[0];
            (pieces as usize, pieces.fract())
        } else if r < REACH {
            let pieces = (r - NEAR) / PIECES[1];
            ((NEAR / PIECES[0]) as usize + pieces as usize, pieces.fract())
        } else {
            return [0.0; 2];
        };
        let t = 2.0 * place - 1.0;
        let [normal, shear] = &self.pieces[index];
        // Clenshaw's recurrence, both series at once.
        let mut sums = [[0.0; 2]; 2];
        for k in (1..TERMS).rev() {
            for (sum, term) in sums.iter_mut().zip([normal[k], shear[k]]) {
                *sum = [term + 2.0 * t * sum[0] - sum[1], sum[0]];
            }
        }
        [normal[0] + t * sums[0][0] - sums[0][1], shear[0] + t * sums[1][0] - sums[1][1]]
    }
}

/// Chebyshev series of both kernels on start … start + length, through its TERMS nodes.
fn piece(start: f64, length: f64, poisson: f64) -> Piece {
    let angle = |j: usize| PI * (j as f64 + 0.5) / TERMS as f64;
    let values: Vec<[f64; 2]> =
        (0..TERMS).map(|j| hankel(start + length * (1.0 + angle(j).cos()) / 2.0, poisson)).collect();
    let term = |which: usize, k: usize| {
        let sum: f64 = values.iter().enumerate().map(|(j, value)| value[which] * (k as f64 * angle(j)).cos()).sum();
        sum * if k == 0 { 1.0 } else { 2.0 } / TERMS as f64
    };
    std::array::from_fn(|which| std::array::from_fn(|k| term(which, k)))
}

/// gn and gs by quadrature.
fn hankel(r: f64, poisson: f64) -> [f64; 2] {
    const PHASE: f64 = 20.0;
    let nodes = rule(NODES);
    let panels = (LAST_Q / 2.0).max(LAST_Q * r / PHASE).ceil() as usize;
    let half = LAST_Q / panels as f64 / 2.0;
    let mut sums = [0.0; 2];
    for panel in 0..panels {
        let middle = half * (2 * panel + 1) as f64;
        for &(x, weight) in nodes.iter() {
            let q = middle + half * x;
            let [normal, shear] = transfer(q, poisson);
            sums[0] += weight * normal * libm::j0(q * r) * q;
            sums[1] += weight * shear * ratio(q * r) * q * q;
        }
    }
    sums.map(|sum| sum * half / TAU)
}

/// J1(x)/x, 1/2 at 0.
fn ratio(x: f64) -> f64 {
    // Below this x, the next term of the series, x²/16, is less than rounding.
    if x < 1e-8 {
        0.5
    } else {
        libm::j1(x) / x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// gt = r gs.
    fn gt(kernel: &Kernel, r: f64) -> f64 {
        r * kernel.at(r)[1]
    }

    #[test]
    fn known_shape() {
        // gn(0) relative to the half-space's 3/2π, half-width of gn, largest gt and its r; three to four digits.
        for (poisson, raised, half_width, largest, at) in [
            (0.40, 1.485, 0.515, 0.2249, 0.483),
            (0.48, 1.547, 0.503, 0.2340, 0.474),
            (0.4999, 1.571, 0.499, 0.2378, 0.471),
        ] {
            let kernel = Kernel::new(poisson);
            let peak = kernel.at(0.0)[0];
            assert!((peak * TAU / 3.0 - raised).abs() < 0.6e-3, "{peak}");
            assert!((kernel.at(half_width)[0] / peak - 0.5).abs() < 1.2e-3);
            assert!((gt(&kernel, at) - largest).abs() < 0.6e-4);
            let beside = [at - 0.01, at + 0.01].map(|r| gt(&kernel, r));
            assert!(beside.iter().all(|g| *g < gt(&kernel, at)));
        }
    }

    #[test]
    fn the_table_follows_the_integral() {
        let kernel = Kernel::new(0.48);
        for k in 0..200 {
            let r = 0.199 * k as f64 + 0.001;
            let (table, integral) = (kernel.at(r), hankel(r, 0.48));
            let off = (0..2).map(|w| (table[w] - integral[w]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-14, "{r}: {off:e}");
        }
        assert!(kernel.at(REACH - 1e-9).iter().all(|g| g.abs() < 1e-13));
        assert_eq!(kernel.at(REACH), [0.0; 2]);
    }

    #[test]
    fn a_ratio_is_tabulated_once() {
        let (first, again) = (Kernel::new(0.377), Kernel::new(0.377));
        assert!(Arc::ptr_eq(&first.pieces, &again.pieces));
        (0..=KEPT).for_each(|k| drop(Kernel::new(0.001 * k as f64)));
        assert_eq!(Kernel::new(0.377).at(0.5), first.at(0.5));
        assert_ne!(Kernel::new(0.378).at(0.5), first.at(0.5));
    }

    #[test]
    fn force_and_moment_arrive_at_the_base() {
        // 2π ∫ gn r dr = 1, π ∫ gs r³ dr = 1: Hn(0) and Ht′(0).
        for poisson in [0.0, 0.25, 0.48] {
            let kernel = Kernel::new(poisson);
            let mut sums = [0.0; 2];
            for step in 0..160 {
                for &(x, weight) in rule(NODES).iter() {
                    let r = 0.25 * step as f64 + 0.125 * (1.0 + x);
                    let [normal, shear] = kernel.at(r);
                    sums[0] += 0.125 * weight * TAU * normal * r;
                    sums[1] += 0.125 * weight * PI * shear * r * r * r;
                }
            }
            // The end of the table leaves out exp(−0.74·40)·40³ ≈ 1e-8 of the moment at most.
            assert!((sums[0] - 1.0).abs() < 1e-10 && (sums[1] - 1.0).abs() < 1e-7, "{poisson}: {sums:?}");
        }
    }
}
