//! Sums per subarray or label in place of a force per taxel.

use dermis_golden::fixed::stages::resultants::{Summed, POSITION_BITS, SUM_BITS};
use dermis_golden::fixed::words::formats::FORCE_BITS;
use dermis_golden::fixed::Model;
use dermis_golden::spec::partition::Grid;
use dermis_golden::spec::sensor::Sensor;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Net, Type};
use crate::primitives::{count_bits, Stream};

block! {
    /// ```text
    /// s_axis (forces, row-major; status) --> moments --> sums of each subarray or label --> m_axis (sums; status)
    /// ```
    /// One force is accepted per cycle. The sums start to leave four cycles after the last force, then the status beats
    /// pass through.
    ///
    /// Where each contact has a μ of its own, a force comes with the label of its taxel, and the taxels of a label are counted.
    pub struct Resultants {
        parts: Parts,
        sensor: Sensor,
    }
    ports ResultantsPorts {
        clock;
        reset;
        /// `{fz, fy, fx}` of a taxel, 32 bits signed each, with contacts above them its label, or a status beat; valid with
        /// `s_axis_tvalid`.
        sink<Stream> s_axis: parts.force_bits();
        /// A beat of sums, or a status beat, 96 bits; valid with `m_axis_tvalid`.
        source<Stream> m_axis: 3 * WORD;
    }
}

/// Width of a component of a force, in bits.
const WORD: usize = FORCE_BITS as usize;
/// Width of a coordinate in half pitches with its sign, in bits.
const PLACE: usize = POSITION_BITS as usize + 1;
/// Width of a sum on the stream, in bits.
const WIDE: usize = 64;

/// What tells to which sums a force is added.
#[derive(Clone, Copy, Debug)]
enum Parts {
    /// The subarray of its taxel.
    Subarrays(Grid),
    /// Its label, one of so many.
    Labels(usize),
}

impl Parts {
    fn summed(self) -> Summed {
        match self {
            Parts::Subarrays(_) => Summed::Subarray,
            Parts::Labels(_) => Summed::Label,
        }
    }

    /// Subarrays along rows and columns.
    fn grid(self) -> Grid {
        match self {
            Parts::Subarrays(grid) => grid,
            Parts::Labels(_) => Grid { rows: 1, cols: 1 },
        }
    }

    /// Number of records.
    fn count(self) -> usize {
        match self {
            Parts::Subarrays(grid) => grid.rows * grid.cols,
            Parts::Labels(count) => count,
        }
    }

    /// Width of a beat of a force.
    fn force_bits(self) -> usize {
        match self {
            Parts::Subarrays(_) => 3 * WORD,
            Parts::Labels(count) => 3 * WORD + count_bits(count),
        }
    }
}

impl Resultants {
    /// The records of `model`; none of a scene that asks for a force per taxel.
    pub fn of_model(model: &Model) -> Option<Self> {
        let parts = match model.summed()? {
            Summed::Subarray => Parts::Subarrays(model.grid()),
            Summed::Label => Parts::Labels(model.records()),
        };
        Some(Resultants { parts, sensor: model.scene.sensor.clone() })
    }
}

impl Block for Resultants {
    fn build<'k>(&self, k: &'k Builder, io: ResultantsPorts<Inside<'k>>) {
        sums(k, io, &self.sensor, self.parts);
    }
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

