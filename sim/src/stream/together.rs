//! Several streams that one thread answers, in turn: each has a thread that reads, a queue, and what its frames so far show.
//!
//! ```text
//! source 0 ── queue ─┐ bell
//! source 1 ── queue ─┼──────── oldest line of each queue that has rung ── answer ── outcome of stream k
//! source 2 ── queue ─┘
//! ```
//! A stream that has many lines is answered once, then the others that have one; what its queue does not hold meanwhile waits or is
//! dropped, by its policy, and harms no other stream.

use std::io::{Error as IoError, ErrorKind, Read, Result as IoResult};
use std::sync::mpsc::channel;

use anyhow::{Error, Result};

use super::answers::{Counts, Outcome, Output, Stream, StreamOptions};
use super::estimators::Estimators;
use super::queue::{Bell, Policy, Taken};
use super::reader::Lines;
use super::stop::Stop;
use super::zero::ZeroRequest;

/// A stream that is answered together with others.
pub struct Member<'a> {
    /// What computes the results.
    pub estimators: Estimators<'a>,
    /// The source of its lines, and its name in errors.
    pub input: (Box<dyn Read + Send>, String),
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
    input: (Box<dyn Read + Send>, &str),
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
    (input, name): (Box<dyn Read + Send>, &str),
    options: StreamOptions,
    output: &mut Output,
) -> Result<Counts> {
    let own = Member { estimators, input: (input, name.to_owned()), options, zero: ZeroRequest::default() };
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
        let Some(received) = item else { return if ended { Next::Ended } else { Next::More } };
        match self.stream.answer(&received, if self.options.live { full } else { 0 }, output) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Next::Closed,
            Err(error) => Next::Failed(error.into()),
            Ok(()) => Next::More,
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
    for (index, Member { estimators, input, options, zero }) in members.into_iter().enumerate() {
        let (bell, clock) = (Bell::new(index, ring.clone()), estimators.clock().clone());
        let lines = Lines::begin(input, (options.queue, options.policy), clock, bell, stop);
        let stream = Stream::new(estimators, options.layout, zero);
        let said = stream.choice(&mut |outcome| output(index, outcome));
        done.push(said.err().map(|error| Err(error.into())));
        running.push(Some(Running { stream, lines, options }));
    }
    while done.iter().any(Option::is_none) && !stop.stopped() {
        let Ok(index) = rung.recv() else { break };
        let Some(own) = running[index].as_mut().filter(|_| done[index].is_none() && !stop.stopped()) else { continue };
        match own.next(&mut |outcome| output(index, outcome)) {
            Next::More => (),
            how => done[index] = running[index].take().map(|own| own.end(how)),
        }
    }
    let all = std::iter::zip(running, done);
    let stopped = |own: Option<Running>| own.map_or_else(|| Ok(Counts::default()), |own| own.end(Next::More));
    all.map(|(own, done)| done.unwrap_or_else(|| stopped(own))).collect()
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

