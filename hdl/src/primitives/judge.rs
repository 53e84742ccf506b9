//! After a sweep: which of the nine candidates is the best so far.

use dermis_golden::fixed::arith::signed_bits;
use dermis_golden::fixed::formats::{Formats, HALVINGS, LOG_TABLE_BITS};
use dermis_golden::fixed::search::{log2, Best};
use rust_hdl::prelude::*;

use super::logarithm::{locate, table, LENGTH_BITS, LOG_BITS};
use super::polynomial_word::resize;
use crate::wire::{Wire, Word};

/// Bits of a position: three grid steps and a candidate beyond, after all halvings.
pub fn position_bits() -> usize {
    signed_bits(4 << HALVINGS) as usize
}

/// Bits of a squared distance in grid steps of the last level.
pub fn square_bits() -> usize {
    2 * position_bits()
}

/// One candidate per cycle: score = total − n·log2 Σp, and the rules of the search (disc, Σp > 0, ties).
///
/// `start` with the sweep's sums, centre and squared distances, its totals `TOTALS_LATER` cycles later; `done` `LATENCY` cycles later, `improved` with it. `begin_frame` forgets the frame,
/// `halve` doubles the position for the next level.
#[derive(LogicBlock)]
pub struct Judge {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// New frame: μ = 0, nothing taken.
    pub begin_frame: Signal<In, Bit>,
    /// New level: the position doubles, nothing taken at it.
    pub halve: Signal<In, Bit>,
    /// Judge the nine.
    pub start: Signal<In, Bit>,
    /// The sweep is one of the coarse grid.
    pub coarse: Signal<In, Bit>,
    /// Nine totals.
    pub totals: Wire<In>,
    /// Nine Σp.
    pub sums: Wire<In>,
    /// Centre of the nine, x.
    pub centre_x: Wire<In>,
    /// Centre of the nine, y.
    pub centre_y: Wire<In>,
    /// Squared distance of the centre from μ = 0.
    pub square: Wire<In>,
    /// Squared radius of the disc.
    pub radius: Wire<In>,
    /// Judged; one cycle.
    pub done: Signal<Out, Bit>,
    /// The sweep just judged changed the best.
    pub improved: Signal<Out, Bit>,
    /// Best position, x.
    pub best_x: Wire<Out>,
    /// Best position, y.
    pub best_y: Wire<Out>,
    /// Its score.
    pub score: Wire<Out>,
    /// Something was taken at this level.
    pub taken: Signal<Out, Bit>,
    /// Something was taken in the coarse grid.
    pub found: Signal<Out, Bit>,
    _taxels: i64,
    _left: usize,
    _best: Best,
    _found: bool,
}

/// Cycles from `start` to `done`.
pub const LATENCY: usize = 14;
/// Cycles from `start` to the first look at the totals: the logarithms of the sums come first.
pub const TOTALS_LATER: usize = 4;
/// Order of the candidates: row-major in the coarse grid, the centre first in a halving.
const ORDERS: [[usize; 9]; 2] = [[4, 0, 1, 2, 3, 5, 6, 7, 8], [0, 1, 2, 3, 4, 5, 6, 7, 8]];

impl Judge {
    /// Widths of `formats`, for subarrays of `taxels` taxels.
    pub fn new(formats: &Formats, taxels: usize) -> Self {
        let bit = || Default::default();
        Judge {
            clk: Default::default(),
            rst: bit(),
            begin_frame: bit(),
            halve: bit(),
            start: bit(),
            coarse: bit(),
            totals: Wire::new(9 * formats.score_bits as usize),
            sums: Wire::new(9 * formats.sum_bits[0] as usize),
            centre_x: Wire::new(position_bits()),
            centre_y: Wire::new(position_bits()),
            square: Wire::new(square_bits()),
            radius: Wire::new(square_bits()),
            done: Default::default(),
            improved: Default::default(),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            taken: Default::default(),
            found: Default::default(),
            _taxels: taxels as i64,
            _left: 0,
            _best: Default::default(),
            _found: false,
        }
    }

