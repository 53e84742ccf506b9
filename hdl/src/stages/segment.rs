//! Stage `segment`: the contact of each taxel and the middle of each contact, from the words of the unpacked v_00.
//!
//! ```text
//! quads -- unpack --> words -- smooth --> q -- climb --> steps -- walk --> basins -- join, order --> contacts --> labels
//!                                                                                        moments --> middles
//! ```
//! One sequencer with one multiplier. `cycles` of the bit-true model predicts the cycles of a frame exactly; n taxels, Q quads,
//! B basins in the list, t taps of a window along all lines:
//!
//! | state | does | table, memory | cycles |
//! |---|---|---|---|
//! | `UNPACK` | words of the quads, row-major | quads → words | 7 Q |
//! | `ALONG_ROWS`, `ALONG_COLUMNS` | products with the weights of a window, read in their order; written transposed | words → steps → words | t + 7 |
//! | `CLIMB` | products of the rise to eight neighbours with the slope; the largest. Maxima get a number and a bar | steps, bars | 10 n + 6 |
//! | `CLEAR` | the saddles of the basins are 0, so are their loads; a list of them | saddles, loads, chain | (B + 1)(B + 2)/2 |
//! | `WALK` | from each taxel up to the first with a basin, and once more to write that basin | steps | 3 per reading |
//! | `BORDERS` | load of each basin; the smaller word of two neighbours in different basins | loads, saddles | 5 n + 3, 3 per pair |
//! | `LEAST` | the smallest load, or in the end the largest | loads, chain | B + 4 |
//! | `PAIRS` | the highest saddle: of a basin with a small load, or of all pairs | saddles, bars | 3 per saddle, 4 per lower basin |
//! | `JOIN` | load, bar and saddles of two basins become one's | loads, bars, saddles, chain | 4 B + 3 |
//! | `TAKE` | the next contact, which leaves the list | chain | 2 |
//! | `SETTLE` | the contact of every basin | chain | 64 |
//! | `LABEL` | labels of the quads; weight and moments of each contact | label quads, loads | 20 Q + 4 |
//! | `MIDDLE` | row and column: how many times twice the weight is in a moment | loads, middles | 2 (row + column) + 9 |
//!
//! The bar of a maximum m is ⌈29 m/32⌉: a saddle is high if it is not below the lower bar. Moments are sums of the word times
//! 2·line + 1, so that the middle is their quotient by twice the weight, rounded down.

use dermis_golden::fixed::stages::segment::cycles::Segmentation;
use dermis_golden::fixed::stages::segment::word_shift;
use dermis_golden::fixed::Model;
use dermis_golden::spec::quads::Quads;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::primitives::count_bits;
use crate::wire::Wire;
use control::{Circuit, Shape};

mod basins;
mod control;
mod labels;
mod walk;

/// Segments the quads that were filled in; ports below, steps in the module docs.
#[derive(dermis_hdl_derive::Block)]
pub struct Segment {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; stops the sequence.
    pub rst: Signal<In, Bit>,
    /// Four taxels of v_00, signed; valid with `fill`.
    pub fill_quad: Wire<In>,
    /// `fill_quad` holds a quad; not from `start` to `done`.
    pub fill: Signal<In, Bit>,
    /// Address of the quad; valid with `fill`.
    pub fill_address: Wire<In>,
    /// All quads have been filled in: start. Ignored from then to `done`.
    pub start: Signal<In, Bit>,
    /// Address of the quad whose labels are asked; taken in every cycle.
    pub label_address: Wire<In>,
    /// Index of the contact whose middle is asked; taken in every cycle.
    pub contact: Wire<In>,
    /// Outputs are valid from now to the next `start`; high for one cycle.
    pub done: Signal<Out, Bit>,
    /// Number of contacts; valid from `done` to the next `start`.
    pub count: Wire<Out>,
    /// There were more contacts or basins than there may be.
    pub overflow: Signal<Out, Bit>,
    /// The contacts of a quad are written; high for one cycle per quad, in their order.
    pub labelled: Signal<Out, Bit>,
    /// Those contacts, signed, a bit wider than a label; valid with `labelled`.
    pub labelled_quad: Wire<Out>,
    /// Contacts of the four taxels of a quad, 0 for none, else 1 + index; two cycles after `label_address`.
    pub labels: Wire<Out>,
    /// Row of the taxel in the middle of a contact; one cycle after `contact`.
    pub middle_row: Wire<Out>,
    /// Its column; as `middle_row`.
    pub middle_col: Wire<Out>,
    kernel: Body,
}

