//! Reconstruction of a stream: one result or refusal per line, in the order of the lines.

use std::collections::VecDeque;
use std::fmt;
use std::io::Write;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::data::text::Stated;
use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::Reconstruction;
use serde::{Serialize, Serializer};

use super::acquisition::Acquisition;
use super::estimators::{Estimators, Note};
use super::line::{self, Brought, LineFrame};
use super::queue::Policy;
use super::reader::{Content, ReceivedLine};
use super::zero::{ZeroRequest, Zeros, ZERO_FRAMES};
use crate::engine::typed;

/// How a stream is read and answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamOptions {
    /// Lines that wait for reconstruction, at least one.
    pub queue: usize,
    /// What happens where that many wait.
    pub policy: Policy,
    /// Whether frames arrive in their own time, so that a stream can fall behind them; a file waits.
    pub live: bool,
    /// What is stated of the lines' layout.
    pub layout: Stated,
}

/// What a stream had.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Results.
    pub answered: u64,
    /// Lines without a frame, or whose frame has no result.
    pub refused: u64,
    /// The first of them, and why.
    pub first_refused: Option<(u64, String)>,
    /// Lines dropped by [`Policy::Latest`].
    pub dropped: u64,
    /// Largest time from a line to its result.
    pub largest_lag: Duration,
    /// Results of each estimator, by name, in the order in which they were taken.
    pub by_estimator: Vec<(&'static str, u64)>,
    /// When the frames were acquired.
    pub acquisition: Acquisition,
}

impl Counts {
    /// Counts a result.
    fn answer(&mut self, estimator: &'static str, lag: Duration) {
        self.answered += 1;
        self.largest_lag = self.largest_lag.max(lag);
        match self.by_estimator.iter_mut().find(|(name, _)| *name == estimator) {
            Some((_, results)) => *results += 1,
            None => self.by_estimator.push((estimator, 1)),
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counts { refused, dropped, largest_lag, by_estimator, acquisition, .. } = self;
        let lag_ms = 1e3 * largest_lag.as_secs_f64();
        write!(f, "{refused} lines refused, {dropped} dropped; largest lag {lag_ms:.1} ms")?;
        let own: Vec<String> = by_estimator.iter().map(|(name, results)| format!("{results} by {name}")).collect();
        if !own.is_empty() {
            write!(f, "; {}", own.join(", "))?;
        }
        write!(f, "{acquisition}")
    }
}

/// What a line gave; as JSON an output line.
#[derive(Serialize)]
#[serde(untagged)]
pub enum Outcome<'a> {
    /// Of the last line of a block.
    Answer(StreamAnswer<'a>),
    /// Of a line without a result.
    Refusal(Refusal<'a>),
    /// What is to be said of the stream; no output line.
    Note(&'a str),
}

/// A result.
#[derive(Clone, Copy, Serialize)]
pub struct StreamAnswer<'a> {
    /// Number of the result, from 0.
    pub sequence: u64,
    /// Number of its last line, from 1.
    pub line: u64,
    /// Seconds since 1970 when that line was read.
    pub received_s: f64,
    /// Seconds since 1970 when the result was ready.
    pub answered_s: f64,
    /// Lines dropped so far.
    pub dropped: u64,
    /// Name of the estimator.
    pub estimator: &'a str,
    /// Why the estimator is another one than that of the result before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimator_change: Option<&'a str>,
    /// The frames of the block, the last one of that line; no part of the output line.
    #[serde(skip)]
    pub frames: &'a [Frame],
    /// Nanoseconds since 1970 when each was acquired, as `time_ns` the last one: the time in its line if there is one, else that
    /// of its arrival.
    #[serde(rename = "time_ns", serialize_with = "last")]
    pub times_ns: &'a [i64],
    /// The result.
    #[serde(flatten)]
    pub result: &'a Reconstruction,
}

impl StreamAnswer<'_> {
    /// Nanoseconds since 1970 when its last frame was acquired.
    pub fn time_ns(&self) -> i64 {
        // A frame of its own completes every block.
        self.times_ns.last().copied().unwrap_or(0)
    }
}

fn last<S: Serializer>(times_ns: &[i64], serializer: S) -> Result<S::Ok, S::Error> {
    times_ns.last().serialize(serializer)
}

/// A line without a result.
#[derive(Serialize)]
pub struct Refusal<'a> {
    /// Number of the line, from 1.
    pub line: u64,
    /// What is wrong.
    pub error: &'a str,
}