    /// Judges all nine at once, as they stand at the last cycle of the pipeline.
    fn judge(&mut self) -> bool {
        let (s, t) = (self.sums.width() / 9, self.totals.width() / 9);
        let coarse = self.coarse.val();
        let centre = [&self.centre_x, &self.centre_y].map(|wire| wire.val().signed(0, position_bits()));
        let mut improved = false;
        for k in ORDERS[usize::from(coarse)] {
            let (ux, uy) = ((k % 3) as i64 - 1, (k / 3) as i64 - 1);
            let sum = self.sums.val().signed(k, s);
            let square =
                self.square.val().number() as i64 + 2 * (ux * centre[0] + uy * centre[1]) + ux.abs() + uy.abs();
            let inside = square <= self.radius.val().number() as i64;
            if sum <= 0 || !inside || !(coarse || self._found) {
                continue;
            }
            let score = self.totals.val().signed(k, t) - self._taxels * log2(sum);
            let position = [(centre[0] + ux) as i32, (centre[1] + uy) as i32];
            let best = &mut self._best;
            let earlier = coarse && (position[1], position[0]) < (best.position[1], best.position[0]);
            if !best.taken || score < best.score || (score == best.score && earlier) {
                *best = Best { position, score, taken: true };
                improved = true;
            }
        }
        self._found |= coarse && self._best.taken;
        improved
    }
}

