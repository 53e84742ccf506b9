//! States: a register that is in one of several states, which have names.
//!
//! [`states!`](crate::states) declares the states, [`Builder::machine`] the register. Beside it the Verilog has its state as text, which
//! simulators show in waves and synthesis does not see.

use std::marker::PhantomData;

use dermis_golden::fixed::plan::resources::count_bits;

use super::build::{Builder, Net};
use super::expression::Expr;
use super::kernel::Type;

/// The states of a state machine; [`states!`](crate::states) implements it.
pub trait States: Copy {
    /// Their names, by their numbers.
    const NAMES: &'static [&'static str];

    /// The number of a state.
    fn number(self) -> u64;
}

/// Declares the states of a state machine, in the order of their numbers.
///
/// ```text
/// states! {
///     /// What a receiver does.
///     enum Receiving { Idle, Header, Payload }
/// }
/// let state = k.machine("state", rst, Receiving::Idle);
/// k.when(state.is(Receiving::Idle) & begins, || state.goes(Receiving::Header));
/// ```
#[macro_export]
macro_rules! states {
    ($(#[$meta:meta])* $vis:vis enum $states:ident { $($(#[$doc:meta])* $state:ident),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $states { $($(#[$doc])* $state,)+ }

        impl $crate::language::States for $states {
            const NAMES: &'static [&'static str] = &[$(stringify!($state)),+];

            fn number(self) -> u64 {
                self as u64
            }
        }
    };
}

/// A register that is in one of the states `S`.
#[derive(Clone, Copy, Debug)]
pub struct Machine<'k, S> {
    builder: &'k Builder,
    register: Net<'k>,
    states: PhantomData<S>,
}

impl Builder {
    /// A register that `reset` sets to the state `first`.
    pub fn machine<'k, S: States>(&'k self, name: &str, reset: Expr<'k>, first: S) -> Machine<'k, S> {
        let ty = Type::unsigned(count_bits(S::NAMES.len()));
        let register = self.state(name, ty, reset, first.number()).named_states(S::NAMES);
        Machine { builder: self, register, states: PhantomData }
    }
}

impl<'k, S: States> Machine<'k, S> {
    /// Whether it is in this state.
    pub fn is(&self, state: S) -> Expr<'k> {
        self.register.is(state.number())
    }

    /// It is in this state from the next cycle on.
    pub fn goes(&self, next: S) {
        self.register.set(self.number(next));
    }

    /// It is in the state of this number from the next cycle on.
    pub fn goes_to(&self, number: Expr<'k>) {
        self.register.set(number);
    }

    /// The number of a state.
    pub fn number(&self, of: S) -> Expr<'k> {
        self.builder.constant(self.register.bits(), of.number())
    }

    /// The number of the state that follows.
    pub fn following(&self) -> Expr<'k> {
        self.register.plus(1)
    }
}

/// The lines of Verilog by which waves show the state of register `name` of `bits` bits as text.
pub(super) fn shown(name: &str, bits: usize, states: &[&str]) -> Vec<String> {
    let length = states.iter().map(|state| state.len()).max().unwrap_or(1);
    let arms = states.iter().enumerate();
    let arms = arms.map(|(number, state)| format!("    {bits}'d{number}: {name}_text = \"{state:length$}\";"));
    let rest = format!("    default: {name}_text = \"{:length$}\";", "?");
    let begin = [
        "`ifndef SYNTHESIS".to_owned(),
        format!("// The state in {name}, for waves."),
        "/* verilator lint_off UNUSEDSIGNAL */".to_owned(),
        format!("reg [{}:0] {name}_text;", 8 * length - 1),
        "/* verilator lint_on UNUSEDSIGNAL */".to_owned(),
        "always @* begin".to_owned(),
        format!("  case ({name})"),
    ];
    let end = ["  endcase", "end", "`endif"].map(str::to_owned);
    begin.into_iter().chain(arms).chain([rest]).chain(end).collect()
}
