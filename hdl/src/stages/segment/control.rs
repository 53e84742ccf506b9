//! What the parts of the circuit share: sizes, registers, memories, the multiplier; and the sequence of the steps.

use std::cell::RefCell;

use dermis_golden::estimate::segment::{BASINS, SADDLE, WEIGHT_BITS, WORD_BITS};
use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::segment::cycles::TAP_BITS;

use super::params::SegmentParams;
use super::SegmentPorts;
use crate::language::{concat, Builder, Contents, Expr, Inside, MemoryPort, Net, Type};
use crate::primitives::count_bits;

/// Width of the number of a basin.
pub(super) const BASIN: usize = 5;
/// Entries of the tables of basins.
pub(super) const TABLE: usize = BASINS + 1;
/// Width of a word of the segmentation.
pub(super) const WORD: usize = WORD_BITS as usize;
/// Fraction bits of a weight.
pub(super) const FRACTION: usize = WEIGHT_BITS as usize;
/// Width of a factor of the multiplier: a weight, a slope, an odd number for a line.
const FACTOR: usize = TAP_BITS;
/// Factor by which a maximum becomes its bar, as a weight.
const BAR: u64 = (SADDLE[0] << WEIGHT_BITS) as u64 / SADDLE[1] as u64;
/// What rounds a bar up.
const BAR_ROUNDING: u64 = (1 << WEIGHT_BITS) - (1 << WEIGHT_BITS) / SADDLE[1] as u64;
/// What rounds a smoothed word half up.
const HALF: u64 = 1 << (WEIGHT_BITS - 1);

pub(super) const IDLE: usize = 0;
pub(super) const UNPACK: usize = 1;
pub(super) const ALONG_ROWS: usize = 2;
pub(super) const ALONG_COLUMNS: usize = 3;
pub(super) const CLIMB: usize = 4;
pub(super) const CLEAR: usize = 5;
pub(super) const WALK: usize = 6;
pub(super) const BORDERS: usize = 7;
pub(super) const LEAST: usize = 8;
pub(super) const PAIRS: usize = 9;
pub(super) const JOIN: usize = 10;
pub(super) const TAKE: usize = 11;
pub(super) const SETTLE: usize = 12;
pub(super) const LABEL: usize = 13;
pub(super) const MIDDLE: usize = 14;
/// Names of the states, a register each.
const STATES: [&str; 15] = [
    "idle",
    "unpack",
    "along_rows",
    "along_columns",
    "climb",
    "clear",
    "walk",
    "borders",
    "least",
    "pairs",
    "join",
    "take",
    "settle",
    "label",
    "middle",
];

/// Registers and memories that more than one part reads or sets.
pub(super) struct Circuit<'k> {
    pub(super) k: &'k Builder,
    pub(super) params: &'k SegmentParams,
    pub(super) io: SegmentPorts<Inside<'k>>,
    state: [Net<'k>; STATES.len()],
    /// When a state ends.
    leaves: RefCell<Vec<Expr<'k>>>,
    pub(super) tick: Net<'k>,

    /// Taxel, or upper left taxel of a quad; its row and column, or those of the quad; upper right taxel of the quad.
    pub(super) address: Net<'k>,
    pub(super) row: Net<'k>,
    pub(super) col: Net<'k>,
    pub(super) mirror: Net<'k>,
    pub(super) quad: Net<'k>,
    pub(super) lane: Net<'k>,
    /// The word of the lane is taken; the word then; whether it is that of a taxel of its own.
    pub(super) picks: Expr<'k>,
    pub(super) word: Expr<'k>,
    pub(super) counts: Net<'k>,
    /// Taxel that is read, and one that is written.
    pub(super) point: Net<'k>,
    pub(super) target: Net<'k>,
    pub(super) line: Net<'k>,
    /// The first taxel has been read; the last one has.
    pub(super) begun: Net<'k>,
    pub(super) ending: Net<'k>,
    /// The taxels that are read move on in this cycle.
    pub(super) moves: Net<'k>,

    pub(super) memories: Memories<'k>,
    pub(super) multiplier: Multiplier<'k>,

    pub(super) count: Net<'k>,
    pub(super) kept: Net<'k>,
    pub(super) overflow: Net<'k>,
    pub(super) done: Net<'k>,
    /// Contact of a taxel, and whether its word is added to the sums.
    pub(super) label: Net<'k>,
    pub(super) adds: Net<'k>,
    pub(super) own: Net<'k>,
    /// Basins of the saddle that is read or written, in any order; counters of other steps.
    pub(super) lower: Net<'k>,
    pub(super) higher: Net<'k>,
    pub(super) cursor: Net<'k>,
    /// For each basin `{0, the next one}`, of those that are gone `{0, the one they are part of}`; at last `{1, contact}`.
    pub(super) chain: MemoryPort<'k>,
    pub(super) chain_out: Expr<'k>,
    /// Loads of the basins, 0 the whole; then sums of the contacts.
    pub(super) loads: MemoryPort<'k>,
    /// For each basin the smallest saddle that is high, where its maximum is the lower one.
    pub(super) bars: MemoryPort<'k>,
}

