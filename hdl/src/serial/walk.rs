//! Stage `search`: sequencer of the sweeps over the polynomials, and comparison of the candidates after each.
//!
//! A sweep takes 16 cycles per polynomial, the sum polynomial first. `tick` counts them; a word is at each point a
//! fixed number of ticks later:
//! ```text
//! tick      0     bank's address: coefficients by rows of equal j, highest i first
//!           1     word into the chain along x; leaves from 5 on into the transpose memory
//!          18     out of it, by columns of equal i, highest j first
//!          19     into the chain along y; leaves from 23 on, halved in a register
//!          24     into the other bank, and to the candidates
//! ```
//! The disc test needs no product: x² + y² − r² is updated, times four at a halving, and by ±2x + 1 from one candidate
//! to the next.

use dermis_golden::fixed::formats::{Formats, HALVINGS};
use dermis_golden::fixed::search::{CENTRE, COARSE_CENTRES};
use dermis_golden::fixed::serial::{polynomials, SELECTION, SLOT, SWEEP_TAIL, TRANSPOSE};
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, position_bits};
use crate::wire::{Wire, Word};

/// Width of x² + y² − r², in bits, signed.
const DISC_BITS: usize = 21;
const COARSE: u64 = COARSE_CENTRES.len() as u64;
const LAST: u64 = COARSE + HALVINGS as u64;
const IDLE: u64 = 0;
const SET_UP: u64 = 1;
const RUN: u64 = 2;
const JUDGE: u64 = 3;
/// Ticks from a bank's address to the word entering the chain along y; then to the word leaving it, and to its
/// write-back.
const ALONG_Y: u64 = TRANSPOSE + 1;
const LEAVES: u64 = ALONG_Y + 4;
const BACK: u64 = LEAVES + 1;

/// Addresses of the sweeps and the best candidate; timing in the module docs.
#[derive(LogicBlock)]
pub struct Walk {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; stops the search.
    pub rst: Signal<In, Bit>,
    /// The polynomials are being written: the odd bank is selected for reading, the even one for writing.
    pub filling: Signal<In, Bit>,
    /// All polynomials have been written: start the search.
    pub start: Signal<In, Bit>,
    /// Search; otherwise p(0) is the result. Valid with `start`.
    pub enabled: Signal<In, Bit>,
    /// Index of the polynomial whose value is read when no sweep runs.
    pub wanted: Wire<In>,
    /// The odd bank is read.
    pub odd: Signal<Out, Bit>,
    /// `{region, polynomial, coefficient}` to read.
    pub read_address: Wire<Out>,
    /// Chain along x: cycle of the polynomial.
    pub x_element: Wire<Out>,
    /// Chain along x: degree in x.
    pub x_top: Wire<Out>,
    /// Chain along x: the centre moves.
    pub x_moves: Signal<Out, Bit>,
    /// Chain along x: by −1.
    pub x_down: Signal<Out, Bit>,
    /// Address in the transpose memory to write.
    pub turn_write: Wire<Out>,
    /// Address in the transpose memory to read.
    pub turn_read: Wire<Out>,
    /// Chain along y: cycle of the polynomial.
    pub y_element: Wire<Out>,
    /// Chain along y: degree in y.
    pub y_top: Wire<Out>,
    /// Chain along y: the centre moves.
    pub y_moves: Signal<Out, Bit>,
    /// Chain along y: by −1.
    pub y_down: Signal<Out, Bit>,
    /// Right shift i + j of the coefficient that leaves the chain along y, in a halving; otherwise 0.
    pub halvings: Wire<Out>,
    /// Write the shifted coefficient to the bank that is not read.
    pub write: Signal<Out, Bit>,
    /// `{region, polynomial, coefficient}` to write; valid with `write`.
    pub write_address: Wire<Out>,
    /// Cycle 4i + j of the coefficient that goes to the candidates.
    pub cycle: Wire<Out>,
    /// As `present` of [`Candidates`](super::Candidates).
    pub present: Wire<Out>,
    /// As `sums` of [`Candidates`](super::Candidates).
    pub sums: Wire<Out>,
    /// The coefficient written is a taxel's value p(μ*).
    pub value_valid: Signal<Out, Bit>,
    /// The comparison reads the totals, so they are addressed by `candidate`.
    pub judging: Signal<Out, Bit>,
    /// Index of the candidate whose total is read; valid with `judging`.
    pub candidate: Wire<Out>,
    /// `{Σp > 0, total}`, one cycle after `candidate`.
    pub total: Wire<In>,
    /// Best position, x, in grid steps of the level, signed.
    pub best_x: Wire<Out>,
    /// Best position, y, in grid steps of the level, signed.
    pub best_y: Wire<Out>,
    /// Score of the best candidate, signed, 2^−6.
    pub score: Wire<Out>,
    /// A candidate was found in the coarse grid.
    pub found: Signal<Out, Bit>,
    /// A candidate was taken at this level.
    pub taken: Signal<Out, Bit>,
    /// The candidates of a sweep have been compared; high for one cycle.
    pub judged: Signal<Out, Bit>,
    /// All values are in the bank that is now read; high for one cycle.
    pub done: Signal<Out, Bit>,
    _degree: u64,
    _polynomials: u64,
    _state: State,
}

