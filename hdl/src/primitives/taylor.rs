//! Taylor shift: moves the polynomials' centre by a grid step and halves the step, with additions and shifts only.

use dermis_golden::fixed::schedule::EXPONENTS;
use dermis_golden::fixed::search::{halve, taylor_shift};
use rust_hdl::prelude::*;

use super::polynomial_word::{resize, PolynomialWord};
use crate::wire::{Wire, Word};

/// Polynomials and their `step` in; the polynomials about the new centre [`LATENCY`] cycles later: two cycles for x,
/// two for y and the halving. The first cycle of an axis adds up the terms to be multiplied by the step, the second
/// adds or subtracts them.
#[derive(LogicBlock)]
pub struct Taylor {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Bits 1:0: move along x, −1, 0 or 1, signed; bits 3:2: along y; bit 4: halve the grid step afterwards. Valid with
    /// `word`.
    pub step: Wire<In>,
    /// Polynomials, one per lane.
    pub word: Wire<In>,
    /// The polynomials about the new centre, four cycles later.
    pub moved: Wire<Out>,
    _layout: PolynomialWord,
    _pipe: Vec<(Word, Word)>,
}

/// Cycles from `word` to `moved`.
pub const LATENCY: usize = 4;

impl Taylor {
    /// For polynomials in `layout`.
    pub fn new(layout: PolynomialWord) -> Self {
        Taylor {
            clk: Default::default(),
            step: Wire::new(5),
            word: Wire::new(layout.bits()),
            moved: Wire::new(layout.bits()),
            _layout: layout,
            _pipe: vec![(Word::default(), Word::default()); LATENCY - 1],
        }
    }

    fn each(&self, word: Word, change: impl Fn(&[i64; 10]) -> [i64; 10]) -> Word {
        let mut out = Word::default();
        for lane in 0..self._layout.lanes {
            self._layout.put(&mut out, lane, &change(&self._layout.get(&word, lane)));
        }
        out
    }
}

impl Logic for Taylor {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self._pipe.push((self.word.val(), self.step.val()));
            let (word, step) = self._pipe.remove(0);
            let (dx, dy, halving) = (step.signed(0, 2), step.signed(1, 2), step.field(4, 1) == 1);
            self.moved.next = self.each(word, |w| {
                let moved = taylor_shift(w, dx, dy);
                if halving {
                    halve(&moved)
                } else {
                    moved
                }
            });
        }
    }

    fn connect(&mut self) {
        self.moved.connect();
    }

    fn hdl(&self) -> Verilog {
        let widths = &self._layout.widths;
        let mut body = String::new();
        for (k, &w) in widths.iter().enumerate() {
            let select = self._layout.select("word", k, "l");
            body += &format!("    wire [{}:0] x{k} = {select};\n", w - 1);
        }
        body += &self.shift("x", "dx", |(i, j), by| (i + by, j));
        for (k, &w) in widths.iter().enumerate() {
            body += &format!("    reg [{}:0] y{k};\n    always @(posedge clk) y{k} <= x{k}_moved;\n", w - 1);
        }
        body += &self.shift("y", "dy", |(i, j), by| (i, j + by));
        body += "    always @(posedge clk) begin\n";
        for (k, &w) in widths.iter().enumerate() {
            let degree = (EXPONENTS[k].0 + EXPONENTS[k].1) as usize;
            let target = self._layout.select("moved", k, "l");
            let value = match degree {
                0 => format!("y{k}_moved"),
                _ => format!(
                    "halving ? {{{{{degree}{{y{k}_moved[{}]}}}}, y{k}_moved[{}:{degree}]}} : y{k}_moved",
                    w - 1,
                    w - 1
                ),
            };
            body += &format!("      {target} <= {value};\n");
        }
        body += "    end\n";
        Verilog::Custom(format!(
            "\
// The step travels along the pipeline: x moves in the second cycle, y in the fourth.
reg [1:0] dy1, dy2;
reg halving1, halving2;
always @(posedge clk) begin
  {{halving1, dy1}} <= step[4:2];
  {{halving2, dy2}} <= {{halving1, dy1}};
end
genvar l;
generate
  for (l = 0; l < {lanes}; l = l + 1) begin : lane
    // One copy per lane, to limit fan-out; the attribute keeps synthesis from merging them.
    reg [1:0] dx, dy;
    reg halving;
    (* keep *) always @(posedge clk) begin
      dx <= step[1:0];
      {{halving, dy}} <= {{halving2, dy2}};
    end
{body}  end
endgenerate",
            lanes = self._layout.lanes
        ))
    }
}

impl Taylor {
    /// Verilog of a move along one axis: registers for the terms that the step multiplies, then wires `<axis>k_moved`
    /// computed from `<axis>k`.
    ///
    /// c0' = c0 + d (c1 + c3) + d² c2,  c1' = c1 + 2d c2 + 3d² c3,  c2' = c2 + 3d c3, with d one of −1, 0, 1. So d² is
    /// 1 if there is a move, and d·c is c, −c or 0, where −c is the complement plus one. Written as one sum, which
    /// synthesis maps to one carry chain.
    fn shift(&self, axis: &str, step: &str, up: impl Fn((u32, u32), u32) -> (u32, u32)) -> String {
        let widths = &self._layout.widths;
        let mut text = String::new();
        for (k, &w) in widths.iter().enumerate() {
            let order = if axis == "x" { EXPONENTS[k].0 } else { EXPONENTS[k].1 };
            let above = |by: u32| {
                let found = EXPONENTS.iter().position(|&e| e == up(EXPONENTS[k], by));
                found.filter(|&n| n < widths.len()).map(|n| resize(&format!("{axis}{n}"), widths[n], w))
            };
            // Binomial factors of the higher terms: those an odd distance above change sign with the step, the others
            // do not.
            let times = |value: &str, factor: u32| match factor {
                2 => format!("({value} << 1)"),
                3 => format!("({value} << 1) + {value}"),
                _ => value.to_string(),
            };
            let choose = |n: u32, by: u32| match by {
                1 => n + 1,
                2 => (n + 2) * (n + 1) / 2,
                _ => 1,
            };
            let term = |by: u32| above(by).map(|value| times(&value, choose(order, by)));
            let mut register = |name: &str, value: &str| {
                text += &format!(
                    "    reg [{}:0] {axis}{k}_{name};\n    always @(posedge clk) {axis}{k}_{name} <= {value};\n",
                    w - 1
                );
            };
            let odd: Vec<String> = [term(1), term(3)].into_iter().flatten().collect();
            register("own", &format!("{axis}{k}"));
            let mut sum = format!("{axis}{k}_own");
            if !odd.is_empty() {
                register("odd", &odd.join(" + "));
                sum += &format!(
                    " + (({axis}{k}_odd & {{{w}{{{step}[0]}}}}) ^ {{{w}{{{step}[1]}}}}) + {{{more}'d0, {step}[1]}}",
                    more = w - 1
                );
            }
            if let Some(even) = term(2) {
                register("even", &even);
                sum += &format!(" + ({axis}{k}_even & {{{w}{{{step}[0]}}}})");
            }
            text += &format!("    wire [{}:0] {axis}{k}_moved = {sum};\n", w - 1);
        }
        text
    }
}
