//! After a sweep: compares its nine candidates with each other and with the best so far.

use dermis_golden::fixed::formats::Formats;
use dermis_golden::fixed::search::Best;
use rust_hdl::prelude::*;

use super::sweep::{position_bits, sweep_bits, unpack, Sweep};
use super::weigh::weight_bits;
use crate::wire::{Wire, Word};

/// Score = total − weight for all nine at once, then a tree of comparisons. Ties: in the coarse grid the first
/// candidate in row-major order wins; in a halving the centre, then row-major order. The last three candidates are
/// compared with the best so far in parallel with each other.
///
/// `start` with totals, weights, eligibility and sweep; `done`, with `improved`, `LATENCY` cycles later.
/// `begin_frame` clears the result for a new search, `halve` doubles the position for the next level.
#[derive(LogicBlock)]
pub struct Judge {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; clears the control pipeline only.
    pub rst: Signal<In, Bit>,
    /// A new search: position 0, score 0, nothing taken.
    pub begin_frame: Signal<In, Bit>,
    /// A new level: the position doubles and `taken` is cleared.
    pub halve: Signal<In, Bit>,
    /// The nine candidates are valid; starts their comparison.
    pub start: Signal<In, Bit>,
    /// Nine totals Σ log2(…), `score_bits` each, signed; valid with `start`.
    pub totals: Wire<In>,
    /// Nine n·log2 Σp, unsigned; valid with `start`.
    pub weights: Wire<In>,
    /// Nine bits, candidate k may be taken; valid with `start`.
    pub eligible: Wire<In>,
    /// Word of the sweep (`Sweep`); valid with `start`.
    pub sweep: Wire<In>,
    /// The comparison is complete; high for one cycle.
    pub done: Signal<Out, Bit>,
    /// The best candidate changed; valid with `done`.
    pub improved: Signal<Out, Bit>,
    /// The next sweep was waiting for this result; valid with `done`.
    pub closes: Signal<Out, Bit>,
    /// Word of the sweep just compared; valid with `done`.
    pub judged: Wire<Out>,
    /// Best position, x, in grid steps of the level, signed.
    pub best_x: Wire<Out>,
    /// Best position, y, in grid steps of the level, signed.
    pub best_y: Wire<Out>,
    /// Score of the best candidate, signed, 2^−6.
    pub score: Wire<Out>,
    /// A candidate was taken at this level.
    pub taken: Signal<Out, Bit>,
    /// A candidate was taken in the coarse grid.
    pub found: Signal<Out, Bit>,
    _left: usize,
    _next: (Word, Word, Word),
    _best: Best,
    _found: bool,
}

/// Cycles from `start` to `done`.
pub const LATENCY: usize = 6;
/// Order of comparison: index 0 in a halving, centre first; index 1 in the coarse grid, row-major.
const ORDERS: [[usize; 9]; 2] = [[4, 0, 1, 2, 3, 5, 6, 7, 8], [0, 1, 2, 3, 4, 5, 6, 7, 8]];

impl Judge {
    /// With the widths of `formats`, for subarrays of at most `taxels` taxels.
    pub fn new(formats: &Formats, taxels: usize) -> Self {
        Judge {
            clk: Default::default(),
            rst: Default::default(),
            begin_frame: Default::default(),
            halve: Default::default(),
            start: Default::default(),
            totals: Wire::new(9 * formats.score_bits as usize),
            weights: Wire::new(9 * weight_bits(taxels)),
            eligible: Wire::new(9),
            sweep: Wire::new(sweep_bits()),
            done: Default::default(),
            improved: Default::default(),
            closes: Default::default(),
            judged: Wire::new(sweep_bits()),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            taken: Default::default(),
            found: Default::default(),
            _left: 0,
            _next: Default::default(),
            _best: Default::default(),
            _found: false,
        }
    }

    /// Compares all nine candidates one after the other; whether the best changed.
    fn judge(&mut self, totals: Word, weights: Word, sweep: Sweep, eligible: u64) -> bool {
        let (t, w) = (self.totals.width() / 9, self.weights.width() / 9);
        let mut improved = false;
        for k in ORDERS[usize::from(sweep.coarse)] {
            if eligible >> k & 1 == 0 || !(sweep.coarse || self._found) {
                continue;
            }
            let score = totals.signed(k, t) - weights.field(k * w, w) as i64;
            let position = [sweep.centre[0] as i32 + k as i32 % 3 - 1, sweep.centre[1] as i32 + k as i32 / 3 - 1];
            let best = &mut self._best;
            let earlier = sweep.coarse && (position[1], position[0]) < (best.position[1], best.position[0]);
            if !best.taken || score < best.score || (score == best.score && earlier) {
                *best = Best { position, score, taken: true };
                improved = true;
            }
        }
        self._found |= sweep.coarse && self._best.taken;
        improved
    }
}

