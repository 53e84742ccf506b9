//! Where the search goes: the order of sweeps, centres and buffers.

use dermis_golden::fixed::formats::HALVINGS;
use dermis_golden::fixed::search::COARSE_CENTRES;
use rust_hdl::prelude::*;

use super::judge::{position_bits, square_bits};
use crate::wire::{Wire, Word};

/// Sweeps over the coarse tiles, then the halvings, then one that only moves to the winner.
///
/// `set_up`, which may come with `judged`, begins a sweep, whose move, centre and buffers stand from the next cycle until the following `set_up`. Two buffers are enough: a coarse sweep
/// writes over its source unless that holds the best polynomial so far; halvings work in place. `judged` with
/// `improved` makes the sweep's buffer the best.
#[derive(LogicBlock)]
pub struct Walk {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// New frame.
    pub begin_frame: Signal<In, Bit>,
    /// Search it; otherwise only the last sweep follows.
    pub enabled: Signal<In, Bit>,
    /// Set up the next sweep.
    pub set_up: Signal<In, Bit>,
    /// A sweep has been judged.
    pub judged: Signal<In, Bit>,
    /// It changed the best.
    pub improved: Signal<In, Bit>,
    /// Best position, x.
    pub best_x: Wire<In>,
    /// Best position, y.
    pub best_y: Wire<In>,
    /// Move along x, −1, 0 or 1.
    pub dx: Wire<Out>,
    /// Move along y.
    pub dy: Wire<Out>,
    /// Halve the step after the move.
    pub halving: Signal<Out, Bit>,
    /// The sweep is one of the coarse grid.
    pub coarse: Signal<Out, Bit>,
    /// The sweep is the last: move to the winner.
    pub last: Signal<Out, Bit>,
    /// The next sweep is a halving.
    pub next_halves: Signal<Out, Bit>,
    /// Buffer to read.
    pub source: Signal<Out, Bit>,
    /// Buffer to write.
    pub target: Signal<Out, Bit>,
    /// The new centre, x.
    pub centre_x: Wire<Out>,
    /// The new centre, y.
    pub centre_y: Wire<Out>,
    /// Its squared distance from μ = 0.
    pub square: Wire<Out>,
    /// Squared radius of the disc.
    pub radius: Wire<Out>,
    _state: State,
}

/// Number of sweeps that are judged.
pub const JUDGED: usize = COARSE_CENTRES.len() + HALVINGS as usize;
const SWEEP_BITS: usize = 4;

#[derive(Clone, Copy, Debug, Default)]
struct State {
    sweep: usize,
    centre: [i64; 2],
    square: i64,
    kept_centre: [i64; 2],
    kept_square: i64,
    current: bool,
    kept: bool,
    radius: i64,
}

impl Default for Walk {
    fn default() -> Self {
        let (p, q) = (position_bits(), square_bits());
        Walk {
            clk: Default::default(),
            begin_frame: Default::default(),
            enabled: Default::default(),
            set_up: Default::default(),
            judged: Default::default(),
            improved: Default::default(),
            best_x: Wire::new(p),
            best_y: Wire::new(p),
            dx: Wire::new(2),
            dy: Wire::new(2),
            halving: Default::default(),
            coarse: Default::default(),
            last: Default::default(),
            next_halves: Default::default(),
            source: Default::default(),
            target: Default::default(),
            centre_x: Wire::new(p),
            centre_y: Wire::new(p),
            square: Wire::new(q),
            radius: Wire::new(q),
            _state: State::default(),
        }
    }
}

/// Moves of the coarse sweeps.
fn coarse_moves() -> Vec<[i32; 2]> {
    let mut at = [0, 0];
    COARSE_CENTRES
        .iter()
        .map(|to| {
            let step = [to[0] - at[0], to[1] - at[1]];
            at = *to;
            step
        })
        .collect()
}

impl Walk {
    fn advance(&mut self) {
        let s = &mut self._state;
        let coarse = s.sweep < COARSE_CENTRES.len();
        let halving = !coarse && s.sweep < JUDGED;
        let best = [&self.best_x, &self.best_y].map(|wire| wire.val().signed(0, position_bits()));
        let (from, square) = if coarse { (s.centre, s.square) } else { (s.kept_centre, s.kept_square) };
        let step = match coarse_moves().get(s.sweep) {
            Some(step) => step.map(i64::from),
            None => [best[0] - from[0], best[1] - from[1]],
        };
        let moved = [from[0] + step[0], from[1] + step[1]];
        let square = square + 2 * (step[0] * from[0] + step[1] * from[1]) + step[0].abs() + step[1].abs();
        self.source.next = if coarse { s.current } else { s.kept };
        let double = i64::from(halving);
        s.centre = moved.map(|c| c << double);
        s.square = square << (2 * double);
        s.radius <<= 2 * double;
        if coarse {
            s.current = if s.current == s.kept { !s.current } else { s.current };
            self.target.next = s.current;
        } else {
            s.kept_centre = s.centre;
            s.kept_square = s.square;
            self.target.next = s.kept;
        }
        self.dx.next = Word::of_fields(&[step[0]], 2);
        self.dy.next = Word::of_fields(&[step[1]], 2);
        self.coarse.next = coarse;
        self.halving.next = halving;
        self.last.next = !coarse && !halving;
        s.sweep += 1;
    }
}