/// The memories of the words of the taxels, and that of the taps.
pub(super) struct Memories<'k> {
    /// Unsmoothed words; then words smoothed along both axes.
    pub(super) words: MemoryPort<'k>,
    /// Words smoothed along the rows; then for each taxel `{1, basin}` or `{0, direction of its step}`.
    pub(super) steps: MemoryPort<'k>,
    pub(super) words_out: Expr<'k>,
    pub(super) steps_out: Expr<'k>,
    /// The tap that is read, and its flags two cycles later.
    pub(super) tap: Net<'k>,
    pub(super) tap_flags: Expr<'k>,
    /// Weight of the tap, with its flags.
    weight: Expr<'k>,
}

/// The multiplier and the sum of its products.
pub(super) struct Multiplier<'k> {
    /// What is subtracted from a word before the multiplication; the difference, the product, rounded sum of products.
    pub(super) base: Net<'k>,
    pub(super) difference: Expr<'k>,
    pub(super) operand: Net<'k>,
    pub(super) product: Expr<'k>,
    pub(super) result: Expr<'k>,
    /// `result` is a smoothed word, the last of a line.
    pub(super) smoothed: Expr<'k>,
    pub(super) line_ends: Expr<'k>,
}

impl<'k> SegmentPorts<Inside<'k>> {
    /// The circuit between the ports.
    pub(super) fn circuit(self, k: &'k Builder, params: &'k SegmentParams) {
        let circuit = Circuit::new(k, params, self);
        let order = circuit.order();
        let list = circuit.tables(&order);
        circuit.labels(&order);
        circuit.begin_pairs(&list);
    }
}

/// A memory of which no word is read in the cycle that writes it.
fn memory<'k>(k: &'k Builder, name: &str, words: usize, bits: usize, holds: Holds) -> MemoryPort<'k> {
    k.memory(name, words, bits, Contents::Undefined).unchecked().holds(holds)
}

/// What is read, two cycles later.
fn later<'k>(k: &'k Builder, name: &str, value: Expr<'k>) -> Expr<'k> {
    k.delay(&format!("{name}_out"), k.delay(&format!("{name}_read"), value))
}

/// The quads that come in: address of the one that is read; whether the word of a `lane` is taken, and that word.
fn unpack<'k>(
    k: &'k Builder,
    params: &SegmentParams,
    io: &SegmentPorts<Inside<'k>>,
    lane: Expr<'k>,
    picks: Expr<'k>,
) -> (Net<'k>, Expr<'k>, Expr<'k>) {
    k.comment("Quads of words, each with its sign; the word of a lane");
    let narrow = |lane: usize| {
        let value = io.fill_quad.slice(lane * params.lane, params.lane).signed();
        let value = value.resize(value.bits().max(params.low + WORD + 1)).unsigned();
        value.top().concat(value.slice(params.low, WORD))
    };
    let quads = memory(k, "quads", params.quad_count(), 4 * (WORD + 1), Holds::SegmentQuads);
    quads.write(io.fill, io.fill_address, concat(&[3, 2, 1, 0].map(narrow)));
    let quad = k.register("quad", Type::unsigned(count_bits(params.quad_count())));
    let quads_out = later(k, "quads", quads.read(*quad));
    let lanes: Vec<(u64, Expr)> =
        (0..4).map(|lane| (lane as u64, quads_out.slice(lane * (WORD + 1), WORD + 1))).collect();
    let signed = lane.case(&lanes[..3], lanes[3].1);
    let picks = k.wire("picks", picks);
    let word = k.register("word", Type::unsigned(WORD));
    k.when(picks, || word.set(signed.low(WORD) & (!signed.top()).repeat(WORD)));
    (quad, picks, *word)
}

