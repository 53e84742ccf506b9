//! Several streams that one thread answers, in turn: each has a queue, a thread that fills it unless it is known when its frames are due,
//! and what its frames so far show.
//!
//! ```text
//! source 0 ── queue ─┐ bell
//! source 1 ── queue ─┼──────── oldest line of each queue that has rung ── answer ── outcome of stream k
//! source 2 ── queue ─┘
//! ```
//! A stream that has many lines is answered once, then the others that have one; what its queue does not hold meanwhile waits or is
//! dropped, by its policy, and harms no other stream.

use std::io::{Error as IoError, ErrorKind, Result as IoResult};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::{Error, Result};

use super::answers::{Counts, Outcome, Output, Stream, StreamOptions};
use super::estimators::Estimators;
use super::queue::{Bell, Policy, Taken};
use super::reader::{Input, Lines};
use super::stop::Stop;
use super::zero::ZeroRequest;

/// How long lines wait for further ones that show their layout.
const QUIET: Duration = Duration::from_millis(200);

/// A stream that is answered together with others.
pub struct Member<'a> {
    /// What computes the results.
    pub estimators: Estimators<'a>,
    /// The source of its lines, and its name in errors.
    pub input: (Input, String),
    /// How it is read.
    pub options: StreamOptions,
    /// Asks for a new zero.
    pub zero: ZeroRequest,
}

/// What takes the outcomes of all streams, each in the order of its lines, with the number of the stream; an error ends that stream,
/// [`ErrorKind::BrokenPipe`] without being one.
pub type Outputs<'a> = dyn FnMut(usize, &Outcome) -> IoResult<()> + 'a;

/// Answers every line of `input`, called `name` in errors, until it ends or `output` is closed.
///
/// # Errors
/// Input or output that fails; a bad line is none.
pub fn run(
    estimators: Estimators,
    input: (impl Into<Input>, &str),
    options: StreamOptions,
    output: &mut Output,
) -> Result<Counts> {
    run_until(&Stop::default(), estimators, input, options, output)
}

/// As [`run`], or until `stop`.
///
/// # Errors
/// As [`run`].
pub fn run_until(
    stop: &Stop,
    estimators: Estimators,
    (input, name): (impl Into<Input>, &str),
    options: StreamOptions,
    output: &mut Output,
) -> Result<Counts> {
    let own = Member { estimators, input: (input.into(), name.to_owned()), options, zero: ZeroRequest::default() };
    let named = |error: IoError| match error.kind() {
        ErrorKind::BrokenPipe => error,
        kind => IoError::new(kind, format!("standard output: {error}")),
    };
    let mut all = run_together(stop, vec![own], &mut |_, outcome| output(outcome).map_err(named));
    // One stream has one end.
    all.pop().unwrap_or_else(|| Ok(Counts::default()))
}

/// A stream and its lines.
struct Running<'a> {
    stream: Stream<'a>,
    lines: Lines,
    options: StreamOptions,
}

impl Running<'_> {
    /// Answers the oldest line.
    fn next(&mut self, output: &mut Output) -> Next {
        let Taken { item, full, ended } = self.lines.take();
        self.stream.dropped(if self.options.policy == Policy::Latest { full } else { 0 });
        let (done, next) = match item {
            Some(received) => {
                (self.stream.answer(received, if self.options.live { full } else { 0 }, output), Next::More)
            }
            None if ended => (self.stream.finish(output), Next::Ended),
            None => (Ok(()), Next::More),
        };
        done.map_or_else(Next::of_error, |()| next)
    }

    /// Answers lines that have waited for further ones, where none has come for some time.
    fn settle(&mut self, output: &mut Output) -> Next {
        match self.stream.waiting().is_some_and(|since| since.elapsed() >= QUIET) {
            true => self.stream.settle(output).map_or_else(Next::of_error, |()| Next::More),
            false => Next::More,
        }
    }

    /// What it had until its lines ended, its output was closed or failed.
    fn end(self, how: Next) -> Result<Counts> {
        match how {
            Next::Ended => self.lines.ended()?,
            // What reads the lines may never return.
            Next::Closed | Next::More => self.lines.close(),
            Next::Failed(error) => {
                self.lines.close();
                return Err(error);
            }
        }
        Ok(self.stream.counts())
    }
}

