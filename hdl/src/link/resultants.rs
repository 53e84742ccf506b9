//! From the engine's beats to the words of an answer: all beats, or sums and status.

use super::{Answers, PacketParams};
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::count_bits;
use crate::{block, states};

block! {
    /// While `run`, beats pass as words; that is all where the board does not answer with forces and with sums. With
    /// `summarise`, the forces are added up, and four words of sums go out before the status beats. No multiplier is
    /// needed: for Σ column · fz, the sum of the fz to the left of each taxel is subtracted, and at the end Σ fz is
    /// added columns − 1 times, once per cycle; likewise for rows.
    pub struct Resultants {
        /// Rows and columns of the array whose forces are added up; none where all beats pass.
        sides: Option<[usize; 2]>,
    }
    ports ResultantsPorts {
        clock;
        reset;
        /// An answer to a frame is being sent.
        in run;
        /// The word is accepted in this cycle.
        in taken;
        /// The answer consists of sums and status; constant during an answer.
        in summarise;
        /// A beat of the engine, 96 bits; valid with `beat_valid`.
        in beat: 96;
        /// `beat` is offered; held until `beat_ready`.
        in beat_valid;
        /// The beat is its frame's last; valid with `beat_valid`.
        in beat_last;
        /// The beat is accepted in this cycle. Registered where sums are computed, so that the packer's logic is not in
        /// the path of a fast engine: a beat that is a word then stays for two cycles after its word was accepted.
        out beat_ready;
        /// A word of the payload, 96 bits; valid with `word_valid`.
        out word: 96;
        /// `word` is offered; held until `taken`.
        out word_valid;
        /// The word is the payload's last; valid with `word_valid`.
        out word_last;
    }
}

states! {
    /// What becomes of beats: forces are added, the sums are finished and leave, the status passes.
    enum Stage { Add, Finish, Out, Status }
}

/// Index of the last word of the sums.
const LAST_WORD: u64 = 3;

impl Resultants {
    /// For the array of `params`.
    pub fn new(params: &PacketParams) -> Self {
        Resultants { sides: (params.answers == Answers::Both).then_some([params.rows, params.cols]) }
    }
}

impl Block for Resultants {
    fn build<'k>(&self, k: &'k Builder, io: ResultantsPorts<Inside<'k>>) {
        match self.sides {
            Some(sides) => sums(k, io, sides),
            None => pass(io),
        }
    }
}

/// Beats pass as words.
fn pass(io: ResultantsPorts<Inside>) {
    io.beat_ready.set(io.run & io.taken);
    io.word.set(io.beat);
    io.word_valid.set(io.run & io.beat_valid);
    io.word_last.set(io.beat_last);
}

