//! Contacts: one μ per contact instead of one per rectangle.
//!
//! With μ constant on each region, m the μ of each taxel, the stress is met exactly when
//!
//! ```text
//! p = p₀ − Ax(m1∘p) − Ay(m2∘p)
//! ```
//!
//! with the same matrices as for one μ. For each region k in turn, M its mask, the other regions held constant:
//!
//! ```text
//! v_00 = p₀ − Ax((1−M)∘m1∘p) − Ay((1−M)∘m2∘p)      v_ij = −(Ax(M∘v_{i−1,j}) + Ay(M∘v_{i,j−1}))
//! ```
//!
//! and μ_k is what `search` finds for this family. A sweep visits all regions; sweeps are repeated until no μ moves by
//! more than 1/400 of mu_max, at most [`SWEEPS`] times. Then neighbouring regions with nearly equal μ are joined, and
//! the regions are segmented anew from the better p, until neither changes them.
//!
//! All this is done for each width of smoothing in `segment`: contacts that touch need a narrow one, rings a wide one.
//! Of the results, and the solution with one μ for all, the one whose p has the best score over the whole array is
//! taken, less a penalty for each region beyond the first.
//!
//! Cells larger than the depth smear a contact's rim, which shifts μ, and an error of one contact appears as shear of
//! its neighbours. Fitted ellipses have neither error. Where elliptic contacts explain the stress (the misfit is no
//! larger than noise and quadrature cause, as in `auto`), `objective::multi_ellipse` fits them together, from regions
//! of several widths, before anything is searched; each contact's μ, load and cells are then those of its ellipse.
//! Where they do not, the regions of the nearest ellipses are one more segmentation to search in.
//! | | shape | unit |
//! |---|---|---|
//! | in: family of one μ and its μ | polynomial, 2 | N, – |
//! | in: stress and noise, for the fit | n, scalar | MPa |
//! | out: p, regions, μ of each | n, n, count × 2 | N, –, – |
//!
//! With one region the result is that of one μ for the whole array, to the bit.

pub(super) mod by_network;
mod ellipses;

use super::objective::taxels::Taxels;
use super::objective::Objective;
use super::pass::{term_index, Polynomial};
use super::search::{search, SearchResult};
use crate::data::frame::Forces;
use crate::estimate::segment::{neighbours, segment, Segments, WIDTH};
use crate::physics::matrices::{FoldedMatrices, Matrices};

/// Maximum number of sweeps over one set of regions.
pub const SWEEPS: usize = 6;
/// Maximum number of segmentations.
pub const ROUNDS: usize = 4;
/// Convergence tolerance of μ, and distance below which two μ are joined, both in units of mu_max.
const MU_TOLERANCE: f64 = 1.0 / 400.0;
const MU_MERGE_DISTANCE: f64 = 0.05;
/// Widths of smoothing that are tried, in units of h.
const WIDTHS: [f64; 2] = [WIDTH, 0.6];
/// Score in bits that each further region must add.
const REGION_COST: f64 = 5.0;
/// Convergence tolerance of p, relative to its largest entry.
const P_TOLERANCE: f64 = 1e-9;
/// Maximum number of iterations of p for given μ; each reduces the error by the factor r or better.
const RELAXATIONS: usize = 60;

/// The contacts found in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct SolvedContacts {
    /// Region of each taxel, if it belongs to one.
    pub segments: Segments,
    /// Result of the last search in each region, `None` where it was not searched or no candidate was admissible.
    pub found: Vec<Option<SearchResult>>,
    /// Normal force on each taxel in N, row-major.
    pub p: Vec<f64>,
    /// Number of sweeps over all regions.
    pub sweeps: usize,
    /// Whether the last sweep moved no μ and the regions stayed.
    pub converged: bool,
}

/// The stress to which ellipses are fitted.
#[derive(Clone, Copy)]
pub(crate) struct MeasuredStress<'a> {
    /// Positions of the taxels.
    pub taxels: &'a Taxels,
    /// b in MPa, row-major.
    pub b: &'a [f64],
    /// Standard deviation of the noise on b in MPa.
    pub noise_MPa: f64,
}

/// The contact solver for one frame.
pub struct Solver<'a> {
    /// The array's matrices.
    pub matrices: &'a Matrices,
    /// Largest |μ|.
    pub mu_max: f64,
    /// The objective of the searches.
    pub objective: &'a dyn Objective,
    /// p₀ = Cz⁺ b in N.
    pub p0: &'a [f64],
    /// The stress to fit ellipses to; `None` where a taxel is dead or no shear is wanted.
    pub(crate) stress: Option<MeasuredStress<'a>>,
    /// Whether region `k` of these segments is to be searched.
    pub searched: &'a dyn Fn(&Segments, usize) -> bool,
}

