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

use crate::language::{concat, Block, Builder, Expr, Inside, Machine, Net, Type};
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
        let sweeps = Sweeps::new(k, &io, count_bits(self.polynomials as usize) + 5);
        let last_tick = SLOT * self.polynomials + SWEEP_TAIL - 1;
        let run_end = k.wire("run_end", sweeps.running & sweeps.tick.is(last_tick));
        let from = k.wire("from", sweeps.coarse.mux(*sweeps.current, *sweeps.kept));
        let down = sweeps.down();
        let turns = sweeps.turns();
        let next_disc = sweeps.next_disc(turns.sides);
        let better = sweeps.better(io.total);
        let comparing = self.output(k, &io, &sweeps);

        sweeps.done.set(run_end & sweeps.final_sweep & !io.rst);
        sweeps.start(io.start, io.enabled);
        sweeps.set_up(from, down);
        sweeps.run(run_end);
        sweeps.compare(comparing, io.total, &turns, next_disc, better);
    }
}

impl SearchSequencer {
    /// Addresses, by the ticks of the module docs, and what the chains and the candidates do; whether candidates are compared.
    fn output<'k>(&self, k: &'k Builder, io: &SearchSequencerPorts<Inside<'k>>, sweeps: &Sweeps<'k>) -> Expr<'k> {
        let Sweeps { source, target, tick, running, coarse, final_sweep, .. } = *sweeps;
        let (polynomials, bits) = (self.polynomials, count_bits(self.polynomials as usize));
        let behind = |name: &str, ticks: u64| k.wire(name, tick.minus(ticks));
        let (behind1, behind5) = (behind("behind1", 1), behind("behind5", 5));
        let (turned, second) = (behind("turned", TRANSPOSE), behind("second", ALONG_Y));
        let (leaving, back) = (behind("leaving", LEAVES), behind("back", BACK));
        let slot = k.wire("slot", back.slice(4, bits));
        let started = running & !back.top();
        let whole = k.wire("whole", started & slot.less(k.constant(bits, polynomials)));
        let within = !k.constant(bits, polynomials).less(slot);
        let whole_before = k.wire("whole_before", started & !slot.is(0) & within);
        let comparing = io.comparing.set(sweeps.state.is(Phase::Compare));

        io.odd.set(io.filling | running.mux(source.at(1), target.at(1)));
        let word = concat(&[source.at(0), tick.slice(4, bits), tick.slice(2, 2), !tick.low(2)]);
        io.read_address.set(running.mux(word, concat(&[target.at(0), io.wanted, k.constant(4, 0)])));
        let top = |element: Expr<'k>| (k.constant(2, self.degree) - element.slice(2, 2)).low(2);
        let [move_x, move_y] = sweeps.moves;
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
        io.halvings.set((coarse | final_sweep).mux(k.constant(2, 0), halved));
        io.write.set(whole);
        io.write_address.set(concat(&[target.at(0), slot, back.low(2), back.slice(2, 2)]));
        io.cycle.set(back.low(4));
        io.present.set((whole_before & !final_sweep).concat(whole & !final_sweep));
        io.sums.set(slot.is(1).concat(slot.is(0)));
        io.value_valid.set(whole & final_sweep & !slot.is(0) & back.low(4).is(0));
        io.candidate.set(*sweeps.turn_read_then);
        io.compared.set(sweeps.state.is(Phase::SetUp) & *sweeps.searching & !sweeps.sweep.is(0));
        comparing
    }
}

