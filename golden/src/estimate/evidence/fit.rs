//! Fit: the rounds of one frame, from its stress to the contacts.
//!
//! Every round takes the pressure of the last one as the envelope, finds μ and the pressure anew, and where they are not
//! known the noise and the readings of clipped taxels. In the first rounds the contacts are segmented anew as well.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | taxels | of its peak |
//! | out: [`EvidenceEstimate`] | – | N per MPa of the peak |

mod network;
mod outcome;
mod regions;

use super::ascent::{ascend, Top};
use super::baseline::{plane, Sizes};
use super::estimate::EvidenceEstimate;
use super::estimator::Evidence;
use super::model::{Design, Readings};
use super::regions::Regions;
use super::slip::Quadratic;
use super::{clipped, noise};
use crate::estimate::segment::neighbours;
use crate::physics::smooth::terms;
use faer::{Mat, Scale};

/// Smallest standard deviation of a reading.
pub(super) const FLOOR: f64 = 1e-4;
/// Largest first noise where it is not known.
const UNKNOWN: f64 = 0.02;
/// Largest number of rounds with coarse pressures.
const ROUNDS: usize = 7;
/// Smallest number of them: the envelope has left the first, too wide one.
const LEAST_ROUNDS: usize = 4;
/// Largest variance that a coarse pressure leaves out, in units of the largest of its shape: envelope and μ need no more.
const COARSE: f64 = 0.01;
/// Square of the distance of two μ, in standard deviations, below which contacts that touch are one: the 95 % quantile
/// of two unknowns.
const SAME_MU: f64 = 6.0;
/// Rounds after which the regions of the contacts are kept.
const SEGMENTED: usize = 6;
/// Standard deviation of μ over the one under a known envelope, on drawn frames of sensor-1.
const ENVELOPE_FACTOR: f64 = 1.1;
/// Times per round that noise, baseline and clipped readings are found anew.
const PASSES: usize = 2;
/// Noise found over the noise of the round before, below which another round follows the last one.
const QUIETER: f64 = 0.5;
/// Largest number of these.
const FINER_ROUNDS: usize = 2;
/// Steps of the ascent in the last round.
const STEPS: usize = 2;
/// Change of μ per round, in units of mu_max, below which the rounds end.
const SETTLED: f64 = 1e-3;
/// The same in standard deviations of μ.
const SETTLED_SIGMA: f64 = 0.1;

/// What the rounds of a fit have found so far, in units of the peak.
#[derive(Clone, Debug)]
pub(super) struct Progress {
    /// Pressure on each cell.
    pub p: Vec<f64>,
    /// Contact of each cell.
    pub labels: Vec<usize>,
    /// μ of each contact.
    pub mu: Vec<[f64; 2]>,
    /// Spread of each contact, see `slip`.
    pub spread: Vec<f64>,
    /// Sizes of the baseline.
    pub sizes: Sizes,
    /// Standard deviation of the noise.
    pub sigma: f64,
}

/// One frame.
pub(super) struct Fit<'a> {
    scene: &'a Evidence,
    b: &'a [f64],
    /// Taxels whose readings count.
    used: &'a [bool],
    /// The taxels that are read.
    taxels: Vec<usize>,
    /// Where they are in the tables of influence.
    offsets: Vec<usize>,
    /// Which of them read zero because they read no tension.
    clipped: Vec<usize>,
    /// Which of them are read for what the estimate says of them alone.
    missing: Vec<usize>,
    readings: Readings,
    /// Whether the noise is known.
    stated: bool,
    now: Progress,
    /// Number of rounds.
    round: usize,
    /// Multiplications of all posteriors.
    work: u64,
}