/// What takes the outcomes, in the order of the lines; the error [`BrokenPipe`](std::io::ErrorKind::BrokenPipe) ends a stream without error.
pub type Output<'a> = dyn FnMut(&Outcome) -> std::io::Result<()> + 'a;

/// Writes each outcome as a line of JSON; if `brief` without the forces of taxels.
pub fn as_lines(output: &mut dyn Write, brief: bool) -> impl FnMut(&Outcome) -> std::io::Result<()> + '_ {
    move |outcome| {
        let text = match outcome {
            Outcome::Note(_) => return Ok(()),
            Outcome::Answer(answer) if brief => {
                let result = &Reconstruction { forces_N: Forces::default(), ..answer.result.clone() };
                serde_json::to_string(&StreamAnswer { result, ..*answer })?
            }
            outcome => serde_json::to_string(outcome)?,
        } + "\n";
        output.write_all(text.as_bytes())?;
        output.flush()
    }
}

/// Lines after which those are answered in any case that wait for one that shows their layout.
const MOST_WAITING: usize = 64;

/// When a line was read.
#[derive(Clone, Copy)]
struct Stamp {
    line: u64,
    time: SystemTime,
    at: Duration,
}

/// The state of a stream.
pub(super) struct Stream<'a> {
    estimators: Estimators<'a>,
    /// Frames of the lines.
    frames: line::Frames,
    /// When the lines were read that have not been answered, or need no answer.
    read: VecDeque<Stamp>,
    /// Since when lines wait that show no layout.
    waiting: Option<Instant>,
    /// Why the next result has another estimator than the last one.
    change: Option<String>,
    /// Flags that the lines of a block that is not complete raise.
    flags: Vec<Flag>,
    zeros: Zeros,
    counts: Counts,
}

