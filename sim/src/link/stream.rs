//! `dermis host --stream`: frames and answers as lines of JSON.

use std::io::{BufRead, ErrorKind, Read, Write};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{anyhow, Result};
use dermis_golden::frame::Frame;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::answer::PhysicalAnswer;
use super::error::HostError;
use super::session::Session;

/// Longest input line in bytes; 65536 taxels of 25 characters take 1.6 MB.
const LONGEST_LINE: u64 = 4 << 20;

/// An input line.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    #[serde(default)]
    id: Value,
    stress_MPa: Vec<f64>,
}

/// An output line with an answer.
#[derive(Serialize)]
struct Reply {
    id: Value,
    /// Seconds since 1970 when the frame was sent, and when its answer was complete.
    sent_s: f64,
    answered_s: f64,
    #[serde(flatten)]
    answer: PhysicalAnswer,
}

/// An output line for an input line that was refused.
#[derive(Serialize)]
struct Refusal {
    id: Value,
    line: usize,
    error: String,
}

/// Result of sending all frames.
pub(crate) struct FramesSent {
    /// Text for standard output; empty with `--stream`.
    pub(crate) text: String,
    /// Whether every compared answer was equal to the model's.
    pub(crate) equal: bool,
    /// Number of frames answered.
    pub(crate) answered: usize,
    /// Number of input lines that are not a valid frame.
    pub(crate) refused: usize,
}

/// Answers every line of `input`; an invalid line is answered with its error.
///
/// # Errors
/// A board that does not answer, streams that fail.
pub(crate) fn run<P: Read + Write>(
    session: &mut Session<P>,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<FramesSent> {
    let mut sent = FramesSent { text: String::new(), equal: true, answered: 0, refused: 0 };
    for index in 0.. {
        let mut line = String::new();
        // Bounded, so that an endless line cannot exhaust the memory.
        let read = (&mut *input).take(LONGEST_LINE + 1).read_line(&mut line);
        match read.map_err(|error| anyhow!("standard input, line {}: {error}", index + 1))? {
            0 => break,
            bytes if bytes as u64 > LONGEST_LINE => {
                return Err(anyhow!("standard input, line {}: over {LONGEST_LINE} bytes", index + 1))
            }
            _ if line.trim().is_empty() => continue,
            _ => (),
        }
        let text = match answer(session, &line) {
            Ok(reply) => {
                sent.equal &= reply.answer.equal != Some(false);
                sent.answered += 1;
                serde_json::to_string(&reply)?
            }
            // Without a working board no further line can be answered.
            Err((_, error)) if error.is::<HostError>() => return Err(error),
            Err((id, error)) => {
                sent.refused += 1;
                serde_json::to_string(&Refusal { id, line: index + 1, error: error.to_string() })?
            }
        };
        match writeln!(output, "{text}").and_then(|()| output.flush()) {
            Err(error) if error.kind() == ErrorKind::BrokenPipe => break,
            Err(error) => return Err(anyhow!("standard output: {error}")),
            Ok(()) => (),
        }
    }
    Ok(sent)
}

fn seconds(time: SystemTime) -> f64 {
    time.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// The answer to one line, or its id (null if it cannot be parsed) with the error.
fn answer<P: Read + Write>(session: &mut Session<P>, line: &str) -> Result<Reply, (Value, anyhow::Error)> {
    let request: Request = serde_json::from_str(line).map_err(|error| (Value::Null, error.into()))?;
    let id = request.id.clone();
    let name = id.as_str().map_or_else(|| id.to_string(), str::to_owned);
    let frame = Frame::from_stress(&name, &session.model.scene.sensor, request.stress_MPa);
    frame.map_err(anyhow::Error::from).and_then(|frame| reply(session, &id, &frame)).map_err(|error| (id, error))
}

fn reply<P: Read + Write>(session: &mut Session<P>, id: &Value, frame: &Frame) -> Result<Reply> {
    let sent_s = seconds(SystemTime::now());
    let (frame, answer) = session.request(frame)?;
    let physical = PhysicalAnswer::new(&session.model, &frame, &answer)?;
    Ok(Reply { id: id.clone(), sent_s, answered_s: seconds(answer.received_at), answer: physical })
}
