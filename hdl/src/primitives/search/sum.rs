//! Sum of all taxels' polynomials of a subarray, one per search buffer.

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Net, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::search::polynomial_word::PolynomialWord;
use crate::primitives::search::sweep::{BUFFERS, BUFFER_BITS, START};

block! {
    /// Adds the counted lanes of each `fill` to the sum of buffer `START`, three cycles later; quad 0 restarts a
    /// coefficient. `read` puts a buffer's sum on `word` after the same three cycles as the search memory, where it is
    /// held; `write` replaces a buffer's sum by the `write_data` of the next cycle.
    pub struct Sum {
        layout: PolynomialWord,
        quads: usize,
        /// Width of a coefficient of a taxel in bits.
        fill_bits: usize,
    }
    ports SumPorts {
        clock;
        /// Add `fill_quad` to coefficient `fill_index`.
        in fill;
        /// Address of the quad; 0 restarts the coefficient. Valid with `fill`.
        in fill_address: count_bits(*quads);
        /// Index of the coefficient; valid with `fill`.
        in fill_index: count_bits(layout.widths.len());
        /// Counted lanes, one bit each; valid with `fill`.
        in fill_mask: LANES;
        /// The coefficient of four taxels, signed; valid with `fill`.
        in fill_quad: LANES * fill_bits;
        /// Put the sum of `read_buffer` on `word`.
        in read;
        /// Buffer to read; valid with `read`.
        in read_buffer: BUFFER_BITS;
        /// The sum read last, in the layout of the sums; three cycles after `read`.
        out word: layout.bits();
        /// Replace the sum of `write_buffer`.
        in write;
        /// Buffer to write; valid with `write`.
        in write_buffer: BUFFER_BITS;
        /// The new sum; valid one cycle after `write`.
        in write_data: layout.bits();
    }
}

/// Taxels of a quad.
const LANES: usize = 4;

impl Sum {
    /// Sums in `layout` (one lane) over `quads` quads, of coefficients of `fill_bits` bits.
    pub fn new(layout: &PolynomialWord, quads: usize, fill_bits: usize) -> Self {
        Sum { layout: layout.clone(), quads, fill_bits }
    }
}

/// The addition of a quad to a coefficient, two cycles after its `fill`.
#[derive(Clone, Copy)]
struct Addition<'k> {
    adds: Expr<'k>,
    index: Expr<'k>,
    first: Expr<'k>,
    added: Expr<'k>,
}

impl Block for Sum {
    fn build<'k>(&self, k: &'k Builder, io: SumPorts<Inside<'k>>) {
        let (layout, bits) = (&self.layout, self.fill_bits);
        let (read, read_buffer) = (k.delay("read_1", io.read), k.delay("read_buffer_1", io.read_buffer));
        let term = |lane: usize| {
            let counted = io.fill_mask.at(lane).mux(io.fill_quad.slice(lane * bits, bits), k.constant(bits, 0));
            k.delay(&format!("term_{lane}"), counted.signed())
        };
        let terms = [0, 1, 2, 3].map(term);
        let twice = |name: &str, value| k.delay(name, k.delay(&format!("{name}_1"), value));
        let addition = Addition {
            adds: twice("adds", io.fill),
            index: twice("index", io.fill_index),
            first: twice("first", io.fill_address.is(0)),
            added: k.delay("added", terms[0] + terms[1] + (terms[2] + terms[3])),
        };
        let written: Vec<Expr> = (0..BUFFERS).map(|b| io.write & io.write_buffer.is(b as u64)).collect();
        let coefficient = |n: usize| {
            k.scope(&format!("coefficient_{n}"), || {
                // Own control registers, to limit fan-out; the attribute keeps synthesis from merging them.
                let own = |name: &str, value: Expr<'_>| {
                    let register = k.register(name, value.ty()).keep();
                    register.set(value);
                    register
                };
                let (reads, from) = (own("reads", read), own("from", read_buffer));
                let writes: Vec<Net> = (0..BUFFERS).map(|b| own(&format!("writes_{b}"), written[b])).collect();
                let data = layout.coefficient(io.write_data, n, 0);
                let buffer = |b: usize| k.register(&format!("buffer_{b}"), Type::signed(layout.widths[n]));
                let buffers: Vec<Net> = (0..=BUFFERS).map(buffer).collect();
                let others: Vec<(u64, Expr)> = (1..).zip(buffers[1..].iter().map(Net::get)).collect();
                let word = k.register("word", Type::signed(layout.widths[n]));
                k.when(*reads, || word.set(from.case(&others, *buffers[0])));
                for (writes, buffer) in writes.iter().zip(&buffers) {
                    k.when(writes.get(), || buffer.set(data));
                }
                add(k, addition, n, buffers[START]);
                word.get()
            })
        };
        let sums: Vec<Expr> = (0..layout.widths.len()).map(coefficient).collect();
        io.word.set(concat(&sums.into_iter().rev().collect::<Vec<_>>()));
    }
}

