//! Stage `choose`: the case that solves a frame, decided while the frame is received.
//!
//! Four cycles: position and magnitude of a code, maxima, limit for a contact, choice.

use dermis_golden::fixed::stages::choose::{is_beside_boundary, quarters, CUT_SHIFT};
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Grid;
use dermis_golden::spec::scene::Condition;
use dermis_golden::spec::sensor::Sensor;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::count_bits;

block! {
    /// Monitors the accepted codes. `case_index` is valid with `settled`, from four cycles after the frame's last code until
    /// `free`, and keeps its value until the next choice.
    pub struct Choose {
        sensor: Sensor,
        /// Subarrays of each case.
        grids: Vec<Grid>,
        condition: Condition,
        /// Noise floor in codes.
        floor: i32,
        /// Width of a code.
        bits: usize,
    }
    ports ChoosePorts {
        clock;
        reset;
        /// A code, `input_bits` wide, two's complement; valid with `accept`.
        in code: bits;
        /// A code is accepted in this cycle.
        in accept;
        /// The code has `tlast`, which before the end of the frame drops the frame; valid with `accept`.
        in tlast;
        /// The frame has been read: clears `settled`.
        in free;
        /// Index of the chosen case; valid with `settled`.
        out case_index: count_bits(grids.len());
        /// The choice for the frame in the buffer is complete.
        out settled;
    }
}

impl Choose {
    /// For the cases of `model`.
    pub fn new(model: &Model) -> Self {
        let bits = model.formats().input_bits as usize;
        Choose {
            sensor: model.scene.sensor.clone(),
            grids: model.grids(),
            condition: model.scene.partition.condition,
            // A floor beyond the code's range is clamped to its end, which no code exceeds either.
            floor: model.noise_floor().min((1 << (bits - 1)) - 1),
            bits,
        }
    }
}

impl Block for Choose {
    fn build<'k>(&self, k: &'k Builder, io: ChoosePorts<Inside<'k>>) {
        let ChoosePorts { rst, code, accept, tlast, free, .. } = io;
        let bit = Type::unsigned(1);
        let (rows, cols, magnitude_bits) = (self.sensor.rows, self.sensor.cols, self.bits - 1);
        let magnitude = Type::unsigned(magnitude_bits);

        let [line_end, frame_end, restart, last3] =
            ["line_end", "frame_end", "restart", "last3"].map(|name| match name {
                "last3" => k.register(name, bit),
                _ => k.net(name, bit),
            });
        let row = k.state("row", Type::unsigned(count_bits(rows)), *restart, 0);
        let col = k.state("col", Type::unsigned(count_bits(cols)), *restart, 0);
        line_end.set(col.is(cols as u64 - 1));
        frame_end.set(*line_end & row.is(rows as u64 - 1));
        restart.set(rst | accept & tlast & !*frame_end);
        k.when(accept, || {
            col.set(line_end.mux(k.constant(col.bits(), 0), col.plus(1)));
            k.when(*line_end, || row.set(frame_end.mux(k.constant(row.bits(), 0), row.plus(1))));
        });

        k.comment("Position and magnitude of a code");
        let forget = k.wire("forget", *restart | *last3);
        let valid1 = k.delay("valid1", accept & !*restart);
        let last1 = k.delay("last1", accept & *frame_end & !rst);
        let last2 = k.delay("last2", last1 & !rst);
        last3.set(last2 & !rst);
        let magnitude1 = k.delay("magnitude1", code.low(magnitude_bits) ^ code.top().repeat(magnitude_bits));
        let rows1 = k.delay("rows1", beside(k, *row, rows));
        let cols1 = k.delay("cols1", beside(k, *col, cols));

