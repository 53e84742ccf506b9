//! Several ellipses: least squares fit of several elliptic contacts at once, each with its own μ.
//!
//! ```text
//! min over θ_k, F_k of ‖b − Σ_k K(θ_k) F_k‖²        θ_k = centre, L, g as in `patch`;  F_k = (Fx, Fy, Fz)
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | n | MPa |
//! | in: initial θ | 6 per contact | as in `patch` |
//! | out: ellipses and their forces | 6 + 3 per contact | as in `patch`, N |
//! | out: squared misfit | scalar | MPa² |
//!
//! The fit starts from several segmentations. If none explains b, an ellipse is added where the misfit of the best fit
//! is largest, or the ellipse there is split in two; at most twice and as long as the misfit halves.

use super::disc::Disc;
use super::ellipse::{node_position, Ellipse, COARSE_NODES, FINE_NODES, PARAMETERS};
use super::fit::{fit, Effort, Fit, Model, QUICK, STEADY};
use super::taxels::Taxels;
use crate::estimate::segment::{Segments, WIDTH};
use crate::spec::sensor::Sensor;
use nalgebra::{DMatrix, DVector};

/// Widths of smoothing of the segmentations from which fits start, in units of h.
pub(crate) const FIT_WIDTHS: [f64; 3] = [WIDTH, 0.6, 0.4];
/// Maximum number of ellipses.
const MAX_ELLIPSES: usize = 8;
/// Maximum of ellipses times taxels, which limits the time of a fit.
const MAX_ELLIPSE_TAXELS: usize = 10_000;
/// A further ellipse must reduce the squared misfit below this fraction.
const REQUIRED_SHARE: f64 = 0.5;
/// Rings and angles of the quadrature while starts are compared.
const ROUGH_NODES: [usize; 2] = [4, 9];
/// Rough misfit, in units of the misfit limit, below which a fit is continued with more nodes.
const REFINE_BELOW: f64 = 1e5;
/// Misfit, in units of the misfit limit, below which no other start is tried and the finest quadrature is used.
const FINE_BELOW: f64 = 1e3;
/// Maximum number of ellipses added.
const MAX_ADDED: usize = 2;
/// Rings and angles of the quadrature for the forces on cells.
const CELL_NODES: [usize; 2] = [32, 96];
/// Fraction of a region's largest force from which a cell counts for the start of its ellipse.
const COUNTS_FROM: f64 = 0.15;
/// Initial g, between Hertz's and a uniform pressure's.
const START_EXPONENT: f64 = 0.4;
/// a²/⟨x²⟩, between 5 for Hertz's pressure and 4 for a uniform one.
const SPREAD: f64 = 4.5;

/// One fitted elliptic contact.
#[derive(Clone, Debug)]
pub(crate) struct FittedEllipse {
    theta: [f64; PARAMETERS],
    /// Force in N, [x, y, normal].
    pub force: [f64; 3],
}

/// Fitted ellipses and their misfit.
#[derive(Clone, Debug)]
pub(crate) struct EllipseFit {
    /// The ellipses, at least one.
    pub patches: Vec<FittedEllipse>,
    /// ‖b − Σ K F‖² in MPa².
    pub misfit: f64,
    /// Largest squared misfit with which the stress counts as explained, in MPa².
    misfit_limit: f64,
    /// Number of evaluations of the columns, over all fits.
    pub evaluations: usize,
}

/// Stress model of several ellipses.
struct MultiEllipse<'a> {
    taxels: &'a Taxels,
    disc: &'a Disc,
}

impl MultiEllipse<'_> {
    fn one(&self) -> Ellipse<'_> {
        Ellipse { taxels: self.taxels, disc: self.disc }
    }

    /// b − Σ K F.
    fn rest(&self, b: &DVector<f64>, found: &Fit) -> DVector<f64> {
        let mut rest = b.clone();
        for (theta, force) in found.theta.chunks(PARAMETERS).zip(found.loads.as_slice().chunks(3)) {
            for (column, f) in self.one().unit_loads(theta).iter().zip(force) {
                rest.iter_mut().zip(column).for_each(|(rest, c)| *rest -= f * c);
            }
        }
        rest
    }
}

/// The columns of all ellipses side by side.
fn joined(n: usize, columns: Vec<Vec<f64>>) -> DMatrix<f64> {
    DMatrix::from_iterator(n, columns.len(), columns.into_iter().flatten())
}

impl Model for MultiEllipse<'_> {
    fn columns(&mut self, theta: &[f64]) -> DMatrix<f64> {
        let columns = theta.chunks(PARAMETERS).flat_map(|theta| self.one().unit_loads(theta)).collect();
        joined(self.taxels.count(), columns)
    }

    fn slopes(&mut self, theta: &[f64], loads: &DVector<f64>) -> DMatrix<f64> {
        let each = theta.chunks(PARAMETERS).zip(loads.as_slice().chunks(3));
        let columns = each.flat_map(|(theta, f)| self.one().derivatives(theta, [f[0], f[1], f[2]])).collect();
        joined(self.taxels.count(), columns)
    }

    fn confine(&self, theta: &mut [f64]) {
        theta.chunks_mut(PARAMETERS).for_each(|theta| self.one().confine(theta));
    }
}