/// Adds to coefficient `n`, which is in `buffer`.
fn add<'k>(k: &'k Builder, addition: Addition<'k>, n: usize, buffer: Net<'k>) {
    let Addition { adds, index, first, added } = addition;
    let bits = buffer.bits();
    let before = first.mux(k.signed_constant(bits, 0), *buffer);
    k.when(adds & index.is(n as u64), || buffer.set((added.resize(bits) + before).resize(bits)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const QUADS: usize = 9;
    const FILL_BITS: usize = 20;
    const WIDTHS: [u32; 3] = [27, 25, 24];

    /// A quad on its way to its coefficient.
    #[derive(Clone, Copy)]
    struct Added {
        index: usize,
        first: bool,
        sum: i64,
    }

    /// The buffers' coefficients, undefined before they are written; reads, writes and additions on their way.
    struct Buffers {
        layout: PolynomialWord,
        buffers: [[Option<i64>; WIDTHS.len()]; BUFFERS + 1],
        word: [Option<i64>; WIDTHS.len()],
        added: [Option<Added>; 2],
        reads: [Option<usize>; 2],
        writes: Option<usize>,
    }

    impl Reference for Buffers {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let all: Option<Vec<i64>> = self.word.iter().copied().collect();
            let word = |all: Vec<i64>| {
                let mut word = Word::default();
                let polynomial = std::array::from_fn(|n| all.get(n).copied().unwrap_or(0));
                self.layout.put(&mut word, 0, &polynomial);
                word
            };
            vec![all.map(word)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            if let Some(buffer) = self.reads[0] {
                self.word = self.buffers[buffer];
            }
            let before = self.buffers;
            if let Some(buffer) = self.writes.take() {
                let data = self.layout.get(&inputs[9], 0);
                self.buffers[buffer] = std::array::from_fn(|n| Some(data[n]));
            }
            if let Some(Added { index, first, sum }) = self.added[0].filter(|added| added.index < WIDTHS.len()) {
                let old = if first { Some(0) } else { before[START][index] };
                let bits = WIDTHS[index];
                self.buffers[START][index] = old.map(|old| (old + sum) << (64 - bits) >> (64 - bits));
            }
            let counted = |lane: &usize| inputs[3].field(*lane, 1) == 1;
            let sum = (0..LANES).filter(counted).map(|lane| inputs[4].signed(lane, FILL_BITS)).sum();
            let (index, first) = (inputs[2].number() as usize, inputs[1].number() == 0);
            let enters = (inputs[0].number() == 1).then_some(Added { index, first, sum });
            self.added = [self.added[1], enters];
            self.reads = [self.reads[1], (inputs[5].number() == 1).then(|| inputs[6].number() as usize)];
            // Sweeps never write START.
            self.writes = (inputs[7].number() == 1).then(|| inputs[8].number() as usize);
        }
    }

    #[test]
    fn sums_are_those_of_integers_in_each_buffer() {
        let layout = PolynomialWord::new(1, &WIDTHS);
        let block = Sum::new(&layout, QUADS, FILL_BITS);
        let mut random = fastrand::Rng::with_seed(8);
        let inputs = |_| {
            vec![
                random.bool().into(),
                random.u64(..QUADS as u64).into(),
                random.u64(..4).into(),
                random.u64(..16).into(),
                random_word(&mut random, LANES * FILL_BITS),
                random.bool().into(),
                random.u64(..4).into(),
                (random.u8(..4) == 0).into(),
                random.u64(..BUFFERS as u64).into(),
                random_word(&mut random, layout.bits()),
            ]
        };
        let stimulus: Vec<Vec<Word>> = (0..3000).map(inputs).collect();
        let mut reference = Buffers {
            layout,
            buffers: Default::default(),
            word: Default::default(),
            added: Default::default(),
            reads: Default::default(),
            writes: None,
        };
        check(&kernel_of(&block), &stimulus, &mut reference);
    }
}
