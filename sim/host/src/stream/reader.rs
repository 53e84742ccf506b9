//! What fills the queue of a stream: a thread that reads lines, or frames that are due in their place.

use std::io::{BufReader, Read};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{anyhow, bail, Result};
use dermis_golden::data::recording::RecordedFrame;
use dermis_golden::data::text::Decoded;

use super::line::{self, Piece};
use super::queue::{Bell, Policy, Queue, Taken};
use super::rate::Clock;
use super::stop::Stop;

/// A frame whose values are known, and when it is due.
pub type DueFrame = (Instant, RecordedFrame);

/// What a stream reads.
pub enum Input {
    /// Bytes, whose lines are frames.
    Bytes(Box<dyn Read + Send>),
    /// Frames, each in place of a line once it is due; none is asked for behind an error.
    Frames(Box<dyn Iterator<Item = std::io::Result<DueFrame>> + Send>),
}

impl From<Box<dyn Read + Send>> for Input {
    fn from(bytes: Box<dyn Read + Send>) -> Input {
        Input::Bytes(bytes)
    }
}

/// What was received in place of a line.
pub(super) enum Content {
    Line(Vec<u8>),
    Frame(RecordedFrame),
    /// No line, for this reason.
    None(String),
}

/// A line as it was received.
pub(super) struct ReceivedLine {
    /// Its number, from 1.
    pub(super) number: u64,
    /// When it was read.
    pub(super) time: SystemTime,
    /// The same by the stream's clock.
    pub(super) at: Duration,
    /// What it is.
    pub(super) content: Content,
}

/// The lines of an input, in a queue.
pub(super) struct Lines {
    name: String,
    queue: Arc<Queue<ReceivedLine>>,
    reads: Reads,
}

/// What fills the queue.
enum Reads {
    /// A thread that waits for bytes; not joined where the output is closed first: the read may never return.
    Thread(JoinHandle<std::io::Result<()>>),
    /// [`Lines::bring`].
    Due(Due),
}

/// Frames of which none is waited for, because it is known when the next one is due.
struct Due {
    frames: Box<dyn Iterator<Item = std::io::Result<DueFrame>> + Send>,
    next: Option<DueFrame>,
    /// Number of the next one, from 1.
    number: u64,
    clock: Clock,
    outcome: std::io::Result<()>,
}

impl Due {
    fn advance(&mut self) {
        let next = self.frames.next().transpose();
        self.next = next.unwrap_or_else(|error| {
            self.outcome = Err(error);
            None
        });
    }
}

impl Lines {
    /// Begins to read an input, called `name` in errors, into a queue of `length`, until `stop`.
    pub(super) fn begin(
        (input, name): (Input, String),
        (length, policy): (usize, Policy),
        clock: Clock,
        bell: Arc<Bell>,
        stop: &Stop,
    ) -> Lines {
        let queue = Arc::new(Queue::new(length, policy, bell));
        let reads = match input {
            Input::Bytes(input) => {
                let filled = Arc::clone(&queue);
                Reads::Thread(std::thread::spawn(move || {
                    let outcome = read_all(input, &clock, &filled);
                    filled.close();
                    outcome
                }))
            }
            Input::Frames(frames) => {
                let mut due = Due { frames, next: None, number: 1, clock, outcome: Ok(()) };
                due.advance();
                Reads::Due(due)
            }
        };
        stop.add(&queue);
        Lines { name, queue, reads }
    }

    /// Puts a frame that is due at `now` into the queue, unless that is full and waits; when the next one is due. `None` where lines
    /// come by themselves, and at the end.
    pub(super) fn bring(&mut self, now: Instant) -> Option<Instant> {
        let Reads::Due(own) = &mut self.reads else { return None };
        if let Some((at, frame)) = own.next.take_if(|(at, _)| *at <= now && self.queue.takes()) {
            // Received when it was due.
            let (late, time) = (now.saturating_duration_since(at), SystemTime::now());
            let (time, at) = (time.checked_sub(late).unwrap_or(time), own.clock.now().saturating_sub(late));
            self.queue.push(ReceivedLine { number: own.number, time, at, content: Content::Frame(frame) });
            own.number += 1;
            own.advance();
        }
        if own.next.is_none() {
            self.queue.close();
        }
        own.next.as_ref().map(|(at, _)| *at)
    }

    /// The oldest line that waits.
    pub(super) fn take(&self) -> Taken<ReceivedLine> {
        self.queue.take()
    }

    /// Reads no further line.
    pub(super) fn close(&self) {
        self.queue.close();
    }

    /// How the input ended, after its last line.
    ///
    /// # Errors
    /// An input that failed, with its name.
    pub(super) fn ended(self) -> Result<()> {
        let name = self.name;
        let outcome = match self.reads {
            Reads::Thread(thread) => thread.join(),
            Reads::Due(due) => Ok(due.outcome),
        };
        match outcome {
            Ok(outcome) => outcome.map_err(|error| anyhow!("{name}: {error}")),
            Err(_) => bail!("{name}: the thread that reads it has ended"),
        }
    }
}

/// Reads all lines into the queue; blank ones only count.
fn read_all(input: Box<dyn Read + Send>, clock: &Clock, queue: &Queue<ReceivedLine>) -> std::io::Result<()> {
    let (mut input, mut line) = (BufReader::new(Decoded::new(input)), Vec::new());
    for number in 1.. {
        let Some(piece) = line::read(&mut input, &mut line)? else { break };
        if piece != Piece::TooLong && line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let content = piece.refusal().map_or_else(|| Content::Line(std::mem::take(&mut line)), Content::None);
        if !queue.push(ReceivedLine { number, time: SystemTime::now(), at: clock.now(), content }) {
            break;
        }
    }
    Ok(())
}
