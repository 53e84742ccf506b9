//! The MAC lanes with their coefficient memory and shift-out chains.

use dermis_golden::fixed::plan::check::{signature, POLYNOMIAL, START};
use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::words::formats::{Formats, MULTIPLIER_BITS};
use dermis_golden::fixed::{CasePlan, Model};

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, MemoryPort, Net, Output, Type};
use crate::primitives::address::case_counter::{largest, value_by_case};
use crate::primitives::address::counter::count_bits;
use crate::primitives::frame::load::{CoefficientPlaces, PAIR_BITS};
use crate::primitives::pass::pass_program::{programs, Control};

const M: usize = MULTIPLIER_BITS as usize;

block! {
    /// ```text
    /// address --> register --> memory --> register --> a \
    ///                                                     * --> product --> accumulator --> chain --> quad
    /// operands ------------------------------------> b   /
    /// ```
    /// A lane is a multiply-accumulator with synchronous clear, as the multiplier blocks of most FPGAs have it. A memory word
    /// holds one coefficient per lane. `operands`, `valid` and `control` belong to the address of three cycles earlier. After
    /// the last product of an accumulation its rows leave one per cycle: `lanes_per_parity` quads, fewer in the last group,
    /// the first of them four cycles after the `control` of that product. In the cycle after that product `valid` must be
    /// low, because the accumulators are cleared when its product has been added.
    ///
    /// Where low limbs are in a memory of their own, both memories are read and their words combined; the other one then has
    /// a word of zeros.
    #[derive(Clone, Debug)]
    pub struct Lanes {
        /// Lanes of one parity; the whole has four times as many.
        per_parity: usize,
        /// Width of an accumulator.
        lane_bits: usize,
        /// Groups of rows of each section.
        groups: Vec<usize>,
        /// Rows of the last group of each section.
        last_rows: Vec<usize>,
        /// Coefficients of each word, one per lane.
        memory: Vec<Vec<i64>>,
        /// The last so many words are in a memory of their own, with so many bits per lane.
        narrow: (usize, usize),
        /// Where coefficients are written.
        written: CoefficientPlaces,
        /// Expected signatures of the sections, with the coefficient check.
        signatures: Option<Vec<u32>>,
        /// A subarray has all sections in turn, beginning with section 0, in the place of one of them.
        in_turn: bool,
        control: Control,
    }
    ports LanesPorts {
        clock;
        /// Synchronous reset, active high; clears the control pipeline and, two cycles later, the accumulators.
        in rst;
        /// Index of the section; constant from its first product to its last row.
        in section: count_bits(groups.len());
        /// Address in the coefficient memory; three cycles before `valid` of its product.
        in address: count_bits(memory.len());
        /// Four operands, one per parity, 18 bits each, signed; valid with `valid`.
        in operands: 4 * M;
        /// `operands` and `control` are valid: one product per lane to accumulate.
        in valid;
        /// Last product of an accumulation, and what else [`Control`] has. Valid with `valid`.
        in control: control.bits();
        /// Writes `coefficient_data` to the coefficient memory ([`Load`](crate::primitives::Load)); only in a reset. Not read where the
        /// coefficients are not written.
        in coefficient_write;
        /// Word of the memory; valid with `coefficient_write`.
        in coefficient_word: written.word_bits();
        /// Pair of lanes; valid with `coefficient_write`.
        in coefficient_pair: written.pair_bits();
        /// The coefficients of two lanes; valid with `coefficient_write`.
        in coefficient_data: PAIR_BITS;
        /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
        out quad: 4 * lane_bits;
        /// `quad` holds a row.
        out quad_valid;
        /// `quad` holds a row two cycles later.
        out quad_soon;
        /// `quad` holds a row of a layer of a network; `quad_valid` is low. Constant 0 without a network.
        out layer_valid;
        /// The signature of the coefficients read since the section's first product, or of a section before it in its
        /// subarray, is wrong, 1 bit; valid from three cycles after its last product. Constant 0 without the check.
        out damaged: 1;
    }
}

