//! The objective Π over the disc of μ, the path of the bit-true search, and the margin of the maximum.
//!
//! margin = Π(μ*) − max Π(μ) over |μ − μ*| ≥ mu_max/8, in bits: the advantage of the best μ over clearly different
//! ones. It is small where shear and uneven pressure are hard to distinguish.

use dermis_golden::estimate::float::objective::{Objective, Sparse};
use dermis_golden::estimate::float::pass::Polynomial;
use dermis_golden::fixed::stages::search::COARSE_CENTRES;
use dermis_golden::fixed::words::formats::{HALVINGS, MU_STEPS};

use super::measured::{ContactCount, Measured};

/// Grid points from the centre to mu_max along an axis.
const HALF: i32 = 20;
/// Distance from μ*, as a share of mu_max, from which a μ counts as clearly different.
const APART: f64 = 1.0 / 8.0;

/// Π over the disc of μ for a frame in one subarray.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectiveMap {
    /// Scene name.
    pub scene: String,
    /// Frame name.
    pub frame: String,
    /// Whether the frame has one contact or several.
    pub contacts: ContactCount,
    /// Largest |μ|.
    pub mu_max: f64,
    /// Π on a square grid of 2·`HALF` + 1 points per axis, row by row, μ2 constant in a row; `None` outside the disc
    /// or without compression.
    pub values: Vec<Option<f64>>,
    /// Best μ of the bit-true search after the coarse grid and after each refinement; μ* last.
    pub path: Vec<[f64; 2]>,
    /// The golden model's μ*.
    pub golden: [f64; 2],
    /// Shear over normal load of the true resultant, if known.
    pub truth: Option<[f64; 2]>,
    /// Margin of the golden model's μ*, in bits.
    pub margin: f64,
    /// The golden model's tangential error.
    pub tangential: Option<f64>,
}

/// The objective map of a frame; `None` if the array has several subarrays or was not searched.
pub fn objective_map(measured: &Measured, index: usize) -> Option<ObjectiveMap> {
    let (frame, result) = (&measured.frames[index], &measured.golden[index]);
    let [part] = &result.subarrays[..] else { return None };
    let best = part.objective_value?;
    let mu_max = measured.scene.search.mu_max;
    let family = Polynomial::new(measured.engine.matrices()?, &frame.stress_MPa);
    let objective = Sparse::default();
    let mu = |i: i32, j: i32| [i, j].map(|k| f64::from(k) * mu_max / f64::from(HALF));
    let at = |[x, y]: [f64; 2]| (x.hypot(y) <= mu_max).then(|| objective.score(&family.eval([x, y]))).flatten();
    let grid = || (-HALF..=HALF).flat_map(|j| (-HALF..=HALF).map(move |i| (i, j)));
    let values: Vec<Option<f64>> = grid().map(|(i, j)| at(mu(i, j))).collect();
    let far = |[x, y]: [f64; 2]| (x - part.mu[0]).hypot(y - part.mu[1]) >= APART * mu_max;
    let others = grid().zip(&values).filter(|((i, j), _)| far(mu(*i, *j))).filter_map(|(_, value)| *value);
    let truth = frame.resultant_N.filter(|[_, _, n]| *n > 0.0).map(|[x, y, n]| [x / n, y / n]);
    Some(ObjectiveMap {
        scene: measured.scene.name.clone(),
        frame: frame.id.clone(),
        contacts: ContactCount::of(frame),
        mu_max,
        margin: best - others.fold(f64::NEG_INFINITY, f64::max),
        values,
        path: measured.bit_true.as_ref().map_or(Vec::new(), |bit_true| {
            let stage = bit_true.traces[index].stages.iter().find(|stage| stage.name == "search");
            path(stage.map_or(&[][..], |stage| &stage.words), mu_max)
        }),
        golden: part.mu,
        truth,
        tangential: result.error.and_then(|error| error.tangential),
    })
}

/// The best μ after the coarse grid and after each halving of the step, from the words of stage `search` (x, y, score,
/// taken), whose x and y count in steps of their level.
fn path(words: &[Vec<i64>], mu_max: f64) -> Vec<[f64; 2]> {
    let coarse = COARSE_CENTRES.len();
    let judged = words.iter().skip(coarse - 1).zip(0..=HALVINGS);
    let step = |level: u32| mu_max * 2f64.powi((HALVINGS - level) as i32) / MU_STEPS as f64;
    judged.map(|(word, level)| [word[0], word[1]].map(|k| k as f64 * step(level))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_by_hand() {
        // Seven coarse sweeps that are skipped, the coarse best (1, −1), then (3, −2) at half the step.
        let mut words = vec![vec![0, 0, 0, 0]; 7];
        words.extend([vec![1, -1, 5, 1], vec![3, -2, 4, 1]]);
        let found = path(&words, 0.6);
        let wanted = [[0.2, -0.2], [0.3, -0.2]];
        assert_eq!(found.len(), 2);
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            assert!((found - wanted).abs() < 1e-12);
        }
    }
}
