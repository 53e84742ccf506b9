//! Takes images of tables from the input stream and passes frames on.

use dermis_golden::fixed::stages::load::{
    beats, Tables, COEFFICIENTS_PER_WORD, HEAD_WORDS, MAGIC, REST, VERSION_BITS, WORD_BYTES,
};
use dermis_golden::fixed::stages::prepare::GAIN_BITS;
use dermis_golden::fixed::words::formats::MULTIPLIER_BITS;
use dermis_golden::fixed::Plan;
use dermis_golden::spec::quads::Quads;
use dermis_golden::wire::link::{CRC_POLYNOMIAL, CRC_RESIDUE};

use super::arrays::{Arrays, Resets};
use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, MemoryPort, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::beats::Stream;

block! {
    /// ```text
    /// s_axis --> code? --> m_axis
    ///               '----> byte --> word of 6 bytes --> zero and gain of a taxel, two coefficients, threshold, noise floor, version
    ///                        '----> CRC-32 ----------> whole
    /// ```
    /// The first byte waits until `idle` has been high, and no code has passed, for [`REST`] cycles. A byte is taken in one cycle
    /// and used in the next, but for a reset.
    /// From the first written word to the last byte `restart` is high, or of several arrays the bit of `anew` of the one that is
    /// written, which is that of the image's first beat. What is in the tables, whether they are whole and their version stand in
    /// memories, which a reset leaves and the bitstream initialises.
    pub struct Load {
        code_bits: usize,
        floor_bits: usize,
        taxels: usize,
        coefficients: CoefficientPlaces,
        /// Number of the layout of an image.
        layout: u32,
        /// The tables of the bitstream, of each array.
        tables: Vec<Tables>,
        arrays: Arrays,
    }
    ports LoadPorts {
        clock;
        reset;
        /// No frame is in the engine.
        in idle;
        /// A code, sign-extended, or a byte of an image, `stream_bits` wide; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: (code_bits + 1, arrays.bits);
        /// A code, `code_bits` wide; valid with `m_axis_tvalid`.
        source<Stream> m_axis: code_bits;
        /// Reset of the engine: `rst`, or tables are written; with several arrays `rst`.
        out restart;
        /// Of several arrays the one whose tables are written, a bit each.
        out anew: arrays.anew_bits(true);
        /// Writes `entry` to taxel `taxel` of array `array`.
        out write;
        /// Array of the image; valid with `write`.
        out array: arrays.bits;
        /// Index of the taxel; valid with `write`.
        out taxel: count_bits(*taxels);
        /// Zero in the low bits, gain above; valid with `write`.
        out entry: code_bits + GAIN_BITS as usize;
        /// Writes `coefficient_data` to the lanes `coefficient_pair` of word `coefficient_word` of their memory. Constant 0 where they
        /// are not written.
        out coefficient_write;
        /// Word of the coefficient memory; valid with `coefficient_write`.
        out coefficient_word: coefficients.word_bits();
        /// Pair of lanes; valid with `coefficient_write`.
        out coefficient_pair: coefficients.pair_bits();
        /// The coefficients of two lanes, the lower first, 18 bits each; valid with `coefficient_write`.
        out coefficient_data: PAIR_BITS;
        /// Array whose noise floor is read.
        in floor_array: arrays.bits;
        /// Noise floor in codes, unsigned; valid unless `restart`.
        out noise_floor: floor_bits;
        /// Array whose forces and status are sent.
        in sent_array: arrays.bits;
        /// Threshold in force LSBs, 32 bits; valid unless `restart`, of several arrays a cycle after `sent_array`.
        out threshold: THRESHOLD_BITS;
        /// Version of the tables, 15 bits, and above it whether the last image was refused; valid unless `restart`.
        out version: VERSION_WORD_BITS;
        /// These tables are not whole.
        out incomplete;
        /// Array whose stress is calibrated.
        in calibrated_array: arrays.bits;
        /// The tables of that array are not whole.
        out calibrates_nothing;
    }
}

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
    /// For the tables of `plan`, if they are writable.
    pub fn of_plan(plan: &Plan) -> Option<Self> {
        let formats = plan.formats();
        let arrays = 0..plan.scene.hardware.arrays;
        let tables: Option<Vec<Tables>> = arrays.map(|array| plan.of_array(array).tables()).collect();
        Some(Load {
            code_bits: formats.code_bits as usize,
            floor_bits: plan.floor_bits() as usize,
            taxels: plan.scene.sensor.taxels(),
            coefficients: CoefficientPlaces::new(plan),
            layout: plan.table_layout(),
            tables: tables?,
            arrays: Arrays::of_model(plan),
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

    /// Width of the index of a word.
    pub fn word_bits(&self) -> usize {
        count_bits(self.words)
    }

    /// Width of the index of a pair.
    pub fn pair_bits(&self) -> usize {
        count_bits(self.pairs)
    }
}

/// The CRC register after one more byte.
fn crc_after<'k>(k: &'k Builder, crc: Expr<'k>, byte: Expr<'k>) -> Expr<'k> {
    let start = crc.slice(8, 24).concat(crc.low(8) ^ byte);
    (0..8).fold(start, |crc, _| {
        let feedback = crc.at(0).mux(k.constant(32, CRC_POLYNOMIAL.into()), k.constant(32, 0));
        crc.slice(1, 31).extend(32) ^ feedback
    })
}