/// File of the coefficient memory, one line per word.
pub const MEMORY_FILE: &str = "coefficients.hex";
/// File of the memory of low limbs, one line per word.
pub const LOW_FILE: &str = "low_coefficients.hex";

impl Lanes {
    /// The lanes of `model`, with the coefficients of all its cases in one memory.
    pub fn new(model: &Model) -> Self {
        let (formats, cases) = (model.formats(), model.cases());
        let programs = programs(model);
        Lanes {
            per_parity: formats.lanes_per_parity,
            lane_bits: formats.lane_bits as usize,
            groups: programs.iter().map(|(case, _)| case.formats.groups).collect(),
            last_rows: programs.iter().map(|(case, _)| last_rows(&case.formats)).collect(),
            memory: cases.iter().flat_map(CasePlan::memory).collect(),
            narrow: (model.first().storage.narrow, formats.limb_align as usize),
            written: CoefficientPlaces::new(model),
            signatures: model
                .has_coefficient_check()
                .then(|| programs.iter().map(|(case, section)| signature(case, section)).collect()),
            in_turn: formats.by_contact(),
            control: Control::new(model),
        }
    }
}

/// Rows (quads) of the last group of a pass.
fn last_rows(formats: &Formats) -> usize {
    formats.quads - (formats.groups - 1) * formats.lanes_per_parity
}

/// A word of a memory of `bits` bits per lane as limbs of 64 bits, lane 0 lowest.
fn limbs(coefficients: &[i64], bits: usize) -> Vec<u64> {
    let mut limbs = vec![0; (coefficients.len() * bits).div_ceil(64)];
    for (lane, &coefficient) in coefficients.iter().enumerate() {
        for bit in (0..bits).filter(|bit| coefficient >> bit & 1 == 1) {
            let at = lane * bits + bit;
            limbs[at / 64] |= 1 << (at % 64);
        }
    }
    limbs
}

/// The signals that all lanes read.
#[derive(Clone, Copy)]
struct Shared<'k> {
    coefficients: Expr<'k>,
    operands: Expr<'k>,
    /// Two cycles after the operands: there is a product to add, a cycle later.
    adds: Expr<'k>,
    /// The last product of an accumulation, with its operands.
    ends: Expr<'k>,
}

/// As [`Builder::delay`], not merged with equal registers.
fn own_copy<'k>(k: &'k Builder, name: &str, value: Expr<'k>) -> Expr<'k> {
    let register = k.register(name, value.ty()).keep();
    register.set(value);
    *register
}

impl Block for Lanes {
    fn build<'k>(&self, k: &'k Builder, io: LanesPorts<Inside<'k>>) {
        let bit = Type::unsigned(1);
        let coefficients = self.coefficients(k, &io);

        let later = |name: &str, value| {
            let state = k.state(name, bit, io.rst, 0);
            state.set(value);
            *state
        };
        let shown = |output: Output<'k>, value| {
            let state = output.state(io.rst, 0);
            state.set(value);
            *state
        };
        let valid1 = later("valid1", io.valid);
        let ends = k.wire("ends", io.valid & io.control.at(0));
        let captured = later("captured", ends);
        let of_layer = self.control.layer_at().map(|bit| k.delay("of_layer", io.control.at(bit)));
        let rows = self.rows(k, &io, of_layer.map_or(captured, |of_layer| captured & !of_layer));
        let rows = match of_layer {
            None => rows,
            Some(of_layer) => of_layer.mux(k.constant(rows.bits(), self.per_parity as u64), rows),
        };
        let left = k.state("left", Type::unsigned(rows.bits()), io.rst, 0);
        let more = k.wire("more", left.any());
        k.when(more, || left.set(left.minus(1)));
        k.when(captured, || left.set(rows));
        k.comment("Not written as left > 1, which is constant where left has one bit.");
        let soon = captured | (more & !left.is(1));
        match of_layer {
            None => {
                shown(io.quad_valid, later("quad_next", shown(io.quad_soon, soon)));
                io.layer_valid.set(k.constant(1, 0));
            }
            Some(of_layer) => {
                // Whose rows leave, until the next accumulation has been captured.
                let leaving = k.state("leaving_layer", bit, io.rst, 0);
                k.when(captured, || leaving.set(of_layer));
                let soon = later("row_soon", soon);
                let quad_soon = io.quad_soon.set(soon & !*leaving);
                shown(io.quad_valid, later("quad_next", quad_soon));
                shown(io.layer_valid, later("layer_next", soon & *leaving));
            }
        }

        self.check(k, &io, || later("valid2", valid1), coefficients);
        let shared = Shared { coefficients, operands: io.operands, adds: valid1, ends };
        let heads: Vec<Expr> = (0..4).rev().map(|parity| self.parity(k, io.rst, parity, shared)).collect();
        io.quad.set(concat(&heads));
    }
}