impl Logic for Judge {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.done.next = false;
            if self._left == 1 {
                let (totals, weights, word) = self._next;
                let sweep = Sweep::of_word(&word);
                let eligible = word.field(sweep_bits(), 9);
                self.improved.next = self.judge(totals, weights, sweep, eligible);
                self.closes.next = sweep.closes;
                self.judged.next = sweep.word();
                self.done.next = true;
            }
            self._left = match (self.rst.val(), self.start.val()) {
                (true, _) => 0,
                (false, true) => LATENCY - 1,
                (false, false) => self._left.saturating_sub(1),
            };
            if self.start.val() {
                let mut word = self.sweep.val();
                word.set(sweep_bits(), 9, self.eligible.val().number());
                self._next = (self.totals.val(), self.weights.val(), word);
            }
            if self.begin_frame.val() {
                self._best = Default::default();
                self._found = false;
            } else if self.halve.val() {
                self._best.position = self._best.position.map(|p| 2 * p);
                self._best.taken = false;
            }
            self.best_x.next = Word::of_fields(&[self._best.position[0].into()], position_bits());
            self.best_y.next = Word::of_fields(&[self._best.position[1].into()], position_bits());
            self.score.next = Word::of_fields(&[self._best.score], self.score.width());
            self.taken.next = self._best.taken;
            self.found.next = self._found;
        }
    }

    fn connect(&mut self) {
        for bit in [&mut self.done, &mut self.improved, &mut self.closes, &mut self.taken, &mut self.found] {
            bit.connect();
        }
        for wire in [&mut self.judged, &mut self.best_x, &mut self.best_y, &mut self.score] {
            wire.connect();
        }
    }

    fn hdl(&self) -> Verilog {
        let (t, w) = (self.totals.width() / 9, self.weights.width() / 9);
        let p = position_bits();
        let weight = match t.checked_sub(w) {
            Some(0) => format!("weights[k * {w} +: {w}]"),
            Some(more) => format!("{{{more}'d0, weights[k * {w} +: {w}]}}"),
            None => format!("weights[k * {w} +: {t}]"),
        };
        // Declarations of a candidate: eligible, score, index.
        let declare = |kind: &str, names: &[&str]| -> String {
            let one = |n: &&str| format!("{kind} ok_{n};\n{kind} signed [{}:0] s_{n};\n{kind} [3:0] k_{n};\n", t - 1);
            names.iter().map(one).collect()
        };
        // The better of two, the first on a tie, one cycle later.
        let duel = |a: &str, b: &str, to: &str| {
            format!(
                "  ok_{to} <= ok_{a} || ok_{b};\n  if (ok_{b} && (!ok_{a} || less(s_{b}, s_{a}))) begin\n    s_{to} <= s_{b};\n    \
                 k_{to} <= k_{b};\n  end else begin\n    s_{to} <= s_{a};\n    k_{to} <= k_{a};\n  end\n"
            )
        };
        let candidates = ["0", "1", "2", "3", "4", "5", "6", "7", "8"];
        let leaves: String = candidates
            .iter()
            .map(|k| {
                format!(
                    "always @(*) ok_{k} = fits[{k}];\nalways @(*) s_{k} = scores[{k} * {t} +: {t}];\n\
                     always @(*) k_{k} = 4'd{k};\n"
                )
            })
            .collect();
        // The eight around the centre keep their order: four pairs, then the four before and the four after the centre.
        let pairs = duel("0", "1", "a") + &duel("2", "3", "b") + &duel("5", "6", "c") + &duel("7", "8", "d");
        let halves = duel("a", "b", "before") + &duel("c", "d", "after");
        let last = ["before", "centre", "after"];
        let each = |text: &dyn Fn(&str) -> String| -> String { last.iter().map(|n| text(n)).collect() };
        let positions = each(&|n| {
            format!(
                "wire [{end}:0] x_{n} = held_centre_x + along(column(k_{n}));\n\
                 wire [{end}:0] y_{n} = held_centre_y + along(row(k_{n}));\n",
                end = p - 1
            )
        });
        let compared = each(&|n| {
            format!(
                "reg lower_{n}, same_{n}, above_{n}, level_{n}, left_{n};\n\
                 wire tie_{n} = same_{n} && (above_{n} || (level_{n} && left_{n}));\n\
                 reg [{}:0] score_{n};\nreg [{end}:0] at_x_{n}, at_y_{n};\n",
                t - 1,
                end = p - 1
            )
        });
        let compare = each(&|n| {
            format!(
                "  lower_{n} <= less(s_{n}, s_best);\n  \
                 same_{n} <= s_{n} == s_best;\n  \
                 above_{n} <= beyond(ahead_y, row(k_{n}));\n  level_{n} <= in_line(ahead_y, row(k_{n}));\n  \
                 left_{n} <= beyond(ahead_x, column(k_{n}));\n  \
                 score_{n} <= s_{n};\n  at_x_{n} <= x_{n};\n  at_y_{n} <= y_{n};\n"
            )
        });
        // The value of the best of the last three.
        let winner = |what: &str| format!("takes_after ? {what}_after : takes_centre ? {what}_centre : {what}_before");
        Verilog::Custom(format!(
            "\
function [1:0] column;
  input [3:0] k;
  case (k)
    4'd0, 4'd3, 4'd6: column = 2'b11;
    4'd1, 4'd4, 4'd7: column = 2'b00;
    default: column = 2'b01;
  endcase
endfunction
function [1:0] row;
  input [3:0] k;
  row = k < 4'd3 ? 2'b11 : k < 4'd6 ? 2'b00 : 2'b01;
endfunction
function [{p_end}:0] along;
  input [1:0] step;
  along = {{{{{p_more}{{step[1]}}}}, step}};
endfunction
// Along one axis: whether the best so far is past the candidate at centre + step, or level with it.
function beyond;
  input [{p}:0] ahead;
  input [1:0] step;
  beyond = !ahead[{p}] && (step[1] || (step[0] ? ahead[{p}:1] != {p}'d0 : ahead != {p_wide}'d0));
endfunction
function in_line;
  input [{p}:0] ahead;
  input [1:0] step;
  in_line = ahead == {{{{{p_end}{{step[1]}}}}, step}};
endfunction
// a < b, both signed. Exchanging the sign bits makes the comparison unsigned, which takes only the carry out of one
// chain; a signed comparison also taps the chain below the sign bit.
function less;
  input [{t_end}:0] a, b;
  less = {{b[{t_end}], a[{t_less}:0]}} < {{a[{t_end}], b[{t_less}:0]}};
endfunction
reg [{scores_end}:0] scores;
reg [8:0] fits;
reg [{sweep_end}:0] held;
reg [4:0] valid;
{declared}{leaves}genvar k;
generate
  for (k = 0; k < 9; k = k + 1) begin : candidate
    always @(posedge clk) scores[k * {t} +: {t}] <= totals[k * {t} +: {t}] - {weight};
  end
endgenerate
always @(posedge clk) begin
  if (start) begin
    fits <= eligible;
    held <= sweep;
  end
{pairs}  {{ok_middle, s_middle, k_middle}} <= {{ok_4, s_4, k_4}};
{halves}  {{ok_centre, s_centre, k_centre}} <= {{ok_middle, s_middle, k_middle}};
end
{fields}wire unused = &{{1'b0, held_square, held_buffer}};
// The earlier one wins ties; in a halving that is the centre.
wire centre_wins = ok_centre && (!ok_before || less(s_centre, s_before) || (!held_coarse && s_centre == s_before));
wire after_wins = ok_after && (!ok_before || less(s_after, s_before)) && (!ok_centre || less(s_after, s_centre));
// All three are compared with the best so far in parallel with the choice among them.
wire signed [{t_end}:0] s_best = score;
// Distance of the best so far from the centre, registered a cycle earlier.
reg [{p}:0] ahead_x, ahead_y;
always @(posedge clk) begin
  ahead_x <= {{best_x[{p_end}], best_x}} - {{held_centre_x[{p_end}], held_centre_x}};
  ahead_y <= {{best_y[{p_end}], best_y}} - {{held_centre_y[{p_end}], held_centre_y}};
end
{positions}reg some, takes_centre, takes_after;
{compared}always @(posedge clk) begin
  some <= ok_before || ok_centre || ok_after;
  takes_centre <= centre_wins;
  takes_after <= after_wins;
{compare}end
reg fit, lower, tie;
reg [{t_end}:0] s;
reg [{p_end}:0] x, y;
always @(posedge clk) begin
  fit <= some && (held_coarse || found);
  lower <= !taken || ({lower});
  tie <= held_coarse && ({tie});
  s <= {score};
  x <= {at_x};
  y <= {at_y};
end
wire take = valid[4] && fit && (lower || tie);
always @(posedge clk) begin
  if (rst) begin
    valid <= 5'd0;
    done <= 1'b0;
  end else begin
    valid <= {{valid[3:0], start}};
    done <= valid[4];
  end
  improved <= take;
  if (valid[4]) begin
    closes <= held_closes;
    judged <= held;
  end
  if (begin_frame) begin
    best_x <= {p}'d0;
    best_y <= {p}'d0;
    score <= {t}'d0;
    taken <= 1'b0;
    found <= 1'b0;
  end else if (halve) begin
    best_x <= best_x << 1;
    best_y <= best_y << 1;
    taken <= 1'b0;
  end else if (take) begin
    best_x <= x;
    best_y <= y;
    score <= s;
    taken <= 1'b1;
    if (held_coarse) found <= 1'b1;
  end
end",
            lower = winner("lower"),
            tie = winner("tie"),
            score = winner("score"),
            at_x = winner("at_x"),
            at_y = winner("at_y"),
            p_end = p - 1,
            p_more = p - 2,
            p_wide = p + 1,
            t_end = t - 1,
            t_less = t - 2,
            scores_end = 9 * t - 1,
            sweep_end = sweep_bits() - 1,
            declared = declare("reg", &candidates)
                + &declare("reg", &["a", "b", "c", "d", "middle", "before", "centre", "after"]),
            fields = unpack("held", "held_"),
        ))
    }
}