/// Answers the lines of several streams in this thread until all have ended, or `stop`; returns what each had.
pub fn run_together(stop: &Stop, members: Vec<Member>, output: &mut Outputs) -> Vec<Result<Counts>> {
    let (ring, rung) = channel();
    let mut running = Vec::new();
    let mut done: Vec<Option<Result<Counts>>> = Vec::new();
    let made = |Member { estimators, input, options, zero }| {
        let clock = estimators.clock().clone();
        (Stream::new(estimators, options.layout, zero), input, options, clock)
    };
    // No stream is read, and none loses a line, while others are made.
    let streams: Vec<_> = members.into_iter().map(made).collect();
    for (index, (stream, input, options, clock)) in streams.into_iter().enumerate() {
        let said = stream.choice(&mut |outcome| output(index, outcome));
        done.push(said.err().map(|error| Err(error.into())));
        let lines = Lines::begin(input, (options.queue, options.policy), clock, Bell::new(index, ring.clone()), stop);
        running.push(Some(Running { stream, lines, options }));
    }
    let mut due = vec![Some(Instant::now()); running.len()];
    while done.iter().any(Option::is_none) && !stop.stopped() {
        let waits = running.iter().flatten().any(|member| member.stream.waiting().is_some());
        let until_due = bring(&mut running, &mut due).map(|at| at.saturating_duration_since(Instant::now()));
        let heard = match until_due.into_iter().chain(waits.then_some(QUIET)).min() {
            Some(most) => rung.recv_timeout(most),
            None => rung.recv().map_err(RecvTimeoutError::from),
        };
        for (index, member) in running.iter_mut().enumerate().filter(|_| waits) {
            match member.as_mut().map_or(Next::More, |member| member.settle(&mut |outcome| output(index, outcome))) {
                Next::More => (),
                how => done[index] = member.take().map(|member| member.end(how)),
            }
        }
        let index = match heard {
            Ok(index) => index,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        let Some(member) = running[index].as_mut().filter(|_| done[index].is_none() && !stop.stopped()) else {
            continue;
        };
        match member.next(&mut |outcome| output(index, outcome)) {
            Next::More => (),
            how => done[index] = running[index].take().map(|member| member.end(how)),
        }
    }
    let all = std::iter::zip(running, done);
    let stopped =
        |member: Option<Running>| member.map_or_else(|| Ok(Counts::default()), |member| member.end(Next::More));
    all.map(|(member, done)| done.unwrap_or_else(|| stopped(member))).collect()
}

/// Puts the frames that are due into the queues, at most one of each stream; when the next one is due. `due` has that of each stream.
fn bring(running: &mut [Option<Running>], due: &mut [Option<Instant>]) -> Option<Instant> {
    let now = Instant::now();
    for (due, member) in std::iter::zip(&mut *due, running).filter(|(due, _)| due.is_some_and(|at| at <= now)) {
        *due = member.as_mut().and_then(|member| member.lines.bring(now));
    }
    due.iter().flatten().min().copied()
}

/// What comes of a line.
enum Next {
    /// There may be further lines.
    More,
    /// There is none.
    Ended,
    /// No one takes the outcomes.
    Closed,
    /// An outcome cannot be written.
    Failed(Error),
}

impl Next {
    fn of_error(error: IoError) -> Next {
        match error.kind() {
            ErrorKind::BrokenPipe => Next::Closed,
            _ => Next::Failed(error.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::data::frame::Frame;
    use dermis_golden::data::recording::RecordedFrame;
    use dermis_golden::data::text::Stated;
    use dermis_golden::engine::CheckPace;
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::spec::scene::{EstimatorKind, Scene};
    use std::io::{Cursor, Read};

    const OPTIONS: StreamOptions = StreamOptions {
        queue: 2,
        policy: Policy::All,
        live: false,
        layout: Stated { columns: None, time_column: None, skip_rows: 0, form: None },
    };

    /// Forces of the results and number of refused lines, of each stream.
    type Seen = Vec<(Vec<[f64; 3]>, u64)>;

    /// What streams of these inputs give together, and how each ends.
    fn together(engine: &Golden, inputs: Vec<Input>) -> (Seen, Vec<Result<Counts>>) {
        let mut seen: Seen = vec![Default::default(); inputs.len()];
        let member = |input| Member {
            estimators: Estimators::only(engine, CheckPace::Never),
            input: (input, "memory".to_owned()),
            options: OPTIONS,
            zero: ZeroRequest::default(),
        };
        let members = inputs.into_iter().map(member).collect();
        let ends = run_together(&Stop::default(), members, &mut |index, outcome| {
            match outcome {
                Outcome::Answer(answer) => seen[index].0.push(answer.result.resultant_N),
                Outcome::Refusal(_) => seen[index].1 += 1,
                Outcome::Note(_) => (),
            }
            Ok(())
        });
        (seen, ends)
    }

    fn lines(frames: &[Frame]) -> String {
        let line = |frame: &Frame| frame.stress_MPa.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
        frames.iter().map(line).collect()
    }

    fn memory(text: String) -> Input {
        Input::Bytes(Box::new(Cursor::new(text.into_bytes())))
    }

    /// Frames that are due so many milliseconds from now, and with an error behind them one more.
    fn due(frames: &[(u64, &Frame)], end: Option<IoError>) -> Input {
        let begun = Instant::now();
        let of = |(ms, frame): &(u64, &Frame)| {
            let recorded = RecordedFrame { time_ns: *ms, shape: [8, 8], stress_MPa: frame.readings() };
            Ok((begun + Duration::from_millis(*ms), recorded))
        };
        let behind = end.as_ref().and_then(|_| frames.first()).map(of);
        let all: Vec<_> = frames.iter().map(of).chain(end.map(Err)).chain(behind).collect();
        Input::Frames(Box::new(all.into_iter()))
    }

    /// Frames in place of lines have the results of their lines, in their time, and end as lines do.
    #[test]
    fn frames_have_the_results_of_lines_once_they_are_due() {
        let scene = Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search);
        let (engine, frames) = (Golden::new(&scene).unwrap(), Frame::shipped(&scene));
        let (begun, wanted) = (Instant::now(), together(&engine, vec![memory(lines(&frames[..2]))]).0.remove(0));
        let later = due(&[(0, &frames[0]), (200, &frames[1])], None);
        let failing = due(&[(0, &frames[0]), (0, &frames[1])], Some(IoError::other("is cut")));
        let other = Frame { stress_MPa: vec![0.0; 63], ..frames[0].clone() };
        let (seen, ends) = together(&engine, vec![later, failing, due(&[(0, &other)], None), due(&[], None)]);
        assert!(begun.elapsed() >= Duration::from_millis(200));
        assert_eq!(seen, [wanted.clone(), wanted, (vec![], 1), (vec![], 0)]);
        assert_eq!(ends[1].as_ref().unwrap_err().to_string(), "memory: is cut");
        assert!([0, 2, 3].iter().all(|own| ends[*own].is_ok()));
    }

    /// Of frames that are due while others are answered the latest are kept; no stop waits for one that is not due.
    #[test]
    fn frames_that_are_due_too_soon_are_dropped_and_a_stop_waits_for_none() {
        const SOON: usize = 9;
        let scene = Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search);
        let (engine, frame) = (Golden::new(&scene).unwrap(), &Frame::shipped(&scene)[0]);
        let all = [vec![(0, frame); SOON], vec![(3_600_000, frame)]].concat();
        let member = |input| Member {
            estimators: Estimators::only(&engine, CheckPace::Never),
            input: (input, "memory".to_owned()),
            options: StreamOptions { policy: Policy::Latest, live: true, ..OPTIONS },
            zero: ZeroRequest::default(),
        };
        let (mut lines, stop) = (Vec::new(), Stop::default());
        // Frames of one stream become due while those of another one that came before them are answered.
        let members = vec![member(due(&all, None)), member(due(&all, None))];
        let ends = run_together(&stop, members, &mut |index, outcome| {
            if let Outcome::Answer(answer) = outcome {
                lines.push((index, answer.line, answer.dropped));
            }
            if (0..2).all(|index| lines.iter().any(|own| own.0 == index && own.1 == SOON as u64)) {
                stop.now();
            }
            Ok(())
        });
        assert!(ends.iter().all(Result::is_ok));
        for index in 0..2 {
            let own: Vec<_> = lines.iter().filter(|own| own.0 == index).collect();
            let last = own[own.len() - 1];
            // Each frame is answered or dropped.
            assert_eq!((last.1, last.2 + own.len() as u64), (SOON as u64, SOON as u64), "{lines:?}");
            assert!(last.2 > 0, "{lines:?}");
        }
    }

    /// Fails after its lines.
    struct Failing(Cursor<Vec<u8>>);

    impl Read for Failing {
        fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
            match self.0.read(buffer)? {
                0 => Err(IoError::other("unplugged")),
                bytes => Ok(bytes),
            }
        }
    }

    #[test]
    fn each_stream_has_its_own_results_and_its_own_end() {
        let scene = Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search);
        let (engine, frames) = (Golden::new(&scene).unwrap(), Frame::shipped(&scene));
        let alone = |frames: &[Frame]| together(&engine, vec![memory(lines(frames))]).0.remove(0).0;
        let failing = Failing(Cursor::new(lines(&frames[..1]).into_bytes()));
        let rubbish = memory("1,2\n".repeat(1000));
        let inputs = vec![
            memory(lines(&frames)),
            memory(lines(&frames[1..])),
            rubbish,
            Input::Bytes(Box::new(failing)),
            memory(String::new()),
        ];
        let (seen, ends) = together(&engine, inputs);
        assert_eq!(seen[0], (alone(&frames), 0));
        assert_eq!(seen[1], (alone(&frames[1..]), 0));
        assert_eq!(seen[2], (vec![], 1000));
        assert_eq!(seen[3].0, alone(&frames[..1]));
        let answered: Vec<Option<u64>> =
            ends.iter().map(|end| end.as_ref().ok().map(|counts| counts.answered)).collect();
        let all = frames.len() as u64;
        assert_eq!(answered, [Some(all), Some(all - 1), Some(0), None, Some(0)]);
        assert_eq!(ends[3].as_ref().unwrap_err().to_string(), "memory: unplugged");
    }

    /// The same line without end.
    struct Flood(Vec<u8>, usize);

    impl Read for Flood {
        fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
            let bytes = (&self.0[self.1..]).read(buffer)?;
            self.1 = (self.1 + bytes) % self.0.len();
            Ok(bytes)
        }
    }

    /// A stream that always has lines is answered in turn: between the results of the other one there is a bounded number of its own.
    #[test]
    fn a_flood_is_answered_in_turn() {
        const WANTED: usize = 50;
        let scene = Scene::builtin("eight-by-eight").unwrap().estimated_by(EstimatorKind::Search);
        let (engine, line) = (Golden::new(&scene).unwrap(), lines(&Frame::shipped(&scene)[..1]));
        let member = |input, queue, policy| Member {
            estimators: Estimators::only(&engine, CheckPace::Never),
            input: (input, "memory".to_owned()),
            options: StreamOptions { queue, policy, live: true, ..OPTIONS },
            zero: ZeroRequest::default(),
        };
        let flood = Input::Bytes(Box::new(Flood(line.clone().into_bytes(), 0)));
        // All lines of the other one wait at once, and as many of the flood, so that it does not matter when its reader has its turn.
        let others = member(memory(line.repeat(WANTED)), WANTED, Policy::All);
        let (mut order, stop) = (Vec::new(), Stop::default());
        let ends = run_together(&stop, vec![member(flood, WANTED, Policy::Latest), others], &mut |index, outcome| {
            if let Outcome::Answer(_) = outcome {
                order.push(index);
            }
            if order.iter().filter(|own| **own == 1).count() == WANTED {
                stop.now();
            }
            Ok(())
        });
        let [first, last] = [order.iter().position(|own| *own == 1), order.iter().rposition(|own| *own == 1)];
        let flooded = order[first.unwrap()..last.unwrap()].iter().filter(|own| **own == 0).count();
        assert!((WANTED / 10..=4 * WANTED).contains(&flooded), "{flooded} results of the flood between {WANTED}");
        assert_eq!(ends[1].as_ref().unwrap().answered, WANTED as u64);
    }
}
