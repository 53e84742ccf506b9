//! Compares what a device did with the bit-true model, stage by stage and beat by beat.
//!
//! Equal means equal: every tap's stream, every force beat, every status beat, the handshake in
//! every cycle, and at full speed the two cycle counts and the cycle of every output beat: beat k leaves
//! `first_output + k·interval` cycles after the last input beat. The first differing stage in hardware order comes first
//! in the list.
//!
//! | in | out |
//! |---|---|
//! | [`Vector`]s: codes and the model's [`Trace`] | [`Findings`]: kept [`Mismatch`]es and their true number |
//! | a [`Device`] with its tap names | [`Times`] of every frame |

mod findings;

pub use findings::{Findings, Mismatch, KEPT_PER_FRAME};

use dermis_hdl::device::Device;

use crate::drive::{record, Beat, InputFrame, Recording, Stimulus, Times};
use dermis_golden::fixed::{Cycles, Trace};

/// The watchdog never bites below this many cycles without a transfer.
const WATCHDOG_MIN: u64 = 10_000;

/// One frame's codes and what the bit-true model makes of them.
#[derive(Clone, Debug)]
pub struct Vector {
    /// Frame name for messages.
    pub frame: String,
    /// Columns of the array, to name a taxel by row and column.
    pub cols: usize,
    /// One code per taxel, row-major, of one frame after the other.
    pub codes: Vec<i32>,
    /// Taxels of a frame.
    pub taxels: usize,
    /// The model's stages, beats, status and cycle counts.
    pub expected: Trace,
}

impl Vector {
    /// The same for a device that shows no stages: its beats and cycles are compared.
    pub fn without_stages(&self) -> Vector {
        let mut vector = self.clone();
        vector.expected.stages.clear();
        vector
    }
}

/// A device with its name and its tap names in the order of its outputs.
pub struct DeviceUnderTest<'a> {
    /// For messages: `verilator`, `rust-hdl`.
    pub name: &'a str,
    /// What is clocked.
    pub device: &'a mut dyn Device,
    /// Stage name of every tap.
    pub taps: &'a [&'static str],
}

/// Runs the vectors through a device and compares.
pub fn run(dut: DeviceUnderTest, vectors: &[Vector], stimulus: Stimulus) -> (Findings, Vec<Times>) {
    let inputs: Vec<InputFrame> = vectors
        .iter()
        .map(|v| InputFrame {
            codes: &v.codes,
            taxels: v.taxels,
            beats: v.expected.beats.len() + v.expected.status.len(),
        })
        .collect();
    let longest = vectors.iter().map(|v| v.expected.cycles.total).max().unwrap_or(0);
    let watchdog = WATCHDOG_MIN.max(4 * longest);
    let recording = record(dut.device, dut.taps.len(), &inputs, stimulus, watchdog);
    let exact = stimulus == Stimulus::FullSpeed;
    let label = format!("{}, {stimulus}", dut.name);
    (compare_recording(&label, dut.taps, vectors, &recording, exact), recording.times)
}

/// Compares a recording with the model; `exact` compares the cycle counts and every output beat's cycle as well.
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
        let mut comparison = FrameComparison { run, vector, number, findings: Findings::default() };
        let beats_after = beats_before + vector.expected.beats.len() + vector.expected.status.len();
        let last = number + 1 == vectors.len();
        let here = |beat: usize| beat >= beats_before && (beat < beats_after || last);
        // First, because a run that was given up explains every missing word after it.
        for timeout in recording.timeout.iter().filter(|t| here(t.beat)) {
            comparison.add_violation(
                "watchdog",
                timeout.beat - beats_before,
                Some(timeout.cycle),
                timeout.rule.clone(),
            );
        }
        comparison.compare_stage_names(taps);
        for stage in &vector.expected.stages {
            let Some(tap) = taps.iter().position(|name| *name == stage.name) else {
                continue;
            };
            for (index, expected) in stage.words.iter().enumerate() {
                let got = streams[tap].next().map(|w| (w.cycle, w.fields.clone()));
                comparison.compare_word(stage.name, index, Some(expected.clone()), got);
            }
        }
        for (stage, words) in [("forces", &vector.expected.beats), ("status", &vector.expected.status)] {
            for (index, expected) in words.iter().enumerate() {
                let got = beats.next().map(|b| (b.cycle, b.data.map(i64::from).to_vec()));
                comparison.compare_word(stage, index, Some(expected.map(i64::from).to_vec()), got);
            }
        }
        if last {
            // What is left over belongs to no frame; it is reported with the last one.
            for (stream, name) in streams.iter_mut().zip(taps) {
                for (extra, word) in stream.enumerate() {
                    comparison.compare_word(name, extra, None, Some((word.cycle, word.fields.clone())));
                }
            }
        }
        for violation in recording.violations.iter().filter(|v| here(v.beat)) {
            comparison.add_violation(
                "handshake",
                violation.beat - beats_before,
                Some(violation.cycle),
                violation.rule.clone(),
            );
        }
        if exact {
            let times = &recording.times[number];
            comparison.compare_cycle_counts(vector.expected.cycles, times);
            let end = beats_after.min(recording.beats.len());
            comparison.compare_beat_cycles(vector.expected.cycles, times, &recording.beats[beats_before.min(end)..end]);
        }
        beats_before = beats_after;
        findings.extend(comparison.findings);
    }
    findings
}

