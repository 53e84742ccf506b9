//! Stage `pass`: one lane per parity, each with its own coefficient and operand memory.
//!
//! ```text
//! address, operand_address --> memories | select | operands | product | accumulate --> quad; word, one after the other
//! ```
//! An operand is written twice, for its own lane and for the lane of the opposite parities, so that `flip` is an
//! address bit.
//!
//! A product issued in cycle t is in its accumulator in cycle t + 4. The accumulators leave one per cycle from the
//! fourth cycle after the `last` product, and are cleared with the fourth; the first product of the next row follows
//! the last one by five cycles at the earliest.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::plan::serial::{coefficients, first_vector, OPERAND_BITS, WIDE};
use dermis_golden::fixed::words::schedule::Kind;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::{count_bits, LOW_FILE, MEMORY_FILE};
use crate::wire::Word;

const OPERAND: usize = OPERAND_BITS as usize;

block! {
    /// Four multiply-accumulate lanes; timing in the module docs.
    pub struct Pass {
        /// Coefficients by address.
        wide: Vec<[i64; 4]>,
        /// Low limbs of Cz⁺ by address; empty if it has none.
        low: Vec<[i64; 4]>,
        /// Width of a low limb.
        low_bits: usize,
        /// Left shift of a product of two high limbs.
        align: usize,
        acc_bits: usize,
        /// Width of the address of a coefficient.
        address_bits: usize,
        /// Width of the address of an operand.
        operand_bits: usize,
    }
    ports PassPorts {
        clock;
        reset;
        /// A product is issued in this cycle.
        in valid;
        /// The product is the last of its row; valid with `valid`.
        in last;
        /// Wide matrix, row and column of the coefficient; valid with `valid`.
        in address: address_bits;
        /// Use the low limb of Cz⁺ in place of the wide matrix; valid with `valid`.
        in low;
        /// Vector and column of the operand; valid with `valid`.
        in operand_address: operand_bits;
        /// Source parity = target parity with both bits inverted; valid with `valid`.
        in flip;
        /// The product is of two high limbs and is shifted left; valid with `valid`.
        in align;
        /// Write `write_data` to the operand memory.
        in write;
        /// Vector and quad to write; valid with `write`.
        in write_address: operand_bits;
        /// Parity to write, 2 bits; valid with `write`.
        in write_lane: 2;
        /// Operand of 16 bits, signed; valid with `write`.
        in write_data: OPERAND;
        /// All four accumulators, `acc_bits` each, signed; valid with `quad_valid`.
        out quad: 4 * acc_bits;
        /// The accumulators hold a row; the first leaves in this cycle.
        out quad_valid;
        /// One accumulator, `acc_bits` wide, signed; valid with `word_valid`.
        out word: acc_bits;
        /// `word` is valid.
        out word_valid;
    }
}

impl Pass {
    /// The lanes of `model`, with its coefficients.
    pub fn new(model: &Model) -> Self {
        let f = model.formats();
        let bits = count_bits(f.quads);
        let table = |kind| coefficients(f, model.quantised(), kind);
        let low_bits = f.inverse_low_bits as usize;
        Pass {
            wide: WIDE.into_iter().flat_map(table).collect(),
            low: if low_bits > 0 { table(Kind::InverseLow) } else { Vec::new() },
            low_bits,
            align: f.limb_align as usize,
            acc_bits: f.acc_bits as usize,
            address_bits: 2 + 2 * bits,
            operand_bits: count_bits(first_vector(f) + f.operand_vectors()) + bits,
        }
    }
}

/// The word at `address` of a memory of `table`, four fields of `bits` bits, one cycle later.
fn coefficient_memory<'k>(
    k: &'k Builder,
    holds: Holds,
    [memory, word, file]: [&str; 3],
    table: &[[i64; 4]],
    bits: usize,
    address: Expr<'k>,
) -> Expr<'k> {
    let words = table.iter().map(|fields| Word::of_fields(fields, bits).limbs()[..(4 * bits).div_ceil(64)].to_vec());
    let contents = Contents::File { name: file.to_owned(), words: words.collect() };
    let memory = k.memory(memory, table.len(), 4 * bits, contents).holds(holds);
    let word = k.register(word, Type::unsigned(4 * bits));
    word.set(memory.read(address));
    *word
}

