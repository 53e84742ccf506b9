//! The clock by which cycles are converted to time, and its origin.

use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;

use dermis_flow::baseline::Baselines;

/// A clock with its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Frequency in MHz.
    pub MHz: f64,
    /// `place and route` if the scene has a committed baseline on the board, else `design clock`.
    pub origin: &'static str,
}

/// The engine's clock for a scene on a board: the board's clock, or, if the scene's committed baseline is slower, the
/// highest clock that it has reached.
pub fn clock(board: &Board, scene: &Scene) -> Clock {
    match Baselines::committed().get(&board.name, &scene.name) {
        Some(placed) => Clock { MHz: board.clock_MHz.min(placed.best_MHz), origin: "place and route" },
        None => Clock { MHz: board.clock_MHz, origin: "design clock" },
    }
}

impl Clock {
    /// Time of `cycles` in s.
    pub fn seconds(&self, cycles: u64) -> f64 {
        cycles as f64 / (1e6 * self.MHz)
    }
}