/// Beats pass as words, or are added up.
fn sums<'k>(k: &'k Builder, io: ResultantsPorts<Inside<'k>>, [rows, cols]: [usize; 2]) {
    let ResultantsPorts { rst, run, taken, summarise, beat, beat_valid, beat_last, .. } = io;
    // Every intermediate sum is at most the largest force word times taxels times the longer side.
    let bits = 32 + count_bits(rows * cols + 1) + count_bits(rows.max(cols));
    let (r, c, m, l) = (count_bits(rows), count_bits(cols), count_bits(rows.max(cols)), count_bits(rows * cols + 1));
    let bit = Type::unsigned(1);
    let stage = k.machine("stage", rst, Stage::Add);
    let out = k.register("out", Type::unsigned(2));
    let adding = k.state("adding", bit, rst, 0);
    let adding = adding.comment("beat_ready, separately for beats that are added and beats that pass.");
    let passing = k.state("passing", bit, rst, 0);
    let was_taken = k.state("was_taken", bit, rst, 0).comment(
        "Registered to shorten the route from the packer; meanwhile the CRC processes the last byte of the word.",
    );
    // The accumulators are far from here: they take a beat a cycle after it was accepted, long before its sums are sent.
    let adds_late = k.state("adds_late", bit, rst, 0);
    let beat_late = k.register("beat_late", Type::unsigned(96));
    let [first_late, begins_late, finishes_late] =
        ["first_late", "begins_late", "finishes_late"].map(|name| k.register(name, bit));
    let row = k.state("row", Type::unsigned(r), rst, 0);
    let col = k.state("col", Type::unsigned(c), rst, 0);
    let [more, more_late] = ["more", "more_late"].map(|name| k.register(name, Type::unsigned(m)));
    let sum = |name: &str| k.register(name, Type::signed(bits));
    let totals = ["sum_x", "sum_y", "sum_z"].map(sum);
    let [moment_x, moment_y, line] = ["moment_x", "moment_y", "line"].map(sum);
    let loaded = k.register("loaded", Type::unsigned(l));

    let passes = k.wire("passes", !summarise | stage.is(Stage::Status));
    let begins = k.wire("begins", col.is(0));
    let first = k.wire("first", row.is(0) & begins);
    let line_end = k.wire("line_end", col.is(cols as u64 - 1));
    let at_end = k.wire("at_end", line_end & row.is(rows as u64 - 1));
    let adds = k.wire("adds", *adding & beat_valid);
    let sends = k.wire("sends", stage.is(Stage::Out));
    let finishes = k.wire("finishes", stage.is(Stage::Finish));
    let ends = passing.get() & beat_valid & beat_last;
    adding.set(run & !passes & stage.is(Stage::Add) & !(adds & at_end));
    passing.set(passes & *was_taken);
    was_taken.set(taken);

    let wrapped = |sum: Expr<'k>| sum.low(bits).signed();
    let nothing = k.signed_constant(bits, 0);
    let (first_beat, begins_line) = (first_late.get(), begins_late.get());
    let forces = [0, 1, 2].map(|axis| beat_late.slice(32 * axis, 32).signed().extend(bits));
    let [.., z] = forces;
    let sum_z = *totals[2];
    adds_late.set(adds);
    finishes_late.set(finishes);
    more_late.set(*more);
    k.when(adds, || {
        beat_late.set(beat);
        first_late.set(first);
        begins_late.set(begins);
        more.set(k.constant(m, 0));
        out.set(k.constant(2, 0));
        col.set(line_end.mux(k.constant(c, 0), col.plus(1)));
        k.when(line_end, || row.set(at_end.mux(k.constant(r, 0), row.plus(1))));
    });
    k.when(*adds_late, || {
        for (total, force) in totals.iter().zip(forces) {
            total.set(first_beat.mux(force, wrapped(**total + force)));
        }
        loaded.set((first_beat.mux(k.constant(l, 0), *loaded) + beat_late.slice(64, 32).any()).low(l));
        line.set(begins_line.mux(z, wrapped(*line + z)));
        moment_x.set(first_beat.mux(nothing, begins_line.mux(*moment_x, wrapped(*moment_x - *line))));
        moment_y.set(first_beat.mux(nothing, begins_line.mux(wrapped(*moment_y - sum_z), *moment_y)));
    });
    k.when(*finishes_late, || {
        for (moment, side) in [(&moment_x, cols), (&moment_y, rows)] {
            let counts = more_late.less(k.constant(m, side as u64 - 1));
            k.when(counts, || moment.set(wrapped(**moment + sum_z)));
        }
    });
    k.when(finishes, || more.set(more.plus(1)));
    let leaves = k.wire("leaves", sends & *was_taken);
    k.when(leaves, || out.set(out.plus(1)));
    k.when(ends, || stage.goes(Stage::Add));
    k.when(leaves & out.is(LAST_WORD), || stage.goes(Stage::Status));
    k.when(finishes & more.is(rows.max(cols) as u64 - 1), || stage.goes(Stage::Out));
    k.when(adds & at_end, || stage.goes(Stage::Finish));

    let sum = |sum: Expr<'k>| sum.extend(64);
    let words = [sum(*moment_y), sum(*moment_x), sum(sum_z), sum(*totals[1]), sum(*totals[0])];
    let all = k.wire("all", loaded.extend(64).concat(concat(&words)));
    let [low, second, third, high] = [0, 1, 2, 3].map(|word| all.slice(96 * word, 96));
    let of_sums = out.at(1).mux(out.at(0).mux(high, third), out.at(0).mux(second, low));
    io.beat_ready.set(*adding | *passing);
    io.word.set(passes.mux(beat, of_sums));
    io.word_valid.set(run & passes.mux(beat_valid & !*passing, sends));
    io.word_last.set(passes & beat_last);
}

#[cfg(test)]
mod tests {
    use dermis_golden::wire::link::Sums;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const STATUS_BEATS: usize = 3;

    /// Adds the beats of a whole frame with the golden model's [`Sums`].
    #[derive(Clone, Default)]
    struct Expected {
        rows: usize,
        cols: usize,
        beats: Vec<[i32; 3]>,
        /// Cycles since the last force was added, words of the sums sent; none before.
        after: Option<(usize, usize)>,
        adding: bool,
        passing: bool,
        was_taken: bool,
        reset: bool,
    }

    impl Expected {
        fn passes(&self, inputs: &[Word]) -> bool {
            inputs[3].number() == 0 || self.after.is_some_and(|(_, words)| words == 4)
        }

