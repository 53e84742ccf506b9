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

use crate::drive::{record, Beat, Play, Recording, Stimulus, Times};
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
pub struct Bench<'a> {
    /// For messages: `verilator`, `rust-hdl`.
    pub name: &'a str,
    /// What is clocked.
    pub device: &'a mut dyn Device,
    /// Stage name of every tap.
    pub taps: &'a [&'static str],
}

/// Runs the vectors through a device and compares.
pub fn run(bench: Bench, vectors: &[Vector], stimulus: Stimulus) -> (Findings, Vec<Times>) {
    let plays: Vec<Play> = vectors
        .iter()
        .map(|v| Play { codes: &v.codes, taxels: v.taxels, beats: v.expected.beats.len() + v.expected.status.len() })
        .collect();
    let longest = vectors.iter().map(|v| v.expected.cycles.total).max().unwrap_or(0);
    let watchdog = WATCHDOG_MIN.max(4 * longest);
    let recording = record(bench.device, bench.taps.len(), &plays, stimulus, watchdog);
    let exact = stimulus == Stimulus::FullSpeed;
    let label = format!("{}, {stimulus}", bench.name);
    (judge(&label, bench.taps, vectors, &recording, exact), recording.times)
}

/// Compares a recording with the model; `exact` compares the cycle counts and every output beat's cycle as well.
pub fn judge(run: &str, taps: &[&'static str], vectors: &[Vector], recording: &Recording, exact: bool) -> Findings {
    let mut findings = Findings::default();
    let mut beats = recording.beats.iter();
    let mut streams: Vec<_> = recording.taps.iter().map(|words| words.iter()).collect();
    let mut beats_before = 0;
    for (number, vector) in vectors.iter().enumerate() {
        let mut judge = Judge { run, vector, number, findings: Findings::default() };
        let beats_after = beats_before + vector.expected.beats.len() + vector.expected.status.len();
        let last = number + 1 == vectors.len();
        let here = |beat: usize| beat >= beats_before && (beat < beats_after || last);
        // First, because a run that was given up explains every missing word after it.
        for timeout in recording.timeout.iter().filter(|t| here(t.beat)) {
            judge.rule("watchdog", timeout.beat - beats_before, Some(timeout.cycle), timeout.rule.clone());
        }
        judge.same_stages(taps);
        for stage in &vector.expected.stages {
            let Some(tap) = taps.iter().position(|name| *name == stage.name) else {
                continue;
            };
            for (index, expected) in stage.words.iter().enumerate() {
                let got = streams[tap].next().map(|w| (w.cycle, w.fields.clone()));
                judge.word(stage.name, index, Some(expected.clone()), got);
            }
        }
        for (stage, words) in [("forces", &vector.expected.beats), ("status", &vector.expected.status)] {
            for (index, expected) in words.iter().enumerate() {
                let got = beats.next().map(|b| (b.cycle, b.data.map(i64::from).to_vec()));
                judge.word(stage, index, Some(expected.map(i64::from).to_vec()), got);
            }
        }
        if last {
            // What is left over belongs to no frame; it is reported with the last one.
            for (stream, name) in streams.iter_mut().zip(taps) {
                for (extra, word) in stream.enumerate() {
                    judge.word(name, extra, None, Some((word.cycle, word.fields.clone())));
                }
            }
        }
        for breach in recording.breaches.iter().filter(|b| here(b.beat)) {
            judge.rule("handshake", breach.beat - beats_before, Some(breach.cycle), breach.rule.clone());
        }
        if exact {
            let times = &recording.times[number];
            judge.cycles(vector.expected.cycles, times);
            let end = beats_after.min(recording.beats.len());
            judge.beat_cycles(vector.expected.cycles, times, &recording.beats[beats_before.min(end)..end]);
        }
        beats_before = beats_after;
        findings.extend(judge.findings);
    }
    findings
}

/// Collects one frame's findings.
struct Judge<'a> {
    run: &'a str,
    vector: &'a Vector,
    /// Index of the frame.
    number: usize,
    findings: Findings,
}

impl Judge<'_> {
    fn add(&mut self, make: impl FnOnce(String, String) -> Mismatch) {
        self.findings.count += 1;
        self.findings.unequal.insert(self.number);
        if self.findings.kept.len() < KEPT_PER_FRAME {
            self.findings.kept.push(make(self.run.to_owned(), self.vector.frame.clone()));
        }
    }

    /// One word against another; both missing cannot happen.
    fn word(&mut self, stage: &str, index: usize, expected: Option<Vec<i64>>, got: Option<(u64, Vec<i64>)>) {
        let (cycle, got) = got.unzip();
        if expected == got {
            return;
        }
        // The streams whose words are taxels in the array's order; other stages may have as many words by chance.
        let forces = stage == "forces" && self.vector.expected.beats.len() == self.vector.taxels;
        let per_taxel = (stage == "receive" || forces) && expected.is_some();
        let cols = self.vector.cols;
        let taxel = per_taxel.then(|| [index / cols, index % cols]);
        self.add(|run, frame| Mismatch {
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

    fn rule(&mut self, stage: &str, index: usize, cycle: Option<u64>, rule: String) {
        self.add(|run, frame| Mismatch {
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
    fn same_stages(&mut self, taps: &[&'static str]) {
        let stages: Vec<&str> = self.vector.expected.stages.iter().map(|s| s.name).collect();
        for name in taps.iter().filter(|t| !stages.contains(t)) {
            self.rule(name, 0, None, "a tap of the hardware that the model has no stage for".into());
        }
        for name in stages.iter().filter(|s| !taps.contains(s)) {
            self.rule(name, 0, None, "a stage of the model that the hardware has no tap for".into());
        }
    }

    /// The cycle of every output beat: beat k of the frame at last input + `first_output` + k·`interval`.
    fn beat_cycles(&mut self, promised: Cycles, times: &Times, beats: &[Beat]) {
        let Some(last_in) = times.last_in else {
            return;
        };
        for (index, beat) in beats.iter().enumerate() {
            let due = last_in + promised.first_output + index as u64 * promised.interval;
            if beat.cycle != due {
                self.rule("cycles", index, Some(beat.cycle), format!("output beat {index} was due in cycle {due}"));
            }
        }
    }

    fn cycles(&mut self, promised: Cycles, times: &Times) {
        let pairs = [("latency", promised.latency, times.latency()), ("total", promised.total, times.total())];
        for (index, (name, expected, got)) in pairs.into_iter().enumerate() {
            if got != Some(expected) {
                let got = got.map_or("no end".to_owned(), |g| g.to_string());
                self.rule("cycles", index, times.last_out, format!("{name}: expected {expected} cycles, got {got}"));
            }
        }
    }
}