        k.comment("Maxima");
        let [peak, middle_rows, middle_cols] =
            ["peak", "middle_rows", "middle_cols"].map(|name| k.state(name, magnitude, forget, 0));
        for (most, counts) in [(peak, None), (middle_rows, Some(rows1)), (middle_cols, Some(cols1))] {
            let larger = most.less(magnitude1);
            let takes = counts.map_or(larger, |counts| counts & larger);
            k.when(valid1 & takes, || most.set(magnitude1));
        }
        let signs = (self.condition != Condition::Loaded).then(|| signs(k, self, [*row, *col, code, valid1, forget]));

        k.comment("Limit for a contact, choice");
        let share = peak.shift_right(CUT_SHIFT as usize).extend(magnitude_bits);
        let floor = k.constant(magnitude_bits, self.floor.max(0) as u64);
        let limit = k.delay("limit", if self.floor > 0 { floor.less(share).mux(share, floor) } else { share });
        let cut_rows = k.wire("cut_rows", limit.less(*middle_rows));
        let cut_cols = k.wire("cut_cols", limit.less(*middle_cols));
        let which_bits = count_bits(self.grids.len());
        let choice =
            self.grids.iter().enumerate().skip(1).rev().fold(k.constant(which_bits, 0), |other, (case, grid)| {
                let cut = match (grid.rows > 1, grid.cols > 1) {
                    (true, true) => cut_rows | cut_cols,
                    (true, false) => cut_rows,
                    _ => cut_cols,
                };
                let refused = signs.map_or(cut, |signs| cut | differ(signs, *grid));
                (!refused).mux(k.constant(which_bits, case as u64), other)
            });
        let case_index = io.case_index.register();
        k.when(*last3, || case_index.set(choice));
        let settled = io.settled.register();
        settled.set((*settled | *last3) & !free & !rst);
    }
}

/// Whether `line` of `lines` is beside the boundary in the middle; 1 bit.
fn beside<'k>(k: &'k Builder, line: Expr<'k>, lines: usize) -> Expr<'k> {
    let mut all = (0..lines).filter(|&line| is_beside_boundary(line, lines));
    let first = all.next().unwrap_or(0);
    let last = all.next_back().unwrap_or(first);
    let at = |number: usize| k.constant(line.bits(), number as u64);
    let within =
        (first > 0).then(|| !line.less(at(first))).into_iter().chain((last + 1 < lines).then(|| !at(last).less(line)));
    within.reduce(|a, b| a & b).unwrap_or(k.constant(1, 1))
}

/// For each quarter of the array a bit: a code was above the noise floor, a code was below its negative.
fn signs<'k>(k: &'k Builder, rule: &Choose, [row, col, code, valid1, forget]: [Expr<'k>; 5]) -> [Expr<'k>; 2] {
    let half = |line: Expr<'k>, lines: usize| !line.less(k.constant(line.bits(), lines.div_ceil(2) as u64));
    let quarter1 = k.delay("quarter1", half(row, rule.sensor.rows).concat(half(col, rule.sensor.cols)));
    let quarter = k.constant(4, 1).shift_left_by(quarter1);
    let floor = i64::from(rule.floor);
    let above = k.signed_constant(rule.bits, floor).less(code.signed());
    let below = code.signed().less(k.signed_constant(rule.bits, -floor));
    [("above", above), ("below", below)].map(|(name, beyond)| {
        let beyond1 = k.delay(&format!("{name}1"), beyond);
        let seen = k.state(name, Type::unsigned(4), forget, 0);
        k.when(valid1 & beyond1, || seen.set(*seen | quarter));
        *seen
    })
}

/// Whether a loaded subarray of a case has codes of one sign only.
fn differ<'k>([above, below]: [Expr<'k>; 2], grid: Grid) -> Expr<'k> {
    let any = |signs: Expr<'k>, part: &[usize]| {
        concat(&part.iter().map(|&quarter| signs.at(quarter)).collect::<Vec<_>>()).any()
    };
    let parts = quarters(grid);
    let unmet = concat(&parts.iter().map(|part| any(above, part) ^ any(below, part)).collect::<Vec<_>>());
    unmet.any()
}

