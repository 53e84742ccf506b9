//! Fit: the rounds of one frame, from its stress to the contacts.
//!
//! Every round takes the pressure of the last one as the envelope, finds μ and the pressure anew, and where they are not
//! known the noise and the readings of clipped taxels. In the first rounds the contacts are segmented anew as well.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: b | taxels | of its peak |
//! | out: [`Estimate`] | – | N per MPa of the peak |

mod advice;
mod regions;

use super::ascent::{ascend, Top};
use super::baseline::{plane, terms, Sizes};
use super::contact::forces;
use super::estimate::Estimate;
use super::estimator::Evidence;
use super::model::{Design, Readings};
use super::residual::Residual;
use super::{clipped, noise};
use crate::data::frame::Forces;
use crate::estimate::segment::neighbours;
use crate::result::reconstruct::ContactEstimate;
use faer::{Mat, Scale};
use regions::Regions;
use std::f64::consts::FRAC_1_SQRT_2;

/// Smallest standard deviation of a reading.
const FLOOR: f64 = 1e-4;
/// Largest first noise where it is not known.
const UNKNOWN: f64 = 0.02;
/// Largest number of rounds.
const ROUNDS: usize = 8;
/// Smallest number of rounds: the envelope has left the first, too wide one.
const LEAST_ROUNDS: usize = 4;
/// Square of the distance of two μ, in standard deviations, below which contacts that touch are one: the 95 % quantile
/// of two unknowns.
const SAME_MU: f64 = 6.0;
/// Rounds after which the regions of the contacts are kept.
const SEGMENTED: usize = 6;
/// Standard deviation of μ over the one under a known envelope, on drawn frames of sensor-1.
const ENVELOPE_FACTOR: f64 = 1.1;
/// Times per round that noise and clipped readings are found anew.
const PASSES: usize = 2;
/// Steps of the ascent.
const STEPS: usize = 4;
/// Steps with the noise, baseline and clipped readings of a pass: the next round goes on from there.
const PASS_STEPS: usize = 1;
/// Change of μ per round, in units of mu_max, below which the rounds end.
const SETTLED: f64 = 1e-3;
/// The same in standard deviations of μ.
const SETTLED_SIGMA: f64 = 0.1;

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
    /// Sizes of the baseline.
    sizes: Sizes,
    sigma: f64,
    /// Whether sigma is known.
    stated: bool,
    /// Pressure on each cell.
    p: Vec<f64>,
    /// Contact of each cell.
    labels: Vec<usize>,
    /// μ of each contact.
    mu: Vec<[f64; 2]>,
}