/// What a fit says of one frame.
pub(super) struct Fitted {
    /// Contacts and forces.
    pub estimate: EvidenceEstimate,
    /// The reading that the others explain least: taxel, and its distance in standard deviations.
    pub worst: Option<(usize, f64)>,
    /// What the others say of each taxel that is not used.
    pub predicted: Vec<Predicted>,
    /// What the rounds found.
    pub found: Progress,
    /// The number of contacts into which the pressure divides.
    pub parts: usize,
    /// Σ b·area that no baseline explains, of the readings that count.
    pub load: f64,
    /// Log evidence of the readings that count, without the constant.
    pub evidence: f64,
    /// Whether a pressure has more coefficients than the readings can tell.
    pub wide: bool,
}

/// What the readings of the others say of one taxel, in units of the peak.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicted {
    /// The taxel.
    pub taxel: usize,
    /// Mean of its stress.
    pub mean: f64,
    /// Variance of its reading, noise and gain included.
    pub variance: f64,
}

/// The contacts with their μ.
struct Found {
    regions: Regions,
    /// The posterior at their μ.
    top: Top,
    /// Covariance of all μ.
    covariance: Mat<f64>,
}

impl<'a> Fit<'a> {
    /// A fit that has not begun, of the taxels `used`; `stated` is the noise in units of the peak, if it is known.
    pub fn new(scene: &'a Evidence, b: &'a [f64], used: &'a [bool], stated: Option<f64>) -> Fit<'a> {
        let sensor = &scene.cells.sensor;
        let first = plane(sensor, b, used);
        let above = |t: usize| b[t] - first.iter().zip(terms(sensor, t)).map(|(size, term)| size * term).sum::<f64>();
        let without: Vec<f64> = (0..b.len()).map(above).collect();
        let readings = (0..b.len()).filter(|&t| used[t]).map(|t| without[t]);
        let sigma = stated.unwrap_or_else(|| noise::first(readings).min(UNKNOWN)).max(FLOOR);
        let p = scene.envelopes.first_pressure(sensor, &without, used, sigma);
        let (labels, mu, sizes) = (vec![0; p.len()], vec![[0.0; 2]], Sizes::of_plane(first));
        Fit::from(scene, b, used, stated, Progress { p, labels, mu, spread: vec![scene.spreads.mean()], sizes, sigma })
    }

    /// The same that goes on from what the rounds of another frame found.
    pub fn from(scene: &'a Evidence, b: &'a [f64], used: &'a [bool], stated: Option<f64>, before: Progress) -> Fit<'a> {
        let sigma = stated.unwrap_or(before.sigma).max(FLOOR);
        let now = Progress { sigma, ..before };
        let taxels = scene.window(&now.p, sigma);
        let of = |is: &dyn Fn(usize) -> bool| (0..taxels.len()).filter(|k| is(taxels[*k])).collect();
        let clipped = of(&|t| used[t] && scene.unipolar && b[t] <= 0.0);
        let missing = of(&|t| !used[t]);
        let readings = Readings { y: vec![0.0; taxels.len()], precision: vec![0.0; taxels.len()] };
        let (stated, offsets) = (stated.is_some(), scene.cells.offsets(&taxels));
        Fit { scene, b, used, taxels, offsets, clipped, missing, readings, stated, now, round: 0, work: 0 }
    }

    /// Whether a reading counts: it is neither clipped nor missing.
    fn counts(&self, k: usize) -> bool {
        self.clipped.binary_search(&k).is_err() && self.missing.binary_search(&k).is_err()
    }

    /// The estimate of a frame of which nothing is known; `None` if the model is not representable.
    pub fn run(mut self) -> Option<Fitted> {
        self.approach()?;
        self.finish()
    }

    /// Rounds until μ stands still, of one contact with coarse pressures. What these leave counts as noise, in which a weak contact
    /// beside a strong one would be lost.
    fn approach(&mut self) -> Option<()> {
        let mut joined = false;
        loop {
            self.round += 1;
            if self.round <= SEGMENTED && !joined {
                self.segment();
            }
            if self.now.mu.is_empty() {
                return None;
            }
            let before = self.now.mu.clone();
            let mut regions = self.regions(if before.len() > 1 { 0.0 } else { COARSE });
            let top = self.ascend(&mut regions.design, 1)?;
            let top = self.with_rest(&mut regions.design, top, 1, 0)?;
            self.find_spread(&mut regions.design, &top);
            self.take(&regions, &top);
            let moved = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
            let most = before.iter().zip(&top.mu).map(moved).fold(0.0, f64::max);
            let mut done = before.len() == top.mu.len() && most <= self.settled(&top);
            if self.round < LEAST_ROUNDS {
                continue;
            }
            if let Some((a, b)) = self.similar_pair(&top) {
                self.join(a, b);
                (joined, done) = (true, false);
            }
            // Where the shear stays open, the regions are all that the rounds have to find. A fit that has had its work ends.
            if done || self.round == ROUNDS || regions.wide && self.round >= SEGMENTED || self.is_spent() {
                return Some(());
            }
        }
    }

    /// The last round, as fine as the noise lets see, and the estimate; `None` if the model is not representable. Where it finds
    /// much less noise than the rounds before, whose coarse pressures left more, the envelope reaches farther: another one follows.
    pub fn finish(mut self) -> Option<Fitted> {
        let last = self.round + 1 + FINER_ROUNDS;
        let (regions, top) = loop {
            self.round += 1;
            let before = self.now.sigma;
            let mut regions = self.regions(0.0);
            let top = self.ascend(&mut regions.design, STEPS)?;
            let top = self.with_rest(&mut regions.design, top, 1, 1)?;
            self.take(&regions, &top);
            if self.now.sigma > QUIETER * before || self.round == last || self.is_spent() {
                break (regions, top);
            }
        };
        let unknowns = 2 * top.mu.len();
        let searched = self.scene.prior.mu_max > 0.0;
        let covariance = match searched {
            // What was cut would have left the shear open.
            true if regions.wide => self.scene.prior.unresolved(unknowns),
            true => self.covariance(&regions.design, &top)?,
            false => Mat::zeros(unknowns, unknowns),
        };
        let mut found = Found { regions, top, covariance };
        if let Some(mu_network) = self.scene.mu_network.as_ref().filter(|_| !found.regions.wide) {
            found = self.with_network(mu_network, found)?;
        }
        self.estimate(&found)
    }

    /// Whether the fit has had its work.
    fn is_spent(&self) -> bool {
        self.work > self.scene.work
    }

    /// Change of μ per round below which the rounds end.
    fn settled(&self, top: &Top) -> f64 {
        let least = SETTLED * self.scene.prior.mu_max;
        let spread = |all: Mat<f64>| (0..all.nrows()).map(|i| all[(i, i)].sqrt()).fold(f64::INFINITY, f64::min);
        self.scene.prior.covariance(&top.slope).map_or(least, |all| least.max(SETTLED_SIGMA * spread(all)))
    }

    /// Divides the loaded cells into contacts; each keeps the μ that its strongest cell had.
    fn segment(&mut self) {
        let loaded = self.scene.envelopes.of(self.now.p.iter().copied(), self.now.sigma);
        let p: Vec<f64> = self.now.p.iter().zip(&loaded).map(|(p, e)| if *e > 0.0 { *p } else { 0.0 }).collect();
        let segments = self.scene.segmenter.segment_forces(&p).segments;
        let mut strongest: Vec<Option<usize>> = vec![None; segments.count];
        let loaded = segments.labels.iter().enumerate().filter(|(cell, _)| p[*cell] > 0.0);
        for (cell, label) in loaded.filter_map(|(cell, label)| Some((cell, (*label)?))) {
            if strongest[label].is_none_or(|other| p[cell] > p[other]) {
                strongest[label] = Some(cell);
            }
        }
        // Regions without a loaded cell are no contacts.
        let kept: Vec<usize> = (0..segments.count).filter(|&label| strongest[label].is_some()).collect();
        let before = |&label: &usize| strongest[label].map(|cell| self.now.labels[cell]);
        let mu_of = |label| before(label).map_or([0.0; 2], |own| self.now.mu[own]);
        let spread_of = |label| before(label).map_or(self.scene.spreads.mean(), |own| self.now.spread[own]);
        (self.now.mu, self.now.spread) = kept.iter().map(|label| (mu_of(label), spread_of(label))).unzip();
        let number = |label: &Option<usize>| kept.iter().position(|kept| Some(*kept) == *label).unwrap_or(0);
        self.now.labels = segments.labels.iter().map(number).collect();
    }

    /// Two contacts that touch and whose μ the stress does not tell apart: parts of one, such as a ring.
    fn similar_pair(&self, top: &Top) -> Option<(usize, usize)> {
        if self.now.mu.len() < 2 || self.scene.prior.mu_max == 0.0 {
            return None;
        }
        let covariance = self.scene.prior.covariance(&top.slope)?;
        let distance = |&(a, b): &(usize, usize)| {
            let spread = |i: usize, j: usize| {
                let of = |k: usize, l: usize| covariance[(2 * k + i, 2 * l + j)];
                of(a, a) + of(b, b) - of(a, b) - of(b, a)
            };
            let off = [self.now.mu[a][0] - self.now.mu[b][0], self.now.mu[a][1] - self.now.mu[b][1]];
            let [xx, xy, yy] = [spread(0, 0), spread(0, 1), spread(1, 1)];
            let determinant = xx * yy - xy * xy;
            (yy * off[0] * off[0] - 2.0 * xy * off[0] * off[1] + xx * off[1] * off[1]) / determinant
        };
        let grid = &self.scene.cells.grid;
        let loaded = |cell: &usize| self.now.p[*cell] > 0.0;
        let pairs = (0..self.now.p.len()).filter(loaded).flat_map(|cell| {
            let other = neighbours(grid, cell).filter(loaded);
            other.map(move |other| (self.now.labels[cell], self.now.labels[other]))
        });
        let near = pairs.filter(|(a, b)| a < b).filter(|pair| distance(pair) <= SAME_MU);
        near.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Makes contact `b` a part of contact `a`.
    fn join(&mut self, a: usize, b: usize) {
        for label in &mut self.now.labels {
            *label = if *label == b { a } else { *label - usize::from(*label > b) };
        }
        self.now.mu.remove(b);
        self.now.spread.remove(b);
    }

    /// Standard deviation of a taxel.
    fn noise(&self, taxel: usize) -> f64 {
        (self.now.sigma * self.scene.noise_shares[taxel]).max(FLOOR)
    }

    /// Readings and precision of the taxels that are not clipped.
    fn weigh(&mut self) {
        for (k, &taxel) in self.taxels.iter().enumerate() {
            let b = self.b[taxel];
            if self.used[taxel] && !(self.scene.unipolar && b <= 0.0) {
                let (noise, gain) = (self.noise(taxel), self.scene.gain_spread * b);
                self.readings.y[k] = b;
                self.readings.precision[k] = 1.0 / (noise * noise + gain * gain);
            }
        }
    }

    /// The largest posterior of μ under the present envelopes within `steps` steps; without a step, as where the work is done, that at
    /// the present μ.
    fn ascend(&mut self, design: &mut Design, steps: usize) -> Option<Top> {
        self.weigh();
        self.baseline(design);
        let steps = if self.is_spent() { 0 } else { steps };
        let top = ascend(design, &self.readings, &self.now.mu, self.scene.prior, steps)?;
        self.work += top.posteriors as u64 * design.work();
        Some(top)
    }

    /// The same from `top`, with the noise, the baseline and the clipped readings that go with it, found anew at least `least`
    /// times; more than once only where there is a baseline or a clipped reading.
    fn with_rest(&mut self, design: &mut Design, mut top: Top, steps: usize, least: usize) -> Option<Top> {
        for pass in 0..PASSES {
            self.find_rest(design, &top);
            let settled = !self.now.sizes.matter() && self.clipped.is_empty();
            if pass >= least && (settled || self.is_spent()) {
                break;
            }
            self.find_spread(design, &top);
            self.now.mu = top.mu;
            top = self.ascend(design, steps)?;
        }
        Some(top)
    }

    /// Finds noise, baseline and clipped readings that go with a posterior.
    fn find_rest(&mut self, design: &Design, top: &Top) {
        let (stress, posterior) = (top.posterior.stress(&self.readings), &top.posterior);
        if !self.stated {
            let ratio = noise::ratio(&self.readings, |k| self.counts(k), &stress);
            self.now.sigma = (self.now.sigma * ratio).clamp(FLOOR, 1.0);
        }
        let first = design.of_baseline().start;
        let of = |term: usize| [posterior.w[first + term], posterior.covariance()[(first + term, first + term)]];
        self.now.sizes = self.now.sizes.found(std::array::from_fn(of));
        for &k in &self.clipped {
            let noise = self.noise(self.taxels[k]);
            clipped::update(&mut self.readings, k, stress[k], noise);
        }
    }

    /// For each contact: the posterior of its spread, mean and variance, and the derivative of all μ in it; `None` if it is not
    /// representable.
    fn of_spreads(&self, design: &Design, top: &Top) -> Option<Vec<([f64; 2], Vec<f64>)>> {
        let (prior, unknowns) = (self.scene.prior, 2 * top.mu.len());
        let covariance = prior.covariance(&top.slope)?;
        let of = |k: usize| {
            let own = design.of_spread(&self.readings, &top.posterior, &top.mu, k);
            let moved = |u: usize| -(0..unknowns).map(|v| covariance[(u, v)] * own.with_mu[v]).sum::<f64>();
            let moved: Vec<f64> = (0..unknowns).map(moved).collect();
            let uphill = |u: usize| top.slope.gradient[u] - prior.precision() * top.mu[u / 2][u % 2];
            let gradient = own.gradient + (0..unknowns).map(|u| moved[u] * uphill(u)).sum::<f64>();
            let information = own.information + (0..unknowns).map(|u| moved[u] * own.with_mu[u]).sum::<f64>();
            let stress = Quadratic { at: self.now.spread[k], gradient, information: information.max(0.0) };
            (self.scene.spreads.moments(stress), moved)
        };
        Some((0..top.mu.len()).map(of).collect())
    }

    /// Finds the spreads that go with a posterior.
    fn find_spread(&mut self, design: &mut Design, top: &Top) {
        for (k, ([mean, _], _)) in self.of_spreads(design, top).into_iter().flatten().enumerate() {
            design.add_spread(k, mean - self.now.spread[k]);
            self.now.spread[k] = mean;
        }
    }

    /// The covariance of all μ with what the envelope and the spreads add.
    fn covariance(&self, design: &Design, top: &Top) -> Option<Mat<f64>> {
        let mut covariance = self.scene.prior.covariance(&top.slope)? * Scale(ENVELOPE_FACTOR * ENVELOPE_FACTOR);
        for (k, ([mean, variance], moved)) in self.of_spreads(design, top)?.into_iter().enumerate() {
            let square = variance + (mean - self.now.spread[k]).powi(2);
            (0..moved.len())
                .for_each(|u| (0..moved.len()).for_each(|v| covariance[(u, v)] += square * moved[u] * moved[v]));
        }
        Some(covariance)
    }

    /// Takes over pressure and μ of a round.
    fn take(&mut self, regions: &Regions, top: &Top) {
        self.now.mu.clone_from(&top.mu);
        self.now.p = regions.pressure(&top.posterior.w, self.now.p.len());
    }
}