/// Collects one frame's findings.
struct FrameComparison<'a> {
    run: &'a str,
    vector: &'a Vector,
    /// Index of the frame.
    number: usize,
    findings: Findings,
}

impl FrameComparison<'_> {
    fn add_mismatch(&mut self, make: impl FnOnce(String, String) -> Mismatch) {
        self.findings.count += 1;
        self.findings.unequal.insert(self.number);
        if self.findings.kept.len() < KEPT_PER_FRAME {
            self.findings.kept.push(make(self.run.to_owned(), self.vector.frame.clone()));
        }
    }

    /// One word against another; both missing cannot happen.
    fn compare_word(&mut self, stage: &str, index: usize, expected: Option<Vec<i64>>, got: Option<(u64, Vec<i64>)>) {
        let (cycle, got) = got.unzip();
        if expected == got {
            return;
        }
        // The streams whose words are taxels in the array's order; other stages may have as many words by chance.
        let forces = stage == "forces" && self.vector.expected.beats.len() == self.vector.taxels;
        let per_taxel = (stage == "receive" || forces) && expected.is_some();
        let cols = self.vector.cols;
        let taxel = per_taxel.then(|| [index / cols, index % cols]);
        self.add_mismatch(|run, frame| Mismatch {
            run,
            frame,
            stage: stage.into(),
            index,
            taxel,
            cycle,
            expected,
            got,
            rule: None,
        });
    }

    fn add_violation(&mut self, stage: &str, index: usize, cycle: Option<u64>, rule: String) {
        self.add_mismatch(|run, frame| Mismatch {
            run,
            frame,
            stage: stage.into(),
            index,
            taxel: None,
            cycle,
            expected: None,
            got: None,
            rule: Some(rule),
        });
    }

    /// The device's taps and the model's stages are the same set of names.
    fn compare_stage_names(&mut self, taps: &[&'static str]) {
        let stages: Vec<&str> = self.vector.expected.stages.iter().map(|s| s.name).collect();
        for name in taps.iter().filter(|t| !stages.contains(t)) {
            self.add_violation(name, 0, None, "a tap of the hardware that the model has no stage for".into());
        }
        for name in stages.iter().filter(|s| !taps.contains(s)) {
            self.add_violation(name, 0, None, "a stage of the model that the hardware has no tap for".into());
        }
    }

    /// The cycle of every output beat: beat k of the frame at last input + `first_output` + k·`interval`.
    fn compare_beat_cycles(&mut self, expected: Cycles, times: &Times, beats: &[Beat]) {
        let Some(last_in) = times.last_in else {
            return;
        };
        for (index, beat) in beats.iter().enumerate() {
            let due = last_in + expected.first_output + index as u64 * expected.interval;
            if beat.cycle != due {
                self.add_violation(
                    "cycles",
                    index,
                    Some(beat.cycle),
                    format!("output beat {index} was due in cycle {due}"),
                );
            }
        }
    }

    fn compare_cycle_counts(&mut self, expected: Cycles, times: &Times) {
        let pairs = [("latency", expected.latency, times.latency()), ("total", expected.total, times.total())];
        for (index, (name, due, got)) in pairs.into_iter().enumerate() {
            if got != Some(due) {
                let got = got.map_or("no end".to_owned(), |g| g.to_string());
                self.add_violation(
                    "cycles",
                    index,
                    times.last_out,
                    format!("{name}: expected {due} cycles, got {got}"),
                );
            }
        }
    }
}
