//! The kernel of [`Average`](super::average::Average) with an adaptive mean: every frame gives 2^L times the mean of a window of the
//! frames so far, as the bit-true model chooses it ([`adaptive_mean`](dermis_golden::fixed::stages::prepare::adaptive_mean)).
//!
//! ```text
//! gather   s_axis --> read means, hold word --> each mean, second difference --> memory; differences --> squares --> sums
//! judge    level of the second differences; a window after the other: factor × level, bit by bit, against its sum
//! send     read means --> window, or two extrapolated --> m_axis
//! ```
//! A frame is taken at a word per cycle, and the next one once the last word of the window has left: the window is known only after the
//! whole frame. g of a mean grows with the number of frames up to its k. An early `tlast` leaves as one beat with `tlast`, at which
//! `receive` drops the frame; the means start again with the next frame of its array. A missing `tlast` is missing behind the mean too,
//! and changes nothing else.

use dermis_golden::data::input::change_noise::{LEVEL_SHIFT, SAME_SIDE};
use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::prepare::adaptive_mean::{AdaptiveMean, FACTOR_BITS, FRAMES_BEFORE, SUM_LATENCY};
use dermis_golden::fixed::stages::send::{FRAMES, WINDOW};
use dermis_golden::spec::mean_window::MeanWindow;

use super::arrays::{Arrays, Resets};
use super::sliding_mean::{rises, MeanPorts};
use crate::language::{concat, Builder, Contents, Expr, Net, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::saturated;

/// Width of the number of frames and of the window above it, as a status has them.
pub(super) const MARK_BITS: usize = (FRAMES.bits + WINDOW.bits) as usize;
/// Stages of a beat behind the one in which it is taken: word and what is stored; means; differences; squares; sums.
const STAGES: usize = 5;

/// The sizes of an adaptive mean.
pub(super) struct AdaptiveKernel<'a> {
    pub mean: &'a AdaptiveMean,
    /// Width of a word in bits.
    pub bits: usize,
    /// There is a bit above a word, which leaves above the number of frames.
    pub limited: bool,
    /// Each has means of its own.
    pub arrays: Arrays,
}

/// What is known of the frame that is taken, judged or sent.
struct Frame<'k> {
    /// It has been taken, and its last word has not left.
    full: Net<'k>,
    /// Its window is sent, from taxel `sent` on.
    sending: Net<'k>,
    sent: Net<'k>,
    /// Its sums are not complete yet.
    settling: Net<'k>,
    array: Expr<'k>,
    /// Whole frames in the longest mean, with it.
    count: Expr<'k>,
    /// Its last beat came with `tlast`.
    last: Net<'k>,
    /// Index of its window.
    chosen: Net<'k>,
}

/// A beat in the cycle after it was taken, and what goes with it through the stages.
struct Beat<'k> {
    word: Expr<'k>,
    /// Where its taxel is stored.
    place: Expr<'k>,
    /// g of the longest mean, c.
    gain: Expr<'k>,
    odd: Expr<'k>,
    /// Bit i: there is a beat i + 1 stages behind the one in which it was taken.
    valid: Net<'k>,
    /// It is the first of its frame.
    first: Net<'k>,
    /// Its taxel is live; `None` where all are.
    live: Option<Net<'k>>,
}

/// What the judgement needs of a frame: S, and χ² of each window but the shortest mean.
struct Sums<'k> {
    spread: Net<'k>,
    squares: Vec<Net<'k>>,
}

