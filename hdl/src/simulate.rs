//! rust-hdl's own simulation of the engine as a [`Device`].

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use rust_hdl::prelude::*;

use crate::device::{Device, Inputs, Outputs};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::stage_list::Stage;
use crate::taps::{words, Observed};
use crate::wire::Word;
use crate::{engine, serial};

/// Update rounds after which signals that still change count as a combinational loop.
const SETTLE_ROUNDS: usize = 200;

/// Updates a block until no signal changes; `false` if it does not settle.
pub(crate) fn settles(block: &mut (impl Block + ?Sized)) -> bool {
    rounds(block).is_some()
}

/// Updates a block until no signal changes, and counts the rounds; `None` if it does not settle.
fn rounds(block: &mut (impl Block + ?Sized)) -> Option<usize> {
    (1..=SETTLE_ROUNDS).find(|_| {
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
}

macro_rules! design {
    ($engine:ty) => {
        impl Design for $engine {
            fn drive(&mut self, inputs: &Inputs, clock: bool) {
                self.rst.next = inputs.rst;
                self.s_axis_tvalid.next = inputs.s_valid;
                self.s_axis_tdata.next = Word::of_fields(&[i64::from(inputs.s_data)], self.s_axis_tdata.width()).into();
                self.s_axis_tlast.next = inputs.s_last;
                self.m_axis_tready.next = inputs.m_ready;
                self.clk.next = clock.into();
            }

            fn pins(&self) -> Outputs {
                let data = self.m_axis_tdata.val().word();
                Outputs {
                    s_ready: self.s_axis_tready.val(),
                    m_valid: self.m_axis_tvalid.val(),
                    m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
                    m_last: self.m_axis_tlast.val(),
                    taps: Vec::new(),
                }
            }
        }
    };
}

design!(engine::Engine);
design!(serial::Engine);

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

#[cfg(test)]
mod tests {
    /// A shift register of three bits at unlike depths of a hierarchy, with the derive of `Block` under test.
    macro_rules! shift_register {
        ($module:ident, $derive:path) => {
            mod $module {
                use rust_hdl::prelude::*;

                #[derive($derive, Default)]
                pub struct Register {
                    pub clk: Signal<In, Clock>,
                    pub d: Signal<In, Bit>,
                    pub q: Signal<Out, Bit>,
                }

                impl Logic for Register {
                    fn update(&mut self) {
                        if self.clk.pos_edge() {
                            self.q.next = self.d.val();
                        }
                    }
                }

                #[derive($derive, Default)]
                pub struct Inner {
                    pub clk: Signal<In, Clock>,
                    pub d: Signal<In, Bit>,
                    pub q: Signal<Out, Bit>,
                    register: Register,
                }

                impl Logic for Inner {
                    fn update(&mut self) {
                        self.register.clk.next = self.clk.val();
                        self.register.d.next = self.d.val();
                        self.q.next = self.register.q.val();
                    }
                }

                #[derive($derive, Default)]
                pub struct ShiftRegister {
                    pub clk: Signal<In, Clock>,
                    pub d: Signal<In, Bit>,
                    pub q: Signal<Out, Bit>,
                    last: Register,
                    middle: Inner,
                    first: Register,
                }

                impl Logic for ShiftRegister {
                    fn update(&mut self) {
                        self.first.clk.next = self.clk.val();
                        self.middle.clk.next = self.clk.val();
                        self.last.clk.next = self.clk.val();
                        self.first.d.next = self.d.val();
                        self.middle.d.next = self.first.q.val();
                        self.last.d.next = self.middle.q.val();
                        self.q.next = self.last.q.val();
                    }
                }

                /// The output before each edge for these inputs, and the rounds until all cycles have settled.
                pub fn run(inputs: &[bool]) -> (Vec<bool>, usize) {
                    let mut block = ShiftRegister::default();
                    let (mut outputs, mut rounds) = (Vec::new(), 0);
                    for &input in inputs {
                        for clock in [false, true] {
                            (block.d.next, block.clk.next) = (input, clock.into());
                            rounds += crate::simulate::rounds(&mut block).unwrap();
                            outputs.extend((!clock).then(|| block.q.val()));
                        }
                    }
                    (outputs, rounds)
                }
            }
        };
    }

    shift_register!(of_rust_hdl, LogicBlock);
    shift_register!(derived, dermis_hdl_derive::Block);

    #[test]
    fn registers_at_all_depths_see_the_values_before_the_edge_and_settle_in_fewer_rounds() {
        let mut random = fastrand::Rng::with_seed(8);
        let inputs: Vec<bool> = (0..200).map(|_| random.bool()).collect();
        let (outputs, rounds) = derived::run(&inputs);
        let later: Vec<bool> = [false; 3].iter().chain(&inputs[..197]).copied().collect();
        assert_eq!(outputs, later);
        let (others, more) = of_rust_hdl::run(&inputs);
        assert_eq!(others, later);
        assert!(2 * rounds < more, "{rounds} rounds, {more} with rust-hdl's derive");
    }
}
