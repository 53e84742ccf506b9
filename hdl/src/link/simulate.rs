//! A board's pins, whatever simulates it.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::generate::board_top;
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

/// What every board's top does in a simulation and in generation, whatever its engine.
pub trait Board: Block + Send {
    /// Puts the line from the host and the clock on the pins.
    fn drive(&mut self, uart_rx: bool, clock: bool);
    /// The output pins.
    fn outputs(&self) -> BoardOutputs;
    /// The Verilog.
    fn verilog(&self) -> String;
}

struct Simulator(Box<dyn Board>);

/// The board of `model` in rust-hdl's simulation, clocked directly.
///
/// # Errors
/// As [`super::generate_board`].
pub fn board_simulator(model: &Model) -> Result<Box<dyn BoardDevice>, HdlError> {
    Ok(Box::new(Simulator(board_top(model)?)))
}

impl Simulator {
    fn settle(&mut self, uart_rx: bool, clock: bool) {
        self.0.drive(uart_rx, clock);
        let settled = (0..SETTLE_ROUNDS).any(|_| {
            self.0.update_all();
            !self.0.has_changed()
        });
        assert!(settled, "the board has a combinational loop: a defect of this crate");
    }
}

impl BoardDevice for Simulator {
    fn cycle(&mut self, uart_rx: bool) -> BoardOutputs {
        self.settle(uart_rx, false);
        let outputs = self.0.outputs();
        self.settle(uart_rx, true);
        outputs
    }
}
