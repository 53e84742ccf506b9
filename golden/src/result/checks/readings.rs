//! Readings: what a frame's readings show of the sensor's electronics, whatever engine computes the forces.
//!
//! ```text
//! plateau     (k − 1) ln(D/q)      k equal largest readings, D above all others, q the smallest difference of two readings
//! line share  the largest of       range of a row or column that the next one repeats to the bit
//!                                  range beside rows or columns of one reading: on both sides, or of many steps on one
//! coarse      d/D                  d from the value that most readings have to the bit to the next one, D to the farthest
//! ```
//!
//! Equal readings are those of unloaded taxels: what they would differ by is below a converter's step or in a deadband, and no
//! estimate sees it, as equal readings leave nothing unexplained. Of several frames it is their mean that counts.
//!
//! A reading that falls in steps of q is one of k equal largest by chance with q/D for each beside the first: the plateau is the
//! negative logarithm of a probability. Ranges are relative to that of the frame, so that zeros and offsets do not count. Lines
//! and largest readings that are equal because the frame is its own mirror image say nothing, nor do ranges of few steps, nor lines
//! of the frame's least reading, as an array has that reads no tension. Missing readings count for nothing: a line is judged by
//! those that it has, if they are at least half.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: readings of one reconstruction, dead taxels, sign of the gains | frames × taxels | unit of the readings |
//! | out: plateau | scalar | ln of a probability, ≥ 0 |
//! | out: line share | scalar | fraction of the frame's range |
//! | out: coarse share | scalar | fraction of the farthest reading |
//!
//! The limits, [`PLATEAU`](super::PLATEAU) and [`LINE`](super::LINE), are above what drawn clean frames of 8 to 20 bits and 0 to 1 % noise have, but for one in a hundred; the tests
//! draw them again.

use super::Checks;
use crate::data::frame::Frame;
use crate::data::input::Input;
use crate::spec::sensor::Sensor;

/// Fewest rows or columns for a fault of one.
const FEWEST_LINES: usize = 4;
/// Fewest steps of a frame's range for faults of lines and of taxels.
const FEWEST_STEPS: f64 = 64.0;
/// Fewest steps of the range of a line beside which others have one reading, whatever is on their other side: under a thin
/// cover a contact ends between two lines.
const STEPS_OF_ONE_SIDE: f64 = 512.0;

impl Checks {
    /// With the figures of `readings`, the frames of one reconstruction: the largest of each.
    pub fn with_readings(self, input: &Input, readings: &[Frame]) -> Checks {
        let upward: Vec<Upward> = readings.iter().map(|frame| Upward::new(input, frame)).collect();
        let largest = |figure: &dyn Fn(&Upward) -> Option<f64>| upward.iter().filter_map(figure).reduce(f64::max);
        Checks {
            full_scale_share: input.full_scale_share(readings),
            plateau: largest(&|own| own.plateau()),
            line_share: largest(&|own| own.line_share()),
            coarse_share: match &upward[..] {
                [one] => coarse_share(input, &one.sorted),
                _ => coarse_share(input, &sorted_sums(input, readings)),
            },
            missing_share: readings.iter().filter_map(|frame| missing_share(input, frame)).reduce(f64::max),
            ..self
        }
    }
}

/// The share of the live taxels without a reading; `None` where each has one.
fn missing_share(input: &Input, frame: &Frame) -> Option<f64> {
    let alive = input.spec().alive(&frame.sensor);
    let missing = frame.missing.iter().filter(|taxel| alive[**taxel]).count();
    (missing > 0).then(|| missing as f64 / alive.iter().filter(|alive| **alive).count() as f64)
}

/// Share of the readings from which on equal ones are unloaded.
const EQUAL: f64 = 0.25;

/// Share of the range below which a difference of readings is rounding, of stress that was computed.
const ROUNDING: f64 = 1e-9;

