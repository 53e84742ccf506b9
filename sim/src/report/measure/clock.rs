//! The clock that turns cycles into time, and where it comes from.

use dermis_golden::board::Board;
use dermis_golden::scene::Scene;

/// A clock with its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Frequency.
    pub MHz: f64,
    /// `design clock` of the board's file, until place and route has measured the scene's.
    pub origin: &'static str,
}

/// The engine's clock for a scene on a board: the one place that decides.
pub fn clock(board: &Board, _scene: &Scene) -> Clock {
    Clock { MHz: board.clock_MHz, origin: "design clock" }
}

impl Clock {
    /// Time of so many cycles in s.
    pub fn seconds(&self, cycles: u64) -> f64 {
        cycles as f64 / (1e6 * self.MHz)
    }
}