/// Location of a set of polynomials: bank and region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Region {
    odd: bool,
    upper: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    state: u64,
    sweep: u64,
    tick: u64,
    enabled: bool,
    moves: [i64; 2],
    source: Region,
    target: Region,
    current: Region,
    kept: Region,
    count: u64,
    turns: [u64; 3],
    position: [i64; 2],
    takes: bool,
    settled: i64,
    centre: [i64; 2],
    centre_disc: i64,
    disc: i64,
    best: [i64; 2],
    best_disc: i64,
    offset: [i64; 2],
    score: i64,
    taken: bool,
    found: bool,
    improved: bool,
}

/// Move to the coarse centre of `sweep` from the previous one.
fn coarse_step(sweep: usize) -> [i64; 2] {
    let before = if sweep == 0 { [0, 0] } else { COARSE_CENTRES[sweep - 1] };
    [0, 1].map(|axis| i64::from(COARSE_CENTRES[sweep][axis] - before[axis]))
}

/// x² + y² − r² at the coarse centre of `sweep`, r = 3.
fn coarse_disc(sweep: usize) -> i64 {
    let [x, y] = COARSE_CENTRES[sweep].map(i64::from);
    x * x + y * y - 9
}

impl Walk {
    /// With the widths and the degree of `formats`.
    pub fn new(formats: &Formats) -> Self {
        let polynomials = polynomials(formats);
        let bits = count_bits(polynomials);
        Walk {
            clk: Default::default(),
            rst: Default::default(),
            filling: Default::default(),
            start: Default::default(),
            enabled: Default::default(),
            wanted: Wire::new(bits),
            odd: Default::default(),
            read_address: Wire::new(1 + bits + 4),
            x_element: Wire::new(2),
            x_top: Wire::new(2),
            x_moves: Default::default(),
            x_down: Default::default(),
            turn_write: Wire::new(6),
            turn_read: Wire::new(6),
            y_element: Wire::new(2),
            y_top: Wire::new(2),
            y_moves: Default::default(),
            y_down: Default::default(),
            halvings: Wire::new(2),
            write: Default::default(),
            write_address: Wire::new(1 + bits + 4),
            cycle: Wire::new(4),
            present: Wire::new(2),
            sums: Wire::new(2),
            value_valid: Default::default(),
            judging: Default::default(),
            candidate: Wire::new(4),
            total: Wire::new(formats.score_bits as usize + 1),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            score: Wire::new(formats.score_bits as usize),
            found: Default::default(),
            taken: Default::default(),
            judged: Default::default(),
            done: Default::default(),
            _degree: formats.degree as u64,
            _polynomials: polynomials as u64,
            _state: State::default(),
        }
    }

    fn run_end(&self) -> bool {
        self._state.state == RUN && self._state.tick == SLOT * self._polynomials + SWEEP_TAIL - 1
    }

    /// Index of the candidate that is next: in a halving the centre comes first.
    fn in_turn(&self) -> u64 {
        let s = &self._state;
        match (s.sweep < COARSE, s.count / 2) {
            (true, order) => order,
            (false, 0) => CENTRE as u64,
            (false, order) if order <= CENTRE as u64 => order - 1,
            (false, order) => order,
        }
    }