impl Lanes {
    /// One coefficient per lane, three cycles after its address.
    fn coefficients<'k>(&self, k: &'k Builder, io: &LanesPorts<Inside<'k>>) -> Expr<'k> {
        let address = io.address;
        let (lanes, (narrow, low)) = (4 * self.per_parity, self.narrow);
        let (wide_words, low_words) = self.memory.split_at(self.memory.len() - narrow);
        let file = |name: &str, words| Contents::File { name: name.to_owned(), words };
        let read =
            |name: &str, memory: MemoryPort<'k>, at| k.delay(name, k.delay(&format!("{name}_read"), memory.read(at)));
        let mut words: Vec<Vec<u64>> = wide_words.iter().map(|word| limbs(word, M)).collect();
        if narrow == 0 {
            let memory =
                k.memory("memory", words.len(), lanes * M, file(MEMORY_FILE, words)).holds(Holds::Coefficients);
            let memory = self.written(memory, io);
            return read("coefficients", memory, k.delay("at", address));
        }
        let zeros = wide_words.len();
        words.push(limbs(&vec![0; lanes], M));
        let memory = k.memory("memory", words.len(), lanes * M, file(MEMORY_FILE, words)).holds(Holds::Coefficients);
        k.comment("The low limbs stand at the lower bits of their addresses.");
        let depth = narrow.next_power_of_two();
        let mut words = vec![limbs(&vec![0; lanes], low); depth];
        for (index, word) in low_words.iter().enumerate() {
            words[(zeros + index) % depth] = limbs(word, low);
        }
        let short = k.memory("low_memory", depth, lanes * low, file(LOW_FILE, words)).holds(Holds::LowCoefficients);
        let is_low = k.wire("is_low", !address.less(k.constant(address.bits(), zeros as u64)));
        let bits = count_bits(zeros + 1);
        let at = k.delay("at", is_low.mux(k.constant(bits, zeros as u64), address.low(bits)));
        let low_at = k.delay("low_at", address.low(count_bits(depth)));
        let (word, short) = (read("word", memory, at), read("low_word", short, low_at));
        let shows = k.delay("shows_1", k.delay("shows", is_low));
        let lane = |lane: usize| {
            // One copy per lane, to limit fan-out; the attribute keeps synthesis from merging them.
            let shows = k.scope(&format!("lane_{lane}"), || own_copy(k, "shows", shows));
            let (own, low_bits) = (word.slice(lane * M, M), short.slice(lane * low, low));
            own.slice(low, M - low).concat(own.low(low) | (low_bits & shows.repeat(low)))
        };
        k.wire("coefficients", concat(&(0..lanes).rev().map(lane).collect::<Vec<_>>()))
    }

    /// The memory with its write port, where coefficients are written. Nothing is read during the reset in which they are.
    fn written<'k>(&self, memory: MemoryPort<'k>, io: &LanesPorts<Inside<'k>>) -> MemoryPort<'k> {
        if self.written.words == 0 {
            return memory;
        }
        let memory = memory.unchecked();
        for own in 0..self.written.pairs {
            let enable = io.coefficient_write & io.coefficient_pair.is(own as u64);
            memory.write_part(enable, io.coefficient_word, own * PAIR_BITS, io.coefficient_data);
        }
        memory
    }

