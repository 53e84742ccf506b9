//! The contacts at the end: the labels of the quads, the sums and the middle of each.

use dermis_golden::fixed::plan::resources::Holds;

use super::control::*;
use super::walk::Order;
use crate::language::{Contents, Expr, Type};
use crate::primitives::count_bits;

impl<'k> Circuit<'k> {
    /// The contact of each taxel, and the labels of the quads.
    pub(super) fn labels(&self, order: &Order<'k>) {
        let (k, bits) = (self.k, self.shape.label());
        k.comment("Labels");
        let found = self.chain_out.low(bits);
        k.when(self.at(LABEL, 3), || {
            self.label.set(found);
            self.adds.set(*self.counts & found.any());
        });
        k.when(self.settled(), || self.adds.set(self.zero(1)));
        let before = k.register("labels_before", Type::unsigned(3 * bits));
        let quad = k.wire("label_quad", self.label.concat(*before));
        k.when(self.at(LABEL, 4), || before.set(quad.slice(bits, 3 * bits)));
        let memory = k.memory("label_quads", self.shape.quad_count(), 4 * bits, Contents::Undefined).unchecked();
        let memory = memory.holds(Holds::Labels);
        memory.write(self.is(LABEL) & order.quads_end, *self.quad, quad);
        let address = k.input("label_address", self.quad.bits());
        k.delay("labels", k.delay("labels_read", memory.read(address)));
        k.when(self.is(LABEL) & order.last_quad, || self.ending.set(k.constant(1, 1)));
        self.enter(self.at(LABEL, 1) & *self.ending, MIDDLE, || ());
    }

    /// Whether the line of a middle is further: the sum of a contact is not `less` than what is held, twice its weight.
    pub(super) fn goes_on(&self, less: Expr<'k>) -> Expr<'k> {
        let last = |lines: usize| self.line.is(lines as u64 - 1);
        let [row, col] =
            [(1, self.shape.rows), (2, self.shape.cols)].map(|(tick, lines)| self.at(MIDDLE, tick) & !last(lines));
        (row | col) & !less
    }

    /// The middles, and the end.
    pub(super) fn middles(&self, less: Expr<'k>) {
        let (k, tick) = (self.k, self.tick);
        let bits = count_bits(self.shape.most);
        let goes_on = self.goes_on(less);
        k.comment("Middles");
        k.when(self.is(MIDDLE), || self.line.set(self.line.plus(1) & goes_on.repeat(self.line.bits())));
        k.when(self.is(MIDDLE) & !goes_on, || tick.set(tick.at(1).mux(self.zero(4), tick.plus(1))));
        k.when(self.at(MIDDLE, 2) & !goes_on, || self.higher.set(self.higher.plus(1)));
        let ends = k.wire("ends", self.at(MIDDLE, 0) & self.higher.equals(self.kept.resize(BASIN)));
        self.enter(ends, IDLE, || ());
        self.done.set(ends);
        let contact = k.input("contact", bits);
        for (axis, (name, lines)) in [("middle_row", self.row), ("middle_col", self.col)].into_iter().enumerate() {
            let memory = k.memory(&format!("{name}s"), self.shape.most, lines.bits(), Contents::Undefined).unchecked();
            let memory = memory.holds(Holds::Middles(axis));
            let writes = self.at(MIDDLE, 1 + axis as u64) & !goes_on;
            memory.write(writes, self.higher.low(bits), self.line.low(lines.bits()));
            k.delay(name, memory.read(contact));
        }
    }
}
