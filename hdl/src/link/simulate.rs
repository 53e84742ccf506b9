//! rust-hdl's own simulation of a board as a [`BoardDevice`].

use dermis_golden::fixed::Model;

use super::board::{Board, BoardDevice, BoardOutputs};
use super::board_top::board_top;
use crate::error::HdlError;
use crate::simulate::settles;

struct Simulator(Box<dyn Board>);

/// The board of `model` in rust-hdl's simulation.
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