impl<'a> Stream<'a> {
    /// A stream without a line so far, whose layout is `stated`; `zero` asks for a new zero.
    pub(super) fn new(estimators: Estimators<'a>, stated: Stated, zero: ZeroRequest) -> Stream<'a> {
        let frames = line::Frames::new(&estimators.scene().sensor, stated);
        let (flags, zeros, counts) = (Vec::new(), Zeros::new(zero), Counts::default());
        Stream { estimators, frames, read: VecDeque::new(), waiting: None, change: None, flags, zeros, counts }
    }

    /// Since when lines wait for those that follow to show their layout.
    pub(super) fn waiting(&self) -> Option<Instant> {
        self.waiting
    }

    /// Sets the number of lines dropped so far.
    pub(super) fn dropped(&mut self, lines: u64) {
        self.counts.dropped = lines;
    }

    /// What it had.
    pub(super) fn counts(self) -> Counts {
        self.counts
    }

    /// Says between which estimators is chosen.
    pub(super) fn choice(&self, output: &mut Output) -> std::io::Result<()> {
        let Some(all) = self.estimators.choice() else { return Ok(()) };
        output(&Outcome::Note(&format!("the best estimator that keeps up, of {all}")))
    }

    /// Hands on what a line gave, it or lines before that waited; nothing for a frame that does not complete its block. `full` lines so
    /// far found the queue full.
    pub(super) fn answer(&mut self, received: ReceivedLine, full: u64, output: &mut Output) -> std::io::Result<()> {
        let ReceivedLine { number: line, time, at, content } = received;
        self.read.push_back(Stamp { line, time, at });
        let brought = match content {
            Content::Line(bytes) if self.read.len() <= MOST_WAITING => self.frames.push(&bytes, line),
            Content::Line(bytes) => [self.frames.settle(), self.frames.push(&bytes, line)].concat(),
            Content::Frame(frame) => self.frames.push_values(frame, line),
            Content::None(reason) => self.frames.refuse(line, reason),
        };
        self.hand_on(brought, full, output)
    }

    /// No line follows for now: hands on what those gave that wait.
    pub(super) fn settle(&mut self, output: &mut Output) -> std::io::Result<()> {
        let brought = self.frames.settle();
        self.hand_on(brought, 0, output)
    }

    /// No line follows: hands on what those gave that wait, and names lines that no frame has made a header.
    pub(super) fn finish(&mut self, output: &mut Output) -> std::io::Result<()> {
        let brought = self.frames.finish();
        self.hand_on(brought, 0, output)
    }

    fn hand_on(&mut self, brought: Vec<Brought>, full: u64, output: &mut Output) -> std::io::Result<()> {
        if let Some(note) = self.frames.note() {
            output(&Outcome::Note(&note))?;
        }
        for (line, frame) in brought {
            while self.read.front().is_some_and(|stamp| stamp.line < line) {
                self.read.pop_front();
            }
            // A line that was a header is named at the end.
            let at_end = Stamp { line, time: SystemTime::now(), at: self.estimators.clock().now() };
            let stamp = self.read.front().copied().filter(|stamp| stamp.line == line).unwrap_or(at_end);
            self.one(stamp, frame.map_err(|none| none.reason), full, output)?;
        }
        match self.frames.is_waiting() {
            true => self.waiting = Some(Instant::now()),
            false => {
                self.waiting = None;
                self.read.clear();
            }
        }
        Ok(())
    }

    /// Hands on what the frame of a line gave.
    fn one(
        &mut self,
        Stamp { line, time, at }: Stamp,
        frame: Result<LineFrame, String>,
        full: u64,
        output: &mut Output,
    ) -> std::io::Result<()> {
        if let Some(note) = frame.as_ref().ok().and_then(|own| self.zero(&own.frame)) {
            output(&Outcome::Note(&note))?;
        }
        let result = frame.and_then(|line| {
            let time_ns = self.counts.acquisition.time_ns(line.frame.time_ns, nanoseconds(time));
            self.flags.extend(line.flag());
            let frame = self.zeros.apply(Frame { time_ns: Some(time_ns), ..line.frame });
            self.estimators.push(frame).map_err(|error| {
                self.flags.clear();
                typed(error).to_string()
            })
        });
        let (frames, mut result) = match result {
            Ok(None) => return Ok(()),
            Ok(Some(complete)) => complete,
            Err(error) => {
                self.counts.refused += 1;
                self.counts.first_refused.get_or_insert_with(|| (line, error.clone()));
                return output(&Outcome::Refusal(Refusal { line, error: &error }));
            }
        };
        result.diagnostics().raise(self.flags.drain(..));
        let times_ns: Vec<i64> = frames.iter().filter_map(|frame| frame.time_ns).collect();
        let change = self.change.take();
        let (sequence, dropped) = (self.counts.answered, self.counts.dropped);
        let estimator = self.estimators.name();
        self.counts.answer(estimator, self.estimators.clock().now().saturating_sub(at));
        let [received_s, answered_s] = [time, SystemTime::now()].map(seconds);
        output(&Outcome::Answer(StreamAnswer {
            sequence,
            line,
            received_s,
            answered_s,
            dropped,
            estimator,
            estimator_change: change.as_deref(),
            frames: &frames,
            times_ns: &times_ns,
            result: &result,
        }))?;
        let Some(Note { text, changed }) = self.estimators.after(line, at, full) else { return Ok(()) };
        output(&Outcome::Note(&text))?;
        self.change = changed.then_some(text);
        Ok(())
    }

    /// What is to be said of the zero after a frame as it was read.
    fn zero(&mut self, frame: &Frame) -> Option<String> {
        match self.zeros.add(frame, self.estimators.scene(), self.estimators.input()) {
            Ok(false) => None,
            Ok(true) => {
                // What frames with another zero show is not true of these.
                self.estimators.restart();
                self.flags.clear();
                Some(format!("zero taken from {ZERO_FRAMES} frames"))
            }
            Err(error) => Some(format!("the zero stays: {error}")),
        }
    }
}

/// Nanoseconds since 1970.
pub fn nanoseconds(time: SystemTime) -> i64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// Seconds since 1970.
pub fn seconds(time: SystemTime) -> f64 {
    time.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineName;
    use crate::stream::{run, run_until, Clock, Faster, Stop};
    use anyhow::bail;
    use dermis_golden::data::input::Input;
    use dermis_golden::engine::{CheckPace, CheckedEngine, Engine, EngineError, State};
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::spec::scene::{EstimatorKind, MeanKind, Scene};
    use serde_json::Value;
    use std::io::Read;
    use std::path::Path;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::sync::mpsc::{channel, Receiver, Sender};
    use std::sync::Arc;

    fn engine_of(scene: &Scene, name: EngineName) -> Box<dyn Engine> {
        name.engine(scene, None, Path::new("")).unwrap()
    }

    fn answers(
        scene: &Scene,
        name: EngineName,
        input: String,
        options: StreamOptions,
        brief: bool,
    ) -> (Counts, Vec<Value>) {
        let engine = engine_of(scene, name);
        let input: Box<dyn Read + Send> = Box::new(std::io::Cursor::new(input.into_bytes()));
        let mut output = Vec::new();
        let estimators = Estimators::only(&*engine, CheckPace::Every(1));
        let counts = run(estimators, (input, "memory"), options, &mut as_lines(&mut output, brief)).unwrap();
        let text = String::from_utf8(output).unwrap();
        (counts, text.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
    }

    const ALL: StreamOptions = StreamOptions {
        queue: 4,
        policy: Policy::All,
        live: false,
        layout: Stated { columns: None, time_column: None, skip_rows: 0, form: None },
    };

    fn scene() -> Scene {
        Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search)
    }

    fn csv(frame: &Frame) -> String {
        frame.stress_MPa.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n"
    }

    #[test]
    fn results_are_those_of_the_engines_and_bad_lines_are_numbered() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let input = format!("{}\nx,y\n{}{{\"id\": 1}}\n", csv(&frames[0]), csv(&frames[1]));
        for name in EngineName::SOFTWARE {
            let (counts, answers) = answers(&scene, name, input.clone(), ALL, false);
            assert_eq!((counts.answered, counts.refused, counts.dropped), (2, 2, 0));
            let lines: Vec<u64> = answers.iter().map(|answer| answer["line"].as_u64().unwrap()).collect();
            assert_eq!(lines, [1, 3, 4, 5]);
            assert_eq!(answers[1]["error"], "2 values, wanted 64");
            assert!(answers[3]["error"].as_str().unwrap().contains("stress_MPa is missing"));
            for (answer, frame, sequence) in [(&answers[0], &frames[0], 0), (&answers[2], &frames[1], 1)] {
                let plain = Frame { resultant_N: None, ..frame.clone() };
                let result = CheckedEngine::new(engine_of(&scene, name)).result(&[plain], true).unwrap();
                let wanted: Value = serde_json::to_value(&result).unwrap();
                assert_eq!((&answer["forces_N"], &answer["flags"]), (&wanted["forces_N"], &wanted["flags"]));
                assert_eq!(answer["sequence"], sequence);
                assert!(answer["answered_s"].as_f64() >= answer["received_s"].as_f64());
            }
        }
    }

