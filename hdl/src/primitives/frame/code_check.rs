//! Whether the codes of a frame are clipped, or a row or column repeats the one before, as they pass: the
//! [`CodeCheck`](dermis_golden::fixed::stages::prepare::code_check) of the bit-true model.
//!
//! ```text
//! code --> largest, next, count ---------------------------------------------------------.
//!  |  '--> difference to the code before --> least change; the row's change --> its line --+--> faults
//!  '--> codes of three rows --> difference to the code above --> the column's change --> its line
//! ```
//! Codes are compared as unsigned numbers that rise with the load. A memory has a word per column of what the rows before have of
//! it; in the last row it is complete, column by column. A pair of equal lines waits for the next line, which tells whether the
//! pair lies on the axis of a frame that is its own mirror image. Of a block of frames that are averaged any one may have the faults.

use dermis_golden::fixed::stages::prepare::code_check::{CodeCheck, FINE, LOADED, MIRROR, PLATEAU_CODES, PLATEAU_GAP};
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::MeanKind;

use super::frame_stats::magnitude_of;
use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Net, Type};
use crate::primitives::address::counter::count_bits;

/// Cycles from the last code of a frame, or of a block of frames, to its faults.
pub const LATENCY: usize = 6;
/// Width of the faults.
pub const FAULT_BITS: usize = 2;
/// Width of the count of equal largest codes.
const COUNT_BITS: usize = 3;

block! {
    /// Sees the codes that another block accepts; at least 4 × 4 of a frame. An early `tlast` begins a new frame and block, a
    /// missing one changes nothing.
    #[derive(Clone)]
    pub struct FrameCheck {
        /// Width of a code.
        bits: usize,
        /// Binary logarithm of the frames of a block.
        power: usize,
        check: CodeCheck,
    }
    ports FrameCheckPorts {
        clock;
        reset;
        /// `code` is accepted in this cycle.
        in accept;
        /// A taxel's code, two's complement; valid with `accept`.
        in code: bits;
        /// The code is the last of its frame; valid with `accept`.
        in tlast;
        /// The codes of the last block are clipped; above it, a loaded row or column repeats the one before. From [`LATENCY`]
        /// cycles after the last code of a block until as many after that of the next.
        out faults: FAULT_BITS;
    }
}

impl FrameCheck {
    /// For the codes of `model`; `None` where they are not checked.
    pub fn of_model(model: &Model) -> Option<Self> {
        let prepare = &model.prepare;
        let power = if prepare.mean == MeanKind::Block { prepare.average as usize } else { 0 };
        prepare.check.clone().map(|check| FrameCheck { bits: model.formats().code_bits as usize, power, check })
    }
}

/// The place of a code in a line: first, last, and at least [`MIRROR`] behind the first.
#[derive(Clone, Copy)]
struct Place<'k> {
    first: Expr<'k>,
    last: Expr<'k>,
    far: Expr<'k>,
}

impl<'k> Place<'k> {
    /// Of a count up to `count`.
    fn new(k: &'k Builder, at: &Net<'k>, count: usize) -> Self {
        let far = k.constant(at.bits(), MIRROR as u64 - 1).less(**at);
        Place { first: at.is(0), last: at.is(count as u64 - 1), far }
    }

    /// One cycle later.
    fn later(self, k: &'k Builder, name: &str) -> Self {
        let later = |end: &str, value| k.delay(&format!("{name}_{end}"), value);
        Place { first: later("first", self.first), last: later("last", self.last), far: later("far", self.far) }
    }
}

/// A code in the cycle after it was accepted, with its place.
struct Beat<'k> {
    valid: Expr<'k>,
    code: Expr<'k>,
    /// The taxel is live; it and the one before in its row; it and the one before in its column.
    live: Expr<'k>,
    pair_in_row: Expr<'k>,
    pair_in_col: Expr<'k>,
    col: Expr<'k>,
    in_row: Place<'k>,
    in_col: Place<'k>,
    /// The last of the frame.
    ends: Expr<'k>,
    /// The frame is the first and the last of its block.
    in_block: Option<[Expr<'k>; 2]>,
}