/// What is summed of a force, two cycles after it is taken from `data`, at this place, [x, y]: the force, and its products; those with fz⁺
/// are 0 for a taxel in tension.
fn values<'k>(k: &'k Builder, data: Expr<'k>, summed: Summed, place: [Expr<'k>; 2]) -> Vec<Expr<'k>> {
    k.comment("A force and its products; those with fz⁺ are 0 for a taxel in tension.");
    let component = |n: usize| data.slice(n * WORD, WORD).signed();
    let once = ["fx_1", "fy_1", "fz_1"].into_iter().enumerate().map(|(n, name)| k.delay(name, component(n)));
    let once: Vec<Expr> = once.collect();
    let force = [("fx", once[0]), ("fy", once[1]), ("fz", once[2])].map(|(name, value)| k.delay(name, value));
    let places = [("x_1", place[0]), ("y_1", place[1])].map(|(name, place)| k.delay(name, place));
    let moment = |name: &str, force: usize, axis: usize| k.delay(name, once[force] * places[axis]);
    let moments = [moment("moment_x", 2, 0), moment("moment_y", 2, 1)];
    let tension = k.delay("tension", once[2].top());
    let mut values: Vec<Expr> = force.to_vec();
    let pressing = [force[2], moments[0], moments[1]];
    values.extend(pressing.map(|value| tension.mux(k.signed_constant(value.bits(), 0), value)));
    if summed == Summed::Label {
        values.extend(moments);
        values.extend([moment("shear_x", 1, 0), moment("shear_y", 0, 1)]);
    }
    values
}

/// The taxel of the next force.
struct Taxel<'k> {
    /// Row and column of its subarray.
    part: [Lines<'k>; 2],
    /// Coordinates x and y in half pitches.
    place: [Expr<'k>; 2],
    /// Its force is taken in this cycle.
    take: Expr<'k>,
    is_last: Expr<'k>,
}

impl<'k> Taxel<'k> {
    /// Moves on with each force that is `valid`, until `counting` ends with the last one.
    fn new(k: &'k Builder, sensor: &Sensor, grid: Grid, restart: Expr<'k>, counting: Net<'k>, valid: Expr<'k>) -> Self {
        k.comment("The taxel of the next force: row and column in its subarray, and of its subarray.");
        let col = Lines::new(k, "col", sensor.cols / grid.cols, restart);
        let part_col = Lines::new(k, "part_col", grid.cols, restart);
        let row = Lines::new(k, "row", sensor.rows / grid.rows, restart);
        let part_row = Lines::new(k, "part_row", grid.rows, restart);
        let line_last = k.wire("line_last", col.is_last & part_col.is_last);
        let is_last = k.wire("last_force", line_last & row.is_last & part_row.is_last);
        let take = k.wire("take", *counting & valid);
        let start_of = |lines: usize| 1 - lines as i64;
        let axis = |name: &str, lines: usize| {
            let start = start_of(lines) as u64 & ((1 << PLACE) - 1);
            k.state(name, Type::signed(PLACE), restart, start)
        };
        let (x, y) = (axis("x", sensor.cols), axis("y", sensor.rows));
        let pitch = k.signed_constant(PLACE, 2);
        k.when(take, || {
            col.step(k);
            x.set(line_last.mux(k.signed_constant(PLACE, start_of(sensor.cols)), (*x + pitch).resize(PLACE)));
            k.when(col.is_last, || part_col.step(k));
            k.when(line_last, || {
                y.set((*y + pitch).resize(PLACE));
                row.step(k);
                k.when(row.is_last, || part_row.step(k));
            });
            k.when(is_last, || counting.set(k.constant(1, 0)));
        });
        Taxel { part: [part_row, part_col], place: [*x, *y], take, is_last }
    }

    /// The number of the sums to which its force, on `data`, is added.
    fn part(&self, k: &'k Builder, parts: Parts, data: Expr<'k>) -> Expr<'k> {
        let (count, bits) = (parts.count(), count_bits(parts.count()));
        match parts {
            Parts::Labels(_) => data.slice(3 * WORD, bits),
            Parts::Subarrays(grid) => {
                k.comment("The index of the subarray as a table, in place of a product.");
                let [row, col] = [0, 1].map(|axis| *self.part[axis].count);
                let index = |part: usize| {
                    let (i, j) = (part / grid.cols, part % grid.cols);
                    ((i << col.bits() | j) as u64, k.constant(bits, part as u64))
                };
                let arms: Vec<(u64, Expr)> = (0..count).map(index).collect();
                k.wire("part", row.concat(col).case(&arms, k.constant(bits, 0)))
            }
        }
    }
}

