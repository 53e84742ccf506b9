//! Search: the μ with the best score, on a grid that is refined seven times.
//!
//! Grid: μ = (i, j)·mu_max/3 with i, j in −3 … 3 and i² + j² ≤ 9, 29 candidates, row by row with μ2 the row, both
//! rising. Then seven times: halve the step and try the eight neighbours of the best candidate in the same order. Only
//! a larger score replaces the best candidate, so the first of equal candidates wins.
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: p(μ) | polynomial | N | – |
//! | out: position | 2 | mu_max/384 | x² + y² ≤ 384² |
//! | out: μ | 2 | – | |μ| ≤ mu_max |
//!
//! Positions are integers, so that every model has the same disc. At most 29 + 7·8 = 85 evaluations.

use super::pass::Polynomial;

/// Halvings after the grid.
pub const HALVINGS: u32 = 7;
/// Grid steps from the centre to mu_max.
pub const GRID: i32 = 3;
/// Position of mu_max: the grid's radius in finest steps.
pub const RADIUS: i32 = GRID << HALVINGS;

/// The best candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchResult {
    /// Ratio of shear to normal force, [x, y].
    pub mu: [f64; 2],
    /// μ in units of mu_max/[`RADIUS`].
    pub position: [i32; 2],
    /// Its score, in the units of the objective.
    pub objective: f64,
    /// Number of candidates evaluated.
    pub evaluations: usize,
}

/// The score of the normal forces of a candidate in N, `None` unless it is admissible.
pub type Score<'a> = &'a dyn Fn(&[f64]) -> Option<f64>;

/// Finds the best μ with |μ| ≤ `mu_max`; `None` if no candidate of the grid has a score, that is Σp ≤ 0 for all.
pub fn search(family: &Polynomial, mu_max: f64, score: Score) -> Option<SearchResult> {
    let mut grid =
        GridSearch { family, mu_max, score, p: vec![0.0; family.coefficients[0].len()], evaluations: 0, best: None };
    if mu_max == 0.0 {
        // Every candidate is the centre.
        grid.try_position([0, 0]);
        return grid.found();
    }
    let step = RADIUS / GRID;
    for j in -GRID..=GRID {
        for i in -GRID..=GRID {
            grid.try_position([i * step, j * step]);
        }
    }
    for level in 1..=HALVINGS {
        let (centre, _) = grid.best?;
        let step = step >> level;
        for j in -1..=1 {
            for i in -1..=1 {
                if (i, j) != (0, 0) {
                    grid.try_position([centre[0] + i * step, centre[1] + j * step]);
                }
            }
        }
    }
    grid.found()
}

/// State of a search.
struct GridSearch<'a> {
    family: &'a Polynomial,
    mu_max: f64,
    score: Score<'a>,
    /// Normal forces of the current candidate.
    p: Vec<f64>,
    evaluations: usize,
    best: Option<([i32; 2], f64)>,
}

impl GridSearch<'_> {
    fn mu(&self, position: [i32; 2]) -> [f64; 2] {
        position.map(|units| f64::from(units) * self.mu_max / f64::from(RADIUS))
    }

    /// Scores a candidate and keeps it if it is the best; outside the disc it is not evaluated.
    fn try_position(&mut self, position: [i32; 2]) {
        let [x, y] = position;
        if x * x + y * y > RADIUS * RADIUS {
            return;
        }
        self.evaluations += 1;
        self.family.eval_into(self.mu(position), &mut self.p);
        let score = (self.score)(&self.p).filter(|score| score.is_finite());
        if let Some(score) = score
            && self.best.is_none_or(|(_, best)| score > best)
        {
            self.best = Some((position, score));
        }
    }

    fn found(&self) -> Option<SearchResult> {
        self.best.map(|(position, objective)| SearchResult {
            mu: self.mu(position),
            position,
            objective,
            evaluations: self.evaluations,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// p(μ) = (1, μ1, μ2): the objective sees μ itself.
    fn mu_itself() -> Polynomial {
        let coefficients = vec![vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0]];
        Polynomial { degree: 1, coefficients }
    }

    fn run(mu_max: f64, score: impl Fn(f64, f64) -> Option<f64>) -> Option<SearchResult> {
        search(&mu_itself(), mu_max, &|p| score(p[1], p[2]))
    }

    #[test]
    fn finds_the_top_of_a_hill_to_half_a_finest_step() {
        let hill = |x: f64, y: f64| Some(-(x - 0.137).powi(2) - (y + 0.251).powi(2));
        let found = run(0.6, hill).unwrap();
        let half = 0.5 * 0.6 / f64::from(RADIUS);
        assert!((found.mu[0] - 0.137).abs() <= half * (1.0 + 1e-9));
        assert!((found.mu[1] + 0.251).abs() <= half * (1.0 + 1e-9));
        assert_eq!(found.evaluations, 85);
    }

    #[test]
    fn first_found_wins_ties() {
        let flat = run(0.6, |_, _| Some(1.0)).unwrap();
        // The first candidate on the disc, row by row, is (0, −3).
        assert_eq!(flat.position, [0, -RADIUS]);
        assert_eq!(flat.mu, [0.0, -0.6]);
    }

    #[test]
    fn never_leaves_the_disc() {
        let found = run(0.5, |x, y| Some(x + y)).unwrap();
        let [x, y] = found.position;
        assert!(x * x + y * y <= RADIUS * RADIUS && found.mu[0].hypot(found.mu[1]) <= 0.5);
        assert!(found.evaluations < 85);
    }

    #[test]
    fn none_when_nothing_presses() {
        assert_eq!(run(0.6, |_, _| None), None);
        assert_eq!(run(0.6, |_, _| Some(f64::NAN)), None);
    }

    #[test]
    fn no_shear_asked_for() {
        let found = run(0.0, |_, _| Some(2.0)).unwrap();
        let expected = SearchResult { mu: [0.0; 2], position: [0; 2], objective: 2.0, evaluations: 1 };
        assert_eq!(found, expected);
    }
}