impl<'k> Beat<'k> {
    fn new(k: &'k Builder, check: &CodeCheck, power: usize, io: &FrameCheckPorts<Inside<'k>>) -> Self {
        let counter = |name: &str, count: usize| k.state(name, Type::unsigned(count_bits(count)), io.rst, 0);
        let (row, col) = (counter("row", check.rows), counter("col", check.cols));
        let zero = |net: &Net<'k>| k.constant(net.bits(), 0);
        let (in_row, in_col) = (Place::new(k, &col, check.cols), Place::new(k, &row, check.rows));
        let line_ends = k.wire("line_ends", in_row.last | io.tlast);
        let frame_ends = k.wire("frame_ends", in_row.last & in_col.last);
        k.when(io.accept, || {
            col.set(line_ends.mux(zero(&col), col.plus(1)));
            k.when(line_ends, || row.set((frame_ends | io.tlast).mux(zero(&row), row.plus(1))));
        });
        let in_block = (power > 0).then(|| {
            let frame = k.state("frame", Type::unsigned(power), io.rst, 0);
            let next = frame_ends.mux(frame.plus(1), zero(&frame));
            k.when(io.accept & (frame_ends | io.tlast), || frame.set(next));
            [("block_first", frame.is(0)), ("block_last", frame.all())].map(|(name, at)| k.delay(name, at))
        });
        let (in_row_held, in_col_held) = (in_row.later(k, "in_row"), in_col.later(k, "in_col"));
        let mut live = [k.constant(1, 1), !in_row_held.first, !in_col_held.first];
        if !check.dead.is_empty() {
            let taxel = counter("taxel", check.rows * check.cols);
            k.when(io.accept, || taxel.set((frame_ends | io.tlast).mux(zero(&taxel), taxel.plus(1))));
            let is_live = |at: usize| !check.dead.contains(&at);
            let table = |name: &str, before: usize| {
                let both = |at: usize| is_live(at) && at.checked_sub(before).is_none_or(is_live);
                let words: Vec<u64> = (0..1 << taxel.bits()).map(|at| u64::from(both(at))).collect();
                k.delay(name, taxel.table(1, &words))
            };
            let tables = [table("live", 0), table("live_in_row", 1), table("live_in_col", check.cols)];
            live = [0, 1, 2].map(|which| live[which] & tables[which]);
        }
        let valid = k.state("valid", Type::unsigned(1), io.rst, 0);
        valid.set(io.accept);
        k.comment("Offset binary, and its complement where codes fall with the load.");
        let code = (!io.code.top()).concat(io.code.low(io.code.bits() - 1));
        Beat {
            valid: *valid,
            code: k.delay("upward", if check.falls { !code } else { code }),
            live: live[0],
            pair_in_row: live[1],
            pair_in_col: live[2],
            col: k.delay("col_held", *col),
            in_row: in_row_held,
            in_col: in_col_held,
            ends: k.delay("ends", frame_ends),
            in_block,
        }
    }
}

/// A code against one before it in a line, two cycles after it was accepted.
struct Pair<'k> {
    /// They are equal.
    repeats: Expr<'k>,
    /// The code is equal to the one [`MIRROR`] before it.
    mirrors: Expr<'k>,
    /// Ones' complement magnitude of their difference; 0 if one is dead or there is none before.
    change: Expr<'k>,
}

impl<'k> Pair<'k> {
    /// `code` against the codes `before` it; both are live where `live`.
    fn new(k: &'k Builder, code: Expr<'k>, live: Expr<'k>, before: [Expr<'k>; MIRROR]) -> Self {
        let difference = k.delay("difference", code - before[0]);
        let live = k.delay("live", live).repeat(code.bits());
        Pair {
            repeats: !difference.any(),
            mirrors: k.delay("is_image", code.equals(before[MIRROR - 1])),
            change: k.wire("change", magnitude_of(difference) & live),
        }
    }
}

