//! Which taxel is read when: quads and taxels in their order, windows of the smoothing, neighbours, steps to a maximum.
//!
//! A direction is 0 for the taxel itself, 1 to 8 for its neighbours in the order of their addresses.

use dermis_golden::estimate::segment::FLOOR;

use super::control::*;
use crate::language::{Expr, Net, Type};

/// Width of a direction.
const DIRECTION: usize = 4;
/// Direction of the taxel with the next address.
const NEXT: u64 = 5;

/// What the order of the taxels says to the other parts.
pub(super) struct Order<'k> {
    /// The neighbour whose word is there in `BORDERS` is within the array.
    pub(super) beside: Expr<'k>,
    /// `BORDERS` ends.
    pub(super) joins: Expr<'k>,
    /// A quad ends; the last one does.
    pub(super) quads_end: Expr<'k>,
    pub(super) last_quad: Expr<'k>,
    /// A basin is found, with this number.
    pub(super) fresh: Expr<'k>,
    pub(super) next: Expr<'k>,
}

/// Registers of the order alone, and where it is.
struct Walk<'k> {
    /// A walk is under way; it is the one that writes its basin.
    walking: Net<'k>,
    back: Net<'k>,
    /// First taxel of a window, or of a walk.
    window: Net<'k>,
    /// Of the last neighbours that were read, which are within the array.
    valids: Net<'k>,
    /// A tap is there in the smoothing.
    runs: Net<'k>,
    /// An entry is there in `WALK`; it has a basin; the next taxel follows.
    walks: Expr<'k>,
    known: Expr<'k>,
    passes: Expr<'k>,
    /// Last column, of quads or of taxels.
    col_last: Expr<'k>,
    quads_end: Expr<'k>,
    last_quad: Expr<'k>,
}

/// The step from a taxel, once it is decided.
struct Climbed<'k> {
    decides: Expr<'k>,
    /// `{1, basin}` of a maximum, else `{0, direction}`.
    step: Expr<'k>,
    fresh: Expr<'k>,
    next: Expr<'k>,
}

/// What is added to an address for each direction, modulo 2^`bits`.
fn offsets(cols: usize, bits: usize) -> Vec<u64> {
    let cols = cols as i64;
    let all = [0, -cols - 1, -cols, 1 - cols, -1, 1, cols - 1, cols, cols + 1];
    (0..1 << DIRECTION)
        .map(|direction| all.get(direction).map_or(0, |offset| offset.rem_euclid(1 << bits) as u64))
        .collect()
}

impl<'k> Circuit<'k> {
    /// The taxels of all steps, in their order.
    pub(super) fn order(&self) -> Order<'k> {
        let (k, params) = (self.k, self.params);
        let starts = self.sequence();
        let walk = self.advance();
        let (of_lane, unpacks) = self.lanes(walk.col_last);
        let smooths = self.taps(walk.runs);
        let heading = self.read(&walk, smooths);

