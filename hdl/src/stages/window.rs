//! Stage `window`: what the network reads around a contact, out of the frame buffer.
//!
//! ```text
//! first sweep   taxel -> code -> magnitude -> shift
//! second sweep  taxel -> code -> shifted -> sums of the quad -> high limbs -> window memory
//! both sweeps   code of a taxel of the contact -> positive, negative
//! ```
//! A sweep reads the window quad by quad, the four mirror images of a quad one after the other, one taxel per cycle. The
//! second follows the first at once: the shift is known when its first taxel arrives. A window takes
//! [`cycles`](dermis_golden::fixed::stages::window::cycles), wherever it lies.

use dermis_golden::fixed::Model;
use dermis_golden::physics::symmetry::parity::hadamard;
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::window;

use super::normalise::left_shift;
use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::{
    beyond, count_bits, lane_of, magnitude_of, quad_address_of, subtracted, TaxelPlace, MASK_BITS,
};
use crate::wire::Word;

block! {
    /// Reads the window around a contact, shifts its codes until the largest fills the word, folds them and gives their high
    /// limbs, quad after quad, with the folded mask. Taxels beyond the array and dead ones are 0 and masked. The array is one
    /// subarray.
    pub struct Window {
        layout: Quads,
        /// Width of a code.
        bits: usize,
        /// Width of the low limb of a parity, and of the high one.
        low_bits: usize,
        high_bits: usize,
        label_bits: usize,
        /// Noise floor in codes, where it is not written.
        floor: Option<i32>,
        floor_bits: usize,
        /// Dead taxels, in ascending order.
        dead: Vec<usize>,
        window: window::Window,
    }
    ports WindowPorts {
        clock;
        /// Synchronous reset, active high: ends a window.
        in rst;
        /// Reads the window around a contact, from now on; ends another.
        in start;
        /// Row of the taxel in the middle of the contact; valid with `start`.
        in middle_row: count_bits(layout.rows);
        /// Column of this taxel; valid with `start`.
        in middle_col: count_bits(layout.cols);
        /// Label of the contact's taxels, from 1 on; valid with `start`.
        in label: label_bits;
        /// Address of a quad of the frame buffer, and of its labels; 0 for a taxel beyond the array.
        out quad_address: count_bits(layout.len());
        /// Four codes, `input_bits` each, signed; two cycles after `quad_address`.
        in quad: 4 * bits;
        /// Labels of the quad's four taxels; two cycles after `quad_address`.
        in labels: 4 * label_bits;
        /// Noise floor in codes, unsigned, where it is written, else one bit; constant between resets, valid from one on.
        in floor: floor_bits;
        /// A quad is written to the window memory.
        out write;
        /// High limbs of the four parities of the quad, signed; valid with `write`.
        out write_quad: 4 * high_bits;
        /// Folded mask of the quad in units of [`MASKED`](dermis_golden::fixed::words::network::MASKED), four signed fields of
        /// 4 bits; valid with `write`.
        out mask_quad: 4 * MASK_BITS;
        /// A code of the contact's taxels in the window is above the noise floor; valid from `done` until the next `start`.
        out positive;
        /// A code of these taxels is below minus the noise floor; valid as `positive`.
        out negative;
    }
}

/// Cycles from the scan of a taxel until its code has been chosen from the quad that was read.
const CODE: usize = 7;
/// Cycles from the scan of a taxel until its shifted code enters the sums of the window's quad.
const SUM: usize = 9;

impl Window {
    /// For the windows around the contacts of `model`, if it has any.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (contacts, formats) = (model.by_contact.as_ref()?, model.formats());
        Some(Window {
            layout: model.layout(),
            bits: formats.input_bits as usize,
            low_bits: formats.input_low_bits as usize,
            high_bits: (formats.fold_bits - formats.input_low_bits) as usize,
            label_bits: count_bits(model.contacts() + 1),
            floor: model.built_in_floor(),
            floor_bits: model.floor_bits() as usize,
            dead: model.dead.clone(),
            window: contacts.window,
        })
    }
}

impl Block for Window {
    fn build<'k>(&self, k: &'k Builder, io: WindowPorts<Inside<'k>>) {
        Circuit { k, io, block: self }.window(&self.window);
    }
}

/// The circuit under construction.
struct Circuit<'k, 'a> {
    k: &'k Builder,
    io: WindowPorts<Inside<'k>>,
    block: &'a Window,
}