/// What a fit says of one frame.
pub(super) struct Fitted {
    /// Contacts and forces.
    pub estimate: Estimate,
    /// The reading that the others explain least: taxel, and its distance in standard deviations.
    pub worst: Option<(usize, f64)>,
    /// The stress on each taxel that is not used.
    pub predicted: Vec<(usize, f64)>,
    /// Σ b·area that no baseline explains, of the readings that count.
    pub load: f64,
    /// Log evidence of the readings that count, without the constant.
    pub evidence: f64,
    /// Whether a pressure has more coefficients than the readings can tell.
    pub wide: bool,
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
        let taxels = scene.window(&p, sigma);
        let of = |is: &dyn Fn(usize) -> bool| (0..taxels.len()).filter(|k| is(taxels[*k])).collect();
        let clipped = of(&|t| used[t] && scene.unipolar && b[t] <= 0.0);
        let missing = of(&|t| !used[t]);
        let readings = Readings { y: vec![0.0; taxels.len()], precision: vec![0.0; taxels.len()] };
        let (labels, mu, sizes) = (vec![0; p.len()], vec![[0.0; 2]], Sizes::of_plane(first));
        let (stated, offsets) = (stated.is_some(), scene.cells.offsets(&taxels));
        Fit { scene, b, used, taxels, offsets, clipped, missing, readings, sizes, sigma, stated, p, labels, mu }
    }

    /// Whether a reading counts: it is neither clipped nor missing.
    fn counts(&self, k: usize) -> bool {
        self.clipped.binary_search(&k).is_err() && self.missing.binary_search(&k).is_err()
    }

    /// The estimate; `None` if the model is not representable.
    pub fn run(mut self) -> Option<Fitted> {
        let (mut round, mut joined) = (0, false);
        let (regions, top) = loop {
            round += 1;
            if round <= SEGMENTED && !joined {
                self.segment();
            }
            if self.mu.is_empty() {
                return None;
            }
            let before = self.mu.clone();
            let mut regions = self.regions();
            let top = self.ascend(&mut regions.design, STEPS)?;
            self.mu.clone_from(&top.mu);
            self.p = regions.pressure(&top.posterior.w, self.p.len());
            let moved = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
            let most = before.iter().zip(&self.mu).map(moved).fold(0.0, f64::max);
            let settled = before.len() == self.mu.len() && most <= self.settled(&top);
            // Where the shear stays open, the regions are all that the rounds have to find.
            if round == ROUNDS || (regions.wide && round >= SEGMENTED) {
                break (regions, top);
            }
            if round >= LEAST_ROUNDS {
                match self.similar_pair(&top) {
                    Some((a, b)) => {
                        self.join(a, b);
                        joined = true;
                    }
                    None if settled => break (regions, top),
                    None => (),
                }
            }
        };
        let unknowns = 2 * top.mu.len();
        let searched = self.scene.prior.mu_max > 0.0;
        let covariance = match searched {
            // What was cut would have left the shear open.
            true if regions.wide => self.scene.prior.unresolved(unknowns),
            true => self.scene.prior.covariance(&top.slope)? * Scale(ENVELOPE_FACTOR * ENVELOPE_FACTOR),
            false => Mat::zeros(unknowns, unknowns),
        };
        let mut found = Found { regions, top, covariance };
        if let Some(adviser) = self.scene.adviser.as_ref().filter(|_| !found.regions.wide) {
            found = self.advised(adviser, found)?;
        }
        self.estimate(&found, round)
    }

    /// Change of μ per round below which the rounds end.
    fn settled(&self, top: &Top) -> f64 {
        let least = SETTLED * self.scene.prior.mu_max;
        let spread = |all: Mat<f64>| (0..all.nrows()).map(|i| all[(i, i)].sqrt()).fold(f64::INFINITY, f64::min);
        self.scene.prior.covariance(&top.slope).map_or(least, |all| least.max(SETTLED_SIGMA * spread(all)))
    }

    /// Divides the loaded cells into contacts; each keeps the μ that its strongest cell had.
    fn segment(&mut self) {
        let loaded = self.scene.envelopes.of(self.p.iter().copied(), self.sigma);
        let p: Vec<f64> = self.p.iter().zip(&loaded).map(|(p, e)| if *e > 0.0 { *p } else { 0.0 }).collect();
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
        let mu_of = |&label: &usize| strongest[label].map_or([0.0; 2], |cell| self.mu[self.labels[cell]]);
        self.mu = kept.iter().map(mu_of).collect();
        let number = |label: &Option<usize>| kept.iter().position(|kept| Some(*kept) == *label).unwrap_or(0);
        self.labels = segments.labels.iter().map(number).collect();
    }

    /// Two contacts that touch and whose μ the stress does not tell apart: parts of one, such as a ring.
    fn similar_pair(&self, top: &Top) -> Option<(usize, usize)> {
        if self.mu.len() < 2 || self.scene.prior.mu_max == 0.0 {
            return None;
        }
        let covariance = self.scene.prior.covariance(&top.slope)?;
        let distance = |&(a, b): &(usize, usize)| {
            let spread = |i: usize, j: usize| {
                let of = |k: usize, l: usize| covariance[(2 * k + i, 2 * l + j)];
                of(a, a) + of(b, b) - of(a, b) - of(b, a)
            };
            let off = [self.mu[a][0] - self.mu[b][0], self.mu[a][1] - self.mu[b][1]];
            let [xx, xy, yy] = [spread(0, 0), spread(0, 1), spread(1, 1)];
            let determinant = xx * yy - xy * xy;
            (yy * off[0] * off[0] - 2.0 * xy * off[0] * off[1] + xx * off[1] * off[1]) / determinant
        };
        let grid = &self.scene.cells.grid;
        let loaded = |cell: &usize| self.p[*cell] > 0.0;
        let pairs = (0..self.p.len()).filter(loaded).flat_map(|cell| {
            let other = neighbours(grid, cell).filter(loaded);
            other.map(move |other| (self.labels[cell], self.labels[other]))
        });
        let near = pairs.filter(|(a, b)| a < b).filter(|pair| distance(pair) <= SAME_MU);
        near.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Makes contact `b` a part of contact `a`.
    fn join(&mut self, a: usize, b: usize) {
        for label in &mut self.labels {
            *label = if *label == b { a } else { *label - usize::from(*label > b) };
        }
        self.mu.remove(b);
    }

    /// Standard deviation of a taxel.
    fn noise(&self, taxel: usize) -> f64 {
        (self.sigma * self.scene.noise_shares[taxel]).max(FLOOR)
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

    /// The largest posterior of μ under the present envelopes within `steps` steps, with the noise, the baseline and the
    /// clipped readings that go with it; without a step the posterior at the present μ.
    fn ascend(&mut self, design: &mut Design, steps: usize) -> Option<Top> {
        let prior = self.scene.prior;
        self.weigh();
        let mut top = ascend(design, &self.readings, &self.mu, prior, steps)?;
        for _ in 0..PASSES {
            let stress = top.posterior.stress(&self.readings);
            if !self.stated {
                let ratio = noise::ratio(&self.readings, |k| self.counts(k), &stress);
                self.sigma = (self.sigma * ratio).clamp(FLOOR, 1.0);
                self.weigh();
            }
            let first = design.of_baseline().start;
            let of =
                |term: usize| [top.posterior.w[first + term], top.posterior.covariance()[(first + term, first + term)]];
            self.sizes = self.sizes.found(std::array::from_fn(of));
            self.baseline(design);
            for &k in &self.clipped {
                let noise = self.noise(self.taxels[k]);
                clipped::update(&mut self.readings, k, stress[k], noise);
            }
            top = ascend(design, &self.readings, &top.mu, prior, steps.min(PASS_STEPS))?;
        }
        Some(top)
    }

    /// Centre of pressure of the cells of a contact in mm from the array's centre.
    fn centre_mm(&self, own: &[usize]) -> [f64; 2] {
        let pressed: f64 = own.iter().map(|&cell| self.p[cell].max(0.0)).sum();
        let mut moment = [0.0; 2];
        for &cell in own {
            let place = self.scene.cells.position_mm(cell);
            (0..2).for_each(|axis| moment[axis] += self.p[cell].max(0.0) / pressed * place[axis]);
        }
        moment
    }

    /// The result of the last round.
    fn estimate(&self, found: &Found, rounds: usize) -> Option<Fitted> {
        let Found { regions, top, covariance } = found;
        let cells = &self.scene.cells;
        let forces = forces((&regions.design, &self.readings), top, covariance, &regions.loads());
        let mut on_taxels = Forces::zeros(self.b.len());
        let mut contacts = Vec::with_capacity(forces.len());
        for (k, (own, force)) in regions.cells.iter().zip(forces).enumerate() {
            let pressed: f64 = own.iter().map(|&cell| self.p[cell].max(0.0)).sum();
            if pressed == 0.0 {
                return None;
            }
            for &cell in own {
                // Contacts do not pull: the pressures below zero go to the others.
                let share = self.p[cell].max(0.0) / pressed;
                let taxel = cells.taxel_of(cell);
                let [fx, fy, fz] = force.force_N.map(|force| share * force);
                on_taxels.fx[taxel] += fx;
                on_taxels.fy[taxel] += fy;
                on_taxels.fz[taxel] += fz;
            }
            let contact = ContactEstimate {
                centre_mm: self.centre_mm(own),
                mu: top.mu[k],
                force_N: force.force_N,
                sigma_N: force.sigma_N,
                mu_covariance: force.mu_covariance,
            };
            contacts.push(contact);
        }
        let known = self.taxels.len() - self.clipped.len() - self.missing.len();
        let misfit_probability = self.stated.then(|| chi_square_tail(top.posterior.square, known as f64));
        let (noise_MPa, rank) = (self.sigma, regions.design.rank());
        let estimate = Estimate {
            contacts,
            forces_N: on_taxels,
            noise_MPa,
            misfit_probability,
            rounds,
            rank,
            ..Estimate::default()
        };
        Some(self.fitted(estimate, regions, top))
    }

    /// The estimate with what it leaves of the readings.
    fn fitted(&self, estimate: Estimate, regions: &Regions, top: &Top) -> Fitted {
        let design = &regions.design;
        let stress = top.posterior.stress(&self.readings);
        let sensor = &self.scene.cells.sensor;
        let residual = Residual::new(&self.readings, |k| self.counts(k), &stress);
        let least = if self.stated { 1.0 } else { FLOOR / self.sigma };
        let baseline = top.posterior.stress_of(|i| design.of_baseline().contains(&i));
        let counted: Vec<usize> = (0..self.taxels.len()).filter(|&k| self.counts(k)).collect();
        let load = counted.iter().map(|&k| self.b[self.taxels[k]] - baseline[k]).sum::<f64>();
        let square = counted.iter().map(|&k| baseline[k].powi(2)).sum::<f64>() / (counted.len().max(1) as f64);
        let worst = residual.worst(least).map(|(k, size)| (self.taxels[k], size));
        Fitted {
            worst,
            predicted: self.missing.iter().map(|&k| (self.taxels[k], stress[k][0])).collect(),
            evidence: top.posterior.value,
            wide: regions.wide,
            load: load * sensor.pitch_x_mm * sensor.pitch_y_mm,
            estimate: Estimate {
                baseline_MPa: square.sqrt(),
                outlier: worst.map(|(_, size)| size),
                residual_correlation: Some(residual.correlation(sensor, &self.taxels)),
                ..estimate
            },
        }
    }
}

/// Probability that χ² with `freedom` degrees of freedom exceeds `value` (Wilson and Hilferty 1931).
fn chi_square_tail(value: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    let z = ((value / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(z * FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::chi_square_tail;

    /// Tabulated quantiles of χ².
    #[test]
    fn tails_by_table() {
        for (freedom, value, tail) in [(10.0, 18.307, 0.05), (100.0, 135.807, 0.01), (100.0, 99.334, 0.5)] {
            assert!((chi_square_tail(value, freedom) / tail - 1.0).abs() < 0.02, "{freedom} {value}");
        }
    }
}
