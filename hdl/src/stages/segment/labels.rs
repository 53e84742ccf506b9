//! The contacts at the end: the labels of the quads, the sums and the middle of each.

use dermis_golden::fixed::plan::resources::Holds;

use super::control::*;
use super::walk::Order;
use crate::language::{concat, Contents, Expr, Type};
use crate::primitives::count_bits;

/// Ticks of `MIDDLE` after those in which the moments along the rows and the columns are compared.
const ROW: u64 = 4;
const COLUMN: u64 = 8;

impl<'k> Circuit<'k> {
    /// The contact of each taxel, and the labels of the quads.
    pub(super) fn labels(&self, order: &Order<'k>) {
        let (k, bits) = (self.k, self.params.label());
        k.comment("Labels");
        let found = self.chain_out.low(bits);
        let before = k.register("labels_before", Type::unsigned(3 * bits));
        let quad = k.wire("label_quad", found.concat(*before));
        // The basin of a taxel is the cursor when the next taxel has been chosen.
        k.when(self.at(LABEL, 4), || self.begun.set(k.constant(1, 1)));
        k.when(self.at(LABEL, 0), || {
            // Its number, and 0 for none, which adds nothing.
            self.label.set(found.low(self.label.bits()));
            self.adds.set(*self.counts & found.any() & *self.begun);
            before.set(quad.slice(bits, 3 * bits));
        });
        k.when(self.settled(), || self.adds.set(self.zero(1)));
        let memory = k.memory("label_quads", self.params.quad_count(), 4 * bits, Contents::Undefined).unchecked();
        let memory = memory.holds(Holds::Labels);
        let whole = k.delay("label_quad_ends", self.is(LABEL) & order.quads_end);
        memory.write(whole, k.delay("label_quad_address", *self.quad), quad);
        self.io.labelled.set(whole);
        let signed = |lane: usize| self.zero(1).concat(quad.slice(lane * bits, bits));
        self.io.labelled_quad.set(concat(&[3, 2, 1, 0].map(signed)));
        self.io.labels.delay(k.delay("labels_read", memory.read(self.io.label_address)));
        k.when(self.is(LABEL) & order.last_quad, || self.ending.set(k.constant(1, 1)));
        self.enter(self.at(LABEL, 3) & *self.ending, [LABEL, MIDDLE], || ());
    }

    /// The middles, and the end. The sum of a contact was `less` than what is held, twice its weight, or is written again.
    pub(super) fn middles(&self, less: Expr<'k>) {
        let (k, tick) = (self.k, self.tick);
        let bits = count_bits(self.params.most);
        k.comment("Middles");
        let less = k.delay("was_less", less);
        let (row, column) = (self.at(MIDDLE, ROW), self.at(MIDDLE, COLUMN));
        let last = |lines: usize| self.line.is(lines as u64 - 1);
        let ends = row.mux(last(self.params.rows), last(self.params.cols)) | less;
        let ends = k.wire("line_found", ends);
        k.when(self.is(MIDDLE), || tick.set(tick.plus(1)));
        self.turn(row & !ends, ROW - 1);
        self.turn(column, 0);
        self.turn(column & !ends, COLUMN - 1);
        k.when(self.at(MIDDLE, 0), || self.line.set(self.zero(self.line.bits())));
        k.when(row | column, || self.line.set(self.line.plus(1) & (!ends).repeat(self.line.bits())));
        k.when(column & ends, || self.higher.set(self.higher.plus(1)));
        let done = k.wire("ends", self.at(MIDDLE, 0) & self.higher.equals(self.kept.resize(BASIN)));
        self.enter(done, [MIDDLE, IDLE], || ());
        self.done.set(done);
        let outputs = [(self.io.middle_row, "middle_rows", self.row), (self.io.middle_col, "middle_cols", self.col)];
        for (axis, (output, name, lines)) in outputs.into_iter().enumerate() {
            let memory = k.memory(name, self.params.most, lines.bits(), Contents::Undefined).unchecked();
            let memory = memory.holds(Holds::Middles(axis));
            let writes = [row, column][axis] & ends;
            memory.write(writes, self.higher.low(bits), self.line.low(lines.bits()));
            output.delay(memory.read(self.io.contact));
        }
    }
}