/// The sums over `readings` of each live taxel that all of them have, sorted; they rise with the load.
fn sorted_sums(input: &Input, readings: &[Frame]) -> Vec<f64> {
    let Some(first) = readings.first() else { return Vec::new() };
    let alive = input.spec().alive(&first.sensor);
    let there = |k: &usize| alive[*k] && readings.iter().all(|frame| !frame.lacks(*k));
    let sum = |k: usize| input.sign() * readings.iter().map(|frame| frame.stress_MPa[k]).sum::<f64>();
    sorted((0..first.sensor.taxels()).filter(there).map(sum))
}

/// The coarse share of readings that rise with the load, or of their sums, in rising order; `None` where few are equal. Zeros of a
/// unipolar array do not count: they are clipped.
fn coarse_share(input: &Input, sums: &[f64]) -> Option<f64> {
    let (taxels, unipolar) = (sums.len(), input.spec().unipolar);
    let clipped = if unipolar { sums.partition_point(|sum| *sum <= 0.0) } else { 0 };
    let groups: Vec<&[f64]> = sums[clipped..].chunk_by(|a, b| a == b).collect();
    let at = (0..groups.len()).max_by_key(|at| groups[*at].len())?;
    let distances =
        (0..groups.len()).filter(|other| *other != at).map(|other| (groups[other][0] - groups[at][0]).abs());
    let [next, farthest] = distances.fold([f64::INFINITY, 0.0], |[next, far], d| [d.min(next), d.max(far)]);
    (groups[at].len() as f64 >= EQUAL * taxels as f64 && farthest > 0.0).then(|| next / farthest)
}

/// Largest less smallest reading; 0 without any.
pub(super) fn range(readings: impl Iterator<Item = f64>) -> f64 {
    let ends = |[low, high]: [f64; 2], reading: f64| [low.min(reading), high.max(reading)];
    let [low, high] = readings.fold([f64::INFINITY, f64::NEG_INFINITY], ends);
    (high - low).max(0.0)
}

/// Readings in rising order.
fn sorted(readings: impl Iterator<Item = f64>) -> Vec<f64> {
    // A filter does not say how many it leaves.
    let mut sorted = Vec::with_capacity(readings.size_hint().1.unwrap_or(0));
    sorted.extend(readings);
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// The smallest difference of two readings; `None` where all are equal.
pub(super) fn step(readings: impl Iterator<Item = f64>) -> Option<f64> {
    step_of_sorted(&sorted(readings))
}

/// The same of readings in rising order.
fn step_of_sorted(sorted: &[f64]) -> Option<f64> {
    let least = ROUNDING * (sorted.last()? - sorted.first()?);
    sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > least).reduce(f64::min)
}

/// Whether the range of readings has enough steps to judge single ones.
pub(super) fn is_fine(readings: impl Iterator<Item = f64> + Clone) -> bool {
    step(readings.clone()).is_some_and(|step| has_steps(range(readings), step))
}

/// Whether a range has enough steps to judge single readings.
fn has_steps(range: f64, step: f64) -> bool {
    range >= FEWEST_STEPS * step
}

/// Readings that rise with the load.
struct Upward {
    rows: Vec<Line>,
    cols: Vec<Line>,
    /// All, in rising order.
    sorted: Vec<f64>,
    /// Largest less smallest of all.
    range: f64,
    /// As [`step`] has it.
    step: Option<f64>,
}

/// The readings of a row or column; `None` of dead taxels and of missing readings.
type Line = Vec<Option<f64>>;

fn range_of(line: &Line) -> f64 {
    range(line.iter().flatten().copied())
}

/// Whether two lines have the same readings, within `rounding`, where both have one.
fn equal(one: &Line, other: &Line, rounding: f64) -> bool {
    let differ =
        |(one, other): (&Option<f64>, &Option<f64>)| one.zip(*other).is_some_and(|(a, b)| (a - b).abs() > rounding);
    !std::iter::zip(one, other).any(differ)
}

/// Whether all lines i and `sum` − i are equal, within `rounding`, and those other than the innermost two are not silent.
fn mirrored(lines: &[Line], sum: usize, rounding: f64) -> bool {
    let pairs = || (0..sum.div_ceil(2)).filter(|i| sum - i < lines.len()).map(|i| (i, &lines[i], &lines[sum - i]));
    pairs().all(|(_, one, other)| equal(one, other, rounding))
        && pairs().any(|(i, one, _)| i != (sum - 1) / 2 && range_of(one) > 0.0)
}

