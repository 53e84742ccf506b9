//! Compares the recording of a device with the bit-true model, stage by stage and beat by beat, without tolerance.
//!
//! Compared are every tap's words, every force beat, every status beat and the handshake in every cycle; at full speed
//! also the two cycle counts and the cycle of every output beat. Mismatches are listed in hardware order, the first differing stage first.
//!
//! | in | out |
//! |---|---|
//! | [`Vector`]s: codes and the model's [`Trace`] | [`Findings`]: the first mismatches of each frame and their total number |
//! | a [`Device`] with its tap names | [`Times`] of every frame |

use dermis_golden::fixed::plan::program::issued;
use dermis_golden::fixed::{Cycles, Model, Stage, Trace};
use dermis_golden::spec::board::EngineKind;
use dermis_hdl::device::Device;

use super::drive::{record, Beat, InputFrame, Recording, Stimulus, Times};
use super::findings::{Findings, FrameComparison, WordLocation};

/// Shortest watchdog, in cycles without a transfer.
const WATCHDOG_MIN: u64 = 10_000;

/// Test vector: the codes of one reconstruction and the bit-true model's results.
#[derive(Clone, Debug)]
pub struct Vector {
    /// Frame name for messages.
    pub frame: String,
    /// Columns of the array, from which messages compute a taxel's row and column.
    pub cols: usize,
    /// Codes of all frames sent, in order, each row-major.
    pub codes: Vec<i32>,
    /// Taxels per frame.
    pub taxels: usize,
    /// The array that the frames are of; 0 where there is one.
    pub array: usize,
    /// The model's stages, beats, status and cycle counts.
    pub expected: Trace,
}

impl Vector {
    /// The vector of `codes`, which the device is sent, and the model's results; the instructions that the passes issue are
    /// added to its stages.
    pub fn new(model: &Model, frame: String, codes: Vec<i32>, mut expected: Trace) -> Vector {
        let sensor = &model.scene.sensor;
        if model.board.engine == EngineKind::Parallel {
            let chosen = expected.stages.iter().find(|stage| stage.name == "choose");
            let case = chosen.and_then(|stage| stage.words.first()).map_or(0, |word| word[0] as usize);
            let contacts = expected.timing.map_or(0, |timing| timing.contacts);
            let words = issued(model, case, contacts).into_iter().map(|word| word.map(|index| index as i64).to_vec());
            // Before its rows, so that a wrong program is the first mismatch.
            let rows = expected.stages.iter().position(|stage| stage.name == "pass").unwrap_or_default();
            expected.stages.insert(rows, Stage { name: "instruction", words: words.collect() });
        }
        Vector { frame, cols: sensor.cols, taxels: sensor.taxels(), array: 0, codes, expected }
    }

    /// The image of the tables of `model`, which nothing answers.
    pub fn of_image(model: &Model) -> Vector {
        let codes = model.image_beats();
        let frame = format!("tables of version {}", model.own().version);
        let of_zeros = model.run(&vec![0; model.scene.sensor.taxels()]);
        let mut vector = Vector { taxels: codes.len(), ..Vector::new(model, frame, codes, of_zeros) };
        let expected = &mut vector.expected;
        expected.stages.iter_mut().for_each(|stage| stage.words.clear());
        (expected.beats, expected.status, expected.beat_cycles) = Default::default();
        vector
    }

    /// What is sent, and how many beats answer it.
    pub fn input(&self) -> InputFrame<'_> {
        let beats = self.expected.beats.len() + self.expected.status.len();
        InputFrame { codes: &self.codes, taxels: self.taxels, beats, array: self.array }
    }

    /// The vector without the model's stages, for a device without taps: only beats and cycles are compared.
    pub fn without_stages(&self) -> Vector {
        let mut vector = self.clone();
        vector.expected.stages.clear();
        vector
    }
}

/// A device with its name and its taps.
pub struct DeviceUnderTest<'a> {
    /// Name in messages: `verilator`, `kernel`.
    pub name: &'a str,
    /// The device.
    pub device: &'a mut dyn Device,
    /// Stage name of every tap, in the order of [`dermis_hdl::device::Outputs::taps`].
    pub taps: &'a [&'static str],
}

/// Sends the vectors through a device and compares; returns the findings and the times of each vector.
pub fn run(dut: DeviceUnderTest, vectors: &[Vector], stimulus: Stimulus) -> (Findings, Vec<Times>) {
    let inputs: Vec<InputFrame> = vectors.iter().map(Vector::input).collect();
    let longest = vectors.iter().map(|v| v.expected.cycles.total).max().unwrap_or(0);
    let watchdog = WATCHDOG_MIN.max(4 * longest);
    let recording = record(dut.device, dut.taps.len(), &inputs, stimulus, watchdog);
    let exact = stimulus == Stimulus::FullSpeed;
    let label = format!("{}, {stimulus}", dut.name);
    (compare_recording(&label, dut.taps, vectors, &recording, exact), recording.times)
}

