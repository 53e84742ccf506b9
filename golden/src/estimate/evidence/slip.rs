//! Slip: how far the shear of a contact is spread beyond its pressure.
//!
//! In full slip the shear is μ p. A contact that is held is in partial slip: its middle sticks and the shear there is less. By
//! Cattaneo, Mindlin and Jäger the shear at a share ρ of the friction limit is
//!
//! ```text
//! μ R p        R p = (p − c³ S p)/ρ        c³ = 1 − ρ        S moves every force to c times its distance from the centre
//! ```
//!
//! Read as full slip, it is taken for up to 1.2 times the shear. R p moves from p to R p at ρ = [`LIMIT`] nearly along a line, so
//! that one number per contact, its spread θ, describes them all:
//!
//! ```text
//! shear = μ (p + θ D p)        D = R − 1 at LIMIT: it carries no force        θ = 0 in full slip, 1 at LIMIT, LARGEST at ρ = 0.1
//! ```
//!
//! Before the stress is seen, θ is 0 with the probability [`FULL`] and else anything up to [`LARGEST`]. The evidence is nearly normal in
//! θ, with a slope and an information as in μ; μ is taken at the mean of θ, and the variance of θ adds to that of μ. So a frame
//! whose noise hides the spread has a μ in the middle and a standard deviation that says so.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: forces on the cells of a contact | cells × r | N |
//! | out: D of them | cells × r | N |
//! | in: slope and information in θ | – | – |
//! | out: mean and variance of θ | 2 | – |

use super::cells::Cells;
use faer::Mat;

/// ρ of the spread 1: shear over the friction limit.
const LIMIT: f64 = 0.4;
/// Largest θ: the second moment of the shear at ρ = 0.1, of Hertz's pressure, over that at [`LIMIT`].
const LARGEST: f64 = 1.41;
/// Probability of full slip.
const FULL: f64 = 0.5;
/// Values of θ over which its posterior is summed.
const VALUES: usize = 64;

/// What is known of θ before the stress is seen.
#[derive(Clone, Copy)]
pub(super) struct SpreadPrior {
    /// Largest θ; 0 takes every contact for one in full slip.
    largest: f64,
}

/// The log evidence about one θ, to second order.
#[derive(Clone, Copy)]
pub(super) struct Quadratic {
    /// The θ.
    pub at: f64,
    /// Slope there.
    pub gradient: f64,
    /// Information.
    pub information: f64,
}

impl SpreadPrior {
    /// Any slip.
    pub const ANY: SpreadPrior = SpreadPrior { largest: LARGEST };
    /// Full slip alone: what the estimator must not take for granted.
    #[cfg(test)]
    pub const FULL_SLIP: SpreadPrior = SpreadPrior { largest: 0.0 };

    /// Mean of θ before the stress is seen.
    pub fn mean(self) -> f64 {
        (1.0 - FULL) * self.largest / 2.0
    }

