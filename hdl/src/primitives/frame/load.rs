//! Takes images of tables from the input stream and passes frames on.

use dermis_golden::fixed::stages::load::{
    beats, Tables, COEFFICIENTS_PER_WORD, HEAD_WORDS, MAGIC, VERSION_BITS, WORD_BYTES,
};
use dermis_golden::fixed::stages::prepare::GAIN_BITS;
use dermis_golden::fixed::words::formats::MULTIPLIER_BITS;
use dermis_golden::fixed::Plan;
use dermis_golden::spec::quads::Quads;
use dermis_golden::wire::link::{CRC_POLYNOMIAL, CRC_RESIDUE};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Expr, Kernel, MemoryPort, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::pass_through::wires;
use crate::wire::Wire;

/// ```text
/// s_axis --> code? --> m_axis
///               '----> byte --> word of 6 bytes --> zero and gain of a taxel, two coefficients, threshold, noise floor, version
///                        '----> CRC-32 ----------> whole
/// ```
/// Without writable tables the stream passes through, and all but `restart`, which is `rst`, is constant 0.
///
/// The first byte waits until `idle` has been high, and no code has passed, for [`REST`] cycles. A byte is taken in one cycle
/// and used in the next, but for a reset.
/// From the first written word to the last byte `restart` is high. What is in the tables, whether they are whole and their
/// version stand in memories, which a reset leaves and the bitstream initialises.
#[derive(dermis_hdl_derive::Block)]
pub struct Load {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// No frame is in the engine.
    pub idle: Signal<In, Bit>,
    /// A code, sign-extended, or a byte of an image, `stream_bits` wide; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame or image; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A code, `code_bits` wide; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Reset of the engine: `rst`, or tables are written.
    pub restart: Signal<Out, Bit>,
    /// Writes `entry` to taxel `taxel`.
    pub write: Signal<Out, Bit>,
    /// Index of the taxel; valid with `write`.
    pub taxel: Wire<Out>,
    /// Zero in the low bits, gain above; valid with `write`.
    pub entry: Wire<Out>,
    /// Writes `coefficient_data` to the lanes `coefficient_pair` of word `coefficient_word` of their memory. Constant 0 where they
    /// are not written.
    pub coefficient_write: Signal<Out, Bit>,
    /// Word of the coefficient memory; valid with `coefficient_write`.
    pub coefficient_word: Wire<Out>,
    /// Pair of lanes; valid with `coefficient_write`.
    pub coefficient_pair: Wire<Out>,
    /// The coefficients of two lanes, the lower first, 18 bits each; valid with `coefficient_write`.
    pub coefficient_data: Wire<Out>,
    /// Noise floor in codes, `input_bits` wide, ≥ 0, one bit where it is not written; valid unless `restart`.
    pub noise_floor: Wire<Out>,
    /// Threshold in force LSBs, 32 bits; valid unless `restart`.
    pub threshold: Wire<Out>,
    /// Version of the tables, 15 bits, and above it whether the last image was refused; valid unless `restart`.
    pub version: Wire<Out>,
    /// The tables are not whole.
    pub incomplete: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Load,
    clock clk,
    inputs [rst, idle, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
    outputs [
        s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast, restart, write, taxel, entry, coefficient_write,
        coefficient_word, coefficient_pair, coefficient_data, noise_floor, threshold, version, incomplete,
    ]
);

/// Cycles after the last code, and without a frame in the engine, after which none is in its first or last registers either.
pub const REST: u64 = 31;
/// Width of the threshold.
pub const THRESHOLD_BITS: usize = 32;
/// Width of the version with the bit above it.
pub const VERSION_WORD_BITS: usize = VERSION_BITS as usize + 1;

/// The beat of the byte `octet` of an image on a stream of codes of `code_bits`.
pub(crate) fn table_beat<'k>(k: &'k Builder, octet: Expr<'k>, code_bits: usize) -> Expr<'k> {
    let bits = code_bits + 1;
    octet.extend(bits) | k.constant(bits, beats(&[0], code_bits as u32)[0] as u64)
}

impl Load {
    /// For the tables of `plan`.
    pub fn new(plan: &Plan) -> Self {
        let formats = plan.formats();
        let (code_bits, taxels) = (formats.code_bits as usize, plan.scene.sensor.taxels());
        let coefficients = CoefficientPlaces::new(plan);
        let [address_bits, pair_bits] = coefficients.bits();
        let shape = Shape {
            code_bits,
            input_bits: formats.input_bits as usize,
            taxels,
            coefficients,
            layout: plan.table_layout(),
        };
        let block = Load {
            clk: Default::default(),
            rst: Default::default(),
            idle: Default::default(),
            s_axis_tdata: Wire::new(plan.stream_bits() as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(code_bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            restart: Default::default(),
            write: Default::default(),
            taxel: Wire::new(count_bits(taxels)),
            entry: Wire::new(code_bits + GAIN_BITS as usize),
            coefficient_write: Default::default(),
            coefficient_word: Wire::new(address_bits),
            coefficient_pair: Wire::new(pair_bits),
            coefficient_data: Wire::new(PAIR_BITS),
            noise_floor: Wire::new(plan.floor_bits() as usize),
            threshold: Wire::new(THRESHOLD_BITS),
            version: Wire::new(VERSION_WORD_BITS),
            incomplete: Default::default(),
            kernel: Body::default(),
        };
        block.bind(match plan.tables() {
            None => shape.wires(),
            Some(tables) => shape.kernel(&tables),
        })
    }
}

/// Width of two coefficients.
pub const PAIR_BITS: usize = COEFFICIENTS_PER_WORD * MULTIPLIER_BITS as usize;

/// Places of the coefficients that are written.
#[derive(Clone, Copy, Debug, Default)]
pub struct CoefficientPlaces {
    /// Words of the coefficient memory; 0 where it is not written.
    pub words: usize,
    /// Pairs of lanes in a word.
    pub pairs: usize,
}

impl CoefficientPlaces {
    /// Those of `plan`.
    pub fn new(plan: &Plan) -> Self {
        match plan.scene.hardware.has_writable_coefficients() {
            false => CoefficientPlaces::default(),
            true => CoefficientPlaces {
                words: plan.cases().iter().map(|case| case.storage.words()).sum(),
                pairs: Quads::LANES * plan.formats().lanes_per_parity / COEFFICIENTS_PER_WORD,
            },
        }
    }

    /// Widths of the index of a word and of a pair.
    pub fn bits(&self) -> [usize; 2] {
        [self.words, self.pairs].map(count_bits)
    }
}

/// Widths and sizes.
struct Shape {
    code_bits: usize,
    input_bits: usize,
    taxels: usize,
    coefficients: CoefficientPlaces,
    layout: u32,
}

/// The CRC register after one more byte.
fn crc_after<'k>(k: &'k Builder, crc: Expr<'k>, byte: Expr<'k>) -> Expr<'k> {
    let start = crc.slice(8, 24).concat(crc.low(8) ^ byte);
    (0..8).fold(start, |crc, _| {
        let feedback = crc.at(0).mux(k.constant(32, CRC_POLYNOMIAL.into()), k.constant(32, 0));
        crc.slice(1, 31).extend(32) ^ feedback
    })
}

impl Shape {
    fn wires(&self) -> Kernel {
        let k = wires("load", self.code_bits, "The tables are in the bitstream: the stream passes through.");
        k.input("idle", 1);
        k.wire("restart", k.named("rst"));
        self.no_coefficients(&k);
        let constants = [
            ("write", 1),
            ("taxel", count_bits(self.taxels)),
            ("entry", self.code_bits + GAIN_BITS as usize),
            ("noise_floor", 1),
            ("threshold", THRESHOLD_BITS),
            ("version", VERSION_WORD_BITS),
            ("incomplete", 1),
        ];
        for (name, bits) in constants {
            k.wire(name, k.constant(bits, 0));
        }
        k.finish()
    }

