//! A counter whose end depends on the case, and how what depends on the case is printed.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use crate::wire::{Wire, Word};

/// As [`Counter`](super::Counter), from 0 to the limit of case `which`. The value is at most the limit when `which`
/// changes, or cleared before it counts again.
#[derive(LogicBlock)]
pub struct CaseCounter {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Which case.
    pub which: Wire<In>,
    /// Back to 0.
    pub clear: Signal<In, Bit>,
    /// One step.
    pub enable: Signal<In, Bit>,
    /// The count.
    pub value: Wire<Out>,
    /// The count is at its last value.
    pub last: Signal<Out, Bit>,
    _ends: Vec<u64>,
}

impl CaseCounter {
    /// Counts 0 .. a limit of at least 1 for each case.
    pub fn new(limits: &[usize]) -> Self {
        CaseCounter {
            clk: Default::default(),
            which: Wire::new(count_bits(limits.len())),
            clear: Default::default(),
            enable: Default::default(),
            value: Wire::new(count_bits(largest(limits))),
            last: Default::default(),
            _ends: limits.iter().map(|&limit| limit.max(1) as u64 - 1).collect(),
        }
    }
}

/// The largest of some limits.
pub fn largest(limits: &[usize]) -> usize {
    limits.iter().copied().max().unwrap_or(1)
}

/// Verilog for the one of `values` that belongs to case `which`; a constant where all are the same.
pub fn by_case(values: &[String]) -> String {
    let which = count_bits(values.len());
    match values {
        [first, rest @ ..] if rest.iter().any(|value| value != first) => {
            let other = |(case, value): (usize, &String)| format!("which == {which}'d{} ? {value} : ", case + 1);
            format!("({}{first})", rest.iter().enumerate().map(other).collect::<String>())
        }
        [first, ..] => first.clone(),
        [] => String::new(),
    }
}

/// [`by_case`] of numbers of `bits` bits.
pub fn number_by_case(values: impl Iterator<Item = usize>, bits: usize) -> String {
    by_case(&values.map(|value| format!("{bits}'d{value}")).collect::<Vec<_>>())
}

impl Logic for CaseCounter {
    fn update(&mut self) {
        let end = self._ends.get(self.which.val().number() as usize).copied().unwrap_or_default();
        if self.clk.pos_edge() {
            let value = self.value.val().number();
            self.value.next = match (self.clear.val(), self.enable.val()) {
                (true, _) => Word::default(),
                (false, true) if value == end => Word::default(),
                (false, true) => Word::from(value + 1),
                (false, false) => self.value.val(),
            };
        }
        self.last.next = self.value.val().number() == end;
    }

    fn connect(&mut self) {
        self.value.connect();
        self.last.connect();
    }

    fn hdl(&self) -> Verilog {
        let bits = self.value.width();
        let end = number_by_case(self._ends.iter().map(|&end| end as usize), bits);
        Verilog::Custom(format!(
            "\
wire unused_which = &{{1'b0, which}};
always @(*) last = value == {end};
always @(posedge clk) begin
  if (clear) value <= {bits}'d0;
  else if (enable) value <= last ? {bits}'d0 : value + {bits}'d1;
end"
        ))
    }
}
