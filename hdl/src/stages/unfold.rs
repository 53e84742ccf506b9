//! Stage `unfold`: words of v_ij back to taxels, coefficient by coefficient into the search memory.

use dermis_golden::fixed::words::schedule::{is_transposed, schedule, vectors};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{count_bits, BitDelay, CaseCounter, Counter, Delay, TransposedPlace, Unfolder};
use crate::wire::Wire;

/// Quads of v_ij in, in order; two cycles later four taxels with coefficient index and quad address.
#[derive(LogicBlock)]
pub struct Unfold {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case; constant while a frame is computed.
    pub which: Wire<In>,
    /// A subarray starts: the words of v_00 come next.
    pub start: Signal<In, Bit>,
    /// Four parities of a v_ij, `vector_bits` each, signed; valid with `words_valid`.
    pub words: Wire<In>,
    /// `words` holds a quad.
    pub words_valid: Signal<In, Bit>,
    /// One coefficient of four taxels, two bits wider, signed; valid with `taxels_valid`, two cycles after `words`.
    pub taxels: Wire<Out>,
    /// `taxels` holds a quad.
    pub taxels_valid: Signal<Out, Bit>,
    /// Index of the coefficient; valid with `taxels_valid`.
    pub index: Wire<Out>,
    /// Address of the quad; valid with `taxels_valid`.
    pub address: Wire<Out>,
    /// All coefficients of the subarray have been output; high for one cycle.
    pub done: Signal<Out, Bit>,
    quads: CaseCounter,
    vectors: Counter,
    unfolder: Unfolder,
    transposed: TransposedPlace,
    index_first: Delay,
    index_later: Delay,
    address_later: Delay,
    valid_later: BitDelay,
    finish: BitDelay,
    quad_end: Signal<Local, Bit>,
}

impl Unfold {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let across = schedule(formats).iter().enumerate().filter(|(_, p)| is_transposed(p)).map(|(k, _)| k).collect();
        let quads: Vec<usize> = model.cases().iter().map(|case| case.formats.quads).collect();
        let bits = formats.vector_bits as usize;
        let count = vectors(formats.degree);
        let (index, address) = (count_bits(count), count_bits(formats.quads));
        Unfold {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(quads.len())),
            start: Default::default(),
            words: Wire::new(4 * bits),
            words_valid: Default::default(),
            taxels: Wire::new(4 * (bits + 2)),
            taxels_valid: Default::default(),
            index: Wire::new(index),
            address: Wire::new(address),
            done: Default::default(),
            quads: CaseCounter::new(&quads),
            vectors: Counter::new(count),
            unfolder: Unfolder::new(bits, count),
            transposed: TransposedPlace::new(model.layout(), bits + 2, count, across),
            index_first: Delay::new(index, 1),
            index_later: Delay::new(index, 1),
            address_later: Delay::new(address, 2),
            valid_later: BitDelay::new(2),
            finish: BitDelay::new(3),
            quad_end: Default::default(),
        }
    }
}

impl Logic for Unfold {
    #[hdl_gen]
    fn update(&mut self) {
        self.quads.clk.next = self.clk.val();
        self.vectors.clk.next = self.clk.val();
        self.unfolder.clk.next = self.clk.val();
        self.index_first.clk.next = self.clk.val();
        self.index_later.clk.next = self.clk.val();
        self.address_later.clk.next = self.clk.val();
        self.valid_later.clk.next = self.clk.val();
        self.finish.clk.next = self.clk.val();
        self.valid_later.rst.next = self.rst.val();
        self.finish.rst.next = self.rst.val();

        self.quad_end.next = self.words_valid.val() & self.quads.last.val();
        self.quads.which.next = self.which.val();
        self.quads.clear.next = self.start.val();
        self.quads.enable.next = self.words_valid.val();
        self.vectors.clear.next = self.start.val();
        self.vectors.enable.next = self.quad_end.val();
        self.unfolder.quad.next = self.words.val();
        self.index_first.d.next = self.vectors.value.val();
        self.unfolder.index.next = self.index_first.q.val();
        self.index_later.d.next = self.index_first.q.val();
        self.address_later.d.next = self.quads.value.val();
        self.valid_later.d.next = self.words_valid.val();

        self.transposed.index.next = self.index_later.q.val();
        self.transposed.address.next = self.address_later.q.val();
        self.transposed.quad.next = self.unfolder.taxels.val();
        self.taxels.next = self.transposed.taxels.val();
        self.taxels_valid.next = self.valid_later.q.val();
        self.index.next = self.index_later.q.val();
        self.address.next = self.transposed.placed.val();
        self.finish.d.next = self.quad_end.val() & self.vectors.last.val();
        self.done.next = self.finish.q.val();
    }
}