    fn kernel(&self, tables: &Tables) -> Kernel {
        let (bits, bit, word_bits) = (self.code_bits, Type::unsigned(1), 8 * WORD_BYTES);
        let k = Builder::new("load");
        let (rst, idle, data) = (k.input("rst", 1), k.input("idle", 1), k.input("s_axis_tdata", bits + 1));
        let [offered, tlast, ready] = ["s_axis_tvalid", "s_axis_tlast", "m_axis_tready"].map(|name| k.input(name, 1));
        let zero = k.constant(1, 0);
        let kept = |name: &str, bits: usize, value: u64| -> MemoryPort {
            k.memory(name, 1, bits, Contents::Words(vec![(0, value)]))
        };
        k.comment("Memories of one word: a reset leaves them as they are.");
        let thresholds = kept("thresholds", THRESHOLD_BITS, tables.threshold.into());
        let floors = kept("noise_floors", self.input_bits, tables.noise_floor as u64);
        let states = kept("states", 1 + VERSION_BITS as usize, 1 << VERSION_BITS | u64::from(tables.version));
        let state = k.wire("state", states.read(zero));
        let whole = state.top();

        let image = k.state("image", bit, rst, 0);
        let skipping = k.state("skipping", bit, rst, 0);
        let writing =
            k.state("writing", bit, rst, 0).comment("Word 0 was right; a register, since it resets the engine.");
        let took = k.state("took", bit, rst, 0);
        let refused = k.state("refused", bit, rst, 0);
        let in_frame = k.state("in_frame", bit, rst, 0);
        let rests = k.state("rests", Type::unsigned(count_bits(REST as usize + 1)), rst, 0);
        let place = k.state("place", Type::unsigned(count_bits(WORD_BYTES)), rst, 0);
        let CoefficientPlaces { words: memory_words, pairs } = self.coefficients;
        let first_coefficient = HEAD_WORDS + self.taxels;
        let words = first_coefficient + memory_words * pairs + 1;
        let index = k.state("index", Type::unsigned(count_bits(words)), rst, 0);
        let (word, crc) = (k.register("word", Type::unsigned(word_bits)), k.register("crc", Type::unsigned(32)));
        let took_last = k.register("took_last", bit);

        k.comment("A byte: the top bit differs from the next.");
        let is_byte = k.wire("is_byte", data.at(bits) ^ data.at(bits - 1));
        let busy = k.wire("busy", *image | *skipping);
        let rested = k.wire("rested", rests.is(REST));
        let takes = k.wire("takes", offered & is_byte & !*took & (busy | *in_frame | rested) & !rst);
        let passes = k.wire("passes", offered & !is_byte & !busy & !*took & !*writing & !rst);
        k.wire("m_axis_tvalid", passes);
        k.wire("m_axis_tdata", data.low(bits));
        k.wire("m_axis_tlast", tlast);
        k.wire("s_axis_tready", takes | (passes & ready));
        k.when(rested.is(0), || rests.set(rests.plus(1)));
        k.when(!idle | (passes & ready), || rests.set(k.constant(rests.bits(), 0)));
        k.when(passes & ready, || in_frame.set(!tlast));

        let byte = data.low(8);
        let begins = k.wire("begins", takes & !busy);
        took.set(takes);
        k.when(takes, || {
            word.set(byte.concat(word.slice(8, word_bits - 8)));
            crc.set(crc_after(&k, begins.mux(k.constant(32, u32::MAX.into()), *crc), byte));
            took_last.set(tlast);
        });
        k.comment("An image between the codes of a frame is refused.");
        k.when(begins, || {
            image.set(!*in_frame);
            skipping.set(*in_frame);
            k.when(*in_frame, || refused.set(k.constant(1, 1)));
        });

        k.comment("The byte taken in the cycle before, and the word that it ends.");
        // Not in a reset: before the first one the registers hold anything, and nothing of it may be written.
        let uses = k.wire("uses", *took & *image & !rst);
        let ends_word = k.wire("ends_word", uses & place.is(WORD_BYTES as u64 - 1));
        let at = |number: usize| ends_word & index.is(number as u64);
        let head = k.constant(word_bits, u64::from(MAGIC) << 32 | u64::from(self.layout));
        let ends = k.wire("ends", at(words - 1));
        let right_head = k.wire("right_head", at(0) & word.equals(head));
        let wrong_head = k.wire("wrong_head", at(0) & word.differs(head));
        let wrong_length = k.wire("wrong_length", uses & took_last.differs(ends));
        let wrong_crc = k.wire("wrong_crc", ends & crc.differs(k.constant(32, CRC_RESIDUE.into())));
        k.comment("A code in an image: its rest will not come.");
        let broken_off = k.wire("broken_off", offered & !is_byte & busy & !*took);
        let fails = k.wire("fails", wrong_head | wrong_length | wrong_crc | (broken_off & *image));
        let done = k.wire("done", ends & !fails);
        let over = k.wire("over", fails | ends);
        k.when(uses, || {
            let next = ends_word.mux(k.constant(place.bits(), 0), place.plus(1));
            place.set(next);
            k.when(ends_word, || index.set(index.plus(1)));
        });
        k.comment("An image that ends with its first word resets the engine for a cycle.");
        k.when(right_head, || writing.set(k.constant(1, 1)));
        k.when(!*image, || writing.set(zero));
        k.when(*took & *skipping & *took_last | broken_off, || skipping.set(zero));
        k.when(over, || {
            image.set(zero);
            writing.set(right_head);
            place.set(k.constant(place.bits(), 0));
            index.set(k.constant(index.bits(), 0));
            refused.set(fails);
            skipping.set(fails & *took & !*took_last);
        });

        let new_version = k.register("new_version", Type::unsigned(VERSION_BITS as usize));
        let second = k.wire("second", at(1));
        k.when(second, || new_version.set(word.slice(THRESHOLD_BITS, VERSION_BITS as usize)));
        thresholds.write(second, zero, word.low(THRESHOLD_BITS));
        floors.write(at(2), zero, word.low(self.input_bits));
        let new_state = done.mux(k.constant(1, 1).concat(*new_version), k.constant(1 + VERSION_BITS as usize, 0));
        states.write(done | right_head, zero, new_state);

        let [first, after] = [HEAD_WORDS, first_coefficient].map(|number| k.constant(index.bits(), number as u64));
        k.wire("write", ends_word & !index.less(first) & index.less(after));
        k.wire("taxel", (*index - first).low(count_bits(self.taxels)));
        k.wire("entry", word.low(bits + GAIN_BITS as usize));
        self.write_coefficients(&k, rst, ends_word & !index.less(after) & !index.is(words as u64 - 1), *image, *word);
        k.wire("restart", rst | *writing);
        k.wire("noise_floor", floors.read(zero));
        k.wire("threshold", thresholds.read(zero));
        k.wire("version", (*refused | !whole).concat(state.low(VERSION_BITS as usize)));
        k.wire("incomplete", !whole);
        k.finish()
    }

