//! The thread that reads the lines of a stream.

use std::io::{BufReader, Read};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use anyhow::{anyhow, bail, Result};
use dermis_golden::data::text::Decoded;

use super::line::{self, Piece};
use super::queue::{Bell, Policy, Queue, Taken};
use super::rate::Clock;
use super::stop::Stop;

/// A line as it was received.
pub(super) struct ReceivedLine {
    /// Its number, from 1.
    pub(super) number: u64,
    /// When it was read.
    pub(super) time: SystemTime,
    /// The same by the stream's clock.
    pub(super) at: Duration,
    /// Or why it is no line.
    pub(super) bytes: std::result::Result<Vec<u8>, String>,
}

/// The lines of an input, read by a thread of their own.
pub(super) struct Lines {
    name: String,
    queue: Arc<Queue<ReceivedLine>>,
    /// Not joined where the output is closed first: the read may never return.
    thread: JoinHandle<std::io::Result<()>>,
}

impl Lines {
    /// Begins to read an input, called `name` in errors, into a queue of `length`, until `stop`.
    pub(super) fn begin(
        (input, name): (Box<dyn Read + Send>, String),
        (length, policy): (usize, Policy),
        clock: Clock,
        bell: Arc<Bell>,
        stop: &Stop,
    ) -> Lines {
        let queue = Arc::new(Queue::new(length, policy, bell));
        let filled = Arc::clone(&queue);
        let thread = std::thread::spawn(move || {
            let outcome = read_all(input, &clock, &filled);
            filled.close();
            outcome
        });
        stop.add(&queue);
        Lines { name, queue, thread }
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
        match self.thread.join() {
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
        let bytes = piece.refusal().map_or_else(|| Ok(std::mem::take(&mut line)), Err);
        if !queue.push(ReceivedLine { number, time: SystemTime::now(), at: clock.now(), bytes }) {
            break;
        }
    }
    Ok(())
}
