//! Replacement for stage `search` in a scene without a search: μ is 0 and the values are v_00.
//!
//! The coefficients that `unfold` delivers are p itself and pass on directly as values; `start` says that all have
//! arrived. Since the force memory is written while the passes run, a frame is not computed before the previous one has
//! been sent.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, position_bits};
use crate::wire::Wire;

/// Ports as of [`Search`](super::Search); inputs that only a search needs are unused, outputs that describe its result
/// are constant.
#[derive(LogicBlock)]
pub struct Unsearched {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Unused: there is one case.
    pub which: Wire<In>,
    /// Values p of four taxels, signed.
    pub fill_quad: Wire<In>,
    /// `fill_quad` holds a quad.
    pub fill: Signal<In, Bit>,
    /// Unused: there is one coefficient.
    pub fill_index: Wire<In>,
    /// Unused: quads arrive in order.
    pub fill_address: Wire<In>,
    /// All values have been output.
    pub start: Signal<In, Bit>,
    /// Unused: there is no search.
    pub enabled: Signal<In, Bit>,
    /// Values p of four taxels, `fill_quad` in the same cycle.
    pub values: Wire<Out>,
    /// `values` holds a quad.
    pub values_valid: Signal<Out, Bit>,
    /// All values have been output; `start` one cycle later.
    pub settled: Signal<Out, Bit>,
    /// The values may be sent; `start` one cycle later.
    pub values_begin: Signal<Out, Bit>,
    /// `start` one cycle later.
    pub done: Signal<Out, Bit>,
    /// Constant 0.
    pub best_x: Wire<Out>,
    /// Constant 0.
    pub best_y: Wire<Out>,
    /// Constant 0.
    pub score: Wire<Out>,
    /// Constant 0.
    pub found: Signal<Out, Bit>,
    /// Constant 0.
    pub judged: Signal<Out, Bit>,
    /// Constant 0.
    pub taken: Signal<Out, Bit>,
}

impl Unsearched {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = &model.formats;
        let quad = 4 * (formats.vector_bits as usize + 2);
        Unsearched {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(1),
            fill_quad: Wire::new(quad),
            fill: Default::default(),
            fill_index: Wire::new(1),
            fill_address: Wire::new(count_bits(formats.quads)),
            start: Default::default(),
            enabled: Default::default(),
            values: Wire::new(quad),
            values_valid: Default::default(),
            settled: Default::default(),
            values_begin: Default::default(),
            done: Default::default(),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            found: Default::default(),
            judged: Default::default(),
            taken: Default::default(),
        }
    }
}

impl Logic for Unsearched {
    fn update(&mut self) {
        self.values.next = self.fill_quad.val();
        self.values_valid.next = self.fill.val();
        if self.clk.pos_edge() {
            let settled = self.start.val() && !self.rst.val();
            self.settled.next = settled;
            self.values_begin.next = settled;
            self.done.next = settled;
        }
    }

    fn connect(&mut self) {
        for wire in [&mut self.values, &mut self.best_x, &mut self.best_y, &mut self.score] {
            wire.connect();
        }
        for bit in [&mut self.values_valid, &mut self.settled, &mut self.values_begin, &mut self.done] {
            bit.connect();
        }
        for bit in [&mut self.found, &mut self.judged, &mut self.taken] {
            bit.connect();
        }
    }

    fn hdl(&self) -> Verilog {
        let (position, score) = (self.best_x.width(), self.score.width());
        Verilog::Custom(format!(
            "\
wire unused = &{{1'b0, which, fill_index, fill_address, enabled}};
always @(posedge clk) {{settled, values_begin, done}} <= {{3{{start && !rst}}}};
always @(*) begin
  values = fill_quad;
  values_valid = fill;
  {{best_x, best_y}} = {}'d0;
  score = {score}'d0;
  {{found, judged, taken}} = 3'd0;
end",
            2 * position
        ))
    }
}