/// What is known of a line, a row or column, after some of its codes.
#[derive(Clone, Copy)]
struct Line<'k> {
    /// It is equal to the line before it, to the one [`MIRROR`] before it.
    repeats: Expr<'k>,
    mirrors: Expr<'k>,
    /// The OR of its changes.
    change: Expr<'k>,
}

impl<'k> Line<'k> {
    /// With a code at `place` of the line, which is the line at `at` of its frame: `across` to the lines before, `along` the line.
    fn with(self, k: &'k Builder, place: Place<'k>, at: Place<'k>, across: &Pair<'k>, along: &Pair<'k>) -> Self {
        let zero = k.constant(self.change.bits(), 0);
        Line {
            repeats: (place.first | self.repeats) & !at.first & across.repeats,
            mirrors: (place.first | self.mirrors) & at.far & across.mirrors,
            change: place.first.mux(zero, self.change) | along.change,
        }
    }

    fn bits(self) -> Expr<'k> {
        concat(&[self.mirrors, self.repeats, self.change])
    }

    fn of_bits(word: Expr<'k>) -> Self {
        let bits = word.bits() - 2;
        Line { repeats: word.at(bits), mirrors: word.at(bits + 1), change: word.low(bits) }
    }

    /// The changes of the lines that repeat the one before, from those that are `done`, the line at `at` of its frame: two cycles
    /// after the last.
    fn repeated(self, k: &'k Builder, done: Expr<'k>, at: Place<'k>) -> Expr<'k> {
        let zero = k.constant(self.change.bits(), 0);
        let [pair, all] = ["pair", "all"].map(|name| k.register(name, zero.ty()));
        let with_pair = *all | *pair;
        let flush = k.delay("flush", done & at.last);
        k.when(flush, || all.set(with_pair));
        k.when(done, || {
            pair.set(self.repeats.mux(self.change, zero));
            all.set(at.first.mux(zero, self.mirrors.mux(*all, with_pair)));
        });
        *all
    }
}

/// The largest code of a frame and the next one, two cycles after its last code.
struct Extremes<'k> {
    largest: Expr<'k>,
    next: Expr<'k>,
    /// There is a next one below [`PLATEAU_CODES`] equal largest ones.
    is_plateau: Expr<'k>,
}

impl<'k> Extremes<'k> {
    fn new(k: &'k Builder, beat: &Beat<'k>) -> Self {
        let (bit, code) = (Type::unsigned(1), Type::unsigned(beat.code.bits()));
        let [seen, has_next] = ["seen", "has_next"].map(|name| k.register(name, bit));
        let [largest, next] = ["largest", "next"].map(|name| k.register(name, code));
        let count = k.register("count", Type::unsigned(COUNT_BITS));
        let begins = k.wire("begins", beat.in_row.first & beat.in_col.first);
        let had = k.wire("had", *seen & !begins);
        let above = k.wire("above", !had | largest.less(beat.code));
        let equal = k.wire("equal", had & largest.equals(beat.code));
        let has = k.wire("has", *has_next & !begins);
        k.when(beat.valid, || {
            seen.set(had | beat.live);
            has_next.set(has | (beat.live & had & !equal));
            k.when(beat.live, || {
                k.when(above, || {
                    largest.set(beat.code);
                    next.set(*largest);
                });
                k.when(!above & !equal & (!has | next.less(beat.code)), || next.set(beat.code));
                let full = count.is(PLATEAU_CODES.into());
                let one = k.constant(COUNT_BITS, 1);
                count.set(above.mux(one, (equal & !full).mux(count.plus(1), *count)));
            });
        });
        let is_plateau = *has_next & count.is(PLATEAU_CODES.into());
        Extremes { largest: *largest, next: *next, is_plateau }
    }
}

/// Changes of a frame, three cycles after its last code.
struct Changes<'k> {
    /// The OR of all.
    all: Expr<'k>,
    /// The least above 0 along a row.
    least: Expr<'k>,
    /// Those of the rows and columns that repeat the one before, five cycles after its last code.
    repeated: Expr<'k>,
}