/// Compares a recording with the model; with `exact` also the cycle counts and the cycle of every output beat. `run`
/// names the run in messages.
pub fn compare_recording(
    run: &str,
    taps: &[&'static str],
    vectors: &[Vector],
    recording: &Recording,
    exact: bool,
) -> Findings {
    let mut findings = Findings::default();
    let mut beats = recording.beats.iter();
    let mut streams: Vec<_> = recording.taps.iter().map(|words| words.iter()).collect();
    let mut beats_before = 0;
    for (number, vector) in vectors.iter().enumerate() {
        let mut comparison = FrameComparison::new(run, vector.frame.clone(), number);
        let beats_after = beats_before + vector.expected.beats.len() + vector.expected.status.len();
        let last = number + 1 == vectors.len();
        let here = |beat: usize| beat >= beats_before && (beat < beats_after || last);
        // First in the list: a watchdog timeout explains all missing words after it.
        for timeout in recording.timeout.iter().filter(|t| here(t.beat)) {
            let (index, cycle) = (timeout.beat - beats_before, Some(timeout.cycle));
            let location = WordLocation { stage: "watchdog", index, cycle, taxel: None };
            comparison.add_violation(location, timeout.rule.clone());
        }
        compare_stage_names(&mut comparison, vector, taps);
        for stage in &vector.expected.stages {
            let Some(tap) = taps.iter().position(|name| *name == stage.name) else {
                continue;
            };
            for (index, expected) in stage.words.iter().enumerate() {
                let got = streams[tap].next().map(|w| (w.cycle, w.fields.clone()));
                compare_word(&mut comparison, vector, (stage.name, index), Some(expected.clone()), got);
            }
        }
        for (stage, words) in [("beats", &vector.expected.beats), ("status", &vector.expected.status)] {
            for (index, expected) in words.iter().enumerate() {
                let got = beats.next().map(|b| (b.cycle, b.data.map(i64::from).to_vec()));
                let expected = expected.map(i64::from).to_vec();
                compare_word(&mut comparison, vector, (stage, index), Some(expected), got);
            }
        }
        if last {
            // Words beyond all expected ones are reported with the last frame.
            for (stream, name) in streams.iter_mut().zip(taps) {
                for (extra, word) in stream.enumerate() {
                    let got = Some((word.cycle, word.fields.clone()));
                    compare_word(&mut comparison, vector, (name, extra), None, got);
                }
            }
        }
        for violation in recording.violations.iter().filter(|v| here(v.beat)) {
            let (index, cycle) = (violation.beat - beats_before, Some(violation.cycle));
            let location = WordLocation { stage: "handshake", index, cycle, taxel: None };
            comparison.add_violation(location, violation.rule.clone());
        }
        if exact && beats_after > beats_before {
            let times = &recording.times[number];
            compare_cycle_counts(&mut comparison, vector.expected.cycles, times);
            let end = beats_after.min(recording.beats.len());
            let own = &recording.beats[beats_before.min(end)..end];
            compare_beat_cycles(&mut comparison, &vector.expected.beat_cycles, times, own);
        }
        beats_before = beats_after;
        findings.extend(comparison.finish());
    }
    findings
}

/// Compares the word `index` of a stage; at most one of the two is missing.
fn compare_word(
    comparison: &mut FrameComparison,
    vector: &Vector,
    (stage, index): (&str, usize),
    expected: Option<Vec<i64>>,
    got: Option<(u64, Vec<i64>)>,
) {
    let (cycle, got) = got.unzip();
    // Only in these streams is the word's index a taxel; other stages may have as many words by coincidence.
    let forces = stage == "beats" && vector.expected.beats.len() == vector.taxels;
    let per_taxel = (stage == "receive" || forces) && expected.is_some();
    let taxel = per_taxel.then(|| [index / vector.cols, index % vector.cols]);
    comparison.compare(WordLocation { stage, index, taxel, cycle }, expected, got);
}

/// Checks that the device's taps and the model's stages have the same names.
fn compare_stage_names(comparison: &mut FrameComparison, vector: &Vector, taps: &[&'static str]) {
    let mut add = |stage, rule: &str| {
        comparison.add_violation(WordLocation { stage, ..WordLocation::default() }, rule.to_owned())
    };
    let stages: Vec<&str> = vector.expected.stages.iter().map(|s| s.name).collect();
    for name in taps.iter().filter(|t| !stages.contains(t)) {
        add(name, "the hardware has a tap for which the model has no stage");
    }
    for name in stages.iter().filter(|s| !taps.contains(s)) {
        add(name, "the model has a stage for which the hardware has no tap");
    }
}

/// Checks the cycle of every output beat, `expected` from the last input.
fn compare_beat_cycles(comparison: &mut FrameComparison, expected: &[u64], times: &Times, beats: &[Beat]) {
    let Some(last_in) = times.last_in else {
        return;
    };
    for (index, (beat, expected)) in beats.iter().zip(expected).enumerate() {
        let due = last_in + expected;
        if beat.cycle != due {
            let location = WordLocation { stage: "cycles", index, cycle: Some(beat.cycle), taxel: None };
            comparison.add_violation(location, format!("output beat {index} was due in cycle {due}"));
        }
    }
}

fn compare_cycle_counts(comparison: &mut FrameComparison, expected: Cycles, times: &Times) {
    let pairs = [("latency", expected.latency, times.latency()), ("total", expected.total, times.total())];
    for (index, (name, due, got)) in pairs.into_iter().enumerate() {
        if got != Some(due) {
            let got = got.map_or("no end".to_owned(), |g| g.to_string());
            let location = WordLocation { stage: "cycles", index, cycle: times.last_out, taxel: None };
            comparison.add_violation(location, format!("{name}: expected {due} cycles, got {got}"));
        }
    }
}