impl<'k> Memories<'k> {
    /// Words and steps are read at `point`, where the reading `moves` on.
    fn new(k: &'k Builder, params: &SegmentParams, moves: Expr<'k>, point: Expr<'k>) -> Self {
        let entry = params.smoothed.max(BASIN + 1);
        let words = memory(k, "words", params.taxels(), params.smoothed, Holds::Smoothed);
        let steps = memory(k, "steps", params.taxels(), entry, Holds::Steps);
        let read = |name: &str, memory: &MemoryPort<'k>, bits: usize| {
            let register = |stage: &str| k.register(&format!("{name}_{stage}"), Type::unsigned(bits));
            let [read, out] = ["read", "out"].map(register);
            k.when(moves, || {
                read.set(memory.read(point));
                out.set(*read);
            });
            *out
        };
        let words_out = read("words", &words, params.smoothed);
        let steps_out = read("steps", &steps, entry);
        let (weights, mut flags): (Vec<u64>, Vec<u64>) = params.taps.concat().into_iter().unzip();
        let tap = k.register("tap", Type::unsigned(count_bits(weights.len())));
        let contents = Contents::Words(weights.iter().copied().enumerate().collect());
        let windows = k.memory("windows", weights.len(), TAP_BITS, contents).style("block");
        let weight = later(k, "tap", windows.holds(Holds::SmoothingWeights).read(*tap));
        // In logic: a block RAM may be far from what the flags decide in the same cycle.
        flags.resize(1 << tap.bits(), 0);
        let tap_flags = later(k, "tap_flags", tap.table(3, &flags));
        Memories { words, steps, words_out, steps_out, tap, tap_flags, weight }
    }
}