fn sums<'k>(k: &'k Builder, io: ResultantsPorts<Inside<'k>>, sensor: &Sensor, parts: Parts) {
    let (count, part_bits, summed) = (parts.count(), count_bits(parts.count()), parts.summed());
    let rst = io.rst;
    let (data, valid, last) = (io.s_axis.data, io.s_axis.valid, io.s_axis.last);
    let ready = io.m_axis.ready;
    let (bit, one, zero) = (Type::unsigned(1), k.constant(1, 1), k.constant(1, 0));
    let restart = k.net("restart", bit);
    let counting = k.state("counting", bit, *restart, 1);
    let sending = k.state("sending", bit, *restart, 0);
    let later = |name: &str, value| {
        let state = k.state(name, bit, *restart, 0);
        state.set(value);
        *state
    };

    let taxel = Taxel::new(k, sensor, parts.grid(), *restart, counting, valid);
    let part = taxel.part(k, parts, data);
    let part_2 = k.delay("part_2", k.delay("part_1", part));
    let values = values(k, data, summed, taxel.place);

    let adds = later("valid_2", later("valid_1", taxel.take));
    let settling = later("settling_1", taxel.take & taxel.is_last);
    let settling = [settling, later("settling_2", settling)];
    let settled = later("settling_3", settling[1]);
    k.comment("The sums of each part; before its first force they are 0.");
    let part_out = k.state("part_out", Type::unsigned(part_bits), *restart, 0);
    let at = k.wire("at", sending.mux(*part_out, part_2));
    let begun = k.state("begun", Type::unsigned(count), *restart, 0);
    let begins = |part: usize| begun.at(part) | (adds & part_2.is(part as u64));
    begun.set(concat(&(0..count).rev().map(begins).collect::<Vec<_>>()));
    let has_begun = pick(at, &(0..count).map(|part| begun.at(part)).collect::<Vec<_>>());
    let has_begun = k.wire("has_begun", has_begun);
    let part_memory = |name: &str, bits: usize| {
        let memory = k.memory(name, count, bits, Contents::Undefined);
        let present = k.wire(&format!("{name}_now"), memory.read(at) & has_begun.repeat(bits));
        (memory, present)
    };
    let sum = |(n, value): (usize, &Expr<'_>)| {
        let (memory, present) = part_memory(&format!("sum_{n}"), SUM_BITS as usize);
        let present = present.signed();
        memory.write(adds, part_2, (present + *value).resize(SUM_BITS as usize).unsigned());
        present.extend(WIDE).unsigned()
    };
    let mut all: Vec<Expr> = values.iter().enumerate().map(sum).collect();
    if summed.counts() {
        let (memory, present) = part_memory("taxels", count_bits(sensor.taxels() + 1));
        memory.write(adds, part_2, present.plus(1));
        all.push(present.extend(WORD));
    }
    all.reverse();
    let all = k.wire("all", concat(&all));

    let beat = Lines::new(k, "beat", summed.beats(), *restart);
    let now: Vec<Expr> = (0..summed.beats()).map(|n| all.slice(n * 3 * WORD, 3 * WORD)).collect();
    let sent = k.wire("sent", *sending & ready);
    k.when(settled, || sending.set(one));
    k.when(sent, || {
        beat.step(k);
        k.when(beat.is_last, || {
            part_out.set(part_out.plus(1));
            k.when(part_out.is(count as u64 - 1), || sending.set(zero));
        });
    });
    let passing = k.wire("passing", !(*counting | settling[0] | settling[1] | settled | *sending));
    let finish = k.wire("finish", passing & valid & ready & last);
    restart.set(rst | finish);
    io.s_axis.ready.set(*counting | (passing & ready));
    io.m_axis.valid.set(*sending | (passing & valid));
    io.m_axis.last.set(passing & last);
    io.m_axis.data.set(sending.mux(pick(*beat.count, &now), data.low(3 * WORD)));
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::resultants::{half_pitches, Record};
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// Cycles from the last force to complete sums.
    const SETTLE: usize = 3;

    /// Adds up each force as it is taken.
    struct Sums {
        sensor: Sensor,
        parts: Parts,
        reset: bool,
        taxel: usize,
        /// Remaining cycles until the sums are complete.
        settling: usize,
        /// Index of the next beat of sums.
        beat: usize,
        records: Vec<Record>,
    }

    impl Sums {
        fn restart(&mut self) {
            (self.taxel, self.settling, self.beat) = (0, 0, 0);
            self.records.fill(Record::default());
        }

        fn counting(&self) -> bool {
            self.taxel < self.sensor.taxels()
        }

        /// Number of beats of sums.
        fn beats(&self) -> usize {
            self.parts.summed().beats() * self.records.len()
        }

        fn sending(&self) -> bool {
            !self.counting() && self.settling == 0 && self.beat < self.beats()
        }

        fn passing(&self) -> bool {
            !self.counting() && self.settling == 0 && self.beat == self.beats()
        }

        fn add(&mut self, data: &Word) {
            let (sensor, taxel) = (&self.sensor, self.taxel);
            let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
            let part = match self.parts {
                Parts::Labels(count) => data.field(3 * WORD, count_bits(count)) as usize,
                Parts::Subarrays(Grid { rows, cols }) => row / (sensor.rows / rows) * cols + col / (sensor.cols / cols),
            };
            let force = [0, 1, 2].map(|n| data.signed(n, WORD) as i32);
            self.records[part].add(half_pitches(sensor, taxel), force);
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
                    let (summed, beats) = (self.parts.summed(), self.parts.summed().beats());
                    let words = self.records[self.beat / beats].beats(summed)[self.beat % beats];
                    Word::of_fields(&words.map(i64::from), WORD)
                }
                false => Word::of_fields(&[0, 1, 2].map(|n| inputs[1].signed(n, WORD)), WORD),
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

    fn are_those_of_the_model(rows: usize, cols: usize, parts: Parts) {
        let text = format!(
            "name = \"sums\"\n[sensor]\nrows = {rows}\ncols = {cols}\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n"
        );
        let sensor = Scene::parse(&text, "sums.toml").unwrap().sensor;
        let block = Resultants { parts, sensor: sensor.clone() };
        let mut random = fastrand::Rng::with_seed(12);
        let inputs = |cycle: usize| {
            let mut fields = [(); 3].map(|()| random.i64(..) >> random.u8(32..64)).to_vec();
            if let Parts::Labels(count) = parts {
                // Large labels are seldom, so that there are records without a taxel.
                let most = random.usize(..count);
                fields.push(random.usize(..=most) as i64);
            }
            vec![
                (cycle < 2 || random.u16(..400) == 0).into(),
                Word::of_fields(&fields, WORD),
                (random.u8(..4) > 0).into(),
                (random.u8(..4) == 0).into(),
                (random.u8(..4) > 0).into(),
            ]
        };
        let stimulus: Vec<Vec<Word>> = (0..6000).map(inputs).collect();
        let records = vec![Record::default(); parts.count()];
        let mut reference = Sums { sensor, parts, reset: false, taxel: 0, settling: 0, beat: 0, records };
        check(&kernel_of(&block), &stimulus, &mut reference);
    }

    #[test]
    fn sums_are_those_of_the_model() {
        are_those_of_the_model(4, 6, Parts::Subarrays(Grid { rows: 2, cols: 3 }));
        are_those_of_the_model(3, 5, Parts::Subarrays(Grid { rows: 1, cols: 1 }));
        are_those_of_the_model(3, 5, Parts::Labels(4));
        are_those_of_the_model(4, 6, Parts::Labels(9));
    }
}