impl Logic for Walk {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            if self.begin_frame.val() {
                let sweep = if self.enabled.val() { 0 } else { JUDGED };
                self._state = State { sweep, radius: 9, ..State::default() };
            }
            if self.judged.val() && self.improved.val() && self.coarse.val() {
                let s = &mut self._state;
                (s.kept_centre, s.kept_square, s.kept) = (s.centre, s.square, s.current);
            }
            if self.set_up.val() {
                self.advance();
            }
            let s = &self._state;
            self.centre_x.next = Word::of_fields(&s.centre[..1], position_bits());
            self.centre_y.next = Word::of_fields(&s.centre[1..], position_bits());
            self.square.next = Word::from(s.square as u64);
            self.radius.next = Word::from(s.radius as u64);
            self.next_halves.next = (COARSE_CENTRES.len()..JUDGED).contains(&s.sweep);
        }
    }

    fn connect(&mut self) {
        for wire in [&mut self.dx, &mut self.dy, &mut self.centre_x, &mut self.centre_y, &mut self.square] {
            wire.connect();
        }
        self.radius.connect();
        for bit in [&mut self.halving, &mut self.coarse, &mut self.last, &mut self.next_halves, &mut self.source] {
            bit.connect();
        }
        self.target.connect();
    }

    fn hdl(&self) -> Verilog {
        let (p, q) = (position_bits(), square_bits());
        let two = |value: i32| value & 3;
        let cases: String = coarse_moves()
            .iter()
            .enumerate()
            .map(|(sweep, [x, y])| {
                format!("    {SWEEP_BITS}'d{sweep}: {{table_y, table_x}} = 4'b{:02b}{:02b};\n", two(*y), two(*x))
            })
            .collect();
        Verilog::Custom(format!(
            "\
reg [{s_end}:0] sweep;
reg current, kept;
reg [{p_end}:0] kept_x, kept_y;
reg [{q_end}:0] kept_square;
reg [1:0] table_x, table_y;
always @(*) begin
  case (sweep)
{cases}    default: {{table_y, table_x}} = 4'd0;
  endcase
end
wire is_coarse = sweep < {SWEEP_BITS}'d{coarse_count};
wire is_halving = !is_coarse && sweep < {SWEEP_BITS}'d{JUDGED};
always @(*) next_halves = is_halving;
// A judgement takes effect for a sweep that is set up with it.
wire keep = judged && improved && coarse;
wire best_buffer = keep ? current : kept;
wire [{p_end}:0] best_centre_x = keep ? centre_x : kept_x;
wire [{p_end}:0] best_centre_y = keep ? centre_y : kept_y;
wire [{q_end}:0] best_square = keep ? square : kept_square;
wire [{p_end}:0] from_x = is_coarse ? centre_x : best_centre_x;
wire [{p_end}:0] from_y = is_coarse ? centre_y : best_centre_y;
wire [{q_end}:0] from_square = is_coarse ? square : best_square;
// The best is at most one step away from the centre of its polynomial.
wire [1:0] step_x = is_coarse ? table_x : best_x[1:0] - best_centre_x[1:0];
wire [1:0] step_y = is_coarse ? table_y : best_y[1:0] - best_centre_y[1:0];
wire [{q_end}:0] wide_x = {{{{{q_more}{{from_x[{p_end}]}}}}, from_x}};
wire [{q_end}:0] wide_y = {{{{{q_more}{{from_y[{p_end}]}}}}, from_y}};
wire [{q_end}:0] along_x = step_x[1] ? {q}'d1 - (wide_x << 1) : step_x[0] ? {q}'d1 + (wide_x << 1) : {q}'d0;
wire [{q_end}:0] along_y = step_y[1] ? {q}'d1 - (wide_y << 1) : step_y[0] ? {q}'d1 + (wide_y << 1) : {q}'d0;
wire [{q_end}:0] to_square = from_square + along_x + along_y;
wire [{p_end}:0] to_x = from_x + {{{{{p_more}{{step_x[1]}}}}, step_x}};
wire [{p_end}:0] to_y = from_y + {{{{{p_more}{{step_y[1]}}}}, step_y}};
wire [{p_end}:0] new_x = is_halving ? to_x << 1 : to_x;
wire [{p_end}:0] new_y = is_halving ? to_y << 1 : to_y;
wire [{q_end}:0] new_square = is_halving ? to_square << 2 : to_square;
wire new_current = current == best_buffer ? !current : current;
wire unused = &{{1'b0, best_x, best_y}};
always @(posedge clk) begin
  if (begin_frame) begin
    sweep <= enabled ? {SWEEP_BITS}'d0 : {SWEEP_BITS}'d{JUDGED};
    current <= 1'b0;
    kept <= 1'b0;
    centre_x <= {p}'d0;
    centre_y <= {p}'d0;
    square <= {q}'d0;
    kept_x <= {p}'d0;
    kept_y <= {p}'d0;
    kept_square <= {q}'d0;
    radius <= {q}'d9;
  end else begin
    if (keep) begin
      kept <= current;
      kept_x <= centre_x;
      kept_y <= centre_y;
      kept_square <= square;
    end
    if (set_up) begin
    sweep <= sweep + {SWEEP_BITS}'d1;
    dx <= step_x;
    dy <= step_y;
    coarse <= is_coarse;
    halving <= is_halving;
    last <= !is_coarse && !is_halving;
    centre_x <= new_x;
    centre_y <= new_y;
    square <= new_square;
    if (is_halving) radius <= radius << 2;
    source <= is_coarse ? current : best_buffer;
    target <= is_coarse ? new_current : best_buffer;
    if (is_coarse) current <= new_current;
    else begin
      kept_x <= new_x;
      kept_y <= new_y;
      kept_square <= new_square;
    end
    end
  end
end",
            s_end = SWEEP_BITS - 1,
            p_end = p - 1,
            q_end = q - 1,
            q_more = q - p,
            p_more = p - 2,
            coarse_count = COARSE_CENTRES.len(),
        ))
    }
}
