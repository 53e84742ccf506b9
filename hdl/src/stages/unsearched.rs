//! In place of stage `search` where a scene has no search: v_00 passes on, μ is 0.
//!
//! The coefficients that `unfold` sends are p itself: they are the values as they come, and stand when `start` says so. So the
//! force memory is written while the passes go on, and a frame is not computed before the last one is out.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, position_bits};
use crate::wire::Wire;

/// The ports of [`Search`](super::Search); those that tell of a search are constant.
#[derive(LogicBlock)]
pub struct Unsearched {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// There is one case.
    pub which: Wire<In>,
    /// Four taxels' p.
    pub fill_quad: Wire<In>,
    /// `fill_quad` is one.
    pub fill: Signal<In, Bit>,
    /// There is one coefficient.
    pub fill_index: Wire<In>,
    /// Quads come in order.
    pub fill_address: Wire<In>,
    /// All values are in.
    pub start: Signal<In, Bit>,
    /// There is nothing to enable.
    pub enabled: Signal<In, Bit>,
    /// Four taxels' p.
    pub values: Wire<Out>,
    /// `values` are a quad.
    pub values_valid: Signal<Out, Bit>,
    /// All values are in, a cycle after `start`.
    pub settled: Signal<Out, Bit>,
    /// The values may be sent.
    pub values_begin: Signal<Out, Bit>,
    /// All values are out.
    pub done: Signal<Out, Bit>,
    /// 0.
    pub best_x: Wire<Out>,
    /// 0.
    pub best_y: Wire<Out>,
    /// 0.
    pub score: Wire<Out>,
    /// Never.
    pub found: Signal<Out, Bit>,
    /// Never.
    pub judged: Signal<Out, Bit>,
    /// Never.
    pub taken: Signal<Out, Bit>,
}

impl Unsearched {
    /// Widths of `model`.
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