impl Block for Load {
    fn build<'k>(&self, k: &'k Builder, io: LoadPorts<Inside<'k>>) {
        self.take_tables(k, io);
    }
}

impl Load {
    /// Frames pass, images are taken.
    fn take_tables<'k>(&self, k: &'k Builder, io: LoadPorts<Inside<'k>>) {
        let (bits, bit, word_bits) = (self.code_bits, Type::unsigned(1), 8 * WORD_BYTES);
        let (data, offered, tlast, ready) = (io.s_axis.data, io.s_axis.valid, io.s_axis.last, io.m_axis.ready);
        let zero = k.constant(1, 0);

        let image = k.state("image", bit, io.rst, 0);
        let skipping = k.state("skipping", bit, io.rst, 0);
        let writing =
            k.state("writing", bit, io.rst, 0).comment("Word 0 was right; a register, since it resets the engine.");
        let took = k.state("took", bit, io.rst, 0);
        let refused = self.arrays.state(k, "refused", bit, Resets { rst: io.rst, anew: None }, 0);
        let own = (self.arrays.bits > 0).then(|| k.register("own", Type::unsigned(self.arrays.bits)));
        let array = own.map_or(io.s_axis.array, |own| *own);
        let in_frame = k.state("in_frame", bit, io.rst, 0);
        let rests = k.state("rests", Type::unsigned(count_bits(REST as usize + 1)), io.rst, 0);
        let place = k.state("place", Type::unsigned(count_bits(WORD_BYTES)), io.rst, 0);
        let CoefficientPlaces { words: memory_words, pairs } = self.coefficients;
        let first_coefficient = HEAD_WORDS + self.taxels;
        let words = first_coefficient + memory_words * pairs + 1;
        let index = k.state("index", Type::unsigned(count_bits(words)), io.rst, 0);
        let (word, crc) = (k.register("word", Type::unsigned(word_bits)), k.register("crc", Type::unsigned(32)));
        let took_last = k.register("took_last", bit);

