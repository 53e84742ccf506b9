//! The tables of the basins: loads, saddles, joining, order.
//!
//! Basins that exist are a list in `chain`, in the order of their numbers: each holds the next one, 0 the first, the last one
//! 0. One that is gone holds the one it is part of, which has a smaller number. One that has been taken from the list, in the
//! order of the loads, holds its contact.

use dermis_golden::estimate::segment::SMALL;
use dermis_golden::fixed::plan::resources::Holds;

use super::control::*;
use super::walk::Order;
use crate::language::{Contents, Expr, Net, Type};
use crate::primitives::count_bits;

/// Ticks of `PAIRS`: the next lower basin of a pair, the next higher one, three for its saddle, the decision two later.
const LOWER: u64 = 1;
const HIGHER: u64 = 3;
const FIRST: u64 = 4;
const SADDLE: u64 = 6;
const JUDGE: u64 = 8;
/// Ticks of `JOIN`: four for the saddles to another basin.
const OTHER: u64 = 3;
const BEST: u64 = 5;
const MERGED: u64 = 6;
/// Tick of `LEAST` in which the last load has been compared.
const COMPARED: u64 = 3;

/// Registers of the tables alone.
pub(super) struct List<'k> {
    /// The lower basin of the pairs.
    outer: Net<'k>,
    /// The pair that was found; of a basin with its load the one before and itself.
    into: Net<'k>,
    gone: Net<'k>,
    found: Net<'k>,
    /// Saddles of a basin with a small load are compared.
    small: Net<'k>,
    /// The largest load is looked for.
    ranks: Net<'k>,
    /// Highest saddle so far.
    best: Net<'k>,
    /// Bar of another basin.
    hold: Net<'k>,
    /// Output of `chain`: the successor, in the list, of the basin at the cursor.
    follows: Expr<'k>,
    /// `follows` registered once; in `JOIN` the successor of the removed basin in place of the removed one.
    next: Expr<'k>,
    /// `follows` was the removed basin, registered once.
    unlinks: Expr<'k>,
    /// Successor of the removed basin.
    after: Net<'k>,
}

impl<'k> Circuit<'k> {
    /// The pairs of a basin with a small load begin with their saddles.
    pub(super) fn begin_pairs(&self, list: &List<'k>) {
        self.begin(self.at(LEAST, COMPARED) & !*list.ranks & *list.found, FIRST);
    }