    /// Mean and variance of θ with what the stress says of it.
    pub fn moments(self, stress: Quadratic) -> [f64; 2] {
        let log = |theta: f64| {
            let away = theta - stress.at;
            away * (stress.gradient - 0.5 * stress.information * away)
        };
        let step = self.largest / VALUES as f64;
        let even = (0..VALUES).map(|k| (step * (k as f64 + 0.5), (1.0 - FULL) / VALUES as f64));
        let all: Vec<(f64, f64)> = std::iter::once((0.0, FULL)).chain(even).collect();
        let most = all.iter().map(|(theta, _)| log(*theta)).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = all.iter().map(|(theta, prior)| prior * (log(*theta) - most).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let moment =
            |of: &dyn Fn(f64) -> f64| all.iter().zip(&weights).map(|((t, _), w)| w * of(*t)).sum::<f64>() / sum;
        let mean = moment(&|theta| theta);
        [mean, moment(&|theta| (theta - mean).powi(2))]
    }
}

/// Where the force of a cell goes: cells and shares, which keep its sum, place and spread.
fn moved(cells: &Cells, numbers: &[Option<usize>], from: usize, to_mm: [f64; 2]) -> Vec<(usize, f64)> {
    let grid = &cells.grid;
    let along = |to: f64, pitch: f64, count: usize| {
        let place = to / pitch + 0.5 * (count as f64 - 1.0);
        let near = place.round().clamp(0.0, count as f64 - 1.0);
        let off = place - near;
        (near as usize, [0.5 * off * (off - 1.0), 1.0 - off * off, 0.5 * off * (off + 1.0)])
    };
    let (col, of_cols) = along(to_mm[0], grid.pitch_x_mm, grid.cols);
    let (row, of_rows) = along(to_mm[1], grid.pitch_y_mm, grid.rows);
    let number = |row: usize, col: usize| numbers.get(row * grid.cols + col).copied().flatten();
    let home = number(row, col).unwrap_or(from);
    let mut all = Vec::with_capacity(9);
    for (down, of_row) in of_rows.iter().enumerate() {
        for (right, of_col) in of_cols.iter().enumerate() {
            // Lines 0 and `count` + 1 are beyond the array.
            let inside = (1..=grid.rows).contains(&(row + down)) && (1..=grid.cols).contains(&(col + right));
            let cell = if inside { number(row + down - 1, col + right - 1) } else { None };
            all.push((cell.unwrap_or(home), of_row * of_col));
        }
    }
    all
}

/// D of the forces `factor` on the cells `own` of a contact about `centre_mm`.
pub(super) fn spread(cells: &Cells, own: &[usize], centre_mm: [f64; 2], factor: &Mat<f64>) -> Mat<f64> {
    let (stick, mut numbers) = (1.0 - LIMIT, vec![None; cells.grid.taxels()]);
    own.iter().enumerate().for_each(|(number, &cell)| numbers[cell] = Some(number));
    let targets: Vec<Vec<(usize, f64)>> = own
        .iter()
        .enumerate()
        .map(|(from, &cell)| {
            let at = cells.position_mm(cell);
            let to = [0, 1].map(|axis| centre_mm[axis] + stick.cbrt() * (at[axis] - centre_mm[axis]));
            moved(cells, &numbers, from, to)
        })
        .collect();
    let mut all = Mat::zeros(own.len(), factor.ncols());
    for column in 0..factor.ncols() {
        let (forces, into) = (factor.col_as_slice(column), all.col_as_slice_mut(column));
        for (from, force) in forces.iter().enumerate() {
            let excess = stick / LIMIT * force;
            into[from] += excess;
            targets[from].iter().for_each(|(to, share)| into[*to] -= excess * share);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::scene::{Medium, Scene};

    /// D carries no force, and moves the second moment of a Hertzian pressure as partial slip does.
    #[test]
    fn the_spread_of_hertz() {
        let cells = Cells::new(&Scene::builtin("sensor-1").unwrap().sensor, Medium::HalfSpace, 1.0);
        let centre = [0.4, -0.3];
        let square = |cell: usize| {
            let [x, y] = cells.position_mm(cell);
            (x - centre[0]).powi(2) + (y - centre[1]).powi(2)
        };
        let radius = 5.0f64;
        let own: Vec<usize> = (0..cells.grid.taxels()).filter(|&cell| square(cell) < radius * radius).collect();
        let p: Vec<f64> = own.iter().map(|&cell| (1.0 - square(cell) / radius.powi(2)).sqrt()).collect();
        let load: f64 = p.iter().sum();
        let spread = spread(&cells, &own, centre, &Mat::from_fn(own.len(), 1, |k, _| p[k] / load));
        let moment =
            |of: &dyn Fn(usize) -> f64| own.iter().zip(spread.col_as_slice(0)).map(|(&c, d)| d * of(c)).sum::<f64>();
        let grown = 0.4 * radius.powi(2) * ((1.0 - (1.0 - LIMIT).powf(5.0 / 3.0)) / LIMIT - 1.0);
        assert!(moment(&|_| 1.0).abs() < 1e-12);
        let found = moment(&square);
        assert!((found / grown - 1.0).abs() < 0.03, "{found} {grown}");
    }

    /// Without information the moments are those of the prior; much of it leaves its own.
    #[test]
    fn moments_of_the_posterior() {
        let of = |at: f64, gradient: f64, information: f64| {
            SpreadPrior::ANY.moments(Quadratic { at, gradient, information })
        };
        let unknown = SpreadPrior::ANY.mean();
        let [mean, variance] = of(0.3, 0.0, 0.0);
        let wanted =
            FULL * unknown.powi(2) + (1.0 - FULL) * (LARGEST.powi(2) / 12.0 + (LARGEST / 2.0 - unknown).powi(2));
        assert!((mean - unknown).abs() < 1e-12 && (variance / wanted - 1.0).abs() < 1e-3);
        // One at 0.8 with a deviation of 0.05.
        let [mean, variance] = of(0.5, 120.0, 400.0);
        assert!((mean - 0.8).abs() < 0.01 && (variance.sqrt() - 0.05).abs() < 0.005);
        // Full slip, and beyond either end.
        assert!(of(0.0, -10.0, 100.0)[0] < 0.03 && of(0.0, -1e6, 1e4)[0] < 1e-6 && of(0.0, 1e6, 1e4)[0] > 1.39);
    }
}
