//! rust-hdl's own simulation of the engine as a [`Device`].

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::device::{Device, Inputs, Outputs};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::primitives::{CALIBRATION_FILE, COLUMN_FILE};
use crate::stage_list::Stage;
use crate::taps::{words, Observed};
use crate::wire::Word;
use crate::{engine, serial};

/// Update rounds after which signals that still change count as a combinational loop.
const SETTLE_ROUNDS: usize = 200;

/// Updates a block until no signal changes; `false` if it does not settle.
pub(crate) fn settles(block: &mut (impl Block + ?Sized)) -> bool {
    (0..SETTLE_ROUNDS).any(|_| {
        block.update_all();
        !block.has_changed()
    })
}

/// Operations on an engine that simulation and generation need, the same for all engines.
pub(crate) trait Design: Block + Observed {
    /// Applies `inputs` and the clock level to the pins.
    fn drive(&mut self, inputs: &Inputs, clock: bool);
    /// Samples the output pins; no taps.
    fn pins(&self) -> Outputs;
    /// Memory files read by the Verilog: name and text.
    fn memory_files(&self) -> Vec<(&'static str, String)>;
}

macro_rules! design {
    ($engine:ty, $files:expr) => {
        impl Design for $engine {
            fn drive(&mut self, inputs: &Inputs, clock: bool) {
                self.rst.next = inputs.rst;
                self.s_axis_tvalid.next = inputs.s_valid;
                self.s_axis_tdata.next = Word::of_fields(&[i64::from(inputs.s_data)], self.s_axis_tdata.width());
                self.s_axis_tlast.next = inputs.s_last;
                self.m_axis_tready.next = inputs.m_ready;
                self.clk.next = clock.into();
            }

            fn pins(&self) -> Outputs {
                let data = self.m_axis_tdata.val();
                Outputs {
                    s_ready: self.s_axis_tready.val(),
                    m_valid: self.m_axis_tvalid.val(),
                    m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
                    m_last: self.m_axis_tlast.val(),
                    taps: Vec::new(),
                }
            }

            fn memory_files(&self) -> Vec<(&'static str, String)> {
                $files(self)
            }
        }
    };
}

design!(engine::Engine, |engine: &engine::Engine| {
    let columns = engine.pass.pass_program.column_file().map(|text| (COLUMN_FILE, text));
    let table = engine.prepare.calibrate.table_file().map(|text| (CALIBRATION_FILE, text));
    engine.pass.lanes.memory_files().into_iter().chain(columns).chain(table).collect()
});

design!(serial::Engine, |engine: &serial::Engine| engine.pass.memory_files());

/// The stages of an engine in the order of the data flow.
pub(crate) fn stages(engine: EngineKind) -> &'static [Stage] {
    match engine {
        EngineKind::Parallel => engine::Engine::STAGES,
        EngineKind::Serial => serial::Engine::STAGES,
    }
}

/// The engine of `model`, after rust-hdl's checks.
pub(crate) fn design(model: &Model) -> Result<Box<dyn Design>, HdlError> {
    let design: Box<dyn Design> = match model.board.engine {
        EngineKind::Serial => checked(serial::Engine::new(model))?,
        EngineKind::Parallel => checked(engine::Engine::new(model))?,
    };
    Ok(design)
}

fn checked<E: Design + 'static>(engine: E) -> Result<Box<dyn Design>, HdlError> {
    Hierarchy::of(&engine).check()?;
    check_all(&engine).map_err(|error| HdlError::Check(format!("{error:?}")))?;
    Ok(Box::new(engine))
}

struct Simulator(Box<dyn Design>);

/// The engine of `model` in rust-hdl's simulation; each cycle settles the signals with the clock low, then high.
///
/// # Errors
/// As [`crate::generate`].
pub fn simulator(model: &Model) -> Result<Box<dyn Device>, HdlError> {
    Ok(Box::new(Simulator(design(model)?)))
}

/// One clock cycle: the signals settle with the clock low, `sample` sees them before the rising edge. Returns the output
/// pins, no taps.
pub(crate) fn cycle(engine: &mut dyn Design, inputs: &Inputs, sample: impl FnOnce(&dyn Design)) -> Outputs {
    let settle = |engine: &mut dyn Design, clock: bool| {
        engine.drive(inputs, clock);
        assert!(settles(engine), "the engine has a combinational loop: a defect of this crate");
    };
    settle(engine, false);
    let outputs = engine.pins();
    sample(engine);
    settle(engine, true);
    outputs
}

impl Device for Simulator {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let mut taps = Vec::new();
        let outputs = cycle(&mut *self.0, inputs, |engine| taps = words(engine));
        Outputs { taps, ..outputs }
    }
}
