//! Passes: from the folded input of a subarray to p and μ, in the order of the schedule.
//!
//! ```text
//! v_00 ─┬─ v_ij of the polynomial ── search
//!       ├─ network: one μ ── steps of relax
//!       └─ a μ for each contact: contacts
//! ```

use super::plan::contents::Plan;
use super::stages::estimate::{estimate, images, MuWords};
use super::stages::pass::{join_limbs, pass, swap, Operands};
use super::stages::search::{search, Block, SearchResult};
use super::stages::send::ln_sigma_word;
use super::stages::{relax, rescale, unfold};
use super::words::formats::Formats;
use super::words::network::WordNetwork;
use super::words::quantised::Quantised;
use super::words::schedule::{by_limbs, is_transposed, layer, schedule, Product, EXPONENTS};
use crate::spec::board::EngineKind;
use crate::spec::quads::Quads;

/// The quads that a stage passes on.
pub type QuadStream = Vec<[i64; 4]>;

/// What the stages passed on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Streams {
    /// Output of `normalise`.
    pub normalised: QuadStream,
    /// Output of `fold`.
    pub folded: QuadStream,
    /// Output of `pass`: one quad per row and accumulation.
    pub passed: QuadStream,
    /// Output of `segment`: the contact of each lane of each quad; empty but for contacts.
    pub segmented: QuadStream,
    /// Output of `window`: for each contact the quads of its operand, then those of its mask; empty but for contacts.
    pub windows: QuadStream,
    /// Output of `estimate`: operands of the images of each layer, then the positions of μ and two zeros, for each contact
    /// where there are several μ; empty without a network.
    pub estimated: QuadStream,
    /// Output of `shear`: for each step the operands for Ax, then those for Ay; empty but for contacts.
    pub sheared: QuadStream,
    /// Output of `rescale`.
    pub rescaled: QuadStream,
    /// Output of `relax`: p after each step; empty without a network.
    pub relaxed: QuadStream,
    /// Output of `unfold`.
    pub unfolded: QuadStream,
}

/// The passes of a subarray: their operands, and what the stages passed on so far.
pub struct Passes<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// Widths and scales.
    pub formats: &'a Formats,
    /// The matrices.
    pub quantised: &'a Quantised,
    /// Layout of the subarray.
    pub layout: Quads,
    /// What the products read.
    pub operands: Operands,
    /// Right shift of `rescale`, known from v_00 on.
    pub shift: u32,
    /// Saturated words so far.
    pub saturations: u32,
    /// What the stages passed on.
    pub streams: Streams,
}

/// A step of `relax`.
pub struct Relaxed {
    /// v_00, or p, in parities.
    pub sums: QuadStream,
    /// The same as operands.
    pub operands: QuadStream,
    /// The same of the taxels, in words of the search.
    pub taxels: QuadStream,
}

