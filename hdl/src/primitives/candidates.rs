//! Values of p at the nine candidates of the 3×3 grid about the centre.

use dermis_golden::fixed::schedule::EXPONENTS;
use dermis_golden::fixed::search::candidates;
use rust_hdl::prelude::*;

use super::polynomial_word::{resize, PolynomialWord};
use crate::wire::{Wire, Word};

/// Polynomials in; nine values per lane two cycles later. Value k = 3·(y + 1) + (x + 1) of lane l is field 9·l + k, as
/// wide as the constant coefficient. First cycle: for each power of y, the three values over x; second cycle: their
/// combination over y. 21 adders per lane at degree 3.
#[derive(LogicBlock)]
pub struct Candidates {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// One polynomial per lane, in the layout given; a new word may come each cycle.
    pub word: Wire<In>,
    /// Nine signed values per lane, [`LATENCY`] cycles after `word`.
    pub values: Wire<Out>,
    _layout: PolynomialWord,
    _between: Word,
}

/// Cycles from `word` to `values`.
pub const LATENCY: usize = 2;

impl Candidates {
    /// For polynomials in `layout`.
    pub fn new(layout: PolynomialWord) -> Self {
        Candidates {
            clk: Default::default(),
            word: Wire::new(layout.bits()),
            values: Wire::new(9 * layout.lanes * layout.widths[0]),
            _layout: layout,
            _between: Word::default(),
        }
    }
}

impl Logic for Candidates {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let values: Vec<i64> =
                (0..self._layout.lanes).flat_map(|lane| candidates(&self._layout.get(&self._between, lane))).collect();
            self.values.next = Word::of_fields(&values, self._layout.widths[0]);
            self._between = self.word.val();
        }
    }

    fn connect(&mut self) {
        self.values.connect();
    }

    fn hdl(&self) -> Verilog {
        let v = self._layout.widths[0];
        let end = v - 1;
        let used = self._layout.widths.len();
        let mut body = String::new();
        for (k, &w) in self._layout.widths.iter().enumerate() {
            body += &format!("    wire [{}:0] w{k} = {};\n", w - 1, self._layout.select("word", k, "l"));
        }
        let coefficient = |i: u32, j: u32| {
            EXPONENTS
                .iter()
                .position(|&e| e == (i, j))
                .filter(|&k| k < used)
                .map(|k| resize(&format!("w{k}"), self._layout.widths[k], v))
        };
        let sum = |terms: [Option<String>; 2]| {
            let present: Vec<String> = terms.into_iter().flatten().collect();
            if present.is_empty() {
                format!("{v}'d0")
            } else {
                present.join(" + ")
            }
        };
        // Terms of y^j: even and odd part in x, then their value at x = −1, 0, 1.
        let rows = (0..4).filter(|&j| coefficient(0, j).is_some()).collect::<Vec<u32>>();
        let mut registers = String::new();
        for &j in &rows {
            body += &format!(
                "    wire [{end}:0] even{j} = {};\n    wire [{end}:0] odd{j} = {};\n    reg [{end}:0] a{j}_0, a{j}_1, a{j}_2;\n",
                sum([coefficient(0, j), coefficient(2, j)]),
                sum([coefficient(1, j), coefficient(3, j)]),
            );
            registers += &format!(
                "      a{j}_0 <= even{j} - odd{j};\n      a{j}_1 <= {};\n      a{j}_2 <= even{j} + odd{j};\n",
                sum([coefficient(0, j), None])
            );
        }
        let row = |j: u32, x: usize| rows.contains(&j).then(|| format!("a{j}_{x}"));
        let mut values = String::new();
        for x in 0..3 {
            body += &format!(
                "    wire [{end}:0] level{x} = {};\n    wire [{end}:0] slope{x} = {};\n",
                sum([row(0, x), row(2, x)]),
                sum([row(1, x), row(3, x)])
            );
            let field = |k: usize| format!("values[(9 * l + {k}) * {v} +: {v}]");
            values += &format!(
                "      {} <= level{x} - slope{x};\n      {} <= a0_{x};\n      {} <= level{x} + slope{x};\n",
                field(x),
                field(3 + x),
                field(6 + x)
            );
        }
        Verilog::Custom(format!(
            "\
genvar l;
generate
  for (l = 0; l < {lanes}; l = l + 1) begin : lane
{body}    always @(posedge clk) begin
{registers}{values}    end
  end
endgenerate",
            lanes = self._layout.lanes
        ))
    }
}