/// Whether enough readings of a line are there to judge it.
fn is_there(line: &Line) -> bool {
    2 * line.iter().flatten().count() >= line.len()
}

impl Upward {
    fn new(input: &Input, frame: &Frame) -> Upward {
        let Sensor { rows, cols, .. } = frame.sensor;
        let (sign, alive) = (input.sign(), input.spec().alive(&frame.sensor));
        let reading = |k: usize| (alive[k] && !frame.lacks(k)).then(|| sign * frame.stress_MPa[k]);
        let rows_of = (0..rows).map(|i| (0..cols).map(|j| reading(i * cols + j)).collect()).collect();
        let cols_of = (0..cols).map(|j| (0..rows).map(|i| reading(i * cols + j)).collect()).collect();
        let sorted = sorted((0..rows * cols).filter_map(reading));
        let (range, step) = (range(sorted.iter().copied()), step_of_sorted(&sorted));
        Upward { rows: rows_of, cols: cols_of, sorted, range, step }
    }

    /// Whether line k of rows or columns repeats the one before it.
    fn is_twin(&self, lines: &[Line], k: usize) -> bool {
        k > 0
            && is_there(&lines[k - 1])
            && is_there(&lines[k])
            && equal(&lines[k - 1], &lines[k], 0.0)
            && !mirrored(lines, 2 * k - 1, ROUNDING * self.range)
    }