/// The candidates that are compared, one every two cycles.
struct Turns<'k> {
    /// The next one.
    next: Expr<'k>,
    /// Whether the present one is left of the centre, right, above, below; whether the one before is.
    sides: [Expr<'k>; 4],
    sides_then: [Expr<'k>; 4],
}

/// Registers of the sweeps and of the comparison, and which sweep it is.
struct Sweeps<'k> {
    k: &'k Builder,
    state: Machine<'k, Phase>,
    /// Cycles of the comparison.
    count: Net<'k>,
    sweep: Net<'k>,
    /// The present candidate, the one before, the one whose total is read.
    turn: Net<'k>,
    turn_then: Net<'k>,
    turn_read_then: Net<'k>,
    tick: Net<'k>,
    searching: Net<'k>,
    /// The sweep has a candidate that is better; the candidate before is.
    improved: Net<'k>,
    takes: Net<'k>,
    /// Along x and y: move of the sweep, offset of its best candidate.
    moves: [Net<'k>; 2],
    offsets: [Net<'k>; 2],
    /// Polynomials that are read and written, those of the last sweep, those of the best candidate.
    source: Net<'k>,
    target: Net<'k>,
    current: Net<'k>,
    kept: Net<'k>,
    /// Positions of the centre, of a candidate, of the best one.
    centre: [Net<'k>; 2],
    new: [Net<'k>; 2],
    best: [Net<'k>; 2],
    /// x² + y² − r² of the centre, of the candidates; of the one before and of the best one, only read times four, modulo
    /// 2^DISC_BITS.
    centre_disc: Net<'k>,
    disc: Net<'k>,
    settled: Net<'k>,
    best_disc: Net<'k>,
    score: Net<'k>,
    taken: Net<'k>,
    found: Net<'k>,
    done: Net<'k>,
    coarse: Expr<'k>,
    final_sweep: Expr<'k>,
    running: Expr<'k>,
}

impl<'k> Sweeps<'k> {
    fn new(k: &'k Builder, io: &SearchSequencerPorts<Inside<'k>>, tick_bits: usize) -> Self {
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let axes = |name: &str, bits: usize| ["x", "y"].map(|axis| register(&format!("{name}_{axis}"), bits));
        let state = k.machine("state", io.rst, Phase::Idle);
        let (count, sweep) = (register("count", 5), register("sweep", 4));
        let sweeps = Sweeps {
            k,
            state,
            count,
            sweep,
            turn: register("turn", 4),
            turn_then: register("turn_then", 4),
            turn_read_then: register("turn_read_then", 4),
            tick: register("tick", tick_bits),
            searching: register("searching", 1),
            improved: register("improved", 1),
            takes: register("takes", 1),
            moves: axes("move", 2),
            offsets: axes("offset", 2),
            source: register("source", 2),
            target: register("target", 2),
            current: register("current", 2),
            kept: register("kept", 2),
            centre: axes("centre", position_bits()),
            new: axes("new", position_bits()),
            best: [io.best_x, io.best_y].map(|output| output.register()),
            centre_disc: register("centre_disc", DISC_BITS),
            disc: register("disc", DISC_BITS),
            settled: register("settled", DISC_BITS - 2),
            best_disc: register("best_disc", DISC_BITS - 2),
            score: io.score.register(),
            taken: io.taken.register(),
            found: io.found.register(),
            done: io.done.register(),
            coarse: k.wire("coarse", sweep.less(k.constant(4, COARSE))),
            final_sweep: k.wire("final_sweep", sweep.is(LAST)),
            running: k.wire("running", state.is(Phase::Run)),
        };
        let _ = sweeps.moves[0].comment("Moves and offsets along an axis: bit 1 moves, bit 0 down.");
        let _ = sweeps.source.comment("Locations of polynomials: bit 1 odd bank, bit 0 upper region.");
        sweeps
    }

    fn zero(&self, bits: usize) -> Expr<'k> {
        self.k.constant(bits, 0)
    }

    /// Whether the coarse centre moves by −1, along x and y.
    fn down(&self) -> [Expr<'k>; 2] {
        let down = |axis: usize| {
            let sweeps = (0..COARSE).filter(|&at| coarse_step(at as usize)[axis] < 0);
            sweeps.map(|at| self.sweep.is(at)).reduce(|any, term| any | term).unwrap_or(self.zero(1))
        };
        [("down_x", 0), ("down_y", 1)].map(|(name, axis)| self.k.wire(name, down(axis)))
    }

    /// The order of the candidates: row-major, in a halving the centre first.
    fn turns(&self) -> Turns<'k> {
        let k = self.k;
        let order = k.wire("order", self.count.slice(1, 4));
        let centre = k.constant(4, CENTRE as u64);
        let halving_turn = order.is(0).mux(centre, centre.less(order).mux(order, order.minus(1)));
        let next = k.wire("in_turn", self.coarse.mux(order, halving_turn));
        let sides = |turn: Expr<'k>, suffix: &str| {
            let any = |turns: [u64; 3]| turns.map(|at| turn.is(at)).into_iter().reduce(|any, term| any | term);
            let named = |name: &str, value| k.wire(&format!("{name}{suffix}"), value);
            let left = named("left", any([0, 3, 6]).unwrap_or(self.zero(1)));
            let right = named("right", any([2, 5, 8]).unwrap_or(self.zero(1)));
            let above = named("above", turn.less(k.constant(4, 3)));
            [left, right, above, named("below", !turn.less(k.constant(4, 6)))]
        };
        let (sides, sides_then) = (sides(*self.turn, ""), sides(*self.turn_then, "_then"));
        Turns { next, sides, sides_then }
    }

    /// x² + y² − r² after the step along x in an odd cycle, along y in an even one.
    fn next_disc(&self, [left, right, above, below]: [Expr<'k>; 4]) -> Expr<'k> {
        let (k, zero, [centre_x, centre_y]) = (self.k, self.zero(1), self.centre);
        let along_y = k.wire("along_y", !self.count.at(0));
        let backward = k.wire("backward", along_y.mux(above, left));
        let sideways = k.wire("sideways", along_y.mux(above | below, left | right));
        let signed_centre = along_y.mux(*centre_y, *centre_x) ^ backward.repeat(centre_x.bits());
        let signed_centre = k.wire("signed_centre", signed_centre);
        k.comment("2x + 1, or -2x + 1 as twice the complement, plus 1, plus 2.");
        let twice = signed_centre.concat(k.constant(1, 1)).signed().resize(DISC_BITS).unsigned();
        let further = k.wire("further", (twice + backward.concat(zero)).low(DISC_BITS));
        let before = k.wire("disc_before", along_y.mux(*self.disc, *self.centre_disc));
        (before + sideways.mux(further, self.zero(DISC_BITS))).low(DISC_BITS)
    }

    /// Whether the candidate whose total is read becomes the best one.
    fn better(&self, total: Expr<'k>) -> Expr<'k> {
        let (k, [new_x, new_y], [best_x, best_y]) = (self.k, self.new, self.best);
        let score = total.low(self.score.bits());
        let smaller = |a: Expr<'k>, b: Expr<'k>| a.signed().less(b.signed());
        let earlier_x = new_y.equals(*best_y) & smaller(*new_x, *best_x);
        let earlier = k.wire("earlier", self.coarse & (smaller(*new_y, *best_y) | earlier_x));
        let equal = score.equals(*self.score) & earlier;
        let better = k.wire("better", !*self.taken | smaller(score, *self.score) | equal);
        let in_disc = k.wire("in_disc", self.disc.top() | self.disc.is(0));
        let has_score = !self.count.less(k.constant(5, 3)) & total.top();
        has_score & in_disc & (self.coarse | *self.found) & better
    }

    /// The first sweep, or where nothing is searched the last one.
    fn start(&self, start: Expr<'k>, enabled: Expr<'k>) {
        self.k.when(self.state.is(Phase::Idle) & start, || {
            self.state.goes(Phase::SetUp);
            self.sweep.set(enabled.mux(self.zero(4), self.k.constant(4, LAST)));
            self.searching.set(enabled);
            let pairs = [[self.current, self.kept], self.moves, self.offsets, self.centre, self.best];
            let cleared = [&pairs.concat()[..], &[self.best_disc, self.score, self.taken, self.found]].concat();
            cleared.iter().for_each(|register| register.set(self.zero(register.bits())));
        });
    }

    /// The polynomials are read at `from`; a coarse sweep moves them `down` or up, a halving by the offset of the best candidate.
    fn set_up(&self, from: Expr<'k>, down: [Expr<'k>; 2]) {
        let (k, kept) = (self.k, self.kept);
        k.when(self.state.is(Phase::SetUp), || {
            self.state.goes(Phase::Run);
            self.tick.set(self.zero(self.tick.bits()));
            self.source.set(from);
            self.target.set((!from.at(1)).concat((!from.at(1)).equals(kept.at(1)) & !kept.at(0)));
            self.improved.set(self.zero(1));
            k.when(self.coarse, || {
                let one = k.constant(1, 1);
                self.moves.iter().zip(down).for_each(|(own, down)| own.set(one.concat(down)));
                for (centre, down) in self.centre.iter().zip(down) {
                    let bits = centre.bits();
                    centre.set((**centre + down.repeat(bits - 1).concat(one)).low(bits));
                }
                let at = |sweep: usize| k.signed_constant(DISC_BITS, coarse_disc(sweep)).unsigned();
                self.centre_disc.set(self.sweep.at(0).mux(at(1), at(0)));
            });
            k.when(!self.coarse, || {
                self.moves.iter().zip(self.offsets).for_each(|(own, offset)| own.set(*offset));
                k.when(!self.final_sweep, || {
                    for (best, centre) in self.best.iter().zip(self.centre) {
                        let doubled = best.low(best.bits() - 1).concat(self.zero(1));
                        best.set(doubled);
                        centre.set(doubled);
                    }
                    let quadrupled = self.best_disc.concat(self.zero(2));
                    self.best_disc.set(quadrupled.low(DISC_BITS - 2));
                    self.centre_disc.set(quadrupled);
                    self.offsets.iter().for_each(|offset| offset.set(self.zero(2)));
                    self.taken.set(self.zero(1));
                });
                k.when(self.sweep.is(COARSE), || self.found.set(*self.taken));
            });
        });
    }

    /// The ticks of a sweep, until it `ends`.
    fn run(&self, ends: Expr<'k>) {
        let (k, state) = (self.k, self.state);
        k.when(self.running, || {
            self.tick.set(self.tick.plus(1));
            k.when(ends, || {
                state.goes_to(self.final_sweep.mux(state.number(Phase::Idle), state.number(Phase::Compare)));
                self.count.set(self.zero(5));
                self.takes.set(self.zero(1));
            });
        });
    }

    /// The candidates of a sweep; the next sweep follows.
    fn compare(&self, comparing: Expr<'k>, total: Expr<'k>, turns: &Turns<'k>, next_disc: Expr<'k>, better: Expr<'k>) {
        let (k, one) = (self.k, self.k.constant(1, 1));
        k.when(comparing, || {
            self.count.set(self.count.plus(1));
            self.turn_read_then.set(*self.turn);
            self.disc.set(next_disc);
            k.when(self.count.at(0), || {
                self.settled.set(self.disc.low(DISC_BITS - 2));
                self.takes.set(better);
            });
            k.when(!self.count.at(0), || {
                let [left, right, above, below] = turns.sides;
                let beside = |centre: Expr<'k>, back: Expr<'k>, on: Expr<'k>| {
                    (centre + back.repeat(centre.bits() - 1).concat(back | on)).low(centre.bits())
                };
                self.turn.set(turns.next);
                self.turn_then.set(*self.turn);
                self.new[0].set(beside(*self.centre[0], left, right));
                self.new[1].set(beside(*self.centre[1], above, below));
                k.when(*self.takes, || {
                    let [left, right, above, below] = turns.sides_then;
                    self.best.iter().zip(self.new).for_each(|(best, new)| best.set(*new));
                    self.score.set(total.low(self.score.bits()));
                    self.taken.set(one);
                    self.offsets[0].set((left | right).concat(left));
                    self.offsets[1].set((above | below).concat(above));
                    self.best_disc.set(*self.settled);
                    self.improved.set(one);
                });
                k.when(self.count.is(SELECTION - 1), || {
                    self.state.goes(Phase::SetUp);
                    self.sweep.set(self.sweep.plus(1));
                    self.current.set(*self.target);
                    k.when(!self.coarse | *self.improved | *self.takes, || self.kept.set(*self.target));
                });
            });
        });
    }
}

#[cfg(test)]
mod tests;