    fn clocked(&mut self) {
        let s = self._state;
        let mut next = s;
        match s.state {
            IDLE if self.start.val() => {
                let sweep = if self.enabled.val() { 0 } else { LAST };
                next = State { state: SET_UP, sweep, enabled: self.enabled.val(), ..State::default() };
            }
            SET_UP => {
                next.state = RUN;
                next.tick = 0;
                next.source = if s.sweep < COARSE { s.current } else { s.kept };
                let odd = !next.source.odd;
                next.target = Region { odd, upper: odd == s.kept.odd && !s.kept.upper };
                next.improved = false;
                if s.sweep < COARSE {
                    next.moves = coarse_step(s.sweep as usize);
                    next.centre = [0, 1].map(|axis| s.centre[axis] + next.moves[axis]);
                    next.centre_disc = coarse_disc(s.sweep as usize);
                } else {
                    next.moves = s.offset;
                    if s.sweep < LAST {
                        next.best = s.best.map(|p| 2 * p);
                        next.centre = next.best;
                        next.best_disc = 4 * s.best_disc;
                        next.centre_disc = 4 * s.best_disc;
                        next.offset = [0, 0];
                        next.taken = false;
                    }
                    if s.sweep == COARSE {
                        next.found = s.taken;
                    }
                }
            }
            RUN => {
                next.tick = s.tick + 1;
                if self.run_end() {
                    next.state = if s.sweep == LAST { IDLE } else { JUDGE };
                    next.count = 0;
                    next.takes = false;
                }
            }
            JUDGE => self.judge(&mut next),
            _ => {}
        }
        if self.rst.val() {
            next.state = IDLE;
        }
        self._state = next;
    }

    /// Compares a candidate every two cycles, five cycles each: index, disc by x, disc by y and position, decision,
    /// update.
    fn judge(&self, next: &mut State) {
        let s = self._state;
        let coarse = s.sweep < COARSE;
        let offset = |turn: u64| [turn as i64 % 3 - 1, turn as i64 / 3 - 1];
        let further = |axis: usize| match offset(s.turns[0])[axis] {
            0 => 0,
            sign => 2 * sign * s.centre[axis] + 1,
        };
        let bits = self.score.width();
        let total = self.total.val().signed(0, bits);
        next.count = s.count + 1;
        next.turns[2] = s.turns[0];
        if s.count % 2 == 1 {
            next.disc = s.centre_disc + further(0);
            next.settled = s.disc;
            let earlier = coarse && (s.position[1], s.position[0]) < (s.best[1], s.best[0]);
            let better = !s.taken || total < s.score || (total == s.score && earlier);
            let eligible = self.total.val().field(bits, 1) == 1 && s.disc <= 0 && (coarse || s.found);
            next.takes = s.count >= 3 && eligible && better;
            return;
        }
        next.turns[0] = self.in_turn();
        next.turns[1] = s.turns[0];
        next.disc = s.disc + further(1);
        next.position = [0, 1].map(|axis| s.centre[axis] + offset(s.turns[0])[axis]);
        if s.takes {
            (next.best, next.score, next.taken) = (s.position, total, true);
            (next.offset, next.best_disc, next.improved) = (offset(s.turns[1]), s.settled, true);
        }
        if s.count == SELECTION - 1 {
            next.state = SET_UP;
            next.sweep = s.sweep + 1;
            next.current = s.target;
            if !coarse || next.improved {
                next.kept = s.target;
            }
        }
    }
}

