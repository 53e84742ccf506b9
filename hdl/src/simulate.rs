//! rust-hdl's own simulation of the engine as a [`Device`].

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::device::{Device, Inputs, Outputs, Tap};
use crate::engine::Engine;
use crate::generate::{engine, HdlError};
use crate::taps::{sample, taps};
use crate::wire::Word;

/// Update rounds after which signals that still change are taken for a combinational loop.
const SETTLE_ROUNDS: usize = 200;

struct Simulator {
    engine: Engine,
    taps: Vec<Tap>,
}

/// The engine of `model` in rust-hdl's simulation, clocked directly.
///
/// # Errors
/// As [`crate::generate`].
pub fn simulator(model: &Model) -> Result<Box<dyn Device>, HdlError> {
    Ok(Box::new(Simulator { engine: engine(model)?, taps: taps(model) }))
}

impl Simulator {
    fn settle(&mut self, clock: bool) {
        self.engine.clk.next = clock.into();
        let settled = simulate(&mut self.engine, SETTLE_ROUNDS);
        assert!(settled, "the engine has a combinational loop: a defect of this crate");
    }
}

impl Device for Simulator {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let engine = &mut self.engine;
        engine.rst.next = inputs.rst;
        engine.s_axis_tvalid.next = inputs.s_valid;
        engine.s_axis_tdata.next = Word::of_fields(&[i64::from(inputs.s_data)], engine.s_axis_tdata.width());
        engine.s_axis_tlast.next = inputs.s_last;
        engine.m_axis_tready.next = inputs.m_ready;
        self.settle(false);
        let engine = &self.engine;
        let data = engine.m_axis_tdata.val();
        let outputs = Outputs {
            s_ready: engine.s_axis_tready.val(),
            m_valid: engine.m_axis_tvalid.val(),
            m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
            m_last: engine.m_axis_tlast.val(),
            taps: sample(engine, &self.taps),
        };
        self.settle(true);
        outputs
    }
}