impl<'k> Changes<'k> {
    fn new(k: &'k Builder, check: &CodeCheck, beat: &Beat<'k>) -> Self {
        let bits = beat.code.bits();
        let code = Type::unsigned(bits);
        k.comment("The codes before in the row, and those above.");
        let before = ["before_1", "before_2", "before_3"].map(|name| k.register(name, code));
        k.when(beat.valid, || {
            before[0].set(beat.code);
            (1..MIRROR).for_each(|place| before[place].set(*before[place - 1]));
        });
        let codes = k.memory("codes", check.cols, MIRROR * bits, Contents::Undefined);
        let word = k.wire("word", codes.read(beat.col));
        let above = [0, 1, 2].map(|place| word.slice(place * bits, bits));
        codes.write(beat.valid, beat.col, concat(&[above[1], above[0], beat.code]));
        let in_row = k.scope("row_", || Pair::new(k, beat.code, beat.pair_in_row, before.map(|net| *net)));
        let in_col = k.scope("col_", || Pair::new(k, beat.code, beat.pair_in_col, above));

        k.comment("A cycle later");
        let (valid, col) = (k.delay("valid_2", beat.valid), k.delay("col_2", beat.col));
        let (at_col, at_row) = (beat.in_row.later(k, "at_col"), beat.in_col.later(k, "at_row"));
        let line_bits = Type::unsigned(bits + 2);
        let row = k.register("row_line", line_bits);
        let with_code = Line::of_bits(*row).with(k, at_col, at_row, &in_col, &in_row).bits();
        k.when(valid, || row.set(with_code));
        let columns = k.memory("columns", check.cols, bits + 2, Contents::Undefined);
        let column = Line::of_bits(k.wire("column", columns.read(col)));
        let with_code = column.with(k, at_row, at_col, &in_row, &in_col).bits();
        columns.write(valid, col, with_code);
        let column = k.delay("col_line", with_code);

        let begins = k.wire("changes_begin", valid & at_col.first & at_row.first);
        let [all, least] = ["changes", "least"].map(|name| k.register(name, code));
        let changes = in_row.change | in_col.change;
        k.when(valid, || all.set(changes | begins.mux(k.constant(bits, 0), *all)));
        k.when(valid & in_row.change.any() & in_row.change.less(*least), || least.set(in_row.change));
        k.when(begins, || least.set(k.constant(1, 1).repeat(bits)));

        let (line_row, line_col) = (at_row.later(k, "line_row"), at_col.later(k, "line_col"));
        let done = |name: &str, last: Expr<'k>| k.delay(name, valid & last);
        let [row_done, col_done] = [done("row_done", at_col.last), done("col_done", at_row.last)];
        let of_rows = k.scope("rows_", || Line::of_bits(*row).repeated(k, row_done, line_row));
        let of_cols = k.scope("cols_", || Line::of_bits(column).repeated(k, col_done, line_col));
        Changes { all: *all, least: *least, repeated: of_rows | of_cols }
    }
}

