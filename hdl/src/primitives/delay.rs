//! Shift registers: a word or a control bit, delayed by a fixed number of cycles.

use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// A word delayed by `depth` cycles. Data, therefore without reset.
#[derive(LogicBlock)]
pub struct Delay {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Input word.
    pub now: Wire<In>,
    /// The word that was on `now` `depth` cycles earlier.
    pub then: Wire<Out>,
    _pipe: Vec<Word>,
}

impl Delay {
    /// Delays words of `bits` bits by `depth` ≥ 1 cycles.
    pub fn new(bits: usize, depth: usize) -> Self {
        Delay {
            clk: Default::default(),
            now: Wire::new(bits),
            then: Wire::new(bits),
            _pipe: vec![Word::default(); depth - 1],
        }
    }
}

impl Logic for Delay {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._pipe.push(self.now.val());
            self.then.next = self._pipe.remove(0);
        }
    }

    fn connect(&mut self) {
        self.then.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(match self._pipe.len() {
            0 => "always @(posedge clk) then <= now;".to_string(),
            inner => format!(
                "\
reg [{bits}:0] pipe [0:{end}];
integer i;
always @(posedge clk) begin
  pipe[0] <= now;
  for (i = 1; i < {inner}; i = i + 1) pipe[i] <= pipe[i - 1];
  then <= pipe[{end}];
end",
                bits = self.now.width() - 1,
                end = inner - 1,
            ),
        })
    }
}

/// A control bit delayed by `depth` cycles; reset clears the whole shift register.
#[derive(LogicBlock)]
pub struct BitDelay {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Input bit.
    pub now: Signal<In, Bit>,
    /// The bit that was on `now` `depth` cycles earlier.
    pub then: Signal<Out, Bit>,
    _pipe: Vec<bool>,
}

impl BitDelay {
    /// Delays by `depth` ≥ 1 cycles.
    pub fn new(depth: usize) -> Self {
        BitDelay {
            clk: Default::default(),
            rst: Default::default(),
            now: Default::default(),
            then: Default::default(),
            _pipe: vec![false; depth - 1],
        }
    }
}

impl Logic for BitDelay {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._pipe.push(self.now.val());
            self.then.next = self._pipe.remove(0) && !self.rst.val();
            if self.rst.val() {
                self._pipe.fill(false);
            }
        }
    }

    fn connect(&mut self) {
        self.then.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(match self._pipe.len() {
            0 => "always @(posedge clk) then <= rst ? 1'b0 : now;".to_string(),
            1 => "\
reg pipe;
always @(posedge clk) {then, pipe} <= rst ? 2'd0 : {pipe, now};"
                .to_string(),
            inner => format!(
                "\
reg [{end}:0] pipe;
always @(posedge clk) {{then, pipe}} <= rst ? {all}'d0 : {{pipe, now}};",
                end = inner - 1,
                all = inner + 1,
            ),
        })
    }
}