    /// Rows that leave after the present group; a counter of the groups where there are several.
    fn rows<'k>(&self, k: &'k Builder, io: &LanesPorts<Inside<'k>>, captured: Expr<'k>) -> Expr<'k> {
        let row_bits = count_bits(self.per_parity + 1);
        let last_rows = value_by_case(k, io.section, &self.last_rows, row_bits);
        let groups = largest(&self.groups);
        if groups == 1 {
            return last_rows;
        }
        let ends: Vec<usize> = self.groups.iter().map(|groups| groups - 1).collect();
        let group = k.state("group", Type::unsigned(count_bits(groups)), io.rst, 0);
        let is_last = k.wire("last_group", group.equals(value_by_case(k, io.section, &ends, group.bits())));
        k.when(captured, || group.set(is_last.mux(k.constant(group.bits(), 0), group.plus(1))));
        is_last.mux(last_rows, k.constant(row_bits, self.per_parity as u64))
    }

    /// Signature of the coefficients read, compared with the expected one: parity of each lane, of four lanes, of all
    /// lanes, one cycle each.
    fn check<'k>(
        &self,
        k: &'k Builder,
        io: &LanesPorts<Inside<'k>>,
        valid2: impl FnOnce() -> Expr<'k>,
        coefficients: Expr<'k>,
    ) {
        let Some(signatures) = &self.signatures else {
            io.damaged.set(k.constant(1, 0));
            return;
        };
        let parities = |of: Expr<'k>, bits: usize| {
            let one = |n: usize| of.slice(n * bits, bits).parity();
            concat(&(0..of.bits() / bits).rev().map(one).collect::<Vec<_>>())
        };
        let odd_lanes = k.delay("odd_lanes", parities(coefficients, M));
        let odd_fours = k.delay("odd_fours", parities(odd_lanes, 4));
        let opens1 = k.delay("opens1", io.control.at(self.control.opens_at().unwrap_or(0)));
        let opens2 = k.delay("opens2", opens1);
        k.comment("Signature of the coefficients read, compared with the expected one.");
        let signature = k.register("signature", Type::unsigned(32));
        let so_far = k.wire("sofar", opens2.mux(k.constant(32, START.into()), *signature));
        let feedback = so_far.top().mux(k.constant(32, POLYNOMIAL.into()), k.constant(32, 0));
        let valid2 = valid2();
        k.when(valid2, || signature.set(so_far.low(31).concat(odd_fours.parity()) ^ feedback));
        let expected: Vec<usize> = signatures.iter().map(|&signature| signature as usize).collect();
        let differs = |section: Expr<'k>| signature.differs(value_by_case(k, section, &expected, 32));
        if !self.in_turn {
            io.damaged.set(differs(io.section));
            return;
        }
        k.comment("A section that begins keeps whether one before it in its subarray was damaged.");
        let (begun, earlier) = (k.register("begun", io.section.ty()), k.register("earlier", Type::unsigned(1)));
        let damaged = io.damaged.set(differs(*begun) | *earlier);
        k.when(opens2 & valid2, || {
            begun.set(io.section);
            earlier.set(!io.section.is(0) & damaged);
        });
    }

    /// The lanes of one parity; the accumulator that its chain shows.
    fn parity<'k>(&self, k: &'k Builder, rst: Expr<'k>, parity: usize, shared: Shared<'k>) -> Expr<'k> {
        let acc = Type::signed(self.lane_bits);
        k.scope(&format!("parity_{parity}"), || {
            // One copy per parity, each for a quarter of the lanes, to limit fan-out and route length.
            let leaves1 = own_copy(k, "leaves1", !rst & shared.ends);
            // After a reset the accumulators are cleared by an end without a product.
            let leaves2 = own_copy(k, "leaves2", rst | leaves1);
            let chain = |lane: usize| k.scope(&format!("lane_{lane}"), || k.register("chain", acc));
            let chains: Vec<Net<'k>> = (0..self.per_parity).map(chain).collect();
            for (lane, chain) in chains.iter().enumerate() {
                let (accumulator, leaves) = k.scope(&format!("lane_{lane}"), || {
                    let leaves = own_copy(k, "leaves", leaves2);
                    (self.lane(k, parity, parity * self.per_parity + lane, shared, leaves), leaves)
                });
                let next = chains.get(lane + 1).map_or(k.signed_constant(self.lane_bits, 0), Net::get);
                chain.set(leaves.mux(accumulator, next));
            }
            chains[0].get()
        })
    }

    /// The accumulator of one lane, cleared when it leaves.
    fn lane<'k>(&self, k: &'k Builder, parity: usize, lane: usize, shared: Shared<'k>, leaves: Expr<'k>) -> Expr<'k> {
        // One copy per lane, to limit fan-out; the attribute keeps synthesis from merging them.
        let adds = own_copy(k, "adds", shared.adds);
        let a = k.delay("a", shared.coefficients.slice(lane * M, M).signed());
        let b = k.delay("b", shared.operands.slice(parity * M, M).signed());
        let product = k.delay("product", a * b);
        let fits = product.low(self.lane_bits.min(product.bits())).signed().extend(self.lane_bits);
        let accumulator = k.register("accumulator", Type::signed(self.lane_bits));
        k.when(adds, || accumulator.set((*accumulator + fits).low(self.lane_bits).signed()));
        k.when(leaves, || accumulator.set(k.signed_constant(self.lane_bits, 0)));
        *accumulator
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::plan::check::{parity, step};
    use dermis_golden::fixed::stages::load::COEFFICIENTS_PER_WORD;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Three lanes per parity and two cases: one group of two rows, two groups of which the second has one row.
    fn shape() -> Lanes {
        let mut random = fastrand::Rng::with_seed(8);
        let mut coefficient = || random.i64(-(1 << (M - 1))..1 << (M - 1));
        let memory = (0..20).map(|_| (0..12).map(|_| coefficient()).collect()).collect();
        Lanes {
            per_parity: 3,
            lane_bits: 41,
            groups: vec![1, 2],
            last_rows: vec![2, 1],
            memory,
            narrow: (0, 0),
            written: CoefficientPlaces::default(),
            signatures: Some(vec![0x1234_5678, 0xabcd_ef01]),
            in_turn: false,
            control: Control { layers: false, opens: true },
        }
    }

    /// One product per lane, as it enters.
    #[derive(Clone, Default)]
    struct Beat {
        valid: bool,
        control: u64,
        word: usize,
        operands: Word,
    }

    struct Integers {
        shape: Lanes,
        /// The products of one, two and three cycles ago.
        pipe: [Beat; 3],
        addresses: [usize; 3],
        /// `None` before the first reset.
        accumulators: Option<Vec<i64>>,
        chain: Option<Vec<i64>>,
        /// Rows to come from two cycles on.
        left: usize,
        /// Whether a row leaves in two cycles, in one, now; `None` before the first reset.
        leaves: Option<[bool; 3]>,
        /// Whether those are rows of a layer.
        of_layer: [bool; 3],
        group: usize,
        signature: Option<u32>,
        /// Section of the signature, and whether one before it in its subarray was damaged.
        section: usize,
        earlier: Option<bool>,
    }

    impl Integers {
        /// Whether the signature, or one before it, is not that of `section`.
        fn damaged(&self, section: usize) -> Option<bool> {
            let Some(expected) = &self.shape.signatures else { return Some(false) };
            match self.shape.in_turn {
                true => Some(self.earlier? | (self.signature? != expected[self.section])),
                false => Some(self.signature? != expected[section]),
            }
        }

        fn accumulate(&mut self, beat: &Beat) {
            let (per_parity, wrap) = (self.shape.per_parity, 64 - self.shape.lane_bits);
            let word = &self.shape.memory[beat.word];
            for (lane, sum) in self.accumulators.iter_mut().flatten().enumerate() {
                let product = word[lane] * beat.operands.signed(lane / per_parity, M);
                *sum = (*sum + product) << wrap >> wrap;
            }
        }
    }

    impl Reference for Integers {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let per_parity = self.shape.per_parity;
            let heads = |chain: &Vec<i64>| [0, 1, 2, 3].map(|parity| chain[parity * per_parity]);
            let shows = self.leaves.is_some_and(|[_, _, now]| now);
            let row =
                |of: usize, layer: bool| self.leaves.map(|leaves| Word::from(leaves[of] && self.of_layer[of] == layer));
            let quad = self.chain.as_ref().filter(|_| shows).map(heads);
            vec![
                row(0, false),
                row(2, false),
                row(2, true),
                self.damaged(inputs[1].number() as usize).map(Word::from),
                quad.map(|heads| Word::of_fields(&heads, self.shape.lane_bits)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let rst = inputs[0].number() == 1;
            if inputs[6].number() == 1 {
                let [word, pair] = [7, 8].map(|k| inputs[k].number() as usize);
                let lanes = &mut self.shape.memory[word][pair * COEFFICIENTS_PER_WORD..];
                lanes.iter_mut().zip([0, 1]).for_each(|(lane, k)| *lane = inputs[9].signed(k, M));
            }
            let per_parity = self.shape.per_parity;
            let [left, added, captured] = self.pipe.clone();
            let ends = |beat: &Beat| beat.valid && beat.control & 1 == 1;
            self.chain.iter_mut().for_each(|chain| {
                (0..4).for_each(|parity| chain[parity * per_parity..][..per_parity].rotate_left(1));
            });
            if ends(&left) {
                self.chain.clone_from(&self.accumulators);
                self.accumulators.iter_mut().flatten().for_each(|sum| *sum = 0);
            }
            if added.valid {
                self.accumulate(&added);
                let opens = self.shape.control.opens_at().is_some_and(|bit| added.control >> bit & 1 == 1);
                if opens {
                    let section = inputs[1].number() as usize;
                    self.earlier = if section == 0 { Some(false) } else { self.damaged(section) };
                    self.section = section;
                }
                let start = if opens { Some(START) } else { self.signature };
                self.signature = start.map(|signature| step(signature, parity(&self.shape.memory[added.word])));
            }
            self.left = self.left.saturating_sub(1);
            let [soon, next, _] = self.of_layer;
            self.of_layer = [soon, soon, next];
            if ends(&captured) {
                let case = inputs[1].number() as usize;
                let layer = self.shape.control.layer_at().is_some_and(|bit| captured.control >> bit & 1 == 1);
                self.of_layer[0] = layer;
                if layer {
                    self.left = per_parity;
                } else {
                    self.group = (self.group + 1) % self.shape.groups[case];
                    self.left = if self.group == 0 { self.shape.last_rows[case] } else { per_parity };
                }
            }
            self.leaves = self.leaves.map(|[soon, next, _]| [self.left > 0, soon, next]);
            self.pipe.rotate_left(1);
            self.pipe[2] = Beat {
                valid: inputs[4].number() == 1 && !rst,
                control: inputs[5].number(),
                word: self.addresses[2],
                operands: inputs[3],
            };
            self.addresses = [inputs[2].number() as usize, self.addresses[0], self.addresses[1]];
            if rst {
                self.pipe.iter_mut().for_each(|beat| beat.valid = false);
                (self.left, self.group, self.leaves) = (0, 0, Some([false; 3]));
                (self.accumulators, self.chain, self.signature) = (Some(vec![0; 4 * per_parity]), None, None);
            }
        }
    }

    /// Accumulations of random length with gaps, one of them after the end; an end at least as many cycles after the
    /// last as rows leave; resets, and another case after a reset.
    fn stimulus(shape: &Lanes, cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(9);
        let (mut case, mut first, mut since) = (0u64, true, 0);
        // Cycles since a write, after which the next address is that of a product.
        let mut rested = 0;
        let inputs = |cycle: usize| {
            let rst = cycle < 3 || random.u16(..150) == 0;
            if rst {
                (case, first) = (random.u64(..2), true);
            }
            let write = rst && shape.written.words > 0;
            rested = if write { 0 } else { rested + 1 };
            let valid = !rst && since > 0 && rested > 3 && random.u8(..4) > 0;
            let last = since > shape.per_parity && random.u8(..4) == 0;
            let opens = first && random.bool();
            if opens && shape.in_turn {
                case = random.u64(..2);
            }
            let mut control = u64::from(last);
            for (bit, set) in [(shape.control.layer_at(), random.bool()), (shape.control.opens_at(), opens)] {
                control |= bit.map_or(0, |bit| u64::from(set) << bit);
            }
            since = if valid && last { 0 } else { since + 1 };
            if valid {
                first = last;
            }
            let operands: Vec<i64> = (0..4).map(|_| random.i64(-(1 << (M - 1))..1 << (M - 1))).collect();
            let coefficients: Vec<i64> =
                (0..COEFFICIENTS_PER_WORD).map(|_| random.i64(-(1 << (M - 1))..1 << (M - 1))).collect();
            let mut place = |count: usize| Word::from(random.u64(..count.max(1) as u64));
            vec![
                rst.into(),
                case.into(),
                place(shape.memory.len()),
                Word::of_fields(&operands, M),
                valid.into(),
                control.into(),
                write.into(),
                place(shape.written.words),
                place(shape.written.pairs),
                Word::of_fields(&coefficients, M),
            ]
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn rows_of_sums_leave_and_the_signature_is_the_model_s() {
        is_equal(shape());
    }

    /// With one word everywhere the signature depends on the number of words alone, so that some sections are undamaged. All have
    /// the same rows: sections change between two accumulations.
    #[test]
    fn a_section_tells_of_those_before_it() {
        let mut shape = Lanes { in_turn: true, groups: vec![1; 2], last_rows: vec![2; 2], ..shape() };
        shape.memory = vec![shape.memory[0].clone(); shape.memory.len()];
        let after = |words: usize| (0..words).fold(START, |signature, _| step(signature, parity(&shape.memory[0])));
        shape.signatures = Some(vec![after(6), after(7)]);
        is_equal(shape);
    }

    #[test]
    fn low_limbs_may_be_in_a_memory_of_their_own() {
        let mut shape = shape();
        shape.narrow = (7, 5);
        shape.memory[13..].iter_mut().flatten().for_each(|coefficient| *coefficient &= 31);
        is_equal(shape);
    }

    #[test]
    fn coefficients_are_written_in_a_reset() {
        let shape = shape();
        let written =
            CoefficientPlaces { words: shape.memory.len(), pairs: 4 * shape.per_parity / COEFFICIENTS_PER_WORD };
        is_equal(Lanes { signatures: None, written, ..shape });
    }

    #[test]
    fn rows_of_layers_leave_apart() {
        let shape = Lanes { control: Control { layers: true, opens: true }, ..shape() };
        is_equal(Lanes { groups: vec![1, 2], ..shape });
    }

    fn is_equal(shape: Lanes) {
        let kernel = kernel_of(&shape);
        let stimulus = stimulus(&shape, 6000);
        let mut reference = Integers {
            pipe: Default::default(),
            addresses: [0; 3],
            accumulators: None,
            chain: None,
            left: 0,
            leaves: None,
            of_layer: [false; 3],
            group: 0,
            signature: None,
            section: 0,
            earlier: None,
            shape,
        };
        check(&kernel, &stimulus, &mut reference);
    }

    #[test]
    fn a_line_of_the_memory_file_has_lane_0_lowest() {
        let kernel = kernel_of(&Lanes { memory: vec![[-1, 0, 1].repeat(4); 2], ..shape() });
        let [(_, text)] = &kernel.memory_files()[..] else { panic!("one file") };
        // All digits of 12 lanes of 18 bits; −1, 1, 0 and −1 in the lowest four.
        assert_eq!(text.lines().count(), 2);
        assert!(text.lines().all(|line| line.len() == 54 && line.ends_with("c000100003ffff")), "{text}");
    }
}