impl Block for FrameCheck {
    fn build<'k>(&self, k: &'k Builder, io: FrameCheckPorts<Inside<'k>>) {
        let bits = self.bits;
        let beat = Beat::new(k, &self.check, self.power, &io);
        let changes = Changes::new(k, &self.check, &beat);
        let Extremes { largest, next, is_plateau } = Extremes::new(k, &beat);
        k.comment("Held from the end of the frame on, while the next one arrives.");
        let later = |name: &str, ends: Expr<'k>| {
            let register = k.state(name, Type::unsigned(1), io.rst, 0);
            register.set(ends);
            *register
        };
        let held = |name: &str, end: Expr<'k>, value: Expr<'k>| {
            let register = k.register(name, value.ty());
            k.when(end, || register.set(value));
            *register
        };
        let ends = k.wire("ends_1", beat.valid & beat.ends);
        let in_block = beat.in_block.map(|[first, last]| [held("of_first", ends, first), held("of_last", ends, last)]);
        let ends = later("ends_2", ends);
        let plateau = held("plateau", ends, is_plateau);
        let far = PLATEAU_GAP as usize;
        let gap = held("gap", ends, (largest - next).slice(far, bits - far));
        let ends = later("ends_3", ends);
        let step = held("step", ends, changes.least);
        let change = held("change", ends, changes.all);
        let ends = later("ends_5", later("ends_4", ends));
        let clipped = plateau & !gap.less(step);
        let fine = !change.shift_right(FINE as usize).less(step);
        let loaded = change.less(changes.repeated.shift_left(LOADED as usize));
        let found = (fine & loaded).concat(clipped);
        let faults = io.faults.state(io.rst, 0);
        let Some([first, last]) = in_block else {
            k.when(ends, || faults.set(found));
            return;
        };
        let before = k.register("before_in_block", found.ty());
        let of_block = k.wire("of_block", found | first.mux(k.constant(FAULT_BITS, 0), *before));
        k.when(ends, || before.set(of_block));
        k.when(ends & last, || faults.set(of_block));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::result::flags::{Flag, FlagSet};

    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;

    const BITS: usize = 12;

    /// The model's flags of each whole block, so many cycles later; undefined before the first reset.
    struct Blocks {
        check: FrameCheck,
        codes: Vec<i32>,
        /// Frames of the block, and what they raise.
        frames: usize,
        raised: FlagSet,
        /// The flags of the last block, and those of the cycles before.
        shown: Option<FlagSet>,
        later: VecDeque<Option<FlagSet>>,
    }

    impl Blocks {
        fn new(check: &FrameCheck) -> Self {
            let later = vec![None; LATENCY - 1].into();
            let (frames, raised) = (0, FlagSet::default());
            Blocks { check: check.clone(), codes: Vec::new(), frames, raised, shown: None, later }
        }

        /// A code; the flags of a block that is complete.
        fn take(&mut self, code: i32, last: bool) -> Option<FlagSet> {
            let check = &self.check.check;
            self.codes.push(code);
            if self.codes.len() < check.rows * check.cols {
                if last {
                    self.codes.clear();
                    self.frames = 0;
                }
                return None;
            }
            self.raised = check.flags(&self.codes) | if self.frames > 0 { self.raised } else { FlagSet::default() };
            self.codes.clear();
            self.frames = (self.frames + 1) % (1 << self.check.power);
            (self.frames == 0).then_some(self.raised)
        }
    }

    impl Reference for Blocks {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let bit = |flags: FlagSet, flag| i64::from(flags.contains(flag));
            let faults = |flags| Word::of_fields(&[bit(flags, Flag::Clipped), bit(flags, Flag::LineFault)], 1);
            vec![self.shown.map(faults)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, accept, last] = [0, 1, 3].map(|input| inputs[input].number() == 1);
            let whole = if accept { self.take(inputs[2].signed(0, BITS) as i32, last) } else { None };
            self.later.push_back(whole);
            if let Some(flags) = self.later.pop_front().flatten() {
                self.shown = Some(flags);
            }
            if rst {
                *self = Blocks { shown: Some(FlagSet::default()), ..Blocks::new(&self.check) };
            }
        }
    }

    /// A frame: a smooth press, of which some are clipped, have lines twice, are mirrored, coarse or noise.
    fn frame(random: &mut fastrand::Rng, rows: usize, cols: usize) -> Vec<i32> {
        let [top, left] = [rows, cols].map(|count| random.i32(0..count as i32));
        let (size, curve) = (random.i32(500..2047), random.i32(17..150));
        let coarse = if random.u8(..4) == 0 { 1 << random.u32(..7) } else { 1 };
        let noise = if random.u8(..5) == 0 { random.i32(1..60) } else { 1 };
        let mut code = |k: usize| {
            let (i, j) = ((k / cols) as i32 - top, (k % cols) as i32 - left);
            let press = size - curve * (i * i + 2 * j * j) / 2 - 31 * i;
            (press + random.i32(-noise..=noise)) / coarse * coarse
        };
        let mut codes: Vec<i32> = (0..rows * cols).map(&mut code).collect();
        let mut sorted = codes.clone();
        sorted.sort_unstable();
        let floor = sorted[sorted.len() / 2];
        codes.iter_mut().for_each(|code| *code = (*code).max(floor + random.i32(0..3)));
        if random.bool() {
            let most = sorted[sorted.len() - random.usize(4..9)];
            codes.iter_mut().for_each(|code| *code = (*code).min(most));
        }
        for _ in 0..random.u8(..3) {
            let (row, col) = (random.usize(1..rows), random.usize(1..cols));
            match random.bool() {
                true => codes.copy_within((row - 1) * cols..row * cols, row * cols),
                false => (0..rows).for_each(|i| codes[i * cols + col] = codes[i * cols + col - 1]),
            }
        }
        if random.bool() {
            // Symmetric about a line between two rows or two columns.
            let of_rows = random.bool();
            let lines = if of_rows { rows } else { cols };
            let axis = random.usize(1..lines);
            for line in (axis..lines).take(axis) {
                let image = 2 * axis - 1 - line;
                match of_rows {
                    true => codes.copy_within(image * cols..(image + 1) * cols, line * cols),
                    false => (0..rows).for_each(|i| codes[i * cols + line] = codes[i * cols + image]),
                }
            }
        }
        if random.u8(..4) == 0 {
            codes.iter_mut().for_each(|code| *code = !*code);
        }
        codes.iter().map(|&code| code.clamp(-(1 << (BITS - 1)), (1 << (BITS - 1)) - 1)).collect()
    }

    fn stimulus(rows: usize, cols: usize, cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(9);
        let (mut codes, mut at, mut busy) = (frame(&mut random, rows, cols), 0, true);
        let cycle = |cycle: usize| {
            let rst = cycle == 0 || random.u16(..900) == 0;
            let accept = !rst && (busy || random.bool());
            let whole = at + 1 == rows * cols;
            let last = if random.u16(..150) == 0 { !whole } else { whole };
            let code = Word::of_fields(&[i64::from(codes[at])], BITS);
            if rst || (accept && (last || whole)) {
                (codes, at, busy) = (frame(&mut random, rows, cols), 0, random.bool());
            } else {
                at += usize::from(accept);
            }
            vec![rst.into(), accept.into(), code, last.into()]
        };
        (0..cycles).map(cycle).collect()
    }

    #[test]
    fn faults_are_those_of_the_model() {
        for (rows, cols, power, falls, dead) in
            [(4, 4, 0, false, vec![]), (5, 7, 1, true, vec![3, 17, 18]), (10, 8, 0, false, vec![0, 79])]
        {
            let block = FrameCheck { bits: BITS, power, check: CodeCheck { rows, cols, falls, dead } };
            let stimulus = stimulus(rows, cols, 8000 * (1 + power));
            let mut seen = Blocks::new(&block);
            let mut raised = [0; 4];
            for inputs in &stimulus {
                seen.clock(inputs);
                let flags = seen.shown.unwrap_or_default();
                raised
                    [usize::from(flags.contains(Flag::Clipped)) + 2 * usize::from(flags.contains(Flag::LineFault))] +=
                    1;
            }
            assert!(raised.iter().all(|cycles| *cycles > 50), "{raised:?}");
            let subject = |changes: &[Change]| subject_of!(block.clone(), changes, inputs [rst, accept, code, tlast], outputs [faults]);
            let mut defects = vec![
                Change::value("", "equal", |k| k.constant(1, 0)),
                Change::value("", "row___is_image", |k| k.constant(1, 0)),
                Change::value("", "col___is_image", |k| k.constant(1, 0)),
                Change::value("", "row___change", |k| k.constant(BITS, 1)),
                Change::value("", "col___change", |k| k.constant(BITS, 0)),
            ];
            // What the first frame of a block raises is forgotten.
            defects.extend((power > 0).then(|| Change::value("", "before_in_block", |k| k.constant(FAULT_BITS, 0))));
            check_with_defects(subject, &stimulus, || Blocks::new(&block), &defects);
        }
    }
}