/// Initial θ of one ellipse per region: centroid and spread of the region's compressive forces.
pub(crate) fn start_parameters(sensor: &Sensor, p: &[f64], segments: &Segments) -> Vec<f64> {
    let least = (0.5 * sensor.thickness_mm).powi(2);
    let start = |region: usize| -> Option<[f64; PARAMETERS]> {
        let own = || segments.taxels(region);
        let largest = own().map(|k| p[k]).fold(0.0, f64::max);
        if largest <= 0.0 {
            return None;
        }
        let counted = || own().filter(|&k| p[k] >= COUNTS_FROM * largest);
        let at = |k: usize| sensor.position_mm(k / sensor.cols, k % sensor.cols);
        let weight: f64 = counted().map(|k| p[k]).sum();
        let mean = |value: &dyn Fn([f64; 2]) -> f64| counted().map(|k| p[k] * value(at(k))).sum::<f64>() / weight;
        let [x, y] = [mean(&|at| at[0]), mean(&|at| at[1])];
        let xx = SPREAD * (mean(&|at| (at[0] - x).powi(2)) - sensor.pitch_x_mm.powi(2) / 12.0);
        let yy = SPREAD * (mean(&|at| (at[1] - y).powi(2)) - sensor.pitch_y_mm.powi(2) / 12.0);
        let xy = SPREAD * mean(&|at| (at[0] - x) * (at[1] - y));
        let (xx, yy) = (xx.max(least), yy.max(least));
        let most = 0.8 * (xx * yy).sqrt();
        // Not `clamp`, which panics on NaN bounds: such a fit is rejected by its misfit.
        let xy = xy.max(-most).min(most);
        // The square root of a symmetric 2 × 2 matrix.
        let root = (xx * yy - xy * xy).sqrt();
        let trace = (xx + yy + 2.0 * root).sqrt();
        Some([x, y, (xx + root) / trace, (yy + root) / trace, xy / trace, START_EXPONENT])
    };
    (0..segments.count).filter_map(start).flatten().collect()
}

/// The fits to one frame.
struct Trial<'a> {
    taxels: &'a Taxels,
    /// The quadratures, from coarse to fine.
    discs: &'a [Disc; 3],
    b: &'a DVector<f64>,
    /// Squared misfit up to which a fit explains b, in MPa².
    misfit_limit: f64,
    evaluations: usize,
}

impl Trial<'_> {
    fn fit(&mut self, disc: usize, theta: &[f64], effort: Effort) -> Option<Fit> {
        let found = fit(&mut MultiEllipse { taxels: self.taxels, disc: &self.discs[disc] }, self.b, theta, effort)?;
        self.evaluations += found.evaluations;
        let presses = |force: &[f64]| force[2] > 0.0 && force.iter().all(|f| f.is_finite());
        Some(found).filter(|found| found.loads.as_slice().chunks(3).all(presses))
    }

    /// The best fit from several starts, continued with more nodes if it may explain b.
    fn best(&mut self, starts: &[&[f64]]) -> Option<Fit> {
        let mut best: Option<Fit> = None;
        for start in starts {
            let found = self.fit(0, start, QUICK);
            best = best.into_iter().chain(found).min_by(|a, b| a.misfit.total_cmp(&b.misfit));
            if best.as_ref().is_some_and(|best| best.misfit <= FINE_BELOW * self.misfit_limit) {
                break;
            }
        }
        let mut best = best?;
        for (disc, limit) in [(1, REFINE_BELOW), (2, FINE_BELOW)] {
            if best.misfit > limit * self.misfit_limit {
                break;
            }
            best = self.fit(disc, &best.theta, STEADY).unwrap_or(best);
        }
        Some(best)
    }
}

/// Fits ellipses to `b`: briefly from each of `starts`, then the best fit with more nodes if it may explain b, then
/// with ellipses added. Returns the best fit in which every contact is compressive, `None` if there is none.
pub(crate) fn fit_ellipses(taxels: &Taxels, b: &[f64], starts: &[Vec<f64>], misfit_limit: f64) -> Option<EllipseFit> {
    let b = DVector::from_column_slice(b);
    let most = MAX_ELLIPSES.min(MAX_ELLIPSE_TAXELS / taxels.count().max(1)) * PARAMETERS;
    let discs = [ROUGH_NODES, COARSE_NODES, FINE_NODES].map(|[rings, angles]| Disc::new(rings, angles));
    let mut trial = Trial { taxels, discs: &discs, b: &b, misfit_limit, evaluations: 0 };
    let starts: Vec<&[f64]> =
        starts.iter().map(Vec::as_slice).filter(|start| !start.is_empty() && start.len() <= most).collect();
    let mut best = trial.best(&starts)?;
    for _ in 0..MAX_ADDED {
        if best.misfit <= misfit_limit || best.theta.len() >= most {
            break;
        }
        let rest = MultiEllipse { taxels, disc: &discs[1] }.rest(&b, &best);
        let worst = rest.iamax();
        let candidates = add_ellipse(&best.theta, [taxels.x[worst], taxels.y[worst]], taxels.depth);
        let better = trial.best(&candidates.each_ref().map(Vec::as_slice));
        match better.filter(|found| found.misfit < REQUIRED_SHARE * best.misfit) {
            Some(better) => best = better,
            None => break,
        }
    }
    let patch = |(theta, force): (&[f64], &[f64])| {
        let mut own = [0.0; PARAMETERS];
        own.copy_from_slice(theta);
        FittedEllipse { theta: own, force: [force[0], force[1], force[2]] }
    };
    let patches: Vec<FittedEllipse> =
        best.theta.chunks(PARAMETERS).zip(best.loads.as_slice().chunks(3)).map(patch).collect();
    Some(EllipseFit { patches, misfit: best.misfit, misfit_limit, evaluations: trial.evaluations })
}