impl Block for Pass {
    fn build<'k>(&self, k: &'k Builder, io: PassPorts<Inside<'k>>) {
        let &Pass { low_bits, align: by, acc_bits: acc, operand_bits, .. } = self;
        let wide_word = coefficient_memory(
            k,
            Holds::Coefficients,
            ["wide", "wide_word", MEMORY_FILE],
            &self.wide,
            OPERAND,
            io.address,
        );
        let low_word = (low_bits > 0).then(|| {
            let low_address = io.address.low(count_bits(self.low.len()));
            (
                k.delay("low_selected", io.low),
                coefficient_memory(
                    k,
                    Holds::LowCoefficients,
                    ["low_memory", "low_word", LOW_FILE],
                    &self.low,
                    low_bits,
                    low_address,
                ),
            )
        });
        // valid, last, align
        let [first, second, third] =
            ["control0", "control1", "control2"].map(|name| k.register(name, Type::unsigned(3)));
        first.set(concat(&[io.valid & !io.rst, io.last, io.align]));
        second.set((first.at(2) & !io.rst).concat(first.low(2)));
        third.set((second.at(2) & !io.rst).concat(second.low(2)));
        let (adds, ends, aligns) = (third.at(2), third.at(1), third.at(0));
        let reading = k.state("reading", Type::unsigned(1), io.rst, 0);
        let idle = k.wire("idle", io.rst | !*reading);
        let read = k.state("read", Type::unsigned(2), idle, 0);
        let clears = k.wire("clears", io.rst | (*reading & read.is(3)));
        reading.set((adds & ends) | (*reading & !read.is(3)));
        read.set(read.plus(1));