impl<'k> Multiplier<'k> {
    /// Of a `word` or what is in the `memories`, in the state that `is` tells, at the tick, row, column and lane of `place`.
    fn new(
        k: &'k Builder,
        params: &SegmentParams,
        is: &dyn Fn(usize) -> Expr<'k>,
        memories: &Memories<'k>,
        word: Expr<'k>,
        [tick, row, col, lane]: [Expr<'k>; 4],
    ) -> Self {
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let Memories { words_out, steps_out, tap_flags, weight, .. } = *memories;
        let smooths = k.wire("smooths", is(ALONG_ROWS) | is(ALONG_COLUMNS));
        let base = register("base", params.smoothed);
        let read = word.extend(params.smoothed);
        let data = is(ALONG_COLUMNS).mux(steps_out.low(params.smoothed), is(LABEL).mux(read, words_out));
        let difference = k.wire("difference", (data - *base).unsigned());
        let operand = register("operand", params.smoothed + 1);
        k.when(!is(BORDERS) | tick.is(3), || operand.set(difference));
        let weight = k.delay("weight2", k.delay("weight1", weight));
        let factor = k.delay("factor", factor(k, params, is, [tick, weight, row, col, lane]));
        let product = register("product", params.smoothed + 1 + FACTOR);
        product.set((operand.signed() * factor.extend(FACTOR + 1).signed()).low(product.bits()));
        // A tap's flags, when its product is there.
        let flags = k.delay("flags1", tap_flags);
        let flags = (2..=4).fold(flags, |flags, stage| k.delay(&format!("flags{stage}"), flags));
        let sum = params.smoothed + FRACTION;
        let partial = register("partial", sum);
        let total = k.wire("total", (*partial + product.low(sum)).low(sum));
        let adds = k.wire("sums", smooths & (tick.at(3) | tick.slice(1, 2).all()));
        let rounding = smooths.mux(k.constant(sum, HALF), k.constant(sum, BAR_ROUNDING));
        partial.set((adds & !flags.at(0)).mux(total, rounding));
        let result = k.delay("result", total.slice(FRACTION, params.smoothed));
        let ready = k.delay("ready", adds & flags.at(0));
        // Not the word that follows the last one of an axis into the next step.
        let smoothed = k.wire("smoothed", ready & tick.any());
        let line_ends = k.delay("line_ends", flags.at(2));
        Multiplier { base, difference, operand, product: product.get(), result, smoothed, line_ends }
    }
}

impl<'k> Circuit<'k> {
    fn new(k: &'k Builder, params: &'k SegmentParams, io: SegmentPorts<Inside<'k>>) -> Self {
        let taxel = count_bits(params.taxels());
        let rst = io.rst;
        let register = |name: &str, bits: usize| k.register(name, Type::unsigned(bits));
        let state =
            STATES.map(|name| k.state(&format!("in_{name}"), Type::unsigned(1), rst, u64::from(name == STATES[IDLE])));
        let tick = register("tick", 4);
        let [address, mirror, point, target] =
            ["address", "mirror", "point", "target"].map(|name| register(name, taxel));
        let (lane, moves) = (register("lane", 2), k.net("moves", Type::unsigned(1)));
        let is = |step: usize| *state[step];

        let picks = is(UNPACK) & tick.slice(1, 2).any() & !tick.slice(1, 2).all() | is(LABEL) & tick.is(3);
        let (quad, picks, word) = unpack(k, params, &io, *lane, picks);
        let memories = Memories::new(k, params, *moves, *point);
        k.comment("Multiplier and the sum of its products");
        let (row, col) = (register("row", count_bits(params.rows)), register("col", count_bits(params.cols)));
        let multiplier = Multiplier::new(k, params, &is, &memories, word, [*tick, *row, *col, *lane]);

        let table = |name: &str, bits: usize, holds: Holds| memory(k, name, TABLE, bits, holds);
        let chain = table("chain", BASIN + 1, Holds::BasinLinks);
        let cursor = register("cursor", BASIN);
        let chain_out = k.wire("chain_out", chain.read(*cursor));
        Circuit {
            k,
            params,
            state,
            leaves: RefCell::default(),
            tick,
            address,
            row,
            col,
            mirror,
            quad,
            lane,
            picks,
            word,
            counts: register("counts", 1),
            point,
            target,
            line: register("line", row.bits().max(col.bits())),
            begun: register("begun", 1),
            ending: register("ending", 1),
            moves,
            memories,
            multiplier,
            count: register("basins", BASIN),
            kept: io.count.register(),
            overflow: io.overflow.register(),
            done: io.done.state(rst, 0),
            label: register("label", count_bits(params.most)),
            adds: register("adds", 1),
            own: register("own", BASIN),
            lower: register("lower", BASIN),
            higher: register("higher", BASIN),
            cursor,
            chain,
            chain_out,
            loads: table("loads", params.sum, Holds::Loads),
            bars: table("bars", params.smoothed, Holds::SaddleThresholds),
            io,
        }
    }
}

impl<'k> Circuit<'k> {
    pub(super) fn zero(&self, bits: usize) -> Expr<'k> {
        self.k.constant(bits, 0)
    }

