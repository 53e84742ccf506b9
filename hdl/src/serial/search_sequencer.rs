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

use dermis_golden::fixed::plan::serial::{polynomials, SELECTION, SLOT, SWEEP_TAIL, TRANSPOSE};
use dermis_golden::fixed::stages::search::{CENTRE, COARSE_CENTRES};
use dermis_golden::fixed::words::formats::{Formats, HALVINGS};

use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::{count_bits, position_bits};
use crate::{block, states};

/// Width of x² + y² − r², in bits, signed.
const DISC_BITS: usize = 21;
const COARSE: u64 = COARSE_CENTRES.len() as u64;
const LAST: u64 = COARSE + HALVINGS as u64;
/// Ticks from a bank's address to the word entering the chain along y; then to the word leaving it, and to its
/// write-back.
const ALONG_Y: u64 = TRANSPOSE + 1;
const LEAVES: u64 = ALONG_Y + 4;
const BACK: u64 = LEAVES + 1;

states! {
    /// What the sequencer does: a sweep is set up, runs, and its best candidate is compared.
    enum Phase { Idle, SetUp, Run, Compare }
}

block! {
    /// Addresses of the sweeps and the best candidate; timing in the module docs.
    pub struct SearchSequencer {
        degree: u64,
        polynomials: u64,
        /// Width of a score.
        score_bits: usize,
    }
    ports SearchSequencerPorts {
        clock;
        /// Synchronous reset, active high; stops the search.
        in rst;
        /// The polynomials are being written: the odd bank is selected for reading, the even one for writing.
        in filling;
        /// All polynomials have been written: start the search.
        in start;
        /// Search; otherwise p(0) is the result. Valid with `start`.
        in enabled;
        /// Index of the polynomial whose value is read; taken while no sweep runs.
        in wanted: count_bits(*polynomials as usize);
        /// The odd bank is read.
        out odd;
        /// `{region, polynomial, coefficient}` to read; valid in every cycle.
        out read_address: 1 + count_bits(*polynomials as usize) + 4;
        /// Chain along x, cycle of the polynomial; valid during a sweep.
        out x_element: 2;
        /// Chain along x, degree in x; valid with `x_element`.
        out x_top: 2;
        /// Chain along x: the centre moves.
        out x_moves;
        /// Chain along x: by −1.
        out x_down;
        /// Address in the transpose memory to write; valid during a sweep.
        out turn_write: 6;
        /// Address in the transpose memory to read; valid during a sweep.
        out turn_read: 6;
        /// Chain along y, cycle of the polynomial; valid during a sweep.
        out y_element: 2;
        /// Chain along y, degree in y; valid with `y_element`.
        out y_top: 2;
        /// Chain along y: the centre moves.
        out y_moves;
        /// Chain along y: by −1.
        out y_down;
        /// Right shift i + j of the coefficient that leaves the chain along y in a halving, otherwise 0; valid during a
        /// sweep.
        out halvings: 2;
        /// Write the shifted coefficient to the bank that is not read.
        out write;
        /// `{region, polynomial, coefficient}` to write; valid with `write`.
        out write_address: 1 + count_bits(*polynomials as usize) + 4;
        /// Cycle 4i + j of the coefficient that goes to the candidates; valid during a sweep.
        out cycle: 4;
        /// As `present` of [`Candidates`](super::Candidates); valid with `cycle`, zero while no sweep runs.
        out present: 2;
        /// As `sums` of [`Candidates`](super::Candidates); valid with the bits of `present`.
        out sums: 2;
        /// The coefficient written is a taxel's value p(μ*).
        out value_valid;
        /// The comparison reads the totals, so they are addressed by `candidate`.
        out comparing;
        /// Index of the candidate whose total is read; valid with `comparing`.
        out candidate: 4;
        /// `{Σp > 0, total}`; one cycle after `candidate`.
        in total: score_bits + 1;
        /// Best position, x, in grid steps of the level, signed; valid with `compared`, and final from `done` until the
        /// next `start`.
        out best_x: position_bits();
        /// Best position, y, in grid steps of the level, signed; as `best_x`.
        out best_y: position_bits();
        /// Score of the best candidate, signed, 2^−6; as `best_x`.
        out score: score_bits;
        /// A candidate was found in the coarse grid.
        out found;
        /// A candidate was taken at this level.
        out taken;
        /// The candidates of a sweep have been compared; high for one cycle.
        out compared;
        /// All values are in the bank that is now read; high for one cycle.
        out done;
    }
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

impl SearchSequencer {
    /// With the widths and the degree of `formats`.
    pub fn new(formats: &Formats) -> Self {
        SearchSequencer {
            degree: formats.degree as u64,
            polynomials: polynomials(formats) as u64,
            score_bits: formats.score_bits as usize,
        }
    }
}

impl Block for SearchSequencer {
    fn build<'k>(&self, k: &'k Builder, io: SearchSequencerPorts<Inside<'k>>) {
        let SearchSequencer { degree, polynomials, score_bits } = *self;
        let bits = count_bits(polynomials as usize);
        let (tick_bits, position) = (bits + 5, position_bits());

        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let zero = |bits: usize| k.constant(bits, 0);
        let one = k.constant(1, 1);
        let state = k.machine("state", io.rst, Phase::Idle);
        let (count, sweep) = (register("count", 5), register("sweep", 4));
        let (turn, turn_then, turn_read_then) =
            (register("turn", 4), register("turn_then", 4), register("turn_read_then", 4));
        let tick = register("tick", tick_bits);
        let (searching, improved, takes) = (register("searching", 1), register("improved", 1), register("takes", 1));
        let [move_x, move_y, offset_x, offset_y] =
            ["move_x", "move_y", "offset_x", "offset_y"].map(|name| register(name, 2));
        let _ = move_x.comment("Moves and offsets along an axis: bit 1 moves, bit 0 down.");
        let [source, target, current, kept] = ["source", "target", "current", "kept"].map(|name| register(name, 2));
        let _ = source.comment("Locations of polynomials: bit 1 odd bank, bit 0 upper region.");
        let [centre_x, centre_y, new_x, new_y] =
            ["centre_x", "centre_y", "new_x", "new_y"].map(|name| register(name, position));
        let [best_x, best_y] = [io.best_x, io.best_y].map(|output| output.register());
        let (centre_disc, disc) = (register("centre_disc", DISC_BITS), register("disc", DISC_BITS));
        // Read only times four, modulo 2^DISC_BITS.
        let (settled, best_disc) = (register("settled", DISC_BITS - 2), register("best_disc", DISC_BITS - 2));
        let score = io.score.register();
        let [taken, found, done] = [io.taken, io.found, io.done].map(|output| output.register());

        let coarse = k.wire("coarse", sweep.less(k.constant(4, COARSE)));
        let final_sweep = k.wire("final_sweep", sweep.is(LAST));
        let running = k.wire("running", state.is(Phase::Run));
        let run_end = k.wire("run_end", running & tick.is(SLOT * polynomials + SWEEP_TAIL - 1));
        let from = k.wire("from", coarse.mux(*current, *kept));
        let down = |axis: usize| {
            let sweeps = (0..COARSE).filter(|&at| coarse_step(at as usize)[axis] < 0);
            sweeps.map(|at| sweep.is(at)).reduce(|any, term| any | term).unwrap_or(zero(1))
        };
        let (down_x, down_y) = (k.wire("down_x", down(0)), k.wire("down_y", down(1)));
        let order = k.wire("order", count.slice(1, 4));
        let centre = k.constant(4, CENTRE as u64);
        let halving_turn = order.is(0).mux(centre, centre.less(order).mux(order, order.minus(1)));
        let in_turn = k.wire("in_turn", coarse.mux(order, halving_turn));
        let sides = |turn: Expr<'k>, suffix: &str| {
            let any = |turns: [u64; 3]| turns.map(|at| turn.is(at)).into_iter().reduce(|any, term| any | term);
            let named = |name: &str, value| k.wire(&format!("{name}{suffix}"), value);
            let left = named("left", any([0, 3, 6]).unwrap_or(zero(1)));
            let right = named("right", any([2, 5, 8]).unwrap_or(zero(1)));
            let above = named("above", turn.less(k.constant(4, 3)));
            [left, right, above, named("below", !turn.less(k.constant(4, 6)))]
        };
        let [left, right, above, below] = sides(*turn, "");
        let [left_then, right_then, above_then, below_then] = sides(*turn_then, "_then");
        let along_y = k.wire("along_y", !count.at(0));
        let backward = k.wire("backward", along_y.mux(above, left));
        let sideways = k.wire("sideways", along_y.mux(above | below, left | right));
        let signed_centre = k.wire("signed_centre", along_y.mux(*centre_y, *centre_x) ^ backward.repeat(position));
        k.comment("2x + 1, or -2x + 1 as twice the complement, plus 1, plus 2.");
        let twice = signed_centre.concat(one).signed().resize(DISC_BITS).unsigned();
        let further = k.wire("further", (twice + backward.concat(zero(1))).low(DISC_BITS));
        let disc_before = k.wire("disc_before", along_y.mux(*disc, *centre_disc));
        let total_now = io.total.low(score_bits).signed();
        let smaller = |a: Expr<'k>, b: Expr<'k>| a.signed().less(b.signed());
        let earlier_x = new_y.equals(*best_y) & smaller(*new_x, *best_x);
        let earlier = k.wire("earlier", coarse & (smaller(*new_y, *best_y) | earlier_x));
        let equal = io.total.low(score_bits).equals(*score) & earlier;
        let better = k.wire("better", !*taken | total_now.less(score.signed()) | equal);
        let in_disc = k.wire("in_disc", disc.top() | disc.is(0));

        let behind = |ticks: u64| tick.minus(ticks);
        let (behind1, behind5) = (k.wire("behind1", behind(1)), k.wire("behind5", behind(5)));
        let (turned, second) = (k.wire("turned", behind(TRANSPOSE)), k.wire("second", behind(ALONG_Y)));
        let (leaving, back) = (k.wire("leaving", behind(LEAVES)), k.wire("back", behind(BACK)));
        let slot = k.wire("slot", back.slice(4, bits));
        let started = running & !back.top();
        let whole = k.wire("whole", started & slot.less(k.constant(bits, polynomials)));
        let within = !k.constant(bits, polynomials).less(slot);
        let whole_before = k.wire("whole_before", started & !slot.is(0) & within);

        done.set(run_end & final_sweep & !io.rst);
        k.when(state.is(Phase::Idle) & io.start, || {
            state.goes(Phase::SetUp);
            sweep.set(io.enabled.mux(zero(4), k.constant(4, LAST)));
            searching.set(io.enabled);
            let cleared = [
                current, kept, move_x, move_y, offset_x, offset_y, centre_x, centre_y, best_x, best_y, best_disc,
                score, taken, found,
            ];
            cleared.iter().for_each(|register| register.set(zero(register.bits())));
        });
        k.when(state.is(Phase::SetUp), || {
            state.goes(Phase::Run);
            tick.set(zero(tick_bits));
            source.set(from);
            target.set((!from.at(1)).concat((!from.at(1)).equals(kept.at(1)) & !kept.at(0)));
            improved.set(zero(1));
            k.when(coarse, || {
                let moved =
                    |centre: Expr<'k>, down: Expr<'k>| (centre + down.repeat(position - 1).concat(one)).low(position);
                move_x.set(one.concat(down_x));
                move_y.set(one.concat(down_y));
                centre_x.set(moved(*centre_x, down_x));
                centre_y.set(moved(*centre_y, down_y));
                let at = |sweep: usize| k.signed_constant(DISC_BITS, coarse_disc(sweep)).unsigned();
                centre_disc.set(sweep.at(0).mux(at(1), at(0)));
            });
            k.when(!coarse, || {
                move_x.set(*offset_x);
                move_y.set(*offset_y);
                k.when(!final_sweep, || {
                    for (best, centre) in [(best_x, centre_x), (best_y, centre_y)] {
                        let doubled = best.low(position - 1).concat(zero(1));
                        best.set(doubled);
                        centre.set(doubled);
                    }
                    let quadrupled = best_disc.concat(zero(2));
                    best_disc.set(quadrupled.low(DISC_BITS - 2));
                    centre_disc.set(quadrupled);
                    offset_x.set(zero(2));
                    offset_y.set(zero(2));
                    taken.set(zero(1));
                });
                k.when(sweep.is(COARSE), || found.set(*taken));
            });
        });
        k.when(running, || {
            tick.set(tick.plus(1));
            k.when(run_end, || {
                state.goes_to(final_sweep.mux(state.number(Phase::Idle), state.number(Phase::Compare)));
                count.set(zero(5));
                takes.set(zero(1));
            });
        });
        let comparing = io.comparing.set(state.is(Phase::Compare));
        k.when(comparing, || {
            count.set(count.plus(1));
            turn_read_then.set(*turn);
            disc.set((disc_before + sideways.mux(further, zero(DISC_BITS))).low(DISC_BITS));
            k.when(count.at(0), || {
                settled.set(disc.low(DISC_BITS - 2));
                let has_score = !count.less(k.constant(5, 3)) & io.total.top();
                takes.set(has_score & in_disc & (coarse | *found) & better);
            });
            k.when(!count.at(0), || {
                let beside = |centre: Expr<'k>, back: Expr<'k>, on: Expr<'k>| {
                    (centre + back.repeat(position - 1).concat(back | on)).low(position)
                };
                turn.set(in_turn);
                turn_then.set(*turn);
                new_x.set(beside(*centre_x, left, right));
                new_y.set(beside(*centre_y, above, below));
                k.when(*takes, || {
                    best_x.set(*new_x);
                    best_y.set(*new_y);
                    score.set(io.total.low(score_bits));
                    taken.set(one);
                    offset_x.set((left_then | right_then).concat(left_then));
                    offset_y.set((above_then | below_then).concat(above_then));
                    best_disc.set(*settled);
                    improved.set(one);
                });
                k.when(count.is(SELECTION - 1), || {
                    state.goes(Phase::SetUp);
                    sweep.set(sweep.plus(1));
                    current.set(*target);
                    k.when(!coarse | *improved | *takes, || kept.set(*target));
                });
            });
        });

        io.odd.set(io.filling | running.mux(source.at(1), target.at(1)));
        let word = concat(&[source.at(0), tick.slice(4, bits), tick.slice(2, 2), !tick.low(2)]);
        io.read_address.set(running.mux(word, concat(&[target.at(0), io.wanted, zero(4)])));
        let top = |element: Expr<'k>| (k.constant(2, degree) - element.slice(2, 2)).low(2);
        io.x_element.set(behind1.low(2));
        io.x_top.set(top(behind1));
        io.x_moves.set(move_x.at(1));
        io.x_down.set(move_x.at(0));
        io.turn_write.set(behind5.low(6));
        io.turn_read.set(concat(&[turned.slice(4, 2), !turned.low(2), turned.slice(2, 2)]));
        io.y_element.set(second.low(2));
        io.y_top.set(top(second));
        io.y_moves.set(move_y.at(1));
        io.y_down.set(move_y.at(0));
        let halved = (leaving.slice(2, 2) + leaving.low(2)).low(2);
        io.halvings.set((coarse | final_sweep).mux(zero(2), halved));
        io.write.set(whole);
        io.write_address.set(concat(&[target.at(0), slot, back.low(2), back.slice(2, 2)]));
        io.cycle.set(back.low(4));
        io.present.set((whole_before & !final_sweep).concat(whole & !final_sweep));
        io.sums.set(slot.is(1).concat(slot.is(0)));
        io.value_valid.set(whole & final_sweep & !slot.is(0) & back.low(4).is(0));
        io.candidate.set(*turn_read_then);
        io.compared.set(state.is(Phase::SetUp) & *searching & !sweep.is(0));
    }
}

#[cfg(test)]
mod tests;
