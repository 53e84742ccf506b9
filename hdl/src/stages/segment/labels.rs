//! The contacts at the end: the labels of the quads, the sums and the middle of each.

use dermis_golden::fixed::plan::resources::Holds;

use super::control::*;
use super::walk::Order;
use crate::language::{concat, Contents, Expr, Type};
use crate::primitives::count_bits;

/// Ticks of `MIDDLE` in which the moments along the rows and the columns are compared.
const ROW: u64 = 3;
const COLUMN: u64 = 7;

impl<'k> Circuit<'k> {
    /// The contact of each taxel, and the labels of the quads.
    pub(super) fn labels(&self, order: &Order<'k>) {
        let (k, bits) = (self.k, self.shape.label());
        k.comment("Labels");
        let found = self.chain_out.low(bits);
        let before = k.register("labels_before", Type::unsigned(3 * bits));
        let quad = k.wire("label_quad", found.concat(*before));
        // The basin of a taxel is the cursor when the next taxel has been chosen.
        k.when(self.at(LABEL, 4), || self.begun.set(k.constant(1, 1)));
        k.when(self.at(LABEL, 0), || {
            self.label.set(found);
            self.adds.set(*self.counts & found.any() & *self.begun);
            before.set(quad.slice(bits, 3 * bits));
        });
        k.when(self.settled(), || self.adds.set(self.zero(1)));
        let memory = k.memory("label_quads", self.shape.quad_count(), 4 * bits, Contents::Undefined).unchecked();
        let memory = memory.holds(Holds::Labels);
        let whole = k.delay("label_quad_ends", self.is(LABEL) & order.quads_end);
        memory.write(whole, k.delay("label_quad_address", *self.quad), quad);
        k.wire("labelled", whole);
        let signed = |lane: usize| self.zero(1).concat(quad.slice(lane * bits, bits));
        k.wire("labelled_quad", concat(&[3, 2, 1, 0].map(signed)));
        let address = k.input("label_address", self.quad.bits());
        k.delay("labels", k.delay("labels_read", memory.read(address)));
        k.when(self.is(LABEL) & order.last_quad, || self.ending.set(k.constant(1, 1)));
        self.enter(self.at(LABEL, 3) & *self.ending, [LABEL, MIDDLE], || ());
    }

    /// Whether the line of a middle is further: the sum of a contact is not `less` than what is held, twice its weight.
    pub(super) fn goes_on(&self, less: Expr<'k>) -> Expr<'k> {
        let last = |lines: usize| self.line.is(lines as u64 - 1);
        let [row, col] = [(ROW, self.shape.rows), (COLUMN, self.shape.cols)];
        let further = |(tick, lines): (u64, usize)| self.at(MIDDLE, tick) & !last(lines);
        (further(row) | further(col)) & !less
    }

    /// The middles, and the end.
    pub(super) fn middles(&self, less: Expr<'k>) {
        let (k, tick) = (self.k, self.tick);
        let bits = count_bits(self.shape.most);
        let goes_on = self.goes_on(less);
        k.comment("Middles");
        // A sum that was written is read again in the next tick, and compared in the one after.
        k.when(self.is(MIDDLE), || tick.set(tick.plus(1)));
        self.turn(self.at(MIDDLE, ROW + 1), ROW);
        self.turn(self.at(MIDDLE, COLUMN + 1), COLUMN);
        self.turn(self.at(MIDDLE, ROW) & !goes_on, ROW + 2);
        self.turn(self.at(MIDDLE, COLUMN) & !goes_on, 0);
        let compares = self.is(MIDDLE) & tick.low(2).all();
        let line = self.line.plus(1) & goes_on.repeat(self.line.bits());
        k.when(self.at(MIDDLE, 0) | compares, || self.line.set(line));
        k.when(self.at(MIDDLE, COLUMN) & !goes_on, || self.higher.set(self.higher.plus(1)));
        let ends = k.wire("ends", self.at(MIDDLE, 0) & self.higher.equals(self.kept.resize(BASIN)));
        self.enter(ends, [MIDDLE, IDLE], || ());
        self.done.set(ends);
        let contact = k.input("contact", bits);
        for (axis, (name, lines)) in [("middle_row", self.row), ("middle_col", self.col)].into_iter().enumerate() {
            let memory = k.memory(&format!("{name}s"), self.shape.most, lines.bits(), Contents::Undefined).unchecked();
            let memory = memory.holds(Holds::Middles(axis));
            let writes = self.at(MIDDLE, [ROW, COLUMN][axis]) & !goes_on;
            memory.write(writes, self.higher.low(bits), self.line.low(lines.bits()));
            k.delay(name, memory.read(contact));
        }
    }
}