        let accumulators = [0, 1, 2, 3].map(|lane| {
            let named = |name: &str| format!("{name}{lane}");
            let operands = k.memory(&named("operands"), 2 << operand_bits, OPERAND, Contents::Undefined);
            let operands = operands.holds(Holds::Operands(lane));
            let ty = Type::signed(OPERAND);
            let operand = k.register(&named("operand"), Type::unsigned(OPERAND));
            let [coefficient, factor] = ["coefficient", "factor"].map(|name| k.register(&named(name), ty));
            let product = k.register(&named("product"), Type::signed(2 * OPERAND));
            let accumulator = k.state(&named("accumulator"), Type::unsigned(acc), clears, 0);
            // A lane holds its own parity, and in the upper half the opposite one.
            let opposite = io.write_lane.at(0) ^ io.write_lane.at(1);
            let holds = if lane == 0 || lane == 3 { !opposite } else { opposite };
            let half = if lane % 2 == 1 { !io.write_lane.at(0) } else { io.write_lane.at(0) };
            operands.write(io.write & holds, half.concat(io.write_address), io.write_data);
            operand.set(operands.read(io.flip.concat(io.operand_address)));
            let wide = wide_word.slice(lane * OPERAND, OPERAND);
            let coefficient_word = low_word.map_or(wide, |(selected, word)| {
                selected.mux(word.slice(lane * low_bits, low_bits).extend(OPERAND), wide)
            });
            coefficient.set(coefficient_word.signed());
            factor.set(operand.signed());
            product.set(*coefficient * *factor);
            // The sums fit an accumulator, so the higher bits of a product are not needed.
            let shifted = |by: usize| {
                let shifted = product.shift_left(by);
                if shifted.bits() > acc {
                    shifted.low(acc)
                } else {
                    shifted.extend(acc).unsigned()
                }
            };
            let aligned = if by == 0 { shifted(0) } else { aligns.mux(shifted(by), shifted(0)) };
            k.when(adds, || accumulator.set((*accumulator + aligned).low(acc)));
            *accumulator
        });
        let [a, b, c, d] = accumulators;
        io.quad.set(concat(&[d, c, b, a]));
        io.quad_valid.set(*reading & read.is(0));
        io.word.set(read.case(&[(0, a), (1, b), (2, c)], d));
        io.word_valid.set(*reading);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};

    const ADDRESS: usize = 5;
    const OPERANDS: usize = 3;
    const LOW_BITS: usize = 9;
    const ALIGN: usize = 7;

    /// Whole products in integers; three cycles later they are in the accumulators.
    struct Lanes {
        tables: Pass,
        operands: [[Option<i64>; 4]; 1 << OPERANDS],
        /// Products and whether they are the last of a row, the newest first.
        products: [Option<([i64; 4], bool)>; 3],
        sums: [i64; 4],
        /// Accumulators that have left.
        read: Option<usize>,
        reset: bool,
    }

    impl Reference for Lanes {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let acc = self.tables.acc_bits;
            vec![
                self.read.filter(|read| *read == 0).map(|_| Word::of_fields(&self.sums, acc)),
                bit(self.read == Some(0)),
                self.read.map(|read| Word::of_fields(&[self.sums[read]], acc)),
                bit(self.read.is_some()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, address, low, operand, flip, align, write, to, lane] =
                [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10].map(|k| inputs[k].number() as usize);
            let arriving = self.products[2];
            self.products.rotate_right(1);
            self.products[0] = (valid == 1).then(|| {
                let table = if low == 1 { &self.tables.low } else { &self.tables.wide };
                let shift = if align == 1 { ALIGN } else { 0 };
                let product = |lane: usize| {
                    let operand = self.operands[operand][if flip == 1 { 3 - lane } else { lane }];
                    (table[address % table.len()][lane] * operand.unwrap()) << shift
                };
                ([0, 1, 2, 3].map(product), last == 1)
            });
            self.read = self.read.map(|read| read + 1).filter(|read| *read < 4).or_else(|| {
                if self.read.is_some() {
                    self.sums = [0; 4];
                }
                None
            });
            if let Some((products, last)) = arriving {
                self.sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
                self.read = self.read.or(last.then_some(0));
            }
            if write == 1 {
                self.operands[to][lane] = Some(inputs[11].signed(0, OPERAND));
            }
            if rst == 1 {
                (self.products, self.sums, self.read, self.reset) = ([None; 3], [0; 4], None, true);
            }
        }
    }

    fn tables(random: &mut fastrand::Rng, low: bool, acc_bits: usize) -> Pass {
        let wide = (0..1 << ADDRESS).map(|_| [(); 4].map(|()| i64::from(random.i16(..)) >> 5)).collect();
        let low_words = (0..8).map(|_| [(); 4].map(|()| random.i64(0..1 << LOW_BITS)));
        Pass {
            wide,
            low: if low { low_words.collect() } else { Vec::new() },
            low_bits: if low { LOW_BITS } else { 0 },
            align: if low { ALIGN } else { 0 },
            acc_bits,
            address_bits: ADDRESS,
            operand_bits: OPERANDS,
        }
    }

    /// All operands, then rows of products with pauses, while single operands change; resets.
    fn stimulus(cycles: usize, low: bool) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(27);
        let (mut left, mut pause) = (0usize, 0usize);
        let inputs = |cycle: usize| {
            let filling = cycle < 4 << OPERANDS;
            let rst = cycle < 2 || random.u16(..400) == 0;
            if left == 0 && pause == 0 {
                left = random.usize(1..20);
            }
            let valid = !filling && left > 0 && random.u8(..8) > 0;
            let last = left == 1;
            if valid {
                left -= 1;
                pause = if last { random.usize(8..14) } else { 0 };
            } else if left == 0 {
                pause -= 1;
            }
            let is_low = low && random.bool();
            let to = if filling { cycle / 4 } else { random.usize(..1 << OPERANDS) };
            let lane = if filling { cycle % 4 } else { random.usize(..4) };
            vec![
                Word::from(rst),
                Word::from(valid),
                Word::from(last),
                Word::from(random.u64(..if is_low { 8 } else { 1 << ADDRESS })),
                Word::from(is_low),
                Word::from(random.u64(..1 << OPERANDS)),
                Word::from(random.bool()),
                Word::from(low && random.bool()),
                Word::from(filling || random.u8(..8) == 0),
                Word::from(to as u64),
                Word::from(lane as u64),
                Word::of_fields(&[i64::from(random.i16(..)) >> 4], OPERAND),
            ]
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn the_lanes_multiply_and_add_in_step() {
        for (low, acc) in [(false, 30), (true, 38)] {
            let tables = || tables(&mut fastrand::Rng::with_seed(28), low, acc);
            let mut lanes = Lanes {
                tables: tables(),
                operands: [[None; 4]; 1 << OPERANDS],
                products: [None; 3],
                sums: [0; 4],
                read: None,
                reset: false,
            };
            check(&kernel_of(&tables()), &stimulus(6000, low), &mut lanes);
        }
    }
}