/// The taxel of a cycle of the scan.
struct Scanned<'k> {
    /// One is scanned.
    valid: Expr<'k>,
    /// Lane of the window's quad, 2 bits.
    lane: Expr<'k>,
    /// With it a quad of the second sweep ends.
    ends_quad: Expr<'k>,
    /// Its row and column in the array, where the array has it, else 0; two cycles later.
    place: [Expr<'k>; 2],
    /// It is beyond the array; valid with `place`.
    outside: Expr<'k>,
}

impl<'k> Circuit<'k, '_> {
    /// A bit that is 0 after a reset or a start.
    fn bit(&self, name: &str, value: Expr<'k>) -> Expr<'k> {
        let state = self.k.state(name, Type::unsigned(1), self.restarts(), 0);
        state.set(value);
        *state
    }

    fn restarts(&self) -> Expr<'k> {
        self.io.rst | self.io.start
    }

    /// A bit so many cycles later, 0 after a reset or a start.
    fn bit_later(&self, name: &str, value: Expr<'k>, cycles: usize) -> Expr<'k> {
        (0..cycles).fold(value, |value, number| self.bit(&format!("{name}_{number}"), value))
    }

    /// A word so many cycles later.
    fn later(&self, name: &str, value: Expr<'k>, cycles: usize) -> Expr<'k> {
        (0..cycles).fold(value, |value, number| self.k.delay(&format!("{name}_{number}"), value))
    }

    fn window(&self, window: &window::Window) {
        let k = self.k;
        let scanned = self.scan(window, self.block.layout);
        let [code, own, masked] = self.code(&scanned);

        k.comment("First sweep: magnitude and signs. The second sweep finds the same ones.");
        let valid = self.bit_later("valid", scanned.valid, CODE);
        let gathered = |name: &str, value: Expr<'k>| {
            let held = k.state(name, Type::unsigned(value.bits()), self.restarts(), 0);
            held.set(*held | value);
            *held
        };
        let magnitude = magnitude_of(code);
        let magnitude = gathered("magnitude", magnitude & valid.repeat(magnitude.bits()));
        let [above, below] = beyond(k, code, self.block.floor, self.io.floor);
        let counts = self.bit("counts", own & valid);
        gathered("positive", k.delay("above", above) & counts);
        gathered("negative", k.delay("below", below) & counts);

        k.comment("Second sweep: codes and mask are shifted and folded, a taxel per cycle.");
        let shift = k.delay("shift", left_shift(k, magnitude));
        let shifted = k.delay("shifted", k.delay("code_later", code).shift_left_by(shift));
        let sums = self.sums(shifted, self.later("lane", scanned.lane, SUM));
        let low = self.block.low_bits;
        self.io.write_quad.set(concat(&sums.map(|sum| sum.slice(low, sum.bits() - low))));
        let mask = k.register("mask", Type::unsigned(Quads::LANES));
        mask.set(self.later("masked_code", masked, SUM - CODE).concat(mask.slice(1, Quads::LANES - 1)));
        self.io.mask_quad.set(mask.table(4 * MASK_BITS, &folded_masks()));

        let ended = self.bit_later("ends_quad", scanned.ends_quad, SUM);
        self.bit("write", ended);
    }

    /// Scans the window twice: quad by quad, in each the four lanes.
    fn scan(&self, window: &window::Window, array: Quads) -> Scanned<'k> {
        let (k, quads) = (self.k, window.quads());
        let scanning = k.state("scanning", Type::unsigned(1), self.io.rst, 0);
        let counter = |name: &str, limit: usize| k.state(name, Type::unsigned(count_bits(limit)), self.restarts(), 0);
        let lane = counter("lane", Quads::LANES);
        let (across, down) = (counter("across", quads.quad_cols()), counter("down", quads.quad_rows()));
        let again = counter("again", 2);
        let quad_ends = k.wire("quad_ends", *scanning & lane.all());
        let row_ends = k.wire("row_ends", quad_ends & across.is(quads.quad_cols() as u64 - 1));
        let sweep_ends = k.wire("sweep_ends", row_ends & down.is(quads.quad_rows() as u64 - 1));
        k.when(*scanning, || lane.set(lane.plus(1)));
        k.when(quad_ends, || across.set(across.plus(1)));
        k.when(row_ends, || across.set(k.constant(across.bits(), 0)));
        k.when(row_ends, || down.set(down.plus(1)));
        k.when(sweep_ends, || down.set(k.constant(down.bits(), 0)));
        k.when(sweep_ends, || again.set(k.constant(1, 1)));
        scanning.set(self.io.start | (*scanning & !(sweep_ends & *again)));

        k.comment("Row and column, modulo a power of two beyond the last line of any window.");
        let middle = [self.io.middle_row, self.io.middle_col];
        let line = |axis: usize, near: Expr<'k>, far: Expr<'k>, own: usize, lines: usize| {
            let name = ["row", "col"][axis];
            let bits = count_bits(lines + own);
            let first = k.register(&format!("first_{name}"), Type::unsigned(bits));
            k.when(self.io.start, || first.set(middle[axis].extend(bits).minus(own as u64 / 2)));
            let mirrored = (k.constant(count_bits(own), own as u64 - 1) - near).low(count_bits(own));
            let at = k.delay(&format!("{name}_at"), (*first + far.mux(mirrored, near)).low(bits));
            (at.low(count_bits(lines)), at.less(k.constant(bits, lines as u64)))
        };
        let (row, has_row) = line(0, *down, lane.at(1), window.rows, array.rows);
        let (col, has_col) = line(1, *across, lane.at(0), window.cols, array.cols);
        let on_array = k.wire("on_array", has_row & has_col);
        let place = |name: &str, at: Expr<'k>| k.delay(name, at & on_array.repeat(at.bits()));
        Scanned {
            valid: *scanning,
            lane: *lane,
            ends_quad: quad_ends & *again,
            place: [place("row", row), place("col", col)],
            outside: k.delay("outside", !on_array),
        }
    }

    /// The code of the scanned taxel, whether it is one of the contact, and whether it is masked; [`CODE`] cycles later.
    fn code(&self, scanned: &Scanned<'k>) -> [Expr<'k>; 3] {
        let (k, layout, dead) = (self.k, self.block.layout, &self.block.dead);
        let [row, col] = scanned.place;
        let place = TaxelPlace::of(k, layout, scanned.place);
        let near = [0, 1].map(|axis| k.delay(["near_row", "near_col"][axis], place.near[axis]));
        let first = k.constant(count_bits(layout.len()), 0);
        self.io.quad_address.delay(quad_address_of(k, layout, near, first));
        let is_dead = (!dead.is_empty()).then(|| {
            let table = (0..1usize << (row.bits() + col.bits())).map(|at| {
                let (row, col) = (at >> col.bits(), at % (1 << col.bits()));
                u64::from(col < layout.cols && dead.binary_search(&(row * layout.cols + col)).is_ok())
            });
            row.concat(col).table(1, &table.collect::<Vec<u64>>())
        });
        let masked = is_dead.map_or(scanned.outside, |dead| scanned.outside | dead);
        // With the quad.
        let masked = self.later("masked", masked, 4);
        let from = self.later("from", place.lower.concat(place.right), 4);
        let chosen = |quad: Expr<'k>| lane_of(quad, Quads::LANES, from);
        let bits = self.block.bits;
        let code = k.delay("code", chosen(self.io.quad) & (!masked).repeat(bits));
        let label = k.register("contact", Type::unsigned(self.block.label_bits));
        k.when(self.io.start, || label.set(self.io.label));
        let own = k.delay("own", chosen(self.io.labels).equals(*label));
        [code, own, k.delay("masked_code", masked)]
    }

    /// The four parities of a quad whose words, signed, come one after the other; last first.
    fn sums(&self, word: Expr<'k>, lane: Expr<'k>) -> [Expr<'k>; 4] {
        let k = self.k;
        let bits = word.bits() + 2;
        let word = word.signed().extend(bits).unsigned();
        let begins = !lane.any();
        let odd = subtracted(k, lane);
        [3, 2, 1, 0].map(|parity| {
            let sum = k.register(&format!("sum{parity}"), Type::unsigned(bits));
            let before = begins.mux(k.constant(bits, 0), *sum);
            // One adder: −w is the complement of w and one more, the carry of the added lowest bits.
            let (odd, turned) = (odd[parity], word ^ odd[parity].repeat(bits));
            sum.set((before.concat(odd) + turned.concat(odd)).slice(1, bits));
            *sum
        })
    }
}

/// The folded mask of a quad, by its four bits.
fn folded_masks() -> Vec<u64> {
    let folded = |masked: i64| hadamard([0, 1, 2, 3].map(|lane| masked >> lane & 1));
    (0..1 << Quads::LANES).map(|masked| Word::of_fields(&folded(masked), MASK_BITS).number()).collect()
}

#[cfg(test)]
mod tests;