    pub(super) fn is(&self, step: usize) -> Expr<'k> {
        *self.state[step]
    }

    /// Whether the step is one of these.
    pub(super) fn among(&self, steps: &[usize]) -> Expr<'k> {
        steps.iter().map(|&step| self.is(step)).reduce(|any, is| any | is).unwrap_or(self.zero(1))
    }

    /// Whether the step is this one at this tick.
    pub(super) fn at(&self, step: usize, tick: u64) -> Expr<'k> {
        self.is(step) & self.tick.is(tick)
    }

    /// Goes from a step to another if `when`, which is only in the first of them, with what else is `set` then.
    pub(super) fn enter(&self, when: Expr<'k>, [from, to]: [usize; 2], set: impl FnOnce()) {
        self.k.when(when, || {
            self.state[from].set(self.zero(1));
            self.state[to].set(self.k.constant(1, 1));
            set();
        });
        self.leaves.borrow_mut().push(when);
    }

    /// Every state begins at tick 0, or `when` at another.
    pub(super) fn begin(&self, when: Expr<'k>, tick: u64) {
        let leaves = self.leaves.borrow().iter().copied().reduce(|any, leaves| any | leaves);
        self.k.when(leaves.unwrap_or(self.zero(1)), || self.tick.set(self.zero(4)));
        self.turn(when, tick);
    }

    /// Goes to a tick of the step if `when`.
    pub(super) fn turn(&self, when: Expr<'k>, tick: u64) {
        self.k.when(when, || self.tick.set(self.k.constant(4, tick)));
    }

    /// The start, and the ticks of the steps that count them.
    pub(super) fn sequence(&self) -> Expr<'k> {
        let (k, tick) = (self.k, self.tick);
        let smooths = self.among(&[ALONG_ROWS, ALONG_COLUMNS]);
        let counted = self.among(&[UNPACK, CLIMB, WALK, LABEL, TAKE, SETTLE]);
        let ends = [(UNPACK, 6), (CLIMB, 9), (WALK, 2), (BORDERS, 4), (LABEL, 4), (TAKE, 1), (SETTLE, 1)];
        let ends = ends.map(|(step, tick)| self.at(step, tick)).into_iter().reduce(|any, end| any | end);
        let ends = k.wire("ticks_end", ends.unwrap_or(self.zero(1)));
        k.when(counted | self.is(BORDERS) & *self.moves | smooths & !tick.at(3), || {
            tick.set(ends.mux(self.zero(4), tick.plus(1)));
        });
        k.wire("starts", self.is(IDLE) & self.io.start)
    }
}

/// The one of `values` whose condition is met, 0 if none is; at most one is.
pub(super) fn select<'k>(values: &[(Expr<'k>, Expr<'k>)]) -> Expr<'k> {
    let masked = values.iter().map(|&(condition, value)| condition.repeat(value.bits()) & value);
    masked.reduce(|any, value| any | value).unwrap_or(values[0].1)
}

/// The factor of a product: a weight along an axis; the slope to a neighbour, or the ratio of a bar; 1 for a load; 2 for the
/// weight of a contact, an odd number for its moments.
fn factor<'k>(
    k: &'k Builder,
    params: &SegmentParams,
    is: &dyn Fn(usize) -> Expr<'k>,
    [tick, weight, row, col, lane]: [Expr<'k>; 5],
) -> Expr<'k> {
    let constant = |value: u64| k.constant(FACTOR, value);
    let [x, y, diagonal] = params.slopes.map(constant);
    let slopes = [(5, y), (7, x), (8, x), (0, y), (2, constant(BAR))];
    // The factors of a taxel stay until its products are there, when the next one has been chosen.
    let odd = |name: &str, line: Expr<'k>, lines: usize, far: Expr<'k>| {
        let mirrored = (k.constant(line.bits(), lines as u64 - 1) - line).low(line.bits());
        let odd = far.mux(mirrored, line).concat(k.constant(1, 1));
        let factor = k.register(name, odd.ty());
        k.when(tick.is(3), || factor.set(odd));
        factor.resize(FACTOR)
    };
    let moments = [(1, constant(2)), (2, odd("row_factor", row, params.rows, lane.at(1)))];
    let moment = tick.case(&moments, odd("col_factor", col, params.cols, lane.at(0)));
    select(&[
        (is(ALONG_ROWS) | is(ALONG_COLUMNS), weight),
        (is(CLIMB), tick.case(&slopes, diagonal)),
        (is(BORDERS), constant(1)),
        (is(LABEL), moment),
    ])
}