impl SolvedContacts {
    /// Ratio of shear to normal force of a region, [x, y]; 0 where it was not searched.
    pub fn mu(&self, region: usize) -> [f64; 2] {
        mu_of(&self.found[region])
    }

    /// μ of a taxel: that of its region, 0 where it belongs to none.
    fn mu_of_taxel(&self, taxel: usize) -> [f64; 2] {
        self.segments.labels[taxel].map_or([0.0; 2], |region| self.mu(region))
    }

    /// The force on each taxel in N, from p and the μ of its region.
    pub fn forces(&self) -> Forces {
        let along =
            |axis: usize| (0..self.p.len()).map(|taxel| self.mu_of_taxel(taxel)[axis] * self.p[taxel]).collect();
        Forces { fx: along(0), fy: along(1), fz: self.p.clone() }
    }
}

fn mu_of(found: &Option<SearchResult>) -> [f64; 2] {
    found.map_or([0.0; 2], |found| found.mu)
}

impl Solver<'_> {
    /// Finds the contacts, starting from the polynomial of one μ for the whole array and the result of its search.
    pub fn solve(&self, family: &Polynomial, found: SearchResult) -> SolvedContacts {
        let p = family.eval(found.mu);
        let segments = Segments::whole(p.len());
        let start = SolvedContacts { segments, found: vec![Some(found)], p, sweeps: 0, converged: true };
        let fit = self.fit(&start);
        if let Some(fitted) = fit.as_ref().and_then(|fit| self.contacts_of_fit(fit, &start)) {
            return fitted;
        }
        let mut best = (found.objective, start.clone());
        let mut keep = |state: SolvedContacts| {
            let cost = REGION_COST * (state.segments.count - 1) as f64;
            if let Some(score) = self.objective.score(&state.p).filter(|score| score - cost > best.0) {
                best = (score - cost, state);
            }
        };
        for width in WIDTHS {
            keep(self.solve_regions(&|p| segment(&self.matrices.sensor, p, width), &start));
        }
        if let Some(fit) = &fit {
            let segments = Segments::numbered(&fit.labels(&self.matrices.sensor));
            keep(self.solve_regions(&|_| segments.clone(), &start));
        }
        let best = best.1;
        // A fit that starts from as many ellipses as the first one would find the same.
        if fit.is_some_and(|fit| fit.patches.len() == best.segments.count) || best.segments.count == 1 {
            return best;
        }
        self.fit(&best).and_then(|fit| self.contacts_of_fit(&fit, &best)).unwrap_or(best)
    }

    /// Solves for the regions of `draw(p)`, drawn anew from each better p.
    fn solve_regions(&self, draw: &dyn Fn(&[f64]) -> Segments, start: &SolvedContacts) -> SolvedContacts {
        let mut state = self.with_regions(start, draw(&start.p));
        if state.segments.count == 1 {
            return start.clone();
        }
        for _ in 0..ROUNDS {
            let before = state.segments.clone();
            self.sweep(&mut state);
            while let Some((a, b)) = self.similar_pair(&state) {
                state.found[a] = state.found[a].or(state.found[b]);
                state.found.remove(b);
                state.segments = state.segments.joined(a, b);
                if state.segments.count == 1 {
                    return SolvedContacts { sweeps: state.sweeps, ..start.clone() };
                }
                self.sweep(&mut state);
            }
            let segments = draw(&state.p);
            if segments == state.segments || segments == before {
                return state;
            }
            state = SolvedContacts { converged: false, ..self.with_regions(&state, segments) };
        }
        self.sweep(&mut state);
        state
    }

    /// The state with new regions, each with the μ that its strongest taxel had.
    fn with_regions(&self, state: &SolvedContacts, segments: Segments) -> SolvedContacts {
        let strongest = |region: usize| segments.taxels(region).max_by(|&a, &b| state.p[a].total_cmp(&state.p[b]));
        let before = |taxel: usize| state.segments.labels[taxel].and_then(|region| state.found[region]);
        let old = |region| strongest(region).and_then(before);
        SolvedContacts { found: (0..segments.count).map(old).collect(), segments, ..state.clone() }
    }

    /// Searches all regions in turn until no μ moves.
    fn sweep(&self, state: &mut SolvedContacts) {
        let searched: Vec<bool> = (0..state.segments.count).map(|k| (self.searched)(&state.segments, k)).collect();
        for (found, searched) in state.found.iter_mut().zip(&searched) {
            *found = found.filter(|_| *searched);
        }
        self.relax(state);
        state.converged = false;
        for _ in 0..SWEEPS {
            let mut moved = 0.0f64;
            for region in (0..state.segments.count).filter(|&k| searched[k]) {
                let family = self.family(state, region);
                let [x, y] = state.mu(region);
                state.found[region] = search(&family, self.mu_max, &|p| self.objective.score(p));
                let mu = state.mu(region);
                moved = moved.max((mu[0] - x).hypot(mu[1] - y));
                state.p = family.eval(mu);
                self.relax(state);
            }
            state.sweeps += 1;
            state.converged = moved <= MU_TOLERANCE * self.mu_max;
            if state.converged {
                break;
            }
        }
    }

    /// The polynomial of one region's μ, the other regions held constant.
    fn family(&self, state: &SolvedContacts, region: usize) -> Polynomial {
        let inside = |k: usize| state.segments.labels[k] == Some(region);
        let other_mu: Vec<[f64; 2]> =
            (0..state.p.len()).map(|k| if inside(k) { [0.0; 2] } else { state.mu_of_taxel(k) }).collect();
        let mut coefficients = vec![self.iterate(&state.p, &other_mu)];
        let masked = |v: &[f64]| -> Vec<f64> { (0..v.len()).map(|k| if inside(k) { v[k] } else { 0.0 }).collect() };
        let FoldedMatrices { basis, ax, ay, .. } = &self.matrices.folded;
        let degree = self.matrices.degree;
        let mut last = vec![basis.fold(&masked(&coefficients[0]))];
        for order in 1..=degree {
            let mut folded = Vec::with_capacity(order + 1);
            for j in 0..=order {
                let mut v = vec![0.0; state.p.len()];
                if j < order {
                    ax.accumulate(&last[j], -1.0, &mut v);
                }
                if j > 0 {
                    ay.accumulate(&last[j - 1], -1.0, &mut v);
                }
                debug_assert_eq!(coefficients.len(), term_index(order - j, j));
                coefficients.push(basis.unfold(&v));
                folded.push(basis.fold(&masked(&coefficients[coefficients.len() - 1])));
            }
            last = folded;
        }
        Polynomial { degree, coefficients }
    }

    /// One iteration p₀ − Ax(m1∘p) − Ay(m2∘p); `mu` is m, per taxel.
    fn iterate(&self, p: &[f64], mu: &[[f64; 2]]) -> Vec<f64> {
        let FoldedMatrices { basis, ax, ay, .. } = &self.matrices.folded;
        let mut next = vec![0.0; p.len()];
        for (axis, a) in [ax, ay].into_iter().enumerate() {
            let shear: Vec<f64> = p.iter().zip(mu).map(|(p, mu)| mu[axis] * p).collect();
            a.accumulate(&basis.fold(&shear), -1.0, &mut next);
        }
        let mut next = basis.unfold(&next);
        next.iter_mut().zip(self.p0).for_each(|(p, p0)| *p += p0);
        next
    }

    /// Iterates p = p₀ − Ax(m1∘p) − Ay(m2∘p) for the state's μ until it converges.
    fn relax(&self, state: &mut SolvedContacts) {
        let mu: Vec<[f64; 2]> = (0..state.p.len()).map(|taxel| state.mu_of_taxel(taxel)).collect();
        for _ in 0..RELAXATIONS {
            let next = self.iterate(&state.p, &mu);
            let size = next.iter().fold(0.0f64, |size, p| p.abs().max(size));
            let moved = next.iter().zip(&state.p).fold(0.0f64, |moved, (a, b)| (a - b).abs().max(moved));
            state.p = next;
            if moved <= P_TOLERANCE * size {
                return;
            }
        }
    }

    /// The pair of neighbouring regions with the most similar μ, if it is within [`MU_MERGE_DISTANCE`].
    fn similar_pair(&self, state: &SolvedContacts) -> Option<(usize, usize)> {
        let labels = &state.segments.labels;
        let sensor = &self.matrices.sensor;
        let pairs = (0..labels.len()).flat_map(|k| neighbours(sensor, k).map(move |other| (labels[k], labels[other])));
        let pairs = pairs.filter_map(|(a, b)| a.zip(b));
        let distance = |&(a, b): &(usize, usize)| {
            let (a, b) = (state.mu(a), state.mu(b));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        pairs
            .filter(|(a, b)| a < b)
            .filter(|pair| distance(pair) <= MU_MERGE_DISTANCE * self.mu_max)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

#[cfg(test)]
mod tests;