/// Two starts with one more ellipse: a new one at the largest misfit, or the ellipse there (or nearest to it) split
/// across its longer axis.
fn add_ellipse(theta: &[f64], [x, y]: [f64; 2], depth: f64) -> [Vec<f64>; 2] {
    let mut added = theta.to_vec();
    added.extend([x, y, depth, depth, 0.0, START_EXPONENT]);
    let mut cut = theta.to_vec();
    let off = |ellipse: &[f64]| (ellipse[0] - x).hypot(ellipse[1] - y) - ellipse[2].max(ellipse[3]);
    let nearest = theta.chunks(PARAMETERS).enumerate().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    if let Some((k, ellipse)) = nearest {
        let (a, b, c) = (ellipse[2], ellipse[3], ellipse[4]);
        let (mean, apart) = ((a + b) / 2.0, ((a - b) / 2.0).hypot(c));
        let (long, short) = (mean + apart, mean - apart);
        let angle = 0.5 * c.atan2((a - b) / 2.0);
        let [dx, dy] = [angle.cos() * long / 2.0, angle.sin() * long / 2.0];
        let radius = (long / 2.0).max(short / 2.0);
        let half = |sign: f64| [ellipse[0] + sign * dx, ellipse[1] + sign * dy, radius, radius, 0.0, START_EXPONENT];
        cut[k * PARAMETERS..(k + 1) * PARAMETERS].copy_from_slice(&half(-1.0));
        cut.extend(half(1.0));
    }
    [added, cut]
}

impl EllipseFit {
    /// Whether the misfit is within the limit, so that the ellipses explain the stress.
    pub fn explains_stress(&self) -> bool {
        self.misfit <= self.misfit_limit
    }

    /// Sum of the forces in N, [x, y, normal].
    pub fn force_N(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.patches.iter().map(|patch| patch.force[axis]).sum())
    }

    /// Normal force of each ellipse on each cell, in N.
    pub fn cells(&self, sensor: &Sensor) -> Vec<Vec<f64>> {
        let disc = Disc::new(CELL_NODES[0], CELL_NODES[1]);
        let index = |mm: f64, pitch: f64, count: usize| {
            let index = (mm / pitch + count as f64 / 2.0).floor();
            (index >= 0.0 && index < count as f64).then_some(index as usize)
        };
        let cells = |patch: &FittedEllipse| {
            let mut cells = vec![0.0; sensor.taxels()];
            for (node, weight) in disc.nodes.iter().zip(disc.weights(patch.theta[5]).0) {
                let [x, y] = node_position(&patch.theta, *node);
                let (col, row) = (index(x, sensor.pitch_x_mm, sensor.cols), index(y, sensor.pitch_y_mm, sensor.rows));
                if let (Some(col), Some(row)) = (col, row) {
                    cells[row * sensor.cols + col] += weight * patch.force[2];
                }
            }
            cells
        };
        self.patches.iter().map(cells).collect()
    }

    /// The ellipse of each taxel: the one with the largest force on its cell, else the one with the nearest rim.
    pub fn labels(&self, sensor: &Sensor) -> Vec<Option<usize>> {
        let cells = self.cells(sensor);
        let label = |k: usize| {
            let [x, y] = sensor.position_mm(k / sensor.cols, k % sensor.cols);
            let beyond = |patch: &FittedEllipse| {
                let [x0, y0, a, b, c, _] = patch.theta;
                let (dx, dy, det) = (x - x0, y - y0, a * b - c * c);
                // |L⁻¹ d| is 1 on the rim.
                let r = ((b * dx - c * dy) / det).hypot((a * dy - c * dx) / det);
                dx.hypot(dy) * (1.0 - 1.0 / r.max(f64::MIN_POSITIVE))
            };
            let all = 0..self.patches.len();
            let nearer = |&i: &usize, &j: &usize| beyond(&self.patches[i]).total_cmp(&beyond(&self.patches[j]));
            let strongest = all.clone().max_by(|&i, &j| cells[i][k].total_cmp(&cells[j][k]));
            strongest.filter(|&i| cells[i][k] > 0.0).or(all.min_by(nearer))
        };
        (0..sensor.taxels()).map(label).collect()
    }
}