impl Logic for Walk {
    fn update(&mut self) {
        let done = self.run_end() && self._state.sweep == LAST;
        if self.clk.pos_edge() {
            self.done.next = done && !self.rst.val();
            self.clocked();
        }
        let s = self._state;
        let bits = self.wanted.width();
        let running = s.state == RUN;
        let behind = |ticks: u64| s.tick.wrapping_sub(ticks);
        let address = |region: Region, polynomial: u64, code: u64| {
            Word::from((u64::from(region.upper) << bits | polynomial & ((1 << bits) - 1)) << 4 | code)
        };
        self.odd.next = match (self.filling.val(), running) {
            (true, _) => true,
            (false, true) => s.source.odd,
            (false, false) => s.target.odd,
        };
        self.read_address.next = match running {
            true => address(s.source, s.tick >> 4, (s.tick >> 2 & 3) << 2 | !s.tick & 3),
            false => address(s.target, self.wanted.val().number(), 0),
        };
        self.x_element.next = Word::from(behind(1) & 3);
        self.x_top.next = Word::from(self._degree.wrapping_sub(behind(1) >> 2 & 3) & 3);
        self.x_moves.next = s.moves[0] != 0;
        self.x_down.next = s.moves[0] < 0;
        self.turn_write.next = Word::from(behind(5) & 63);
        let turned = behind(TRANSPOSE);
        self.turn_read.next = Word::from((turned >> 4 & 3) << 4 | (!turned & 3) << 2 | turned >> 2 & 3);
        self.y_element.next = Word::from(behind(ALONG_Y) & 3);
        self.y_top.next = Word::from(self._degree.wrapping_sub(behind(ALONG_Y) >> 2 & 3) & 3);
        self.y_moves.next = s.moves[1] != 0;
        self.y_down.next = s.moves[1] < 0;
        let leaves = behind(LEAVES);
        let halves = s.sweep >= COARSE && s.sweep < LAST;
        self.halvings.next = Word::from(if halves { ((leaves >> 2 & 3) + (leaves & 3)) & 3 } else { 0 });
        let back = behind(BACK);
        let started = s.tick >= BACK;
        let slot = back >> 4;
        let present = running && started && slot < self._polynomials;
        self.write.next = present;
        self.write_address.next = address(s.target, slot, (back & 3) << 2 | back >> 2 & 3);
        self.cycle.next = Word::from(back & 15);
        let before = running && started && slot >= 1 && slot <= self._polynomials;
        let scored = s.sweep != LAST;
        self.present.next = Word::from(u64::from(present && scored) | u64::from(before && scored) << 1);
        self.sums.next = Word::from(u64::from(slot == 0) | u64::from(slot == 1) << 1);
        self.value_valid.next = present && s.sweep == LAST && slot >= 1 && back & 15 == 0;
        self.judging.next = s.state == JUDGE;
        self.candidate.next = Word::from(s.turns[2] & 15);
        self.best_x.next = Word::of_fields(&[s.best[0]], position_bits());
        self.best_y.next = Word::of_fields(&[s.best[1]], position_bits());
        self.score.next = Word::of_fields(&[s.score], self.score.width());
        self.found.next = s.found;
        self.taken.next = s.taken;
        self.judged.next = s.state == SET_UP && s.enabled && s.sweep != 0;
    }

    fn connect(&mut self) {
        let wires = [
            &mut self.read_address,
            &mut self.x_element,
            &mut self.x_top,
            &mut self.turn_write,
            &mut self.turn_read,
            &mut self.y_element,
            &mut self.y_top,
            &mut self.halvings,
            &mut self.write_address,
            &mut self.cycle,
            &mut self.present,
            &mut self.sums,
            &mut self.candidate,
            &mut self.best_x,
            &mut self.best_y,
            &mut self.score,
        ];
        wires.into_iter().for_each(Wire::connect);
        let bits = [
            &mut self.odd,
            &mut self.x_moves,
            &mut self.x_down,
            &mut self.y_moves,
            &mut self.y_down,
            &mut self.write,
            &mut self.value_valid,
            &mut self.judging,
            &mut self.found,
            &mut self.taken,
            &mut self.judged,
            &mut self.done,
        ];
        bits.into_iter().for_each(Signal::connect);
    }

