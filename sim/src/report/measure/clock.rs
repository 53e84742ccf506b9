//! The clock that turns cycles into time, and where it comes from.

use dermis_golden::board::Board;
use dermis_golden::scene::Scene;

use crate::bitstream::baseline::Baselines;

/// A clock with its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Frequency.
    pub MHz: f64,
    /// Whether place and route has shown that the scene reaches it, or the board's file alone says so.
    pub origin: &'static str,
}

/// The engine's clock for a scene on a board: the one place that decides.
///
/// A bitstream runs at the board's clock, however much faster its design could be; a scene that has missed it when it was
/// last placed runs at what it has reached.
pub fn clock(board: &Board, scene: &Scene) -> Clock {
    match Baselines::committed().get(&board.name, &scene.name) {
        Some(placed) => Clock { MHz: board.clock_MHz.min(placed.best_MHz), origin: "place and route" },
        None => Clock { MHz: board.clock_MHz, origin: "design clock" },
    }
}

impl Clock {
    /// Time of so many cycles in s.
    pub fn seconds(&self, cycles: u64) -> f64 {
        cycles as f64 / (1e6 * self.MHz)
    }
}