kernel_block!(
    Segment,
    clock clk,
    inputs [rst, fill_quad, fill, fill_address, start, label_address, contact],
    outputs [done, count, overflow, labelled, labelled_quad, labels, middle_row, middle_col]
);

impl Segment {
    /// For the contacts of `model`; without contacts all outputs are constant 0.
    pub fn of_model(model: &Model) -> Self {
        let formats = model.formats();
        let lane = formats.vector_bits as usize + 2;
        match &model.by_contact {
            Some(contacts) => Segment::new(&contacts.segmentation(&model.scene), lane, word_shift(formats) as usize),
            None => Segment::nothing(model.layout(), lane),
        }
    }

    /// Constant 0 in the place of a segmentation, for quads with lanes of `lane` bits.
    fn nothing(layout: Quads, lane: usize) -> Self {
        let (quad, bits) = (count_bits(layout.len()), count_bits(1));
        let k = Builder::new("segment");
        k.comment("There are no contacts.");
        for (name, width) in [
            ("rst", 1),
            ("fill_quad", 4 * lane),
            ("fill", 1),
            ("fill_address", quad),
            ("start", 1),
            ("label_address", quad),
            ("contact", bits),
        ] {
            k.input(name, width);
        }
        for (name, width) in [
            ("done", 1),
            ("count", bits),
            ("overflow", 1),
            ("labelled", 1),
            ("labelled_quad", 4 * (bits + 1)),
            ("labels", 4 * bits),
            ("middle_row", count_bits(layout.rows)),
            ("middle_col", count_bits(layout.cols)),
        ] {
            k.wire(name, k.constant(width, 0));
        }
        Segment::with(layout, lane, bits, bits).bind(k.finish())
    }

    /// For a segmentation of quads with lanes of `lane` bits, of which the word is that from bit `low` on.
    pub fn new(segmentation: &Segmentation, lane: usize, low: usize) -> Self {
        let shape = Shape::new(segmentation, lane, low);
        Segment::with(segmentation.quads(), lane, count_bits(shape.most), shape.label()).bind(kernel(&shape))
    }

    /// The ports for quads of `layout` with lanes of `lane` bits, indices of contacts of `contact` bits and labels of `label`.
    fn with(layout: Quads, lane: usize, contact: usize, label: usize) -> Self {
        let quad = count_bits(layout.len());
        Segment {
            clk: Default::default(),
            rst: Default::default(),
            fill_quad: Wire::new(4 * lane),
            fill: Default::default(),
            fill_address: Wire::new(quad),
            start: Default::default(),
            label_address: Wire::new(quad),
            contact: Wire::new(contact),
            done: Default::default(),
            count: Wire::new(label),
            overflow: Default::default(),
            labelled: Default::default(),
            labelled_quad: Wire::new(4 * (label + 1)),
            labels: Wire::new(4 * label),
            middle_row: Wire::new(count_bits(layout.rows)),
            middle_col: Wire::new(count_bits(layout.cols)),
            kernel: Body::default(),
        }
    }
}

fn kernel(shape: &Shape) -> Kernel {
    let k = Builder::new("segment");
    {
        let circuit = Circuit::new(&k, shape);
        let order = circuit.order();
        let list = circuit.tables(&order);
        circuit.labels(&order);
        circuit.begin_pairs(&list);
    }
    k.finish()
}

#[cfg(test)]
mod tests;
