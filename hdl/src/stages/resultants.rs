//! Sums per subarray in place of a force per taxel.

use dermis_golden::fixed::stages::resultants::{BEATS, POSITION_BITS, SUMS, SUM_BITS};
use dermis_golden::fixed::words::formats::FORCE_BITS;
use dermis_golden::partition::Grid;
use dermis_golden::sensor::Sensor;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Net, Type};
use crate::primitives::count_bits;
use crate::wire::Wire;

/// ```text
/// s_axis (forces, row-major; status) --> X fz⁺, Y fz⁺ --> sums of each subarray --> m_axis (sums; status)
/// ```
/// One force is accepted per cycle. The sums start to leave four cycles after the last force, then the status beats
/// pass through. If the scene asks for a force per taxel, the whole stream passes through on wires.
#[derive(LogicBlock)]
pub struct Resultants {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// `{fz, fy, fx}` of a taxel, 32 bits signed each, or a status beat; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A beat of sums, or a status beat, 96 bits; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    kernel: Body,
}

/// Width of a component of a force, in bits.
const WORD: usize = FORCE_BITS as usize;
/// Width of a coordinate in half pitches with its sign, in bits.
const PLACE: usize = POSITION_BITS as usize + 1;
/// Width of a sum on the stream, in bits.
const WIDE: usize = 64;

kernel_block!(
    Resultants,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
    outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast]
);

impl Resultants {
    /// For the array `sensor` divided into `parts`; if sums are not `wanted`, the stream passes through.
    pub fn new(wanted: bool, sensor: &Sensor, parts: Grid) -> Self {
        let block = Resultants {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(3 * WORD),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(3 * WORD),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            kernel: Body::default(),
        };
        block.bind(if wanted { sums(sensor, parts) } else { pass_through() })
    }
}

/// The stream on wires.
fn pass_through() -> Kernel {
    let k = Builder::new("resultants");
    k.input("rst", 1);
    let (data, valid) = (k.input("s_axis_tdata", 3 * WORD), k.input("s_axis_tvalid", 1));
    let (last, ready) = (k.input("s_axis_tlast", 1), k.input("m_axis_tready", 1));
    k.comment("A force per taxel: the stream passes through.");
    k.wire("s_axis_tready", ready);
    k.wire("m_axis_tdata", data);
    k.wire("m_axis_tvalid", valid);
    k.wire("m_axis_tlast", last);
    k.finish()
}

/// A counter from 0 to `last` that starts again at 0.
struct Lines<'k> {
    count: Net<'k>,
    is_last: Expr<'k>,
}

impl<'k> Lines<'k> {
    fn new(k: &'k Builder, name: &str, limit: usize, restart: Expr<'k>) -> Self {
        let count = k.state(name, Type::unsigned(count_bits(limit)), restart, 0);
        Lines { count, is_last: k.wire(&format!("{name}_last"), count.is(limit as u64 - 1)) }
    }

    fn step(&self, k: &'k Builder) {
        let zero = k.constant(self.count.bits(), 0);
        self.count.set(self.is_last.mux(zero, self.count.plus(1)));
    }
}