    #[test]
    fn the_last_piece_without_an_end_is_no_line() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let (one, two) = (csv(&frames[0]), csv(&frames[1]));
        for cut in [1, 3] {
            let input = one.clone() + &two[..two.len() - cut];
            let (counts, answers) = answers(&scene, EngineName::Golden, input, ALL, true);
            assert_eq!((counts.answered, counts.refused), (1, 1));
            let reason = "the last line has no end, and may be cut within a number";
            assert_eq!((&answers[1]["line"], answers[1]["error"].as_str()), (&Value::from(2), Some(reason)));
        }
    }

    #[test]
    fn words_behind_which_no_frame_stands_are_refused() {
        let (counts, answers) = answers(&scene(), EngineName::Golden, "no device\nno device\n".into(), ALL, true);
        assert_eq!((counts.answered, counts.refused), (0, 2));
        assert_eq!(answers[0]["error"], "no numbers, wanted 64 of 8x8 taxels");
        assert_eq!(answers[0]["line"], 1);
    }

    /// Lines that do not show their layout one by one wait for those that follow, and keep their order, numbers and times.
    #[test]
    fn lines_with_a_time_are_answered_in_order() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let line = |k: usize| format!("{},{}", 100 + 10 * k, csv(&frames[k % 2]));
        for lines in [2, 3, 12] {
            let input = "ms,".to_owned() + &(1..=64).map(|k| k.to_string()).collect::<Vec<_>>().join(",") + "\n";
            let input = input + &(0..lines).map(line).collect::<String>();
            let (counts, answers) = answers(&scene, EngineName::Golden, input, ALL, true);
            assert_eq!((counts.answered, counts.refused), (lines as u64, 0));
            let numbers: Vec<u64> = answers.iter().map(|answer| answer["line"].as_u64().unwrap()).collect();
            assert!(numbers.into_iter().eq(2..lines as u64 + 2));
            let times: Vec<i64> = answers.iter().map(|answer| answer["time_ns"].as_i64().unwrap()).collect();
            assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 10_000_000), "{times:?}");
            let alone = super::tests::answers(&scene, EngineName::Golden, csv(&frames[1]), ALL, true).1;
            assert_eq!(answers[1]["resultant_N"], alone[0]["resultant_N"]);
        }
    }

    /// Lines that wait, and their source that waits for an answer.
    struct Patient(Vec<u8>, Receiver<()>);

    impl Read for Patient {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            if self.0.is_empty() {
                // Half a minute where nothing answers.
                let _ = self.1.recv_timeout(Duration::from_secs(30));
                return Ok(0);
            }
            let bytes = (&self.0[..]).read(buffer)?;
            self.0.drain(..bytes);
            Ok(bytes)
        }
    }

    #[test]
    fn a_line_that_no_other_follows_is_answered_soon() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let engine = engine_of(&scene, EngineName::Golden);
        let (sender, receiver) = channel();
        let text = format!("t_ms,{}\n7,{}", vec!["p"; 64].join(","), csv(&frames[0]));
        let input: Box<dyn Read + Send> = Box::new(Patient(text.into_bytes(), receiver));
        let begun = std::time::Instant::now();
        let mut answered = None;
        let mut output = |outcome: &Outcome| {
            if let Outcome::Answer(_) = outcome {
                answered = Some(begun.elapsed());
                let _ = sender.send(());
            }
            Ok(())
        };
        let counts = run(Estimators::only(&*engine, CheckPace::Never), (input, "memory"), ALL, &mut output).unwrap();
        assert_eq!((counts.answered, counts.refused), (1, 0));
        assert!(answered.unwrap() < Duration::from_secs(20), "{answered:?}");
    }

    #[test]
    fn a_block_of_frames_gives_one_result_and_brief_leaves_out_the_taxels() {
        let (mut scene, frames) = (scene(), Frame::shipped(&scene()));
        scene.input.average = 1;
        let input = csv(&frames[0]) + &csv(&frames[1]) + &csv(&frames[2]);
        let (counts, answers) = answers(&scene, EngineName::Golden, input, ALL, true);
        assert_eq!((counts.answered, answers.len(), &answers[0]["line"]), (1, 1, &Value::from(2)));
        assert_eq!(answers[0]["forces_N"]["fz"], Value::Array(Vec::new()));
        let mean = Golden::new(&scene).unwrap().run_averaged(&frames[..2]).unwrap().resultant_N;
        assert_eq!(answers[0]["resultant_N"], serde_json::to_value(mean).unwrap());
    }

    /// A press that grows over a taxel that does not; both models, and only from the frame on that is late enough.
    #[test]
    fn a_taxel_that_stands_still_is_flagged_in_a_stream() {
        let (scene, exact) = (scene(), Frame::shipped(&scene()).remove(1));
        let peak = (0..64).max_by(|a, b| exact.stress_MPa[*a].total_cmp(&exact.stress_MPa[*b])).unwrap();
        let line = |moment: usize| {
            let mut frame = exact.clone();
            frame.stress_MPa.iter_mut().for_each(|b| *b *= moment as f64);
            frame.stress_MPa[peak] = exact.stress_MPa[peak];
            csv(&frame)
        };
        let input: String = (1..=10).map(line).collect();
        for name in EngineName::SOFTWARE {
            let (_, answers) = answers(&scene, name, input.clone(), ALL, true);
            let has = |answer: &Value| answer["flags"].as_array().unwrap().contains(&Value::from("taxel-constant"));
            assert_eq!((has(&answers[6]), has(&answers[9])), (false, true), "{answers:?}");
            assert!(answers[9]["checks"]["constant_share"].as_f64() > Some(0.06));
        }
    }

    /// A result with every line, as that of all frames up to it.
    #[test]
    fn a_mean_that_slides_answers_every_line() {
        for (mean, name) in [
            (MeanKind::Sliding, EngineName::Golden),
            (MeanKind::Sliding, EngineName::Fixed),
            (MeanKind::Adaptive, EngineName::Golden),
            (MeanKind::Adaptive, EngineName::Fixed),
        ] {
            let mut scene = scene();
            (scene.input.mean, scene.input.average, scene.input.full_scale_MPa) = (mean, 3, Some(1.0));
            scene.input.template = name == EngineName::Golden;
            let frames = &Frame::shipped(&scene)[..4];
            let input: String = frames.iter().map(csv).collect();
            let (_, answers) = answers(&scene, name, input, ALL, true);
            let engine = name.engine(&scene, None, Path::new("")).unwrap();
            for (number, answer) in answers.iter().enumerate() {
                let all = engine.reconstruct(&frames[..=number]).unwrap();
                assert_eq!(answer["mean_frames"], Value::from(all.extra.mean_frames), "{mean:?}");
                assert_eq!(answer["resultant_N"], serde_json::to_value(all.resultant_N).unwrap(), "{mean:?} {number}");
            }
            assert_eq!(answers.len(), 4);
        }
    }

    /// A line of JSON that states the force is answered with the errors.
    #[test]
    fn known_forces_of_a_line_give_errors() {
        let (scene, frame) = (scene(), Frame::shipped(&scene()).remove(1));
        let line = |force: &str| format!("{{\"stress_MPa\": {:?}{force}}}\n", frame.stress_MPa);
        let input = line("") + &line(&format!(", \"resultant_N\": {:?}", frame.resultant_N.unwrap()));
        let (_, answers) = answers(&scene, EngineName::Golden, input, ALL, true);
        assert!(answers[0]["error"].is_null() && answers[1]["error"]["tangential"].as_f64() < Some(0.1), "{answers:?}");
    }

    #[test]
    fn the_latest_of_many_lines_are_answered_and_the_others_counted() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let options = StreamOptions { queue: 1, policy: Policy::Latest, live: true, layout: Stated::default() };
        let (counts, answers) = answers(&scene, EngineName::Golden, csv(&frames[0]).repeat(2000), options, true);
        assert_eq!(counts.answered + counts.dropped, 2000);
        assert!(counts.dropped > 0);
        // The newest line is never dropped.
        assert_eq!(answers.last().unwrap()["line"], 2000);
    }

    /// An input that never ends.
    struct Endless;

    impl Read for Endless {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            std::thread::park();
            Ok(0)
        }
    }

    #[test]
    fn a_stream_whose_input_never_ends_is_stopped() {
        let (scene, stop) = (scene(), Stop::default());
        let run = || {
            let engine = engine_of(&scene, EngineName::Golden);
            let estimators = Estimators::only(&*engine, CheckPace::Never);
            let endless: Box<dyn Read + Send> = Box::new(Endless);
            run_until(&stop, estimators, (endless, "memory"), ALL, &mut |_| Ok(()))
        };
        std::thread::scope(|scope| {
            let running = scope.spawn(run);
            stop.now();
            assert_eq!(running.join().unwrap().unwrap(), Counts::default());
        });
        // One that begins later ends at once.
        assert_eq!(run().unwrap(), Counts::default());
    }

    #[test]
    fn an_answer_has_the_frames_of_its_block() {
        let (mut scene, frames) = (scene(), Frame::shipped(&scene()));
        scene.input.average = 1;
        let engine = engine_of(&scene, EngineName::Golden);
        let input = csv(&frames[0]) + &csv(&frames[1]);
        let mut seen = Vec::new();
        let mut output = |outcome: &Outcome| {
            if let Outcome::Answer(answer) = outcome {
                let stress = answer.frames.iter().map(|frame| frame.stress_MPa.clone());
                seen.push((stress.collect::<Vec<_>>(), answer.times_ns.to_vec(), answer.time_ns()));
            }
            Ok(())
        };
        let input: Box<dyn Read + Send> = Box::new(std::io::Cursor::new(input.into_bytes()));
        run(Estimators::only(&*engine, CheckPace::Never), (input, "memory"), ALL, &mut output).unwrap();
        let [(stress, times_ns, last)] = &seen[..] else { panic!("{} answers", seen.len()) };
        assert_eq!(*stress, [frames[0].stress_MPa.clone(), frames[1].stress_MPa.clone()]);
        assert!(times_ns.len() == 2 && times_ns[0] <= times_ns[1] && times_ns[1] == *last, "{times_ns:?}, {last}");
    }

    #[test]
    fn the_time_in_a_line_is_that_of_its_result() {
        let (scene, frame) = (scene(), Frame::shipped(&scene()).remove(0));
        let json = |field: &str| format!("{{{field}, \"stress_MPa\": {:?}}}\n", frame.stress_MPa);
        let lines = [
            format!("time,{}\n1732770000.000000001,{}", vec!["p"; 64].join(","), csv(&frame)),
            format!("1732770000.010000002,{}", csv(&frame)),
            json("\"time_ns\": 1732770000020000003"),
            json("\"timestamp\": \"2024-11-28T05:00:00.030000004Z\""),
        ];
        let (counts, answers) = answers(&scene, EngineName::Fixed, lines.concat(), ALL, true);
        let times: Vec<i64> = answers.iter().map(|answer| answer["time_ns"].as_i64().unwrap()).collect();
        assert_eq!(times, [1, 10_000_002, 20_000_003, 30_000_004].map(|ns| 1_732_770_000_000_000_000 + ns));
        let words = "; 4 by search; acquired at 100.0 per second, 0 gaps, the largest step 10.0 ms";
        assert!(counts.to_string().ends_with(words), "{counts}");
    }

    /// An engine whose results take three milliseconds, and any time by a clock of its own.
    struct Slow {
        engine: Box<dyn Engine>,
        now_ms: Arc<AtomicU64>,
        cost_ms: u64,
    }

    impl Engine for Slow {
        fn scene(&self) -> &Scene {
            self.engine.scene()
        }

        fn input(&self) -> &Input {
            self.engine.input()
        }

        fn estimator(&self) -> EstimatorKind {
            self.engine.estimator()
        }

        fn reconstruct_after(&self, state: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
            // Long enough for the reader to fill the queue on a busy machine.
            std::thread::sleep(Duration::from_millis(3));
            self.now_ms.fetch_add(self.cost_ms, Ordering::Relaxed);
            self.engine.reconstruct_after(state, frames)
        }
    }

    /// The lines and notes of a stream whose first estimator takes 20 ms, the next one 1 ms, of `lines` that all wait.
    fn slow_stream(lines: usize, wanted_Hz: Option<f64>, broken: bool) -> (Counts, Vec<Value>, Vec<String>) {
        let (evidence, search) = (Scene::builtin("eight-by-eight").unwrap(), scene());
        let now_ms = Arc::new(AtomicU64::new(0));
        let slow = |scene: &Scene, cost_ms: u64| -> Box<dyn Engine> {
            Box::new(Slow { engine: engine_of(scene, EngineName::Golden), now_ms: Arc::clone(&now_ms), cost_ms })
        };
        let first = slow(&evidence, 20);
        let build = || if broken { bail!("no memory") } else { Ok(slow(&search, 1)) };
        let clock = Arc::clone(&now_ms);
        let clock = Clock::new(move || Duration::from_millis(clock.load(Ordering::Relaxed)));
        let faster = if wanted_Hz.is_some() { vec![Faster::new("search", build)] } else { Vec::new() };
        let estimators = Estimators::new(&*first, faster, CheckPace::Never, wanted_Hz, clock);
        let input: Box<dyn Read + Send> =
            Box::new(std::io::Cursor::new(csv(&Frame::shipped(&search)[1]).repeat(lines).into_bytes()));
        let (mut text, mut notes) = (Vec::new(), Vec::new());
        let mut written = as_lines(&mut text, true);
        let mut output = |outcome: &Outcome| {
            if let Outcome::Note(note) = outcome {
                notes.push(note.to_string());
            }
            written(outcome)
        };
        let counts = run(estimators, (input, "memory"), StreamOptions { live: true, ..ALL }, &mut output).unwrap();
        drop(written);
        let lines = String::from_utf8(text).unwrap();
        (counts, lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect(), notes)
    }

    #[test]
    fn an_estimator_that_does_not_keep_up_gives_way_and_the_line_says_why() {
        // Of 20 ms a result, half a second has 25.
        let (counts, lines, notes) = slow_stream(60, Some(100.0), false);
        assert_eq!(counts.by_estimator, [("evidence", 25), ("search", 35)]);
        let why = "search from now on: evidence takes 20.000 ms a result, 100.0 frames per second leave 10.000 ms";
        for (number, line) in lines.iter().enumerate() {
            assert_eq!(line["estimator"], if number < 25 { "evidence" } else { "search" });
            assert_eq!(line["estimator_change"].as_str(), (number == 25).then_some(why));
        }
        assert_eq!(notes, ["the best estimator that keeps up, of evidence, search", why]);
        assert!(counts.to_string().contains("; 25 by evidence, 35 by search; arrived at "), "{counts}");
        // Fast enough, and one that cannot be built.
        let (counts, ..) = slow_stream(60, Some(50.0), false);
        assert_eq!(counts.by_estimator, [("evidence", 60)]);
        let (counts, _, notes) = slow_stream(60, Some(100.0), true);
        assert_eq!((counts.by_estimator, &notes[1][..]), (vec![("evidence", 60)], "search is left out: no memory"));
    }

    #[test]
    fn a_stream_that_answers_all_lines_says_while_it_runs_that_it_is_behind() {
        let (counts, lines, notes) = slow_stream(600, None, false);
        assert_eq!((counts.answered, counts.dropped, lines.len()), (600, 0, 600));
        // Twelve seconds: once, and again after ten.
        assert!(notes.len() == 2 && notes[0].starts_with("behind: evidence takes 20.000 ms a result"), "{notes:?}");
    }

    /// Lines that say when they have all been read.
    struct Drained(std::io::Cursor<Vec<u8>>, Sender<()>);

    impl Read for Drained {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            let bytes = self.0.read(buffer)?;
            if bytes == 0 {
                // The receiver takes only the first.
                let _ = self.1.send(());
            }
            Ok(bytes)
        }
    }

    /// Who sends is never refused: lines are read while a result is computed, however long that takes.
    #[test]
    fn every_line_is_read_while_a_result_is_computed() {
        let (scene, frames) = (scene(), Frame::shipped(&scene()));
        let drained = |options: StreamOptions, patience: Duration| {
            let engine = engine_of(&scene, EngineName::Golden);
            let (sender, receiver): (_, Receiver<()>) = channel();
            let lines = std::io::Cursor::new(csv(&frames[0]).repeat(600).into_bytes());
            let mut all_read = None;
            let mut output = |_: &Outcome| {
                all_read = all_read.or_else(|| Some(receiver.recv_timeout(patience).is_ok()));
                Ok(())
            };
            let input: Box<dyn Read + Send> = Box::new(Drained(lines, sender));
            let estimators = Estimators::only(&*engine, CheckPace::Never);
            (run(estimators, (input, "memory"), options, &mut output).unwrap(), all_read)
        };
        for queue in [1, 16] {
            let options = StreamOptions { queue, policy: Policy::Latest, live: true, layout: Stated::default() };
            let (counts, all_read) = drained(options, Duration::from_secs(60));
            assert_eq!((all_read, counts.answered + counts.dropped), (Some(true), 600));
            // The first frame is answered once the second is there; then all are read, and the queue holds the last ones.
            assert!(counts.answered <= queue as u64 + 2, "{counts:?}");
        }
        // A source that waits is not read.
        let (counts, all_read) = drained(ALL, Duration::from_millis(100));
        assert_eq!((all_read, counts.answered, counts.dropped), (Some(false), 600, 0));
    }
}