        k.comment("A byte: the top bit differs from the next.");
        let is_byte = k.wire("is_byte", data.at(bits) ^ data.at(bits - 1));
        let busy = k.wire("busy", *image | *skipping);
        let rested = k.wire("rested", rests.is(REST));
        let takes = k.wire("takes", offered & is_byte & !*took & (busy | *in_frame | rested) & !io.rst);
        let passes = k.wire("passes", offered & !is_byte & !busy & !*took & !*writing & !io.rst);
        io.m_axis.valid.set(passes);
        io.m_axis.data.set(data.low(bits));
        io.m_axis.last.set(tlast);
        io.s_axis.ready.set(takes | (passes & ready));
        k.when(rested.is(0), || rests.set(rests.plus(1)));
        k.when(!io.idle | (passes & ready), || rests.set(k.constant(rests.bits(), 0)));
        k.when(passes & ready, || in_frame.set(!tlast));

        let byte = data.low(8);
        let begins = k.wire("begins", takes & !busy);
        took.set(takes);
        k.when(takes, || {
            word.set(byte.concat(word.slice(8, word_bits - 8)));
            crc.set(crc_after(k, begins.mux(k.constant(32, u32::MAX.into()), *crc), byte));
            took_last.set(tlast);
        });
        k.comment("An image between the codes of a frame is refused.");
        k.when(begins, || {
            image.set(!*in_frame);
            skipping.set(*in_frame);
            k.when(*in_frame, || refused.set(k, io.s_axis.array, k.constant(1, 1)));
            if let Some(own) = own {
                own.set(io.s_axis.array);
            }
        });