impl AdaptiveKernel<'_> {
    /// The kernel.
    pub fn build<'k>(&self, k: &'k Builder, io: MeanPorts<'k>) {
        let kept = self.mean.word_bits(self.bits as u32) as usize;
        let places = self.arrays.words(self.taxels());
        let means = k.memory("means", places, kept, Contents::Undefined).holds(Holds::Average);
        let (valid, final_out) = (io.valid_out.state(io.rst, 0), k.register("final_out", Type::unsigned(1)));
        let moves = k.wire("moves", !*valid | io.ready);
        let (frame, beat, place) = self.take(k, &io, *valid & *final_out & io.ready);
        let stored = k.register("stored", Type::unsigned(kept));
        k.when(moves, || stored.set(means.read(place)));
        let (fresh, second, written) = self.follow(k, &beat, *stored);
        let followed = k.delay("followed_place", beat.place);
        means.write(beat.valid.at(1), followed, written);
        let sums = self.sums(k, &beat, &fresh, second);
        self.judge(k, io.resets, &frame, &sums);
        let (value, leaves, final_value) = self.window(k, io.rst, &frame, *stored, moves);
        let data = io.data_out.register();
        k.when(moves, || {
            valid.set(leaves);
            final_out.set(final_value);
            data.set(value);
        });
        io.last_out.set(*final_out & *frame.last);
        io.array_out.set(frame.array);
        let marks = frame.chosen.extend(WINDOW.bits as usize).concat(frame.count.extend(FRAMES.bits as usize));
        io.frames.set(match self.limited {
            false => marks,
            true => {
                let limit = k.register("limit", Type::unsigned(1));
                k.when(!*frame.full, || limit.set(io.data.top()));
                limit.concat(marks)
            }
        });
    }

    /// Width of a word of a mean.
    fn wide(&self) -> usize {
        self.bits + self.mean.longest() as usize
    }

    fn taxels(&self) -> usize {
        self.mean.live.len()
    }

    /// Takes the beats of a frame until it is full, and again once its last word has left. What is read: the place of the beat, or of the
    /// word that is sent.
    fn take<'k>(&self, k: &'k Builder, io: &MeanPorts<'k>, left: Expr<'k>) -> (Frame<'k>, Beat<'k>, Expr<'k>) {
        let (rst, resets, tlast, power) = (io.rst, io.resets, io.tlast, self.mean.longest() as usize);
        let (bit, index) = (Type::unsigned(1), Type::unsigned(count_bits(self.taxels())));
        let end = self.taxels() as u64 - 1;
        k.comment("Place of the next word; g and c of its frame, whole frames in the longest mean.");
        let taxel = k.state("taxel", index, rst, 0);
        let gains = self.arrays.state(k, "gain", Type::unsigned(count_bits(power + 1)), resets, 0);
        let odds = self.arrays.state(k, "odd", bit, resets, 0);
        let wholes = self.arrays.state(k, "whole", Type::unsigned(power + 1), resets, 0);
        let [full, settling, sending] = ["full", "settling", "sending"].map(|name| k.state(name, bit, rst, 0));
        let (sent, last) = (k.register("sent", index), k.register("last", bit));
        let takes = k.wire("takes", io.offered & !*full);
        io.ready_out.set(!*full & !rst);
        let [gain, odd, whole] = [&gains, &odds, &wholes].map(|state| state.of(io.array));
        let at_end = k.wire("at_end", taxel.is(end));
        let early = k.wire("early", tlast & !at_end);
        let held_array = (self.arrays.bits > 0).then(|| k.register("array", Type::unsigned(self.arrays.bits)));
        let array = held_array.map_or(io.array, |held| *held);
        k.when(takes, || {
            taxel.set((early | at_end).mux(k.constant(index.bits, 0), taxel.plus(1)));
            held_array.iter().for_each(|held| held.set(io.array));
            full.set(early | at_end);
            settling.set(at_end);
            last.set(tlast);
            k.comment("Of a frame that ended early the last place is sent.");
            sending.set(early);
            sent.set(early.mux(k.constant(index.bits, end), k.constant(index.bits, 0)));
            k.when(at_end, || {
                wholes.set(k, io.array, whole.all().mux(whole, whole.plus(1)));
                odds.set(k, io.array, !odd);
                gains.set(k, io.array, (gain + rises(k, whole, power)).low(gain.bits()));
            });
            k.when(early, || {
                for (states, state) in [(&wholes, whole), (&odds, odd), (&gains, gain)] {
                    states.set(k, io.array, k.constant(state.bits(), 0));
                }
            });
        });
        k.when(left, || full.set(k.constant(1, 0)));
        let read_array = if self.arrays.bits > 0 { sending.mux(array, io.array) } else { array };
        let place = self.arrays.address(k, read_array, sending.mux(*sent, *taxel));
        let count = wholes.of(array);
        let chosen = k.register("chosen", Type::unsigned(count_bits(self.mean.windows.len())));
        let beat = self.hold(k, io, takes, [*taxel, place, gain, odd]);
        (Frame { full, settling, sending, sent, array, count, last, chosen }, beat, place)
    }

    /// The registers behind the beat that is taken.
    fn hold<'k>(
        &self,
        k: &'k Builder,
        io: &MeanPorts<'k>,
        takes: Expr<'k>,
        [taxel, place, gain, odd]: [Expr<'k>; 4],
    ) -> Beat<'k> {
        let word = k.delay("word", io.data.low(self.bits).signed());
        let (place, gain, odd) = (k.delay("held_place", place), k.delay("held_gain", gain), k.delay("held_odd", odd));
        let valid = k.state("valids", Type::unsigned(STAGES), io.rst, 0);
        valid.set(valid.low(STAGES - 1).concat(takes));
        let follow = |name: &str, value: Expr<'k>, stages: usize| {
            let net = k.register(name, Type::unsigned(stages));
            net.set(net.low(stages - 1).concat(value));
            net
        };
        let first = follow("firsts", taxel.is(0), STAGES);
        let some_dead = self.mean.live.iter().any(|live| !live);
        let live = some_dead.then(|| {
            let words: Vec<u64> = (0..1 << taxel.bits())
                .map(|at: usize| u64::from(self.mean.live.get(at).copied().unwrap_or_default()))
                .collect();
            follow("lives", taxel.table(1, &words), STAGES - 2)
        });
        Beat { word, place, gain, odd, valid, first, live }
    }

    /// Moves what is `stored` of a taxel to its next word, two stages on: the means, the second difference, and all that is stored.
    fn follow<'k>(&self, k: &'k Builder, beat: &Beat<'k>, stored: Expr<'k>) -> (Vec<Expr<'k>>, Expr<'k>, Expr<'k>) {
        let (wide, power) = (self.wide(), self.mean.longest());
        let above = self.mean.averages.len() * wide;
        let [before, earlier] = [0, 1].map(|age| stored.slice(above + age * self.bits, self.bits).signed());
        let follow = |(index, &average): (usize, &u32)| {
            k.scope(&format!("mean_{average}_"), || {
                k.comment("Of the first frame nothing has been stored.");
                let zero = k.signed_constant(wide, 0);
                let stored = k.wire("stored", beat.gain.is(0).mux(zero, stored.slice(index * wide, wide).signed()));
                let shifts: Vec<u64> = (0..1 << beat.gain.bits()).map(|gain| gain.min(u64::from(average))).collect();
                let shift = beat.gain.table(beat.gain.bits(), &shifts);
                // As in `sliding_mean`: 2 (2^L word − mean) − c, which the shift rounds down to the same.
                let difference = beat.word.shift_left(power as usize + 1);
                let difference = difference - stored.unsigned().concat(beat.odd).signed();
                let (base, moved) = (k.delay("base", stored), k.delay("moved", difference.shift_right_by(shift)));
                let half = (base.unsigned().concat(k.constant(1, 1)).signed() + moved).slice(1, wide);
                k.wire("next", half)
            })
        };
        let next: Vec<Expr<'k>> = self.mean.averages.iter().enumerate().map(follow).collect();
        let (sample, recent) = (k.delay("sample", beat.word), k.delay("recent", before));
        let second = (beat.word + earlier) - before.shift_left(1).extend(self.bits + 1);
        let second = second.shift_right(self.mean.shifts[1] as usize);
        let (second, _) = saturated(k, second, self.mean.second_bits(self.bits as u32) as usize);
        let second = k.delay("second", self.of_live(k, beat, 0, second));
        let kept: Vec<Expr<'k>> =
            [recent.unsigned(), sample.unsigned()].into_iter().chain(next.iter().rev().copied()).collect();
        (next, second.signed(), concat(&kept))
    }

    /// A word, or 0 of a dead taxel whose beat is at stage `stage`.
    fn of_live<'k>(&self, k: &'k Builder, beat: &Beat<'k>, stage: usize, word: Expr<'k>) -> Expr<'k> {
        beat.live.map_or(word, |live| live.at(stage).mux(word, k.constant(word.bits(), 0)))
    }

    /// The sums of the squares of a frame.
    fn sums<'k>(&self, k: &'k Builder, beat: &Beat<'k>, next: &[Expr<'k>], second: Expr<'k>) -> Sums<'k> {
        let more = count_bits(self.taxels() + 1);
        let sum = |name: &str, square: Expr<'k>, stage: usize| {
            let net = k.register(name, Type::unsigned(square.bits() + more));
            let before = beat.first.at(stage).mux(k.constant(net.bits(), 0), *net);
            k.when(beat.valid.at(stage), || net.set((before + square.extend(net.bits())).low(net.bits())));
            net
        };
        let square = |name: &str, factor: Expr<'k>| k.delay(name, (factor * factor).low(2 * factor.bits() - 1));
        let spread = sum("spread", square("second_square", second), 2);
        let means: Vec<Expr<'k>> = next
            .iter()
            .zip(&self.mean.averages)
            .map(|(next, k_of)| k.delay(&format!("mean_{k_of}"), next.signed()))
            .collect();
        let squares = self.mean.judged().enumerate().map(|(index, (window, _))| {
            k.scope(&format!("window_{index}_"), || {
                let value = self.value(&means, window);
                let bits = self.mean.apart_bits(window, self.bits as u32) as usize;
                let apart = (value - means[0]).shift_right(self.mean.shifts[0] as usize);
                let (apart, _) = saturated(k, apart, bits);
                let apart = k.delay("apart", self.of_live(k, beat, 2, apart)).signed();
                sum("sum", square("square", apart), 4)
            })
        });
        Sums { squares: squares.collect(), spread }
    }

    /// The word of a window of these means.
    fn value<'k>(&self, means: &[Expr<'k>], window: MeanWindow) -> Expr<'k> {
        match self.mean.means(window) {
            (short, None) => means[short],
            (short, Some((long, shift))) => {
                let apart = means[short] - means[long];
                extrapolated(means[short], apart, apart.shift_right(shift as usize))
            }
        }
    }

    /// Judges a full frame: the level, then one window after the other.
    fn judge<'k>(&self, k: &'k Builder, resets: Resets<'k>, frame: &Frame<'k>, sums: &Sums<'k>) {
        let (rst, bit) = (resets.rst, Type::unsigned(1));
        let bits = FACTOR_BITS as usize;
        k.comment("Cycles until the sums are complete; the window that is judged, digits of its factor.");
        let cycles = k.state("cycles", Type::unsigned(count_bits(SUM_LATENCY as usize - 1)), rst, 0);
        let judging = k.state("judging", bit, rst, 0);
        let window = k.register("window", Type::unsigned(frame.chosen.bits()));
        let digit = k.register("digit", Type::unsigned(count_bits(bits + 1)));
        let found = k.register("found", bit);
        let settled = k.wire("settled", *frame.settling & cycles.is(u64::from(SUM_LATENCY) - 2));
        let level = self.level(k, resets, frame, *sums.spread, settled);
        let factors: Vec<u64> = self.mean.factors.iter().map(|factor| u64::from(*factor)).collect();
        let indices = 1 << window.bits();
        let padded = |words: &[u64]| [words, &vec![0; indices - words.len()]].concat();
        let after = window.table(bits, &padded(&factors[1..]));
        let factor = k.register("factor", Type::unsigned(bits));
        let product = k.register("product", Type::unsigned(level.bits() + bits));
        let done = k.wire("done", digit.is(bits as u64));
        let counts_from: Vec<u64> = self.mean.judged().map(|(window, _)| window.counts_from() as u64).collect();
        let from = window.table(frame.count.bits(), &padded(&counts_from));
        let arms: Vec<(u64, Expr<'k>)> = (0..).zip(sums.squares.iter().map(|sum| **sum)).collect();
        let widest = sums.squares.iter().map(|sum| sum.bits()).max().unwrap_or(1);
        let arms: Vec<(u64, Expr<'k>)> = arms.into_iter().map(|(index, sum)| (index, sum.extend(widest))).collect();
        let square = k.wire("square", window.case(&arms[1..], arms[0].1));
        let (up, down) = (self.mean.factor_shift.max(0) as usize, (-self.mean.factor_shift).max(0) as usize);
        let exceeds = product.shift_left(down).less(square.shift_left(up));
        let early = frame.count.less(from) | !k.constant(frame.count.bits(), FRAMES_BEFORE as u64).less(frame.count);
        let agrees = k.wire("agrees", !exceeds & !early);
        k.when(*frame.settling, || cycles.set(settled.mux(k.constant(cycles.bits(), 0), cycles.plus(1))));
        k.when(settled, || {
            frame.settling.set(k.constant(1, 0));
            judging.set(k.constant(1, 1));
            window.set(k.constant(window.bits(), 0));
            digit.set(k.constant(digit.bits(), 0));
            found.set(k.constant(1, 0));
            factor.set(k.constant(bits, factors[0]));
            product.set(k.constant(product.bits(), 0));
            frame.chosen.set(k.constant(frame.chosen.bits(), factors.len() as u64));
        });
        k.when(*judging, || {
            let added = factor.top().mux(level, k.constant(level.bits(), 0));
            let more = (product.shift_left(1) + added.extend(product.bits() + 1)).low(product.bits());
            product.set(done.mux(k.constant(product.bits(), 0), more));
            factor.set(done.mux(after, factor.low(bits - 1).concat(k.constant(1, 0))));
            digit.set(done.mux(k.constant(digit.bits(), 0), digit.plus(1)));
            k.when(done, || {
                window.set(window.plus(1));
                found.set(*found | agrees);
                k.when(agrees & !*found, || frame.chosen.set(*window));
                k.when(window.is(factors.len() as u64 - 1), || {
                    judging.set(k.constant(1, 0));
                    frame.sending.set(k.constant(1, 1));
                });
            });
        });
    }

    /// S̃ of the frame's array, which the frame moves once its sums have `settled`.
    fn level<'k>(
        &self,
        k: &'k Builder,
        resets: Resets<'k>,
        frame: &Frame<'k>,
        spread: Expr<'k>,
        settled: Expr<'k>,
    ) -> Expr<'k> {
        let run_bits = count_bits(SAME_SIDE as usize);
        k.comment("Level of the second differences: half of the frames are above it; frames on the same side of it.");
        let levels = self.arrays.state(k, "level", Type::unsigned(spread.bits() + 1), resets, 0);
        let sides = self.arrays.state(k, "side", Type::unsigned(1), resets, 0);
        let runs = self.arrays.state(k, "run", Type::unsigned(run_bits), resets, 0);
        let [level, side, run] = [&levels, &sides, &runs].map(|states| states.of(frame.array));
        let above = k.wire("above", level.less(spread.extend(level.bits())));
        let same = k.wire("same", !(side ^ above));
        let first = frame.count.is(FRAMES_BEFORE as u64 + 1);
        let restarts = k.wire("restarts", first | same & run.is(u64::from(SAME_SIDE) - 1));
        let step = level.shift_right(LEVEL_SHIFT as usize).extend(level.bits());
        let moved = above.mux((level + step).low(level.bits()), (level - step).low(level.bits()));
        let counts = k.constant(frame.count.bits(), FRAMES_BEFORE as u64).less(frame.count);
        k.when(settled & counts, || {
            levels.set(k, frame.array, restarts.mux(spread.extend(level.bits()), moved));
            sides.set(k, frame.array, !restarts & above);
            let next = same.mux(run.plus(1), k.constant(run_bits, 1));
            runs.set(k, frame.array, restarts.mux(k.constant(run_bits, 0), next));
        });
        level
    }

    /// The words of the chosen window, two stages behind what is `stored`; whether there is one, and whether it is the last.
    fn window<'k>(
        &self,
        k: &'k Builder,
        rst: Expr<'k>,
        frame: &Frame<'k>,
        stored: Expr<'k>,
        moves: Expr<'k>,
    ) -> (Expr<'k>, Expr<'k>, Expr<'k>) {
        let (wide, bit) = (self.wide(), Type::unsigned(1));
        let [read, picked] = ["read", "picked"].map(|name| k.state(name, bit, rst, 0));
        let [final_read, final_picked] = ["final_read", "final_picked"].map(|name| k.register(name, bit));
        let ends = k.wire("ends", frame.sent.is(self.taxels() as u64 - 1));
        let mean = |index: usize| stored.slice(index * wide, wide).signed();
        let by_window = |of: &dyn Fn(MeanWindow) -> Expr<'k>| {
            let arms: Vec<(u64, Expr<'k>)> = (0..).zip(self.mean.windows.iter().map(|window| of(*window))).collect();
            frame.chosen.case(&arms[1..], arms[0].1)
        };
        let pair = |window: MeanWindow| self.mean.means(window);
        let short = by_window(&|window| mean(pair(window).0));
        let long = by_window(&|window| mean(pair(window).1.map_or(pair(window).0, |(long, _)| long)));
        let most = count_bits(self.mean.longest() as usize);
        let shift = by_window(&|window| k.constant(most, pair(window).1.map_or(0, |(_, shift)| u64::from(shift))));
        let held = |name: &str, value: Expr<'k>| {
            let net = k.register(name, value.ty());
            k.when(moves, || net.set(value));
            *net
        };
        let (short, long) = (held("short", short), held("long", long));
        let apart = short - long;
        let (value, _) = saturated(k, extrapolated(short, apart, apart.shift_right_by(shift)), wide);
        k.when(moves, || {
            read.set(*frame.sending);
            final_read.set(ends);
            picked.set(*read);
            final_picked.set(*final_read);
            k.when(*frame.sending, || {
                frame.sent.set(frame.sent.plus(1));
                k.when(ends, || frame.sending.set(k.constant(1, 0)));
            });
        });
        (value, *picked, *final_picked)
    }
}

/// a + (a − b) − ⌊(a − b) / 2^k⌋ of a, a − b and ⌊(a − b) / 2^k⌋; it is within three times the range of a.
fn extrapolated<'k>(short: Expr<'k>, apart: Expr<'k>, shifted: Expr<'k>) -> Expr<'k> {
    let bits = short.bits() + 2;
    ((short + apart) - shifted.extend(apart.bits() + 1)).low(bits).signed()
}