        k.when(self.tick.is(3), || self.multiplier.base.set(self.memories.words_out));
        let bare = !self.among(&[CLIMB, BORDERS]) | self.at(CLIMB, 1) | self.at(BORDERS, 2) & *self.moves;
        k.when(bare, || self.multiplier.base.set(self.zero(params.smoothed)));
        let climbed = self.climb(walk.valids.top());
        self.write(walk.walks & *walk.back & !walk.known, unpacks | self.at(LABEL, 0), of_lane, &climbed);
        let joins = self.ends(starts, &walk, heading);
        Order {
            beside: walk.valids.at(2),
            joins,
            quads_end: walk.quads_end,
            last_quad: walk.last_quad,
            fresh: climbed.fresh,
            next: climbed.next,
        }
    }

    /// Row, column and address of the next quad or taxel.
    fn advance(&self) -> Walk<'k> {
        let (k, params, quad_cols) = (self.k, self.params, self.params.quads[1]);
        let [walking, back] = ["walking", "back"].map(|name| k.register(name, Type::unsigned(1)));
        let window = k.register("window", self.point.ty());
        let valids = k.register("valids", Type::unsigned(5));

        k.comment("Order of quads and taxels");
        let in_quads = k.wire("in_quads", self.among(&[UNPACK, LABEL]));
        let quads_end = k.wire("quads_end", self.at(UNPACK, 6) | self.at(LABEL, 4) & self.lane.all());
        let known = self.memories.steps_out.at(BASIN);
        // An entry is there in WALK, a tap in the smoothing.
        let walks = k.state("walks", Type::unsigned(1), self.io.rst, 0);
        walks.set(self.at(WALK, 1));
        let runs = k.register("runs", Type::unsigned(1));
        let passes = k.wire("passes", known & (*back | !*walking));
        let begins = k.wire("begins", self.at(CLIMB, 9) | self.at(BORDERS, 4) & *self.moves);
        let advances = k.wire("advances", quads_end | begins | *walks & passes);
        let col_last = in_quads.mux(self.col.is(quad_cols as u64 - 1), self.col.is(params.cols as u64 - 1));
        let col_last = k.wire("col_last", col_last);
        k.when(advances, || {
            self.col.set(col_last.mux(self.zero(self.col.bits()), self.col.plus(1)));
            self.row.set((*self.row + col_last).low(self.row.bits()));
            let step = (in_quads & col_last).mux(self.taxel(params.cols - quad_cols + 1), self.taxel(1));
            self.address.set((*self.address + step).low(self.address.bits()));
            let step =
                col_last.mux(self.taxel(params.cols + quad_cols - 1), self.taxel((1 << self.address.bits()) - 1));
            self.mirror.set((*self.mirror + step).low(self.address.bits()));
        });
        k.when(quads_end, || self.quad.set(self.quad.plus(1)));
        let last_taxel = k.delay("last_taxel", self.address.is(params.taxels() as u64 - 1));
        let last_quad = k.delay("quads_last", self.quad.is(params.quad_count() as u64 - 1));
        let last_quad = k.wire("last_quad", quads_end & last_quad);
        k.when(begins, || {
            self.begun.set(k.constant(1, 1));
            self.ending.set(last_taxel);
        });
        let walks = *walks;
        Walk { walking, back, window, valids, runs, walks, known, passes, col_last, quads_end, last_quad }
    }

    /// The taxel of the lane of a quad, and whether its word is written.
    fn lanes(&self, col_last: Expr<'k>) -> (Expr<'k>, Expr<'k>) {
        let (k, params) = (self.k, self.params);
        k.comment("Taxel of a lane");
        let far = self.lane.at(1);
        let beside = (far ^ self.lane.at(0)).mux(*self.mirror, *self.address);
        let turned = beside ^ far.repeat(self.address.bits());
        let all = self.taxel(params.taxels()) & far.repeat(self.address.bits());
        let of_lane = k.wire("of_lane", (turned + all).low(self.address.bits()));
        let twice = |odd: bool, end: Expr<'k>, far: Expr<'k>| if odd { end & far } else { self.zero(1) };
        let middle_row = self.row.is(params.quads[0] as u64 - 1);
        let copies =
            twice(params.rows % 2 == 1, middle_row, far) | twice(params.cols % 2 == 1, col_last, self.lane.at(0));
        let unpacks = k.wire("unpacks", self.is(UNPACK) & self.picks);
        k.when(self.picks, || self.counts.set(!copies));
        k.when(unpacks | self.at(LABEL, 4), || self.lane.set(self.lane.plus(1)));
        (of_lane, unpacks)
    }

    /// The taps along the lines of both axes, where one is smoothed; `runs` when a tap is there.
    fn taps(&self, runs: Net<'k>) -> Expr<'k> {
        let (k, tap) = (self.k, self.memories.tap);
        k.comment("Taps of the smoothing");
        let smooths = self.among(&[ALONG_ROWS, ALONG_COLUMNS]);
        runs.set(smooths & self.tick.any());
        let [along_row, along_column] = self.params.tap_counts();
        let wraps = [(along_row - 1, 0), (along_row + along_column - 1, along_row)];
        let wraps = wraps.map(|(end, first)| (end as u64, k.constant(tap.bits(), first as u64)));
        tap.set(smooths.mux(tap.case(&wraps, tap.plus(1)), self.zero(tap.bits())));
        smooths
    }

    /// The taxel that is read next, and its direction from the one of the present tick.
    fn read(&self, walk: &Walk<'k>, smooths: Expr<'k>) -> Net<'k> {
        let (k, params) = (self.k, self.params);
        let Walk { walks, known, passes, .. } = *walk;
        let [last, moves, ends] = [0, 1, 2].map(|flag| self.memories.tap_flags.at(flag));
        k.comment("The taxel that is read");
        // Direction of the present tick, 0 in the other steps.
        let heading = k.register("heading", Type::unsigned(DIRECTION));
        let [climbs, borders] = [[1, 2, 3, 4, 5, 6, 7, 8], [5, 6, 7, 8, 0, 0, 0, 0]]
            .map(|next| self.tick.table(DIRECTION, &[&next[..], &[0; 8]].concat()));
        k.when(self.is(CLIMB) | self.is(BORDERS) & *self.moves, || {
            heading.set(self.is(BORDERS).mux(borders, climbs));
        });
        let ahead = k.wire("ahead", *walk.runs & (!last | ends | moves));
        let direction = k.wire("direction", *heading | k.constant(DIRECTION, NEXT) & ahead.repeat(DIRECTION));
        let from_window = k.wire("from_window", smooths & last & !ends);
        let own = self.is(LABEL).mux(*self.target, *self.address);
        let from = from_window.mux(*walk.window, smooths.mux(*self.point, own));
        let next_to = |from: Expr<'k>, direction: Expr<'k>| {
            let offset = direction.table(self.address.bits(), &offsets(params.cols, self.address.bits()));
            (from + offset).low(self.address.bits())
        };
        // The entry of a walk comes late from its memory: what it says is known is selected behind the sum.
        let uphill = k.wire("uphill", next_to(*self.point, self.memories.steps_out.low(DIRECTION)));
        let walked = known.mux(passes.mux(*self.address, *walk.window), uphill);
        let next = k.wire("next_point", self.is(WALK).mux(walked, next_to(from, direction)));
        let reads = self.is(CLIMB) | self.is(BORDERS) & *self.moves | *walk.runs | walks | self.at(LABEL, 1);
        k.when(reads, || self.point.set(next));
        k.when(*walk.runs & last, || walk.window.set(next));
        // In WALK the address is that of the next taxel, the window that of the taxel from which a walk starts.
        k.when(walks & !known & !*walk.walking, || walk.window.set(*self.point));
        k.when(walks, || {
            walk.walking.set(!passes);
            walk.back.set(known & *walk.walking & !passes | *walk.back & !known);
            k.when(known & !passes, || self.own.set(self.memories.steps_out.low(BASIN)));
        });
        let within = self.within(*heading);
        k.when(*self.moves, || walk.valids.set(walk.valids.low(4).concat(within)));
        heading
    }

    /// Whether there is a neighbour in a direction.
    fn within(&self, heading: Expr<'k>) -> Expr<'k> {
        let params = self.params;
        let needs = |directions: &[usize]| {
            let table: Vec<u64> = (0..16).map(|at| u64::from(directions.contains(&at))).collect();
            heading.table(1, &table)
        };
        let beyond = [
            (vec![1, 2, 3], self.row.is(0)),
            (vec![6, 7, 8], self.row.is(params.rows as u64 - 1)),
            (vec![1, 4, 6], self.col.is(0)),
            (vec![3, 5, 8], self.col.is(params.cols as u64 - 1)),
        ];
        let beyond = beyond.iter().map(|(directions, end)| needs(directions) & *end).reduce(|any, end| any | end);
        heading.any() & !beyond.unwrap_or(self.zero(1))
    }

    /// Ends of the steps; that of `BORDERS`.
    fn ends(&self, starts: Expr<'k>, walk: &Walk<'k>, heading: Net<'k>) -> Expr<'k> {
        let (k, params, tap, cleared) = (self.k, self.params, self.memories.tap, self.cleared());
        k.comment("Ends of the steps");
        let line_last = self.is(ALONG_ROWS).mux(self.line_is(params.rows), self.line_is(params.cols));
        let smoothed = k.wire("smoothed_all", self.multiplier.smoothed & self.multiplier.line_ends & line_last);
        let joins = k.wire("joins", self.at(BORDERS, 2) & *self.moves & *self.ending);
        let beyond_last = k.delay("beyond_last", self.address.equals(self.taxel(params.taxels())));
        let ends = [
            (starts, IDLE, UNPACK),
            (self.is(UNPACK) & walk.last_quad, UNPACK, ALONG_ROWS),
            (self.is(ALONG_ROWS) & smoothed, ALONG_ROWS, ALONG_COLUMNS),
            (self.is(ALONG_COLUMNS) & smoothed, ALONG_COLUMNS, CLIMB),
            (self.at(CLIMB, 5) & *self.ending, CLIMB, CLEAR),
            (cleared, CLEAR, WALK),
            (walk.walks & walk.passes & beyond_last, WALK, BORDERS),
            (self.settled(), SETTLE, LABEL),
        ];
        for (end, from, to) in ends {
            self.enter(end, [from, to], || match to {
                ALONG_COLUMNS => tap.set(k.constant(tap.bits(), params.tap_counts()[0] as u64)),
                CLIMB => {
                    [self.count, self.overflow].iter().for_each(|register| register.set(self.zero(register.bits())))
                }
                _ => {}
            });
        }
        let restarts = ends.map(|(end, ..)| end).into_iter().reduce(|any, end| any | end);
        let restarts = k.wire("restarts", restarts.unwrap_or(self.zero(1)));
        k.when(restarts, || {
            let registers = [
                self.row,
                self.col,
                self.quad,
                self.lane,
                self.point,
                self.target,
                self.line,
                self.begun,
                self.ending,
                walk.window,
                walk.walking,
                walk.back,
                walk.valids,
                heading,
                walk.runs,
            ];
            registers.iter().for_each(|register| register.set(self.zero(register.bits())));
            self.address.set(cleared.resize(self.address.bits()));
            self.mirror.set(self.taxel(params.cols - 1));
        });
        joins
    }

    /// The address of the taxel of this number, or of what is beyond the last one.
    fn taxel(&self, number: usize) -> Expr<'k> {
        let bits = self.address.bits();
        self.k.constant(bits, (number % (1 << bits)) as u64)
    }

    /// The steepest neighbour of a taxel, where the product of its rise is `valid`, and the numbers of the maxima.
    fn climb(&self, valid: Expr<'k>) -> Climbed<'k> {
        let (k, params) = (self.k, self.params);
        let zero = |bits: usize| self.zero(bits);
        let bits = self.multiplier.product.bits() - 1;
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let (rise, steepest, tall) = (register("rise", bits), register("steepest", DIRECTION), register("tall", 1));
        let peak = register("peak", params.smoothed);

        k.comment("The steepest neighbour; maxima");
        let rises =
            k.wire("rises", valid & !self.multiplier.product.top() & rise.less(self.multiplier.product.low(bits)));
        // A product is there five cycles after its direction was read.
        let directions = [5, 6, 7, 8, 0, 0, 1, 2, 3, 4, 0, 0, 0, 0, 0, 0];
        k.when(rises, || {
            rise.set(self.multiplier.product.low(bits));
            steepest.set(self.tick.table(DIRECTION, &directions));
        });
        k.when(self.tick.is(5), || {
            rise.set(zero(bits));
            steepest.set(zero(DIRECTION));
        });
        k.when(self.is(ALONG_COLUMNS) & self.multiplier.smoothed & peak.less(self.multiplier.result), || {
            peak.set(self.multiplier.result)
        });
        k.when(self.is(ALONG_ROWS), || peak.set(zero(params.smoothed)));
        let floor = peak.shift_right(FLOOR.trailing_zeros() as usize);
        k.when(self.tick.is(3), || tall.set(floor.less(self.multiplier.operand.low(params.smoothed))));
        let decides = k.wire("decides", self.at(CLIMB, 5) & *self.begun);
        let is_top = k.wire("is_top", !steepest.any());
        let full = self.count.all();
        let found = k.wire("found_top", decides & is_top & *tall);
        let (fresh, next) = (k.wire("fresh", found & !full), k.wire("next_basin", self.count.plus(1)));
        k.when(fresh, || self.count.set(next));
        k.when(found & full, || self.overflow.set(k.constant(1, 1)));
        let number = next & (*tall & !full).repeat(BASIN);
        let step = is_top.concat(is_top.mux(number, steepest.extend(BASIN)));
        Climbed { decides, step, fresh, next }
    }

    /// Writes what is smoothed, the steps, and in the way `back` of a walk the basins.
    fn write(&self, back: Expr<'k>, places: Expr<'k>, of_lane: Expr<'k>, climbed: &Climbed<'k>) {
        let (k, params, bits) = (self.k, self.params, self.target.bits());
        let stride = |number: usize| k.constant(bits, number as u64);
        let columns = self.is(ALONG_COLUMNS);
        let stores = k.delay("stores", self.is(UNPACK) & self.picks) & *self.counts;
        let word = columns.mux(self.multiplier.result, self.word.extend(params.smoothed));
        self.memories.words.write(stores | columns & self.multiplier.smoothed, *self.target, word);
        let entry = self.memories.steps_out.bits();
        let step = self.is(WALK).mux(k.constant(1, 1).concat(*self.own), climbed.step).extend(entry);
        let data = self.is(ALONG_ROWS).mux(self.multiplier.result.extend(entry), step);
        let writes = self.is(ALONG_ROWS) & self.multiplier.smoothed | climbed.decides | back;
        self.memories.steps.write(writes, self.is(WALK).mux(*self.point, *self.target), data);

        // Smoothed words are written transposed, so that both axes are read in the order of the addresses.
        let next_line = k.wire("next_line", self.line.plus(1));
        let along = select(&[
            (self.is(ALONG_ROWS), stride(params.rows)),
            (columns, stride(params.cols)),
            (self.is(CLIMB), stride(1)),
        ]);
        let along = (*self.target + along).low(bits);
        let turns = self.multiplier.line_ends & !self.is(CLIMB);
        k.when(places | self.multiplier.smoothed | climbed.decides, || {
            let next = turns.mux(next_line.resize(bits), along);
            self.target.set(places.mux(of_lane, next));
        });
        k.when(self.multiplier.smoothed & self.multiplier.line_ends, || self.line.set(next_line));
    }

    fn line_is(&self, lines: usize) -> Expr<'k> {
        self.line.is(lines as u64 - 1)
    }
}