impl Passes<'_> {
    /// The products of vector number `k`, rescaled.
    fn vector(&mut self, k: usize, products: &[Product]) -> QuadStream {
        let of = |part: &Vec<Product>| pass(self.formats, self.quantised, self.layout, part, &self.operands);
        let limbs: Vec<QuadStream> = by_limbs(products).iter().map(of).collect();
        let accumulators = join_limbs(self.formats, &limbs);
        if k == 0 {
            self.shift = rescale::shift(self.formats, rescale::raw_length(&accumulators));
        }
        let shift = if k == 0 { self.shift } else { self.formats.a_shift };
        let (words, clipped) = rescale::rescale(self.formats, &accumulators, shift);
        self.saturations += clipped;
        match self.plan.board.engine {
            EngineKind::Parallel => self.streams.passed.extend(limbs.concat()),
            EngineKind::Serial => self.streams.passed.extend(accumulators),
        }
        self.streams.rescaled.extend(&words);
        words
    }

    /// A step of `relax`: the sum of v_00 and these products, its operands, and its taxels.
    fn relax(&mut self, first: &[[i64; 4]], words: &[[i64; 4]]) -> Relaxed {
        let (sums, operands, clipped) = relax::relax(self.formats, first, words);
        self.saturations += clipped;
        let taxels = unfold::unfold(&sums, 0);
        self.streams.relaxed.extend(&sums);
        self.streams.unfolded.extend(&taxels);
        Relaxed { sums, operands, taxels }
    }

    /// v_00 where a network gives μ.
    pub fn first(&mut self) -> Relaxed {
        let words = self.vector(0, &schedule(self.formats)[0]);
        self.relax(&vec![[0; 4]; self.formats.quads], &words)
    }

    /// p of the taxels after all steps of `relax` from v_00; `give` makes the operands of the next products from those of p.
    pub fn relaxed(&mut self, first: Relaxed, give: impl Fn(&mut Self, QuadStream)) -> QuadStream {
        let Relaxed { sums: start, mut operands, mut taxels } = first;
        for (k, products) in schedule(self.formats).iter().enumerate().skip(1) {
            give(self, operands);
            let words = self.vector(k, products);
            Relaxed { operands, taxels, .. } = self.relax(&start, &words);
        }
        taxels
    }

    /// Evaluates the layers of the network; the images of each become operands. Those of whole groups of rows are passed on,
    /// zeros beyond the last.
    pub fn evaluate(&mut self, network: &WordNetwork) -> MuWords {
        let (formats, last) = (self.formats, self.formats.layers.len() - 1);
        self.operands.layers.clear();
        for (index, rows) in formats.hidden_rows().enumerate() {
            let products = layer(formats, index);
            let accumulators = pass(formats, self.quantised, self.layout, &products, &self.operands);
            let (next, clipped) = images(formats, network.shift, &accumulators);
            self.saturations += clipped;
            self.streams.estimated.extend(&next);
            self.streams.estimated.extend(vec![[0; 4]; rows - next.len()]);
            self.operands.layers.push(next);
        }
        let rows = pass(formats, self.quantised, self.layout, &layer(formats, last), &self.operands);
        let found = estimate(network.shift, &rows);
        self.saturations += found.saturations;
        found
    }

    /// Adds a position of μ to the words that `estimate` passes on.
    pub fn push_position(&mut self, position: [i32; 2]) {
        let [x, y] = position.map(i64::from);
        self.streams.estimated.push([x, y, 0, 0]);
    }

    /// One μ for the subarray by the network.
    pub fn by_network(&mut self, network: &WordNetwork, condition: bool) -> SearchResult {
        let first = self.first();
        let estimate = self.evaluate(network);
        let position = if condition { estimate.position } else { [0; 2] };
        self.operands.position = position.map(i64::from);
        self.push_position(position);
        let values = self.relaxed(first, |passes, operands| passes.operands.vectors.push(operands));
        let score = condition.then(|| i64::from(ln_sigma_word(estimate.ln_sigma)));
        SearchResult { sweeps: Vec::new(), position, score, values }
    }

    /// The polynomial p(μ), and the search, if the subarray is `searched`.
    pub fn search(&mut self, searched: bool) -> SearchResult {
        let layout = self.layout;
        let mut polynomials = vec![[[0i64; 10]; 4]; self.formats.quads];
        for (k, products) in schedule(self.formats).iter().enumerate() {
            let words = self.vector(k, products);
            self.operands.vectors.push(rescale::operand(self.formats, &words));
            // A transposed result is transposed back on its way to the search memory.
            let transposed = is_transposed(products);
            let mut taxels = unfold::unfold(&words, EXPONENTS[k].0 + EXPONENTS[k].1);
            if transposed {
                taxels.iter_mut().for_each(|quad| *quad = swap(*quad));
            }
            for (address, values) in taxels.iter().enumerate() {
                let to = if transposed { layout.transposed(address) } else { address };
                for (w, &value) in polynomials[to].iter_mut().zip(values) {
                    w[k] = value;
                }
            }
            self.streams.unfolded.extend(taxels);
        }
        search(layout, Block::new(layout, polynomials), searched)
    }
}
