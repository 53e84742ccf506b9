//! A board's pins, whatever simulates it.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::generate::board_top;
use super::BoardTop;
use crate::generate::HdlError;
use crate::simulate::SETTLE_ROUNDS;

/// A board's output pins in one clock cycle, sampled just before the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardOutputs {
    /// To the host.
    pub uart_tx: bool,
    /// Blinks.
    pub alive: bool,
    /// There is something to do.
    pub busy: bool,
    /// A packet was dropped.
    pub error: bool,
}

/// Something that computes one clock cycle of a board.
pub trait BoardDevice: Send {
    /// Applies the line from the host, samples the outputs as they stand before the rising edge, then clocks.
    fn cycle(&mut self, uart_rx: bool) -> BoardOutputs;
}

struct Simulator(BoardTop);

/// The board of `model` in rust-hdl's simulation, clocked directly.
///
/// # Errors
/// As [`super::generate_board`].
pub fn board_simulator(model: &Model) -> Result<Box<dyn BoardDevice>, HdlError> {
    Ok(Box::new(Simulator(board_top(model)?)))
}

impl Simulator {
    fn settle(&mut self, clock: bool) {
        self.0.clk.next = clock.into();
        let settled = simulate(&mut self.0, SETTLE_ROUNDS);
        assert!(settled, "the board has a combinational loop: a defect of this crate");
    }
}

impl BoardDevice for Simulator {
    fn cycle(&mut self, uart_rx: bool) -> BoardOutputs {
        self.0.uart_rx.next = uart_rx;
        self.settle(false);
        let top = &self.0;
        let outputs = BoardOutputs {
            uart_tx: top.uart_tx.val(),
            alive: top.alive.val(),
            busy: top.busy.val(),
            error: top.error.val(),
        };
        self.settle(true);
        outputs
    }
}
