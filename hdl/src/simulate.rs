//! rust-hdl's own simulation of the engine as a [`Device`].

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::device::{Device, Inputs, Outputs, Tap};
use crate::generate::HdlError;
use crate::language::Hierarchy;
use crate::primitives::{position_bits, CALIBRATION_FILE, COLUMN_FILE, MEMORY_FILE};
use crate::taps::{taps, SEARCH_FIELD};
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
pub(crate) trait Design: Block {
    /// Applies `inputs` and the clock level to the pins.
    fn drive(&mut self, inputs: &Inputs, clock: bool);
    /// Samples the output pins and the word of each of `taps`.
    fn observe(&self, taps: &[Tap]) -> Outputs;
    /// Memory files read by the Verilog: name and text.
    fn memory_files(&self) -> Vec<(&'static str, String)>;
}

macro_rules! design {
    ($engine:ty, $streams:expr, $files:expr) => {
        impl Design for $engine {
            fn drive(&mut self, inputs: &Inputs, clock: bool) {
                self.rst.next = inputs.rst;
                self.s_axis_tvalid.next = inputs.s_valid;
                self.s_axis_tdata.next = Word::of_fields(&[i64::from(inputs.s_data)], self.s_axis_tdata.width());
                self.s_axis_tlast.next = inputs.s_last;
                self.m_axis_tready.next = inputs.m_ready;
                self.clk.next = clock.into();
            }

            fn observe(&self, taps: &[Tap]) -> Outputs {
                let streams = $streams(self);
                let sample = |tap: &Tap| {
                    let (_, valid, word): &(&str, bool, Word) = streams.iter().find(|(name, ..)| *name == tap.name)?;
                    let field = |field| word.signed(field, tap.field_bits as usize);
                    valid.then(|| (0..tap.fields).map(field).collect())
                };
                let data = self.m_axis_tdata.val();
                Outputs {
                    s_ready: self.s_axis_tready.val(),
                    m_valid: self.m_axis_tvalid.val(),
                    m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
                    m_last: self.m_axis_tlast.val(),
                    taps: taps.iter().map(sample).collect(),
                }
            }

            fn memory_files(&self) -> Vec<(&'static str, String)> {
                $files(self)
            }
        }
    };
}

/// The word of the search's tap.
macro_rules! best {
    ($search:expr) => {
        Word::of_fields(
            &[
                $search.best_x.val().signed(0, position_bits()),
                $search.best_y.val().signed(0, position_bits()),
                $search.score.val().signed(0, $search.score.width()),
                i64::from($search.taken.val()),
            ],
            SEARCH_FIELD as usize,
        )
    };
}

design!(
    engine::Engine,
    |engine: &engine::Engine| [
        ("receive", engine.receive.accept.val(), engine.receive.taken_word.val()),
        ("choose", engine.begin_frame.val(), engine.receive.which.val()),
        ("normalise", engine.fold.normalised_valid.val(), engine.normalise.shifted.val()),
        ("fold", engine.fold.folded_valid.val(), engine.fold.folded.val()),
        ("pass", engine.pass.quad_valid.val(), engine.pass.quad.val()),
        ("rescale", engine.rescale.words_valid.val(), engine.rescale.words.val()),
        ("unfold", engine.unfold.taxels_valid.val(), engine.unfold.taxels.val()),
        ("search", engine.search.compared.val(), best!(engine.search)),
        ("force", engine.search.values_valid.val(), engine.search.values.val()),
    ],
    |engine: &engine::Engine| {
        let columns = engine.pass.pass_program.column_file().map(|text| (COLUMN_FILE, text));
        let table = engine.prepare.calibrate.table_file().map(|text| (CALIBRATION_FILE, text));
        [(MEMORY_FILE, engine.pass.lanes.memory_file())].into_iter().chain(columns).chain(table).collect()
    }
);

design!(
    serial::Engine,
    |engine: &serial::Engine| [
        ("receive", engine.receive.accept.val(), engine.receive.s_axis_tdata.val()),
        ("normalise", engine.pass_sequencer.normalised_valid.val(), engine.rounder.rounded.val()),
        ("fold", engine.butterfly.quad_valid.val() && engine.pass_sequencer.folding.val(), engine.butterfly.quad.val()),
        ("pass", engine.pass.quad_valid.val(), engine.pass.quad.val()),
        ("rescale", engine.pass_sequencer.rescaled_valid.val(), engine.rounder.rounded.val()),
        ("unfold", engine.unfold.taxel_valid.val(), engine.unfold.taxel.val()),
        ("search", engine.search_sequencer.compared.val(), best!(engine.search_sequencer)),
        ("force", engine.search_sequencer.value_valid.val(), engine.coefficient_shift.value.val()),
    ],
    |engine: &serial::Engine| engine.pass.memory_files()
);

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

struct Simulator {
    engine: Box<dyn Design>,
    taps: Vec<Tap>,
}

/// The engine of `model` in rust-hdl's simulation; each cycle settles the signals with the clock low, then high.
///
/// # Errors
/// As [`crate::generate`].
pub fn simulator(model: &Model) -> Result<Box<dyn Device>, HdlError> {
    Ok(Box::new(Simulator { engine: design(model)?, taps: taps(model) }))
}

/// One clock cycle: the signals settle with the clock low, `sample` sees them before the rising edge.
pub(crate) fn cycle(
    engine: &mut dyn Design,
    inputs: &Inputs,
    taps: &[Tap],
    sample: impl FnOnce(&dyn Design),
) -> Outputs {
    let settle = |engine: &mut dyn Design, clock: bool| {
        engine.drive(inputs, clock);
        assert!(settles(engine), "the engine has a combinational loop: a defect of this crate");
    };
    settle(engine, false);
    let outputs = engine.observe(taps);
    sample(engine);
    settle(engine, true);
    outputs
}

impl Device for Simulator {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        cycle(&mut *self.engine, inputs, &self.taps, |_| {})
    }
}