    fn hdl(&self) -> Verilog {
        let bits = self.wanted.width();
        let tick = bits + 5;
        let (position, score) = (self.best_x.width(), self.score.width());
        let terms = |of: &dyn Fn(usize) -> bool| {
            let terms: Vec<String> =
                (0..COARSE as usize).filter(|&s| of(s)).map(|s| format!("sweep == 4'd{s}")).collect();
            format!("({})", terms.join(" || "))
        };
        let degree = self._degree;
        Verilog::Custom(format!(
            "\
reg [1:0] state;
reg [4:0] count;
reg [3:0] sweep, turn, turn_then, turn_read_then;
reg [{te}:0] tick;
reg searching, improved, takes;
// Moves and offsets along an axis: bit 1 moves, bit 0 down.
reg [1:0] move_x, move_y, offset_x, offset_y;
// Locations of polynomials: bit 1 odd bank, bit 0 upper region.
reg [1:0] source, target, current, kept;
reg [{pe}:0] centre_x, centre_y;
reg [{pe}:0] new_x, new_y;
reg signed [{de}:0] centre_disc, disc, settled, best_disc;
wire coarse = sweep < 4'd{coarse};
wire final_sweep = sweep == 4'd{last};
wire running = state == 2'd2;
wire run_end = running && tick == {tick}'d{tick_end};
wire [1:0] from = coarse ? current : kept;
wire down_x = {down_x};
wire down_y = {down_y};
wire [3:0] order = count[4:1];
wire [3:0] in_turn = coarse ? order : order == 4'd0 ? 4'd{centre} : order <= 4'd{centre} ? order - 4'd1 : order;
wire left = turn == 4'd0 || turn == 4'd3 || turn == 4'd6;
wire right = turn == 4'd2 || turn == 4'd5 || turn == 4'd8;
wire above = turn < 4'd3;
wire below = turn >= 4'd6;
wire left_then = turn_then == 4'd0 || turn_then == 4'd3 || turn_then == 4'd6;
wire right_then = turn_then == 4'd2 || turn_then == 4'd5 || turn_then == 4'd8;
wire above_then = turn_then < 4'd3;
wire below_then = turn_then >= 4'd6;
wire along_y = !count[0];
wire [{pe}:0] centre_along = along_y ? centre_y : centre_x;
wire backward = along_y ? above : left;
wire sideways = along_y ? above || below : left || right;
wire [{pe}:0] signed_centre = centre_along ^ {{{position}{{backward}}}};
// 2x + 1, or -2x + 1 as twice the complement, plus 1, plus 2.
wire [{de}:0] further = {{{{{disc_fill}{{signed_centre[{pe}]}}}}, signed_centre, 1'b1}} + {{{disc_less}'d0, backward, 1'b0}};
wire [{de}:0] disc_before = along_y ? disc : centre_disc;
wire signed [{pe}:0] best_y_now = best_y, best_x_now = best_x, new_x_now = new_x, new_y_now = new_y;
wire signed [{se}:0] score_now = score, total_now = total[{se}:0];
wire earlier = coarse && (new_y_now < best_y_now || (new_y == best_y && new_x_now < best_x_now));
wire better = !taken || total_now < score_now || (total_now == score_now && earlier);
wire in_disc = disc[{de}] || disc == {disc_bits}'d0;
wire [{te}:0] behind1 = tick - {tick}'d1;
wire [{te}:0] behind5 = tick - {tick}'d5;
wire [{te}:0] turned = tick - {tick}'d{transpose};
wire [{te}:0] second = tick - {tick}'d{along_y};
wire [{te}:0] leaving = tick - {tick}'d{leaves};
wire [{te}:0] back = tick - {tick}'d{back};
wire [{be}:0] slot = back[{slot_end}:4];
wire early = back[{te}];
wire whole = running && !early && slot < {bits}'d{polynomials};
wire whole_before = running && !early && slot != {bits}'d0 && slot <= {bits}'d{polynomials};
wire unused = &{{1'b0, best_disc[{de}:{dl_over}], behind1[{te}:4], behind5[{te}:6], turned[{te}:6], second[{te}:4], leaving[{te}:4]}};
always @(posedge clk) begin
  done <= run_end && final_sweep && !rst;
  case (state)
    2'd0: if (start) begin
      state <= 2'd1;
      sweep <= enabled ? 4'd0 : 4'd{last};
      searching <= enabled;
      current <= 2'd0;
      kept <= 2'd0;
      move_x <= 2'd0;
      move_y <= 2'd0;
      offset_x <= 2'd0;
      offset_y <= 2'd0;
      centre_x <= {position}'d0;
      centre_y <= {position}'d0;
      best_x <= {position}'d0;
      best_y <= {position}'d0;
      best_disc <= {disc_bits}'d0;
      score <= {score}'d0;
      taken <= 1'b0;
      found <= 1'b0;
    end
    2'd1: begin
      state <= 2'd2;
      tick <= {tick}'d0;
      source <= from;
      target <= {{!from[1], !from[1] == kept[1] && !kept[0]}};
      improved <= 1'b0;
      if (coarse) begin
        move_x <= {{1'b1, down_x}};
        move_y <= {{1'b1, down_y}};
        centre_x <= centre_x + {{{{{pe}{{down_x}}}}, 1'b1}};
        centre_y <= centre_y + {{{{{pe}{{down_y}}}}, 1'b1}};
        centre_disc <= sweep[0] ? -{disc_bits}'sd{odd_disc} : -{disc_bits}'sd{even_disc};
      end else begin
        move_x <= offset_x;
        move_y <= offset_y;
        if (!final_sweep) begin
          best_x <= {{best_x[{pl}:0], 1'b0}};
          best_y <= {{best_y[{pl}:0], 1'b0}};
          centre_x <= {{best_x[{pl}:0], 1'b0}};
          centre_y <= {{best_y[{pl}:0], 1'b0}};
          best_disc <= {{best_disc[{dl}:0], 2'd0}};
          centre_disc <= {{best_disc[{dl}:0], 2'd0}};
          offset_x <= 2'd0;
          offset_y <= 2'd0;
          taken <= 1'b0;
        end
        if (sweep == 4'd{coarse}) found <= taken;
      end
    end
    2'd2: begin
      tick <= tick + {tick}'d1;
      if (run_end) begin
        state <= final_sweep ? 2'd0 : 2'd3;
        count <= 5'd0;
        takes <= 1'b0;
      end
    end
    default: begin
      count <= count + 5'd1;
      turn_read_then <= turn;
      disc <= disc_before + (sideways ? further : {disc_bits}'d0);
      if (count[0]) begin
        settled <= disc;
        takes <= count >= 5'd3 && total[{score}] && in_disc && (coarse || found) && better;
      end else begin
        turn <= in_turn;
        turn_then <= turn;
        new_x <= centre_x + {{{{{pe}{{left}}}}, left || right}};
        new_y <= centre_y + {{{{{pe}{{above}}}}, above || below}};
        if (takes) begin
          best_x <= new_x;
          best_y <= new_y;
          score <= total[{se}:0];
          taken <= 1'b1;
          offset_x <= {{left_then || right_then, left_then}};
          offset_y <= {{above_then || below_then, above_then}};
          best_disc <= settled;
          improved <= 1'b1;
        end
        if (count == 5'd{last_count}) begin
          state <= 2'd1;
          sweep <= sweep + 4'd1;
          current <= target;
          if (!coarse || improved || takes) kept <= target;
        end
      end
    end
  endcase
  if (rst) state <= 2'd0;
end
always @(*) begin
  odd = filling || (running ? source[1] : target[1]);
  read_address = running ? {{source[0], tick[{slot_end}:4], tick[3:2], ~tick[1:0]}} : {{target[0], wanted, 4'd0}};
  x_element = behind1[1:0];
  x_top = 2'd{degree} - behind1[3:2];
  x_moves = move_x[1];
  x_down = move_x[0];
  turn_write = behind5[5:0];
  turn_read = {{turned[5:4], ~turned[1:0], turned[3:2]}};
  y_element = second[1:0];
  y_top = 2'd{degree} - second[3:2];
  y_moves = move_y[1];
  y_down = move_y[0];
  halvings = coarse || final_sweep ? 2'd0 : leaving[3:2] + leaving[1:0];
  write = whole;
  write_address = {{target[0], slot, back[1:0], back[3:2]}};
  cycle = back[3:0];
  present = {{whole_before && !final_sweep, whole && !final_sweep}};
  sums = {{slot == {bits}'d1, slot == {bits}'d0}};
  value_valid = whole && final_sweep && slot != {bits}'d0 && back[3:0] == 4'd0;
  judging = state == 2'd3;
  candidate = turn_read_then;
  judged = state == 2'd1 && searching && sweep != 4'd0;
end",
            te = tick - 1,
            be = bits - 1,
            pe = position - 1,
            pl = position - 2,
            de = DISC_BITS - 1,
            dl = DISC_BITS - 3,
            dl_over = DISC_BITS - 2,
            se = score - 1,
            disc_bits = DISC_BITS,
            disc_fill = DISC_BITS - position - 1,
            disc_less = DISC_BITS - 2,
            coarse = COARSE,
            last = LAST,
            tick_end = SLOT * self._polynomials + SWEEP_TAIL - 1,
            down_x = terms(&|s| coarse_step(s)[0] < 0),
            down_y = terms(&|s| coarse_step(s)[1] < 0),
            centre = CENTRE,
            odd_disc = -coarse_disc(1),
            even_disc = -coarse_disc(0),
            back = BACK,
            slot_end = tick - 2,
            polynomials = self._polynomials,
            last_count = SELECTION - 1,
            transpose = TRANSPOSE,
            along_y = ALONG_Y,
            leaves = LEAVES,
        ))
    }
}