impl Logic for Judge {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.done.next = false;
            if self._left == 1 {
                self.improved.next = self.judge();
                self.done.next = true;
            }
            self._left = match (self.rst.val(), self.start.val()) {
                (true, _) => 0,
                (false, true) => LATENCY - 1,
                (false, false) => self._left.saturating_sub(1),
            };
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
        self.done.connect();
        self.improved.connect();
        self.best_x.connect();
        self.best_y.connect();
        self.score.connect();
        self.taken.connect();
        self.found.connect();
    }

    fn hdl(&self) -> Verilog {
        let (s, t) = (self.sums.width() / 9, self.totals.width() / 9);
        let (p, q) = (position_bits(), square_bits());
        let slot = LOG_TABLE_BITS as usize;
        let product = LOG_BITS + 64 - (self._taxels as u64).leading_zeros() as usize;
        // n·log2 Σp without a multiplier: one term for each bit of n.
        let terms: Vec<String> = (0..64)
            .filter(|bit| self._taxels >> bit & 1 == 1)
            .map(|bit| format!("({{{}'d0, log}} << {bit})", product - LOG_BITS))
            .collect();
        let select = |word: &str, by: &str, width: usize| {
            let cases: String =
                (0..9).map(|k| format!("    4'd{k}: {word}_k = {word}s[{} +: {width}];\n", k * width)).collect();
            format!(
                "reg [{end}:0] {word}_k;\nalways @(*) begin\n  case ({by})\n{cases}    default: {word}_k = {width}'d0;\n  endcase\nend\n",
                end = width - 1
            )
        };
        Verilog::Custom(format!(
            "\
{locate}{table}// Turn m = 0 … 8 looks at candidate k.
reg [3:0] turn;
reg running;
wire [3:0] k = coarse ? turn : turn == 4'd0 ? 4'd4 : turn <= 4'd4 ? turn - 4'd1 : turn;
reg [3:0] k1, k2, k3;
{totals}{sums}// Stage 1: select; offsets −1, 0, 1 in x (low bits) and y.
reg [3:0] valid;
reg [3:0] finish;
reg [{t_end}:0] total4;
reg [{s_end}:0] sum1;
reg [{found_end}:0] found2;
reg [{log_end}:0] log;
reg [{product_end}:0] weighted;
reg ok1, ok2, ok3, ok4;
reg signed [{p_end}:0] x1, y1, x2, y2, x3, y3, x4, y4;
reg signed [1:0] ux, uy;
always @(*) begin
  case (k)
    4'd0, 4'd3, 4'd6: ux = -2'sd1;
    4'd1, 4'd4, 4'd7: ux = 2'sd0;
    default: ux = 2'sd1;
  endcase
  case (k)
    4'd0, 4'd1, 4'd2: uy = -2'sd1;
    4'd3, 4'd4, 4'd5: uy = 2'sd0;
    default: uy = 2'sd1;
  endcase
end
// |c + u|² = |c|² + 2 (ux cx + uy cy) + |ux| + |uy|: the disc needs no multiplier.
wire [{q_end}:0] wide_x = {{{{{q_more}{{centre_x[{p_end}]}}}}, centre_x}};
wire [{q_end}:0] wide_y = {{{{{q_more}{{centre_y[{p_end}]}}}}, centre_y}};
wire [{q_end}:0] along_x = ux[1] ? {q}'d1 - (wide_x << 1) : ux[0] ? {q}'d1 + (wide_x << 1) : {q}'d0;
wire [{q_end}:0] along_y = uy[1] ? {q}'d1 - (wide_y << 1) : uy[0] ? {q}'d1 + (wide_y << 1) : {q}'d0;
wire [{q_end}:0] distance = square + along_x + along_y;
wire [{p_end}:0] step_x = {{{{{p_more}{{ux[1]}}}}, ux}};
wire [{p_end}:0] step_y = {{{{{p_more}{{uy[1]}}}}, uy}};
wire signed [{t_end}:0] score_k = total4 - {weighted};
wire signed [{t_end}:0] score_best = score;
wire signed [{p_end}:0] bx = best_x;
wire signed [{p_end}:0] by = best_y;
wire earlier = coarse && (y4 < by || (y4 == by && x4 < bx));
wire better = !taken || score_k < score_best || (score_k == score_best && earlier);
wire take = valid[3] && ok4 && better;
always @(posedge clk) begin
  {{k3, k2, k1}} <= {{k2, k1, k}};
  total4 <= total_k;
  sum1 <= sum_k;
  ok1 <= !sum_k[{s_end}] && sum_k != {s}'d0 && distance <= radius && (coarse || found);
  x1 <= centre_x + step_x;
  y1 <= centre_y + step_y;
  found2 <= locate(sum1);
  log <= {{found2[{found_end}:{slot}], fraction(found2[{slot_end}:0])}};
  weighted <= {terms};
  {{ok4, ok3, ok2}} <= {{ok3, ok2, ok1}};
  {{x4, x3, x2}} <= {{x3, x2, x1}};
  {{y4, y3, y2}} <= {{y3, y2, y1}};
end
always @(posedge clk) begin
  if (rst) begin
    running <= 1'b0;
    valid <= 4'd0;
    finish <= 4'd0;
    done <= 1'b0;
  end else begin
    if (start) running <= 1'b1;
    else if (turn == 4'd8) running <= 1'b0;
    valid <= {{valid[2:0], running}};
    finish <= {{finish[2:0], running && turn == 4'd8}};
    done <= finish[3];
  end
  turn <= start ? 4'd0 : turn + 4'd1;
  if (start) improved <= 1'b0;
  else if (take) improved <= 1'b1;
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
    best_x <= x4;
    best_y <= y4;
    score <= score_k;
    taken <= 1'b1;
    if (coarse) found <= 1'b1;
  end
end",
            locate = locate("locate", s),
            table = table("fraction"),
            totals = select("total", "k3", t),
            sums = select("sum", "k", s),
            t_end = t - 1,
            s_end = s - 1,
            found_end = LENGTH_BITS + slot - 1,
            slot_end = slot - 1,
            log_end = LOG_BITS - 1,
            product_end = product - 1,
            p_end = p - 1,
            p_more = p - 2,
            q_end = q - 1,
            q_more = q - p,
            weighted = match t.checked_sub(product) {
                Some(0) => "weighted".to_string(),
                Some(more) => format!("{{{more}'d0, weighted}}"),
                None => resize("weighted", product, t),
            },
            terms = terms.join(" + "),
        ))
    }
}