    /// Every number of a basin is in the list.
    pub(super) fn cleared(&self) -> Expr<'k> {
        self.is(CLEAR) & self.lower.equals(*self.higher) & self.higher.equals(*self.count)
    }

    /// Every basin has its contact.
    pub(super) fn settled(&self) -> Expr<'k> {
        self.at(SETTLE, 1) & self.higher.all()
    }

    /// The tables, filled in the `order` of the taxels.
    pub(super) fn tables(&self, order: &Order<'k>) -> List<'k> {
        let k = self.k;
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        k.comment("List of the basins");
        let [outer, into, gone, after] = ["outer", "into", "gone", "after"].map(|name| register(name, BASIN));
        let [found, small, ranks] = ["found", "is_small", "ranks"].map(|name| register(name, 1));
        let follows = self.chain_out.low(BASIN);
        let unlinks = k.wire("unlinks", self.is(JOIN) & follows.equals(*gone));
        let next = k.delay("next", unlinks.mux(*after, follows));
        let unlinks = k.delay("unlinked", unlinks);
        let [best, hold] = ["best", "hold"].map(|name| register(name, self.params.smoothed));
        let list = List { outer, into, gone, found, small, ranks, best, hold, follows, next, unlinks, after };
        self.saddles(order, &list);
        let less = self.loads(&list);
        self.middles(less);
        self.list(&list, order.joins);
        list
    }

    /// The saddles and the bars; which pair is to be joined.
    fn saddles(&self, order: &Order<'k>, list: &List<'k>) {
        let (k, params) = (self.k, self.params);
        let one = k.constant(1, 1);
        k.comment("Saddles");
        let basin = self.memories.steps_out.low(BASIN);
        let stall = k.register("stall", Type::unsigned(2));
        let differs = k.wire("differs", self.is(BORDERS) & order.beside & basin.differs(*self.own));
        stall.set(stall.plus(1) & differs.repeat(2));
        self.moves.set(!differs | stall.all());
        k.when(self.at(BORDERS, 3), || self.own.set(basin));
        let meets = k.wire("meets", differs & stall.is(0));

        let (other_tick, merged) = (self.at(JOIN, OTHER), self.at(JOIN, MERGED));
        let (compared, starts) = (self.at(LEAST, COMPARED), self.at(JOIN, 2));
        let pairs = meets | self.at(PAIRS, HIGHER) | self.at(PAIRS, SADDLE) | other_tick | merged;
        let diagonal = k.wire("diagonal", self.lower.equals(*self.higher));
        let (clears, climbs) = (self.is(CLEAR), self.is(CLIMB));
        let lower = select(&[
            (self.is(BORDERS), *self.own),
            (self.is(PAIRS), *list.outer),
            (other_tick, *list.into),
            (merged, *list.gone),
            (clears & !diagonal, self.lower.plus(1)),
        ]);
        // The list begins with 0, so do the counters of the steps that follow.
        k.when(pairs | clears | compared | starts | climbs, || self.lower.set(lower));
        let counts = self.among(&[CLEAR, SETTLE]);
        let higher = select(&[
            (self.is(BORDERS), basin),
            (self.is(PAIRS) | merged, list.next),
            (other_tick, *self.cursor),
            (compared & !*list.ranks | starts, *list.gone),
            (counts, self.higher.plus(1)),
        ]);
        let counted = clears & diagonal | self.at(SETTLE, 1);
        k.when(pairs | counted | compared | starts | climbs, || self.higher.set(higher));

        let turned = k.wire("turned", self.higher.less(*self.lower));
        let lower = k.wire("lower_ordered", turned.mux(*self.higher, *self.lower));
        let higher = k.wire("higher_ordered", turned.mux(*self.lower, *self.higher));
        let place = lower.concat(higher);
        let memory = k.memory("saddles", TABLE * TABLE, params.smoothed, Contents::Undefined).unchecked();
        let memory = memory.holds(Holds::Saddles);
        let saddle = k.delay("saddle", k.delay("saddle_read", memory.read(place)));
        let larger = k.wire("larger", list.best.less(saddle));
        let largest = larger.mux(saddle, *list.best) & (!self.is(CLEAR)).repeat(params.smoothed);
        memory.write(self.is(CLEAR) | differs & stall.all() | self.at(JOIN, MERGED), place, largest);
        let least =
            k.delay("is_less", self.multiplier.difference.top()).mux(self.memories.words_out, *self.multiplier.base);
        k.when(differs & stall.is(1), || list.best.set(least));
        k.when(self.at(JOIN, BEST), || list.best.set(saddle));

        let bar = k.delay("bar", self.bars.read(*self.cursor));
        k.when(self.at(PAIRS, HIGHER) | self.at(JOIN, 1), || list.hold.set(bar));
        let rises = self.at(JOIN, 2) & list.into.any() & bar.less(*list.hold);
        let fresh = order.fresh;
        self.bars.write(
            fresh | rises,
            fresh.mux(order.next, *self.cursor),
            fresh.mux(self.multiplier.result, *list.hold),
        );
        let high = !saddle.less(bar) | !saddle.less(*list.hold);
        let may = list.small.mux(self.cursor.differs(*list.outer), high);
        let may = k.delay("may_take", self.at(PAIRS, SADDLE) & may);
        let takes = k.wire("takes_pair", may & (!*list.found | k.delay("is_larger", larger)));
        let [saddle, lower, higher] =
            [("saddle2", saddle), ("lower2", lower), ("higher2", higher)].map(|(name, value)| k.delay(name, value));
        k.when(takes, || {
            list.best.set(saddle);
            list.found.set(one);
            list.into.set(lower);
            list.gone.set(higher);
        });
    }

    /// The loads, and the sums of the contacts: whether one is less than what is held. A sum is there two cycles after its
    /// place is chosen, and may be written then.
    fn loads(&self, list: &List<'k>) -> Expr<'k> {
        let (k, params) = (self.k, self.params);
        let contact = count_bits(params.most);
        k.comment("Loads and sums");
        let index = |contact: Expr<'k>, sum: Expr<'k>| contact.concat(sum).extend(BASIN);
        // In LABEL 0, 1, 2 at the ticks 1, 2, 3; in MIDDLE 0 at tick 0, 1 up to tick 4, then 2.
        let column = self.tick.at(3) | self.tick.at(2) & self.tick.low(2).any();
        let middle = column.concat(!column & self.tick.any());
        let at = select(&[
            (self.at(BORDERS, 4), *self.own),
            (self.is(LABEL), index(self.label.minus(1), self.tick.minus(1).low(2))),
            (self.is(MIDDLE), index(self.higher.low(contact), middle)),
            (self.among(&[CLEAR, SETTLE]), *self.higher),
            (self.among(&[LEAST, JOIN]), *self.cursor),
        ]);
        let place = k.delay("place", at);
        let load = k.delay("load", self.loads.read(place));
        let place = k.delay("place2", place);
        let before = k.delay("place3", place);
        let later = |name: &str, value| k.delay(&format!("{name}2"), k.delay(&format!("{name}1"), value));
        let (held, low) = (k.register("held", load.ty()), k.register("held_low", Type::unsigned(1)));
        let less = k.wire("less", load.concat(self.zero(1)).less(held.concat(*low)));
        let scans = later("scans", self.at(LEAST, 0));
        let begins = k.wire("begins_list", scans & !place.any());
        let takes = k.wire("takes_load", scans & place.any() & (less ^ *list.ranks));
        k.when(begins | takes | self.at(JOIN, 2) | self.at(MIDDLE, 2), || {
            let whole = load.shift_right(SMALL.trailing_zeros() as usize).extend(params.sum);
            held.set(begins.mux(whole & (!*list.ranks).repeat(params.sum), load));
        });
        // Half a unit more makes a comparison one of "at most".
        k.when(begins, || {
            low.set(k.constant(1, 1));
            list.found.set(self.zero(1));
        });
        k.when(takes, || {
            low.set(*list.ranks);
            list.found.set(k.constant(1, 1));
            list.gone.set(place);
            list.into.set(before);
        });
        k.when(self.at(MIDDLE, 2), || low.set(self.zero(1)));

        let diagonal = self.is(CLEAR) & self.lower.equals(*self.higher);
        let zeros = later("zeros", diagonal | self.at(SETTLE, 1));
        let borders = (self.at(BORDERS, 4) & self.own.any() | self.at(BORDERS, 0) & *self.begun) & *self.moves;
        let joins = self.at(JOIN, 1) & list.into.any();
        let labels = self.is(LABEL) & *self.adds & self.tick.low(2).any();
        let sums = later("sums_up", borders | joins | labels);
        // In MIDDLE the sums are compared, and written, at every fourth tick or the second after that.
        let compares = self.is(MIDDLE) & !self.tick.at(0) & self.tick.any();
        let holds = k.delay("holds", compares | self.is(JOIN));
        let subtracts = k.delay("subtracts", compares);
        let held = *held ^ subtracts.repeat(params.sum);
        let addend = holds.mux(held, self.multiplier.product.resize(params.sum));
        let total = k.wire("load_total", (load + addend + subtracts).low(params.sum));
        // A moment is not read again when it is less than what is held.
        self.loads.write(zeros | sums | subtracts, place, total & (!zeros).repeat(params.sum));
        less
    }

    /// The list, and the steps through it.
    fn list(&self, list: &List<'k>, joins: Expr<'k>) {
        let (k, tick) = (self.k, self.tick);
        let zero = |bits: usize| self.zero(bits);
        let (one, ends) = (k.constant(1, 1), k.wire("list_ends", !list.next.any()));
        let (found, ranks) = (*list.found, *list.ranks);
        let number = |tick: u64| k.constant(4, tick);

        k.comment("Steps through the list");
        self.enter(joins, [BORDERS, LEAST], || list.ranks.set(zero(1)));
        k.when(self.among(&[LEAST, PAIRS, JOIN]), || tick.set(tick.plus(1)));
        let scans = self.at(LEAST, 0);
        k.when(scans, || {
            tick.set(zero(3).concat(!list.follows.any()));
        });
        let compared = self.at(LEAST, COMPARED);
        self.enter(compared & ranks & found, [LEAST, TAKE], || ());
        self.enter(compared & ranks & !found, [LEAST, SETTLE], || ());
        self.enter(compared & !ranks, [LEAST, PAIRS], || {
            list.small.set(found);
            list.found.set(zero(1));
            list.outer.set(*list.gone);
        });

        k.when(self.at(PAIRS, LOWER), || {
            list.outer.set(list.next);
            tick.set(ends.mux(number(JUDGE - 1), number(LOWER + 1)));
        });
        let saddle = self.at(PAIRS, SADDLE);
        k.when(self.at(PAIRS, HIGHER) | saddle, || {
            tick.set(ends.mux((saddle & *list.small).mux(number(JUDGE - 1), zero(4)), number(FIRST)));
        });
        let judges = self.at(PAIRS, JUDGE);
        self.enter(judges & found, [PAIRS, JOIN], || ());
        self.enter(judges & !found, [PAIRS, LEAST], || {
            list.ranks.set(one);
            self.kept.set(zero(self.kept.bits()));
        });

        k.when(self.at(JOIN, 0), || {
            list.after.set(list.follows);
        });
        let merged = self.at(JOIN, MERGED);
        k.when(merged, || {
            tick.set(number(OTHER));
        });
        self.enter(merged & ends, [JOIN, LEAST], || ());

        let full = self.kept.is(self.params.most as u64);
        self.enter(self.at(TAKE, 1), [TAKE, LEAST], || {
            self.kept.set(full.mux(*self.kept, self.kept.plus(1)));
        });
        k.when(self.at(TAKE, 1) & full, || self.overflow.set(one));

        let others = self.at(PAIRS, HIGHER) | saddle;
        let follows = scans | self.at(SETTLE, 0) & !self.chain_out.top();
        let nexts = self.at(PAIRS, LOWER) | others | merged;
        let gone = compared & ranks & found | judges & found;
        let zeros = joins | judges & !found | self.at(JOIN, 2) | self.at(TAKE, 1);
        let (into, settles, labels) = (self.at(JOIN, 0), self.at(SETTLE, 1), self.is(LABEL));
        // The next one is 0 at the end of the list.
        let cursor = select(&[
            (nexts, list.next),
            (others & ends, *list.outer),
            (gone, *list.gone),
            (into, *list.into),
            (settles, self.higher.plus(1)),
            (labels, self.memories.steps_out.low(BASIN)),
        ]);
        let cursor = list.follows & follows.repeat(BASIN) | k.wire("other_cursor", cursor);
        k.when(follows | nexts | gone | into | settles | labels | zeros, || self.cursor.set(cursor));

        let link = |basin: Expr<'k>| zero(1).concat(basin);
        let diagonal = self.is(CLEAR) & self.lower.equals(*self.higher);
        let last = self.higher.equals(*self.count);
        let label = one.concat((self.kept.plus(1) & (!full).repeat(self.kept.bits())).resize(BASIN));
        let (joins, unlinks) = (self.at(JOIN, 1), merged & list.unlinks);
        let [takes, labels, settles] = [(TAKE, 0), (TAKE, 1), (SETTLE, 1)].map(|(step, tick)| self.at(step, tick));
        let at = select(&[
            (self.among(&[CLEAR, SETTLE]), *self.higher),
            (joins | labels, *list.gone),
            (merged, *self.cursor),
            (takes, *list.into),
        ]);
        let following = self.higher.plus(1) & (!last).repeat(BASIN);
        let data = select(&[
            (self.is(CLEAR), link(following)),
            (joins, link(*list.into)),
            (takes, link(list.follows)),
            (merged, link(list.next)),
            (labels, label),
            (settles, self.chain_out),
        ]);
        self.chain.write(diagonal | joins | unlinks | takes | labels | settles, at, data);
    }
}