/// The one of `values` with number `index`.
fn pick<'k>(index: Expr<'k>, values: &[Expr<'k>]) -> Expr<'k> {
    let arms: Vec<(u64, Expr)> = (1..).zip(values[1..].iter().copied()).collect();
    index.case(&arms, values[0])
}

fn sums(sensor: &Sensor, parts: Grid) -> Kernel {
    let count = parts.rows * parts.cols;
    let (rows, cols) = (sensor.rows / parts.rows, sensor.cols / parts.cols);
    let k = Builder::new("resultants");
    let rst = k.input("rst", 1);
    let (data, valid) = (k.input("s_axis_tdata", 3 * WORD), k.input("s_axis_tvalid", 1));
    let (last, ready) = (k.input("s_axis_tlast", 1), k.input("m_axis_tready", 1));
    let (bit, one, zero) = (Type::unsigned(1), k.constant(1, 1), k.constant(1, 0));
    let restart = k.net("restart", bit);
    let counting = k.state("counting", bit, *restart, 1);
    let sending = k.state("sending", bit, *restart, 0);
    let later = |name: &str, value| {
        let state = k.state(name, bit, *restart, 0);
        state.set(value);
        *state
    };

    k.comment("The taxel of the next force: row and column in its subarray, and of its subarray.");
    let col = Lines::new(&k, "col", cols, *restart);
    let part_col = Lines::new(&k, "part_col", parts.cols, *restart);
    let row = Lines::new(&k, "row", rows, *restart);
    let part_row = Lines::new(&k, "part_row", parts.rows, *restart);
    let line_last = k.wire("line_last", col.is_last & part_col.is_last);
    let last_force = k.wire("last_force", line_last & row.is_last & part_row.is_last);
    let take = k.wire("take", *counting & valid);
    let start_of = |lines: usize| 1 - lines as i64;
    let axis = |name: &str, lines: usize| {
        let start = start_of(lines) as u64 & ((1 << PLACE) - 1);
        k.state(name, Type::signed(PLACE), *restart, start)
    };
    let (x, y) = (axis("x", sensor.cols), axis("y", sensor.rows));
    let pitch = k.signed_constant(PLACE, 2);
    k.when(take, || {
        col.step(&k);
        x.set(line_last.mux(k.signed_constant(PLACE, start_of(sensor.cols)), (*x + pitch).resize(PLACE)));
        k.when(col.is_last, || part_col.step(&k));
        k.when(line_last, || {
            y.set((*y + pitch).resize(PLACE));
            row.step(&k);
            k.when(row.is_last, || part_row.step(&k));
        });
        k.when(last_force, || counting.set(zero));
    });

    k.comment("A force and its products; the index of the subarray as a table, in place of a product.");
    let part_bits = count_bits(count);
    let index = |k_part: usize| {
        let (i, j) = (k_part / parts.cols, k_part % parts.cols);
        let at = (i << part_col.count.bits() | j) as u64;
        (at, k.constant(part_bits, k_part as u64))
    };
    let arms: Vec<(u64, Expr)> = (0..count).map(index).collect();
    let part = k.wire("part", part_row.count.concat(*part_col.count).case(&arms, k.constant(part_bits, 0)));
    let part_2 = k.delay("part_2", k.delay("part_1", part));
    let component = |n: usize| data.slice(n * WORD, WORD).signed();
    let force = ["fx", "fy", "fz"]
        .iter()
        .enumerate()
        .map(|(n, name)| k.delay(name, k.delay(&format!("{name}_1"), component(n))));
    let pressed = k.delay("pressed_1", data.top().mux(k.signed_constant(WORD, 0), component(2)));
    let moments = [("moment_x", "x_1", *x), ("moment_y", "y_1", *y)];
    let moments = moments.map(|(name, held, place)| k.delay(name, pressed * k.delay(held, place)));
    let values: Vec<Expr> = force.chain([k.delay("pressed", pressed)]).chain(moments).collect();

    let adds = later("valid_2", later("valid_1", take));
    let settling = later("settling_1", take & last_force);
    let settling = [settling, later("settling_2", settling)];
    let settled = later("settling_3", settling[1]);
    let part_out = k.state("part_out", Type::unsigned(part_bits), *restart, 0);
    let sum = |n: usize| {
        let one = |part: usize| k.state(&format!("sum_{n}_{part}"), Type::signed(SUM_BITS as usize), *restart, 0);
        let own: Vec<Net> = (0..count).map(one).collect();
        let present: Vec<Expr> = own.iter().map(Net::get).collect();
        let sum = k.wire(&format!("next_{n}"), (pick(part_2, &present) + values[n]).resize(SUM_BITS as usize));
        for (part, own) in own.iter().enumerate() {
            k.when(adds & part_2.is(part as u64), || own.set(sum));
        }
        pick(*part_out, &present).extend(WIDE)
    };
    let all: Vec<Expr> = (0..SUMS).rev().map(sum).collect();
    let all = k.wire("all", concat(&all));

    let quarter = k.state("quarter", Type::unsigned(2), *restart, 0);
    let now: Vec<Expr> = (0..BEATS).map(|n| all.slice(n * 3 * WORD, 3 * WORD)).collect();
    let sent = k.wire("sent", *sending & ready);
    k.when(settled, || sending.set(one));
    k.when(sent, || {
        quarter.set(quarter.plus(1));
        k.when(quarter.is(BEATS as u64 - 1), || {
            part_out.set(part_out.plus(1));
            k.when(part_out.is(count as u64 - 1), || sending.set(zero));
        });
    });
    let passing = k.wire("passing", !(*counting | settling[0] | settling[1] | settled | *sending));
    let finish = k.wire("finish", passing & valid & ready & last);
    restart.set(rst | finish);
    k.wire("s_axis_tready", *counting | (passing & ready));
    k.wire("m_axis_tvalid", *sending | (passing & valid));
    k.wire("m_axis_tlast", passing & last);
    k.wire("m_axis_tdata", sending.mux(pick(*quarter, &now), data));
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::resultants::{beats, half_pitches};
    use dermis_golden::scene::Scene;

    use super::*;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    /// Cycles from the last force to complete sums.
    const SETTLE: usize = 3;

    /// Adds up each force as it is taken.
    struct Sums {
        sensor: Sensor,
        parts: Grid,
        reset: bool,
        taxel: usize,
        /// Remaining cycles until the sums are complete.
        settling: usize,
        /// Index of the next beat of sums.
        beat: usize,
        sums: Vec<[i64; SUMS]>,
    }

    impl Sums {
        fn restart(&mut self) {
            let parts = self.sums.len();
            (self.taxel, self.settling, self.beat, self.sums) = (0, 0, 0, vec![[0; SUMS]; parts]);
        }

        fn counting(&self) -> bool {
            self.taxel < self.sensor.taxels()
        }

        fn sending(&self) -> bool {
            !self.counting() && self.settling == 0 && self.beat < BEATS * self.sums.len()
        }

        fn passing(&self) -> bool {
            !self.counting() && self.settling == 0 && self.beat == BEATS * self.sums.len()
        }

        fn add(&mut self, data: &Word) {
            let (sensor, parts, taxel) = (&self.sensor, self.parts, self.taxel);
            let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
            let part = row / (sensor.rows / parts.rows) * parts.cols + col / (sensor.cols / parts.cols);
            let [x, y] = half_pitches(sensor, taxel);
            let [fx, fy, fz] = [0, 1, 2].map(|n| data.signed(n, WORD));
            let pressed = fz.max(0);
            let values = [fx, fy, fz, pressed, x * pressed, y * pressed];
            self.sums[part].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            self.taxel += 1;
            self.settling = SETTLE;
        }
    }

    impl Reference for Sums {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            if !self.reset {
                return vec![None; 4];
            }
            let [valid, last, ready] = [2, 3, 4].map(|k| inputs[k].number() == 1);
            let data = match self.sending() {
                true => {
                    let words = beats(&self.sums[self.beat / BEATS])[self.beat % BEATS];
                    Word::of_fields(&words.map(i64::from), WORD)
                }
                false => inputs[1],
            };
            vec![
                Some((self.counting() || self.passing() && ready).into()),
                Some((self.sending() || self.passing() && valid).into()),
                Some((self.passing() && last).into()),
                Some(data),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, last, ready] = [0, 2, 3, 4].map(|k| inputs[k].number() == 1);
            if self.counting() {
                if valid {
                    self.add(&inputs[1]);
                }
            } else if self.settling > 0 {
                self.settling -= 1;
            } else if self.sending() {
                self.beat += usize::from(ready);
            } else if valid && ready && last {
                self.restart();
            }
            if rst {
                self.restart();
                self.reset = true;
            }
        }
    }

    fn are_those_of_the_model(rows: usize, cols: usize, parts: Grid) {
        let text = format!(
            "name = \"sums\"\n[sensor]\nrows = {rows}\ncols = {cols}\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"
        );
        let sensor = Scene::parse(&text, "sums.toml").unwrap().sensor;
        let block = Resultants::new(true, &sensor, parts);
        let mut random = fastrand::Rng::with_seed(12);
        let inputs = |cycle: usize| {
            vec![
                (cycle < 2 || random.u16(..400) == 0).into(),
                random_word(&mut random, 3 * WORD),
                (random.u8(..4) > 0).into(),
                (random.u8(..4) == 0).into(),
                (random.u8(..4) > 0).into(),
            ]
        };
        let stimulus: Vec<Vec<Word>> = (0..6000).map(inputs).collect();
        let sums = vec![[0; SUMS]; parts.rows * parts.cols];
        let mut reference = Sums { sensor, parts, reset: false, taxel: 0, settling: 0, beat: 0, sums };
        check(block.kernel.kernel(), &stimulus, &mut reference);
    }

    #[test]
    fn sums_are_those_of_the_model() {
        are_those_of_the_model(4, 6, Grid { rows: 2, cols: 3 });
        are_those_of_the_model(3, 5, Grid { rows: 1, cols: 1 });
    }
}
