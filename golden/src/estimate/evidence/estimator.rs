//! The estimator of one scene, prepared for its frames.

use super::ascent::Prior;
use super::cells::Cells;
use super::envelope::Envelopes;
use super::prior::ShapeCorrelation;
use super::screen::Screen;
use super::slip::SpreadPrior;
use crate::estimate::learned::Learned;
use crate::estimate::segment::{Segmenter, WIDTH};
use crate::spec::scene::Scene;

/// ℓ in units of the depth.
const LENGTH_PER_DEPTH: f64 = 2.0 / 3.0;
/// Least and largest ℓ² in units of a taxel's area.
const LENGTH_PER_TAXEL: [f64; 2] = [0.25, 0.5];
/// Number of taxels above which only those near the contacts are read.
const WINDOW_FROM: usize = 400;
/// Distance from the cells of a contact within which taxels are read, in units of the depth.
const WINDOW: f64 = 4.0;

/// Multiplications of a fit after which μ takes no further step, and no further round begins but the first ones and the last, per
/// pair of taxels. Drawn presses take 1000 to 2500 in the median; without a limit noise and even loads take up to 26 times as much.
const WORK: u64 = 3000;
/// The same of fits whose μ a network gives, over that: each has further rounds with all coefficients.
const WITH_NETWORK: u64 = 2;

/// The estimator of one scene.
pub struct Evidence {
    pub(in crate::estimate) cells: Cells,
    pub(in crate::estimate) envelopes: Envelopes,
    pub(in crate::estimate) shape: ShapeCorrelation,
    pub(super) segmenter: Segmenter,
    pub(super) prior: Prior,
    pub(super) spreads: SpreadPrior,
    /// Taxels that are not dead.
    pub(super) alive: Vec<bool>,
    pub(super) unipolar: bool,
    pub(super) gain_spread: f64,
    /// Noise of each taxel over the root mean square of all.
    pub(super) noise_shares: Vec<f64>,
    pub(super) mu_network: Option<MuNetwork>,
    pub(super) screen: Option<Screen>,
    /// See [`WORK`]; for the whole array.
    pub(super) work: u64,
}

/// A network that gives μ, and whether alone.
pub(super) struct MuNetwork {
    /// The network.
    pub network: Learned,
    /// Whether its μ is combined with the evidence's.
    pub combined: bool,
}

impl Evidence {
    /// Prepares the estimator: tables of influence, milliseconds for 20 × 20 taxels.
    pub fn new(scene: &Scene) -> Evidence {
        let sensor = &scene.sensor;
        let area_mm2 = sensor.pitch_x_mm * sensor.pitch_y_mm;
        let [least, most] = LENGTH_PER_TAXEL.map(|share| (share * area_mm2).sqrt());
        let length_mm = (LENGTH_PER_DEPTH * sensor.thickness_mm).clamp(least, most);
        let mut alive = vec![true; sensor.taxels()];
        scene.input.dead.iter().for_each(|[row, col]| alive[row * sensor.cols + col] = false);
        let cells = Cells::new(sensor, scene.medium, length_mm);
        Evidence {
            envelopes: Envelopes::new(&cells, length_mm),
            shape: ShapeCorrelation::new(&cells.grid, length_mm),
            segmenter: Segmenter::new(&cells.grid, WIDTH),
            cells,
            prior: Prior { mu_max: scene.search.mu_max },
            spreads: SpreadPrior::ANY,
            screen: Screen::new(sensor, scene.medium, &alive),
            work: WORK * (alive.len() as u64).pow(2),
            alive,
            unipolar: scene.input.unipolar,
            gain_spread: scene.input.gain_spread,
            noise_shares: vec![1.0; sensor.taxels()],
            mu_network: None,
        }
    }

    /// The same estimator whose fits take what work they want, for measurements of what the limit saves.
    pub fn without_limit(self) -> Evidence {
        Evidence { work: u64::MAX, ..self }
    }

    /// Whether the influence of every cell is a finite number, and presses on the taxel below it.
    pub fn is_representable(&self) -> bool {
        self.cells.is_representable()
    }

    /// The same estimator with noise that differs between taxels: `shares` is the standard deviation of each one over
    /// the root mean square of all, a value per taxel.
    pub fn with_noise_shares(self, shares: Vec<f64>) -> Evidence {
        Evidence { noise_shares: shares, ..self }
    }

    /// The same with the μ of each contact from a trained network; `combined` with the evidence's own or in its place.
    pub fn with_network(self, network: Learned, combined: bool) -> Evidence {
        Evidence { mu_network: Some(MuNetwork { network, combined }), work: WITH_NETWORK * self.work, ..self }
    }

    /// The taxels that are read: all of a small array, those near the pressure `p` (N per cell) of a large one.
    pub(in crate::estimate) fn window(&self, p: &[f64], sigma: f64) -> Vec<usize> {
        let all = (0..self.alive.len()).filter(|&taxel| self.alive[taxel]);
        if self.alive.len() <= WINDOW_FROM {
            return all.collect();
        }
        let sensor = &self.cells.sensor;
        let lines = |pitch: f64| (WINDOW * sensor.thickness_mm / pitch).ceil() as usize + 1;
        let (along_x, along_y) = (lines(sensor.pitch_x_mm), lines(sensor.pitch_y_mm));
        let mut near = vec![false; self.alive.len()];
        let loaded = self.envelopes.of(p.iter().copied(), sigma);
        let mut seen = vec![false; self.alive.len()];
        for cell in (0..loaded.len()).filter(|&cell| loaded[cell] > 0.0) {
            let taxel = self.cells.taxel_of(cell);
            if std::mem::replace(&mut seen[taxel], true) {
                continue;
            }
            let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
            for r in row.saturating_sub(along_y)..(row + along_y + 1).min(sensor.rows) {
                for c in col.saturating_sub(along_x)..(col + along_x + 1).min(sensor.cols) {
                    near[r * sensor.cols + c] = true;
                }
            }
        }
        all.filter(|&taxel| near[taxel]).collect()
    }
}