#[cfg(test)]
pub(crate) mod tests {
    use dermis_golden::fixed::stages::choose::FrameStats;
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::testbench::{check, subject_of, Reference};
    use crate::wire::Word;

    const BITS: usize = 12;

    /// The choice of the bit-true model, with the cycles that it takes.
    pub(crate) struct Expected<'a> {
        rule: &'a Choose,
        index: usize,
        seen: FrameStats,
        /// Edges until the choice, while a frame is complete.
        left: Option<usize>,
        case_index: Option<u64>,
        settled: Option<bool>,
    }

    impl<'a> Expected<'a> {
        pub(crate) fn new(rule: &'a Choose) -> Self {
            Expected { rule, index: 0, seen: FrameStats::default(), left: None, case_index: None, settled: None }
        }

        /// A frame is complete and has not been read.
        fn full(&self) -> bool {
            self.left.is_some() || self.settled == Some(true)
        }
    }

    impl Reference for Expected<'_> {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            vec![self.case_index.map(Word::from), self.settled.map(Word::from)]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, accept, tlast, free] = [0, 1, 2, 3].map(|k| inputs[k].number() == 1);
            let rule = self.rule;
            if rst {
                *self = Expected { case_index: self.case_index, settled: Some(false), ..Expected::new(rule) };
                return;
            }
            let chosen = self.left == Some(1);
            if chosen {
                self.case_index = Some(self.seen.choose(&rule.grids, rule.condition, rule.floor) as u64);
                self.seen = FrameStats::default();
            }
            self.settled = self.settled.map(|settled| (settled || chosen) && !free);
            self.left = self.left.map(|left| left - 1).filter(|left| *left > 0);
            if accept {
                let code = inputs[4].signed(0, rule.bits) as i32;
                self.seen.add(&rule.sensor, self.index, code, rule.floor);
                self.index += 1;
                if self.index == rule.sensor.taxels() {
                    (self.index, self.left) = (0, Some(3));
                } else if tlast {
                    (self.index, self.seen) = (0, FrameStats::default());
                }
            }
        }
    }

    /// Codes of sparse contacts with gaps; early `tlast`, resets, a buffer that stays full for a while.
    fn stimulus(rule: &Choose, cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(6);
        let mut state = Expected::new(rule);
        let mut all = Vec::new();
        let mut size = 1;
        for cycle in 0..cycles {
            let rst = cycle < 2 || random.u16(..3000) == 0;
            let settled = state.settled == Some(true);
            if state.index == 0 {
                size = 1 << random.u32(2..BITS as u32 - 1);
            }
            let code = if random.u8(..8) == 0 { random.i64(-size..size) } else { random.i64(-2..2) };
            let bits = [
                rst,
                !rst && !state.full() && random.u8(..8) > 0,
                random.u16(..200) == 0,
                !rst && settled && random.u8(..4) == 0,
            ];
            let inputs = [&bits.map(Word::from)[..], &[Word::of_fields(&[code], BITS)]].concat();
            state.clock(&inputs);
            all.push(inputs);
        }
        all
    }

    #[test]
    fn the_choice_is_that_of_the_bit_true_model() {
        let sensor = Scene::builtin("eight-by-eight").unwrap().sensor;
        let grid = |rows, cols| Grid { rows, cols };
        let all = vec![grid(1, 1), grid(2, 2), grid(1, 2), grid(2, 1)];
        for (condition, floor, grids) in [
            (Condition::Loaded, 0, all.clone()),
            (Condition::BothSigns, 9, all),
            (Condition::BothSigns, 0, vec![grid(1, 1), grid(2, 1)]),
        ] {
            let rule = Choose { sensor: sensor.clone(), grids, condition, floor, bits: BITS };
            let subject =
                subject_of!(rule, &[], inputs [rst, accept, tlast, free, code], outputs [case_index, settled]);
            check(subject, &stimulus(&rule, 30_000), &mut Expected::new(&rule));
        }
    }
}
