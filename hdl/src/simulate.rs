//! Kernel simulation of the engine as a [`Device`].

use dermis_golden::fixed::Model;

use crate::device::{Device, Inputs, Outputs};
use crate::engine::Engine;
use crate::error::HdlError;
use crate::language::{kernel_of, Hierarchy, Run, Slot};
use crate::taps::{streams, Tapped};
use crate::wire::Word;

/// The blocks of the engine of `model`, checked.
pub(crate) fn design(model: &Model) -> Result<Hierarchy, HdlError> {
    let hierarchy = Hierarchy::of_kernel(kernel_of(&Engine::new(model)));
    hierarchy.check()?;
    Ok(hierarchy)
}

/// The pins of a running engine.
struct Pins {
    rst: Slot,
    s_valid: Slot,
    s_data: Slot,
    s_array: Slot,
    s_last: Slot,
    s_ready: Slot,
    m_valid: Slot,
    m_data: Slot,
    m_array: Slot,
    m_last: Slot,
    m_ready: Slot,
}

impl Pins {
    fn of(run: &Run) -> Self {
        let pin = |name| run.slot("", name);
        Pins {
            rst: pin("rst"),
            s_valid: pin("s_axis_tvalid"),
            s_data: pin("s_axis_tdata"),
            s_array: pin("s_axis_tid"),
            s_last: pin("s_axis_tlast"),
            s_ready: pin("s_axis_tready"),
            m_valid: pin("m_axis_tvalid"),
            m_data: pin("m_axis_tdata"),
            m_array: pin("m_axis_tid"),
            m_last: pin("m_axis_tlast"),
            m_ready: pin("m_axis_tready"),
        }
    }
}

/// An engine in kernel simulation, with signals inside it that can be read.
pub(crate) struct Running {
    run: Run,
    pins: Pins,
}

impl Running {
    /// Starts the engine of `hierarchy`; `observed` as of [`Run::new`].
    pub(crate) fn new(hierarchy: &Hierarchy, observed: &[(&str, &str)]) -> Self {
        let run = Run::new(hierarchy, observed);
        Running { pins: Pins::of(&run), run }
    }

    /// The simulation.
    pub(crate) fn run(&self) -> &Run {
        &self.run
    }

    /// One clock cycle; `sample` sees the signals before the rising edge. Returns the output pins, no taps.
    pub(crate) fn cycle(&mut self, inputs: &Inputs, sample: impl FnOnce(&Run)) -> Outputs {
        let Running { run, pins } = self;
        run.set(pins.rst, inputs.rst.into());
        run.set(pins.s_valid, inputs.s_valid.into());
        run.set(pins.s_data, Word::of_fields(&[i64::from(inputs.s_data)], 64));
        run.set(pins.s_array, (inputs.s_array as u64).into());
        run.set(pins.s_last, inputs.s_last.into());
        run.set(pins.m_ready, inputs.m_ready.into());
        run.settle();
        let data = run.get(pins.m_data);
        let outputs = Outputs {
            s_ready: run.is_high(pins.s_ready),
            m_valid: run.is_high(pins.m_valid),
            m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
            m_array: run.get(pins.m_array).number() as usize,
            m_last: run.is_high(pins.m_last),
            taps: Vec::new(),
        };
        sample(run);
        run.clock();
        outputs
    }
}

struct Simulator {
    engine: Running,
    taps: Vec<Tapped>,
}

/// The engine of `model` in kernel simulation.
///
/// # Errors
/// As [`crate::generate`].
pub fn simulator(model: &Model) -> Result<Box<dyn Device>, HdlError> {
    let streams = streams(model);
    let observed: Vec<(&str, &str)> =
        streams.iter().flat_map(|stream| stream.signals()).map(|name| ("", name)).collect();
    let engine = Running::new(&design(model)?, &observed);
    let taps = streams.iter().map(|stream| Tapped::new(stream, engine.run())).collect();
    Ok(Box::new(Simulator { engine, taps }))
}

impl Device for Simulator {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let Simulator { engine, taps } = self;
        let mut words = Vec::new();
        let outputs = engine.cycle(inputs, |run| words = taps.iter().map(|tap| tap.word(run)).collect());
        Outputs { taps: words, ..outputs }
    }
}