    fn readings(&self) -> impl Iterator<Item = f64> + Clone + '_ {
        self.rows.iter().flatten().flatten().copied()
    }

    /// `None` where all readings are equal.
    fn plateau(&self) -> Option<f64> {
        let step = self.step?;
        let largest = self.readings().reduce(f64::max)?;
        let next = self.readings().filter(|b| largest - b >= step).reduce(f64::max)?;
        let of_row = |row: &Line| {
            row.iter().enumerate().filter(|(j, b)| **b == Some(largest) && !self.is_twin(&self.cols, *j)).count()
        };
        let own = (0..self.rows.len()).filter(|i| !self.is_twin(&self.rows, *i)).map(|i| of_row(&self.rows[i]));
        let rounding = ROUNDING * self.range;
        let is_mirrored = |lines: &[Line]| (1..2 * lines.len() - 2).any(|sum| mirrored(lines, sum, rounding));
        let images = [&self.rows, &self.cols].into_iter().filter(|lines| is_mirrored(lines)).count();
        let equal = own.sum::<usize>().div_ceil(1 << images);
        Some(equal.saturating_sub(1) as f64 * ((largest - next) / step).ln())
    }

    /// `None` on arrays of few rows and columns, and for readings of few steps.
    fn line_share(&self) -> Option<f64> {
        let (whole, step) = (self.range, self.step.filter(|step| has_steps(self.range, *step))?);
        let all = [&self.rows, &self.cols].into_iter().filter(|lines| lines.len() >= FEWEST_LINES);
        all.map(|lines| self.repeated(lines).max(self.silent(lines, step)) / whole).reduce(f64::max)
    }

    /// The largest range of a line that the next one repeats.
    fn repeated(&self, lines: &[Line]) -> f64 {
        (1..lines.len()).filter(|&k| self.is_twin(lines, k)).map(|k| range_of(&lines[k])).fold(0.0, f64::max)
    }

    /// The largest range beside lines of one reading: of the smaller side, or of the larger one where it has many steps.
    fn silent(&self, lines: &[Line], step: f64) -> f64 {
        let ranges: Vec<f64> = lines.iter().map(range_of).collect();
        let least = self.readings().fold(f64::INFINITY, f64::min);
        let (mut largest, mut first) = (0.0f64, 0);
        while let Some(start) = (first..lines.len()).find(|&k| ranges[k] == 0.0 && is_there(&lines[k])) {
            let end = (start..lines.len()).find(|&k| ranges[k] > 0.0).unwrap_or(lines.len());
            let sides = [start.checked_sub(1).map_or(0.0, |k| ranges[k]), ranges.get(end).copied().unwrap_or(0.0)];
            let (less, more) = (sides[0].min(sides[1]), sides[0].max(sides[1]));
            // Where tension reads as zero, or small readings do, lines of the least reading are those beside contacts.
            if lines[start].iter().flatten().any(|reading| *reading > least) {
                largest = largest.max(if more >= STEPS_OF_ONE_SIDE * step { more } else { less });
            }
            first = end;
        }
        largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Contact;
    use crate::data::generator::converter::Converter;
    use crate::data::generator::draws::{DrawOptions, Draws};
    use crate::data::generator::generate;
    use crate::estimate::float::Golden;
    use crate::fixed::Model;
    use crate::result::checks::history::History;
    use crate::result::checks::tests::press;
    use crate::result::checks::{LINE, PLATEAU};
    use crate::result::flags::Flag;
    use crate::spec::scene::{Medium, Scene};

    /// The flags of the readings and of a stream.
    const FLAGS: [Flag; 4] = [Flag::Clipped, Flag::LineFault, Flag::TaxelConstant, Flag::TornFrame];

    fn thin() -> Scene {
        let sensor = Sensor { rows: 10, cols: 8, pitch_x_mm: 5.0, pitch_y_mm: 4.0, thickness_mm: 2.0 };
        Scene::of_sensor(&sensor, "thin")
    }

    /// Flags of the moments of a press that grows, at some noise and width of the codes.
    fn flags_of_stream(scene: &Scene, number: u64, bits: u32, noise: f64) -> [bool; 4] {
        let options = DrawOptions { contacts: 1 + (number % 2) as usize, seed: 3, ..Default::default() };
        let drawn = Draws::new(scene, options).unwrap().frame(number).unwrap();
        let (input, mut history, mut raised) = (Input::new(scene).unwrap(), History::new(scene), [false; 4]);
        for moment in 0..12u64 {
            // Not pressed, then growing.
            let load = moment.saturating_sub(2) as f64 / 9.0;
            let mut own = drawn.frame.clone();
            own.stress_MPa = drawn.exact_MPa.iter().map(|b| load * b).collect();
            // The noise is that of the press; full scale is one to four times its peak.
            let peak = if load > 0.0 { load } else { 1e-9 };
            own.stress_MPa[0] += if load > 0.0 { 0.0 } else { 1e-9 * drawn.peak_MPa() };
            let converter = Converter {
                noise: noise / peak,
                bits: Some(bits),
                full_scale_MPa: Some(drawn.peak_MPa() * (1.05 + (number % 4) as f64)),
                unipolar: scene.input.unipolar,
                seed: number * 100 + moment,
                ..Default::default()
            };
            let frame = [converter.convert(&own).unwrap()];
            let checks = history.add(&frame, Checks::default()).with_readings(&input, &frame);
            checks
                .flags(scene)
                .for_each(|flag| FLAGS.iter().zip(&mut raised).for_each(|(own, raised)| *raised |= *own == flag));
        }
        raised
    }

    /// The limits: at most one clean press of a hundred has a flag, from 8 to 20 bits and at 0 to 1 % noise.
    #[test]
    fn clean_presses_raise_no_flag() {
        const PRESSES: u64 = 12;
        let names = ["sensor-1", "eight-by-eight", "sensor-1-unipolar", "sensor-1-bonded"];
        let scenes = names.map(|name| Scene::builtin(name).unwrap());
        let (mut all, mut raised) = (0, [0; 4]);
        for scene in scenes.into_iter().chain([thin()]) {
            for (bits, noise) in
                [8, 10, 12, 16, 20].into_iter().flat_map(|bits| [0.0, 1e-3, 1e-2].map(|noise| (bits, noise)))
            {
                for number in 0..PRESSES {
                    let own = flags_of_stream(&scene, number, bits, noise);
                    (0..4).for_each(|flag| raised[flag] += usize::from(own[flag]));
                    all += 1;
                }
            }
        }
        println!("{raised:?} of {all}");
        assert!(raised.iter().all(|raised| raised * 100 <= all), "{raised:?} of {all}");
    }

    /// Both models raise the same flags of a frame's readings.
    fn both(scene: &Scene, frame: &Frame) -> [bool; 2] {
        let golden = Golden::reference(scene).unwrap().run(frame).unwrap();
        let fixed = Model::new(scene).unwrap().reconstruct(frame).unwrap();
        assert_eq!((golden.checks.plateau, golden.checks.line_share), (fixed.checks.plateau, fixed.checks.line_share));
        [Flag::Clipped, Flag::LineFault].map(|flag| {
            let raised = [&golden, &fixed].map(|result| result.flags.contains(&flag));
            assert_eq!(raised[0], raised[1], "{flag:?}");
            raised[0]
        })
    }

    #[test]
    fn clipped_readings_and_faulty_lines_are_flagged_by_both_models() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let exact = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        assert_eq!(both(&scene, &exact), [false; 2]);
        let changed = |change: &dyn Fn(&mut Vec<f64>)| {
            let mut frame = exact.clone();
            change(&mut frame.stress_MPa);
            both(&scene, &frame)
        };
        let peak = exact.peak_MPa();
        assert_eq!(changed(&|b| b.iter_mut().for_each(|b| *b = b.min(0.5 * peak))), [true, false]);
        assert_eq!(changed(&|b| b.copy_within(24..32, 32)), [false, true]);
        assert_eq!(changed(&|b| (0..8).for_each(|i| b[8 * i + 3] = b[8 * i + 4])), [false, true]);
        assert_eq!(changed(&|b| b[24..32].fill(0.0)), [false, true]);
        assert_eq!(changed(&|b| b[32..].fill(0.0)), [false, true]);
    }

    /// Codes of 8 bits and a deadband are flagged, codes of 10 bits are not, nor 8 bits whose rounding noise makes even; a mean of two
    /// frames has half the step. A scene without shear has no flag.
    #[test]
    fn steps_that_hide_the_shear_are_flagged() {
        let mut scene = Scene::builtin("sensor-1").unwrap();
        let exact = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        let peak = exact.peak_MPa();
        let of = |scene: &Scene, frames: &[Frame]| {
            let checks = Checks::default().with_readings(&Input::new(scene).unwrap(), frames);
            (checks.coarse_share.is_some(), checks.flags(scene).any(|flag| flag == Flag::ShearUnreliable))
        };
        let changed = |change: &dyn Fn(f64) -> f64| {
            let mut frame = exact.clone();
            frame.stress_MPa.iter_mut().for_each(|b| *b = change(*b));
            frame
        };
        let codes = |bits: i32| changed(&|b| (b / peak * 2f64.powi(bits - 1)).round());
        let noisy = |seed| {
            let converter = Converter { bits: Some(8), noise: 0.01, seed, ..Default::default() };
            converter.convert(&exact).unwrap()
        };
        assert_eq!(of(&scene, std::slice::from_ref(&exact)), (false, false));
        assert_eq!([8, 10].map(|bits| of(&scene, &[codes(bits)])), [(true, true), (true, false)]);
        assert_eq!(of(&scene, &[changed(&|b| if b.abs() > 0.01 * peak { b } else { 0.0 })]), (true, true));
        assert_eq!(of(&scene, &[noisy(1)]), (false, false));
        let shifted = changed(&|b| ((b / peak + 0.002) * 128.0).round());
        assert!(!of(&scene, &[codes(8), shifted]).1);
        scene.search.mu_max = 0.0;
        assert_eq!(of(&scene, &[codes(8)]), (true, false));
    }

    /// A press without shear on the array's centre is its own mirror image.
    #[test]
    fn a_symmetric_press_is_no_fault() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let contact = |centre: [f64; 2]| Contact {
            shape: Some("hertz-circle".to_owned()),
            size_mm: vec![4.0],
            centre_mm: Some(centre),
            normal_N: Some(5.0),
            ..Default::default()
        };
        let input = Input::new(&scene).unwrap();
        for centre in [[0.0, 0.0], [2.0, 0.0], [4.0, -4.0]] {
            let frame = generate("symmetric", &scene.sensor, Medium::HalfSpace, &[contact(centre)]).unwrap();
            let codes = Converter { bits: Some(12), ..Default::default() }.convert(&frame).unwrap();
            for frame in [frame, codes] {
                let checks = Checks::default().with_readings(&input, &[frame]);
                assert!(checks.plateau < Some(PLATEAU) && checks.line_share < Some(LINE), "{centre:?}: {checks:?}");
            }
        }
    }

    #[test]
    fn shipped_frames_are_no_fault() {
        for name in Scene::builtin_names() {
            let scene = Scene::builtin(name).unwrap();
            let input = Input::new(&scene).unwrap();
            for frame in Frame::shipped(&scene) {
                let id = frame.id.clone();
                let checks = Checks::default().with_readings(&input, &[frame]);
                let flags: Vec<Flag> = checks.flags(&scene).filter(|flag| FLAGS.contains(flag)).collect();
                assert!(flags.is_empty(), "{id}: {flags:?} {checks:?}");
            }
        }
    }

    /// Missing readings are no fault: single ones, those of a row, of a block; and the faults beside them are found.
    #[test]
    fn missing_readings_are_no_fault_and_hide_none() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let exact = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        let input = Input::new(&scene).unwrap();
        let flags = |frame: &Frame, missing: Vec<usize>| -> Vec<Flag> {
            let mut frame = Frame { missing, ..frame.clone() };
            frame.missing.iter().for_each(|&taxel| frame.stress_MPa[taxel] = 0.0);
            Checks::default().with_readings(&input, &[frame]).flags(&scene).collect()
        };
        let block = (0..9).map(|k| (k / 3 + 2) * 8 + k % 3 + 2).collect();
        let column = (0..8).map(|row| 8 * row + 3).collect();
        for missing in [vec![27], (24..32).collect(), column, block] {
            assert_eq!(flags(&exact, missing.clone()), [Flag::TaxelMissing], "{missing:?}");
        }
        let mut doubled = exact.clone();
        doubled.stress_MPa.copy_within(24..32, 32);
        assert_eq!(flags(&doubled, vec![26, 37]), [Flag::LineFault, Flag::TaxelMissing]);
        let mut clipped = exact.clone();
        clipped.stress_MPa.iter_mut().for_each(|b| *b = b.min(0.5 * exact.peak_MPa()));
        assert_eq!(flags(&clipped, vec![27]), [Flag::Clipped, Flag::TaxelMissing]);
    }

    /// Dead taxels and falling readings change nothing.
    #[test]
    fn only_live_taxels_count_and_readings_may_fall() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let mut frame = press(&scene.sensor, 5.0, 8.0, [1.5, 0.7]);
        let peak = frame.peak_MPa();
        frame.stress_MPa.iter_mut().for_each(|b| *b = b.min(0.5 * peak));
        let figures = |scene: &Scene, frame: &Frame| {
            let checks = Checks::default().with_readings(&Input::new(scene).unwrap(), std::slice::from_ref(frame));
            [checks.plateau.unwrap(), checks.line_share.unwrap()]
        };
        let whole = figures(&scene, &frame);
        assert!(whole[0] > PLATEAU);
        scene.input.dead = vec![[0, 0]];
        frame.stress_MPa[0] = 99.0;
        assert!(figures(&scene, &frame)[0] > PLATEAU);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        let line = |k: usize| format!("{},{},3,-1\n", k / 8, k % 8);
        std::fs::write(&path, "row,col,offset,gain\n".to_owned() + &(0..64).map(line).collect::<String>()).unwrap();
        scene.input.calibration = Some(path);
        frame.stress_MPa.iter_mut().for_each(|b| *b = 3.0 - *b);
        assert!(figures(&scene, &frame)[0] > PLATEAU);
    }
}
