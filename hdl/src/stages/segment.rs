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

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::count_bits;
use params::SegmentParams;

mod basins;
mod control;
mod labels;
mod params;
mod walk;

block! {
    /// Segments the quads that were filled in; ports below, steps in the module docs.
    pub struct Segment {
        layout: Quads,
        /// Width of a lane of a quad that comes in.
        lane: usize,
        /// Width of the index of a contact.
        contact_bits: usize,
        /// Width of a label.
        label_bits: usize,
        params: SegmentParams,
    }
    ports SegmentPorts {
        clock;
        /// Synchronous reset, active high; stops the sequence.
        in rst;
        /// Four taxels of v_00, signed; valid with `fill`.
        in fill_quad: 4 * lane;
        /// `fill_quad` holds a quad; not from `start` to `done`.
        in fill;
        /// Address of the quad; valid with `fill`.
        in fill_address: count_bits(layout.len());
        /// All quads have been filled in: start. Ignored from then to `done`.
        in start;
        /// Address of the quad whose labels are asked; taken in every cycle.
        in label_address: count_bits(layout.len());
        /// Index of the contact whose middle is asked; taken in every cycle.
        in contact: contact_bits;
        /// Outputs are valid from now to the next `start`; high for one cycle.
        out done;
        /// Number of contacts; valid from `done` to the next `start`.
        out count: label_bits;
        /// There were more contacts or basins than there may be.
        out overflow;
        /// The contacts of a quad are written; high for one cycle per quad, in their order.
        out labelled;
        /// Those contacts, signed, a bit wider than a label; valid with `labelled`.
        out labelled_quad: 4 * (label_bits + 1);
        /// Contacts of the four taxels of a quad, 0 for none, else 1 + index; two cycles after `label_address`.
        out labels: 4 * label_bits;
        /// Row of the taxel in the middle of a contact; one cycle after `contact`.
        out middle_row: count_bits(layout.rows);
        /// Its column; as `middle_row`.
        out middle_col: count_bits(layout.cols);
    }
}

impl Segment {
    /// For the contacts of `model`, if it has any.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (contacts, formats) = (model.by_contact.as_ref()?, model.formats());
        let lane = formats.vector_bits as usize + 2;
        Some(Segment::new(&contacts.segmentation(&model.scene), lane, word_shift(formats) as usize))
    }

    /// For a segmentation of quads with lanes of `lane` bits, of which the word is that from bit `low` on.
    pub fn new(segmentation: &Segmentation, lane: usize, low: usize) -> Self {
        let params = SegmentParams::new(segmentation, lane, low);
        let (contact_bits, label_bits) = (count_bits(params.most), params.label());
        Segment { layout: segmentation.quads(), lane, contact_bits, label_bits, params }
    }
}

impl Block for Segment {
    fn build<'k>(&'k self, k: &'k Builder, io: SegmentPorts<Inside<'k>>) {
        io.circuit(k, &self.params);
    }
}

#[cfg(test)]
mod tests;