    /// The coefficients are in the bitstream: nothing is written.
    fn no_coefficients(&self, k: &Builder) {
        let [word_bits, pair_bits] = self.coefficients.bits();
        let outputs = [
            ("coefficient_write", 1),
            ("coefficient_word", word_bits),
            ("coefficient_pair", pair_bits),
            ("coefficient_data", PAIR_BITS),
        ];
        for (name, bits) in outputs {
            k.wire(name, k.constant(bits, 0));
        }
    }

    /// The write port of the coefficient memory: with `is_pair` the register `word` holds two coefficients, which are written in
    /// the next cycle, before another byte is taken.
    fn write_coefficients<'k>(
        &self,
        k: &'k Builder,
        rst: Expr<'k>,
        is_pair: Expr<'k>,
        image: Expr<'k>,
        word: Expr<'k>,
    ) {
        let [address_bits, pair_bits] = self.coefficients.bits();
        let CoefficientPlaces { words, pairs } = self.coefficients;
        if words == 0 {
            return self.no_coefficients(k);
        }
        let is_written = k.state("is_written", Type::unsigned(1), rst, 0);
        let address = k.state("address", Type::unsigned(address_bits), rst, 0);
        let pair = k.state("pair", Type::unsigned(pair_bits), rst, 0);
        is_written.set(is_pair);
        let is_last = k.wire("is_last_pair", pair.is(pairs as u64 - 1));
        k.when(*is_written, || {
            pair.set(is_last.mux(k.constant(pair_bits, 0), pair.plus(1)));
            k.when(is_last, || address.set(address.plus(1)));
        });
        // Not with the end of the image: a short one may end with two coefficients, which are written in the next cycle.
        k.when(!image, || {
            address.set(k.constant(address_bits, 0));
            pair.set(k.constant(pair_bits, 0));
        });
        k.wire("coefficient_write", *is_written & !rst);
        k.wire("coefficient_word", *address);
        k.wire("coefficient_pair", *pair);
        k.wire("coefficient_data", word.low(PAIR_BITS));
    }
}

#[cfg(test)]
mod tests;
