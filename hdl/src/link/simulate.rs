//! A board's pins, whatever simulates it.

use dermis_golden::fixed::Model;
#[cfg(doc)]
use dermis_golden::link::LinkKind;
use rust_hdl::prelude::*;

use super::generate::board_top;
use crate::generate::HdlError;
use crate::simulate::settles;

/// A board's output pins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardOutputs {
    /// The link's pin to the host, [`LinkKind::output`].
    pub to_host: bool,
    /// Blinks.
    pub alive: bool,
    /// There is something to do.
    pub busy: bool,
    /// A packet was dropped.
    pub error: bool,
}

/// A board that is computed. Its link's input pins are bits, from bit 0 on in the order of [`LinkKind::inputs`].
pub trait BoardDevice: Send {
    /// Puts the link's inputs and the clock on the pins and lets everything settle; the outputs then. Two clocks that
    /// change in the same call have no order.
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs;

    /// One clock cycle: the inputs, then the rising edge; the outputs as they stand before that.
    fn cycle(&mut self, inputs: u64) -> BoardOutputs {
        let outputs = self.settle(inputs, false);
        self.settle(inputs, true);
        outputs
    }
}

/// What every board's top does in a simulation and in generation, whatever its engine and its link.
pub trait Board: Block + Send {
    /// Puts the link's inputs and the clock on the pins.
    fn drive(&mut self, inputs: u64, clock: bool);
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

impl BoardDevice for Simulator {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        self.0.drive(inputs, clock);
        assert!(settles(&mut *self.0), "the board has a combinational loop: a defect of this crate");
        self.0.outputs()
    }
}