        /// The sums are complete, and words of them are to be sent.
        fn sends(&self) -> bool {
            self.after.is_some_and(|(cycles, words)| cycles >= self.rows.max(self.cols) && words < 4)
        }

        fn word(&self, word: usize) -> Word {
            let bytes = Sums::of(&self.beats, self.cols).to_bytes();
            let mut all = Word::default();
            bytes[12 * word..][..12].iter().enumerate().for_each(|(at, &byte)| all.set(8 * at, 8, byte.into()));
            all
        }
    }

    impl Reference for Expected {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 4];
            }
            let [run, valid, last] = [1, 5, 6].map(|k| inputs[k].number() == 1);
            let passes = self.passes(inputs);
            let stands = if passes { valid && !self.passing } else { self.sends() };
            let word = match (passes, self.after) {
                (true, _) => Some(inputs[4]),
                (false, Some((_, words))) if self.sends() => Some(self.word(words)),
                _ => None,
            };
            let bit = |bit: bool| Some(Word::from(bit));
            vec![bit(self.adding || self.passing), word, bit(run && stands), bit(passes && last)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, run, taken, _, _, valid, last] = [0, 1, 2, 3, 4, 5, 6].map(|k| inputs[k].number() == 1);
            let (before, passes) = (self.clone(), self.passes(inputs));
            if before.adding && valid {
                self.beats.push([0, 1, 2].map(|axis| inputs[4].signed(axis, 32) as i32));
            }
            self.after = match before.after {
                None => (self.beats.len() == self.rows * self.cols).then_some((0, 0)),
                Some((_, words)) if before.sends() => {
                    Some((self.rows.max(self.cols), words + usize::from(before.was_taken)))
                }
                Some((cycles, words)) => Some((cycles + 1, words)),
            };
            if before.passing && valid && last {
                (self.after, self.beats) = (None, Vec::new());
            }
            self.adding = run && !passes && self.after.is_none() && before.after.is_none();
            self.passing = passes && before.was_taken;
            self.was_taken = taken;
            if rst {
                *self = Expected { reset: true, rows: self.rows, cols: self.cols, ..Expected::default() };
            }
        }
    }

    /// Frames of forces and status; some answers are all beats, the others their sums. Beats stay until they are
    /// accepted; no word is accepted in the cycle after one; resets.
    fn stimulus(cycles: usize, rows: usize, cols: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(21);
        let mut answers = Expected { rows, cols, ..Expected::default() };
        let (mut at, mut pause, mut summarise, mut beat, mut offered, mut large) =
            (0, 0, false, Word::default(), false, false);
        let inputs = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..1500) == 0;
            if rst || (pause == 0 && at == rows * cols + STATUS_BEATS) {
                // Between answers: `run` is low, and the kind of the next is known.
                (at, pause, summarise, offered, large) = (0, 3, random.u8(..3) > 0, false, random.bool());
            }
            pause -= usize::from(pause > 0);
            if !offered {
                offered = !rst && pause == 0 && random.u8(..4) > 0;
                let one = |random: &mut fastrand::Rng| match (large, random.u8(..3)) {
                    (_, 0) => 0,
                    (true, 1) => i32::MIN.into(),
                    (true, _) => i32::MAX.into(),
                    _ => i64::from(random.i32(..)),
                };
                beat = Word::of_fields(&[one(&mut random), one(&mut random), one(&mut random)], 32);
            }
            let last = at == rows * cols + STATUS_BEATS - 1;
            let run = pause == 0 && random.u8(..16) > 0;
            let bit = Word::from;
            let mut inputs = vec![bit(rst), bit(run), bit(false), bit(summarise), beat, bit(offered), bit(last)];
            answers.reset = true;
            let outputs = answers.outputs(&inputs);
            let stands = outputs[2] == Some(Word::from(true));
            inputs[2] = bit(stands && !answers.was_taken && random.u8(..3) == 0);
            if offered && outputs[0] == Some(Word::from(true)) {
                (offered, at) = (false, at + 1);
            }
            answers.clock(&inputs);
            inputs
        };
        (0..cycles).map(inputs).collect()
    }

    #[test]
    fn the_sums_are_those_of_the_model() {
        for (rows, cols) in [(3, 5), (6, 2)] {
            let params = PacketParams {
                rows,
                cols,
                input_bits: 12,
                answer_bytes: [0; 2],
                image_bytes: None,
                answers: Answers::Both,
                frames: 4,
                scans: false,
            };
            let mut answers = Expected { rows, cols, ..Expected::default() };
            check(&kernel_of(&Resultants::new(&params)), &stimulus(12_000, rows, cols), &mut answers);
        }
    }
}