        k.comment("The byte taken in the cycle before, and the word that it ends.");
        // Not in a reset: before the first one the registers hold anything, and nothing of it may be written.
        let uses = k.wire("uses", *took & *image & !io.rst);
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
            refused.set(k, array, fails);
            skipping.set(fails & *took & !*took_last);
        });

        self.write(k, &io, ends_word, (*index, words), (*image, *word));
        self.begin_anew(&io, *writing, array);
        self.store_states(k, &io, array, *word, at, [right_head, done, refused.of(io.sent_array)]);
    }

    /// Writes the tables: entries of taxels and coefficients, from words of an image in their order, of which there are `words`.
    fn write<'k>(
        &self,
        k: &'k Builder,
        io: &LoadPorts<Inside<'k>>,
        ends_word: Expr<'k>,
        (index, words): (Expr<'k>, usize),
        (image, word): (Expr<'k>, Expr<'k>),
    ) {
        let (bits, first_coefficient) = (self.code_bits, HEAD_WORDS + self.taxels);
        let [first, after] = [HEAD_WORDS, first_coefficient].map(|number| k.constant(index.bits(), number as u64));
        io.write.set(ends_word & !index.less(first) & index.less(after));
        io.taxel.set((index - first).low(count_bits(self.taxels)));
        io.entry.set(word.low(bits + GAIN_BITS as usize));
        self.write_coefficients(k, io, ends_word & !index.less(after) & !index.is(words as u64 - 1), image, word);
    }

    /// The array whose tables are written begins anew, or the engine where it is the only one.
    fn begin_anew<'k>(&self, io: &LoadPorts<Inside<'k>>, writing: Expr<'k>, array: Expr<'k>) {
        match self.arrays.bits {
            0 => {
                io.restart.set(io.rst | writing);
            }
            bits => {
                io.restart.set(io.rst);
                let of = |number: u64| writing & array.is(number);
                io.anew.set(concat(&(0..1 << bits).rev().map(of).collect::<Vec<_>>()));
                io.array.set(array);
            }
        }
    }

    /// Threshold, noise floor, version and state of the tables: from word n of an image of `array`, which is `word` when `at(n)`.
    /// Then whether its first word is right, whether it ends whole, whether the last one of `sent_array` was refused.
    fn store_states<'k>(
        &self,
        k: &'k Builder,
        io: &LoadPorts<Inside<'k>>,
        array: Expr<'k>,
        word: Expr<'k>,
        at: impl Fn(usize) -> Expr<'k>,
        [right_head, done, refused]: [Expr<'k>; 3],
    ) {
        k.comment("Memories of a word for each array: a reset leaves them as they are.");
        let array_memory = |name: &str, bits: usize, value: &dyn Fn(&Tables) -> u64| -> MemoryPort {
            let words = self.tables.iter().map(value).enumerate().collect();
            k.memory(name, self.arrays.count(), bits, Contents::Words(words))
        };
        let place = |array: Expr<'k>| if self.arrays.bits == 0 { k.constant(1, 0) } else { array };
        let thresholds = array_memory("thresholds", THRESHOLD_BITS, &|tables| tables.threshold.into());
        let floors = array_memory("noise_floors", self.floor_bits, &|tables| tables.noise_floor as u64);
        let whole_version = |tables: &Tables| 1 << VERSION_BITS | u64::from(tables.version);
        let states = array_memory("states", 1 + VERSION_BITS as usize, &whole_version);
        let state = k.wire("state", states.read(place(io.sent_array)));
        let whole = state.top();

        let new_version = k.register("new_version", Type::unsigned(VERSION_BITS as usize));
        let second = k.wire("second", at(1));
        k.when(second, || new_version.set(word.slice(THRESHOLD_BITS, VERSION_BITS as usize)));
        thresholds.write(second, place(array), word.low(THRESHOLD_BITS));
        floors.write(at(2), place(array), word.low(self.floor_bits));
        let new_state = done.mux(k.constant(1, 1).concat(*new_version), k.constant(1 + VERSION_BITS as usize, 0));
        states.write(done | right_head, place(array), new_state);

        io.noise_floor.set(floors.read(place(io.floor_array)));
        let threshold = thresholds.read(place(io.sent_array));
        // Of several arrays it is a read behind a choice, which the comparison of forces need not wait for.
        io.threshold.set(if self.arrays.bits == 0 { threshold } else { k.delay("threshold_held", threshold) });
        io.version.set((refused | !whole).concat(state.low(VERSION_BITS as usize)));
        io.incomplete.set(!whole);
        io.calibrates_nothing.set(match self.arrays.bits {
            0 => !whole,
            _ => !states.read(io.calibrated_array).top(),
        });
    }

    /// The coefficients are in the bitstream: nothing is written.
    fn no_coefficients<'k>(k: &'k Builder, io: &LoadPorts<Inside<'k>>) {
        for output in [io.coefficient_write, io.coefficient_word, io.coefficient_pair, io.coefficient_data] {
            output.set(k.constant(output.bits(), 0));
        }
    }

    /// The write port of the coefficient memory: with `is_pair` the register `word` holds two coefficients, which are written in
    /// the next cycle, before another byte is taken.
    fn write_coefficients<'k>(
        &self,
        k: &'k Builder,
        io: &LoadPorts<Inside<'k>>,
        is_pair: Expr<'k>,
        image: Expr<'k>,
        word: Expr<'k>,
    ) {
        let CoefficientPlaces { words, pairs } = self.coefficients;
        if words == 0 {
            return Load::no_coefficients(k, io);
        }
        let is_written = k.state("is_written", Type::unsigned(1), io.rst, 0);
        let address = k.state("address", Type::unsigned(io.coefficient_word.bits()), io.rst, 0);
        let pair = k.state("pair", Type::unsigned(io.coefficient_pair.bits()), io.rst, 0);
        is_written.set(is_pair);
        let is_last = k.wire("is_last_pair", pair.is(pairs as u64 - 1));
        k.when(*is_written, || {
            pair.set(is_last.mux(k.constant(pair.bits(), 0), pair.plus(1)));
            k.when(is_last, || address.set(address.plus(1)));
        });
        // Not with the end of the image: a short one may end with two coefficients, which are written in the next cycle.
        k.when(!image, || {
            address.set(k.constant(address.bits(), 0));
            pair.set(k.constant(pair.bits(), 0));
        });
        io.coefficient_write.set(*is_written & !io.rst);
        io.coefficient_word.set(*address);
        io.coefficient_pair.set(*pair);
        io.coefficient_data.set(word.low(PAIR_BITS));
    }
}

#[cfg(test)]
mod tests;
