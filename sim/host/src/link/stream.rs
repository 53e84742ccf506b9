//! `dermis host --stream`: frames and answers as lines of JSON; of a board that scans its array, answers alone.

use std::io::{BufRead, BufReader, Write};
use std::time::SystemTime;

use anyhow::{anyhow, Result};
use dermis_flow::say;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::text::{Decoded, Stated};
use dermis_golden::engine::{CheckPace, StreamChecks};
use dermis_golden::fixed::Model;
use serde::Serialize;
use serde_json::Value;

use super::answer::{BoardAnswer, PhysicalAnswer};
use super::error::HostError;
use super::session::Session;
use crate::stream::acquisition::Acquisition;
use crate::stream::line::{self, Frames, LineFrame, NoFrame, Piece};
use crate::stream::{nanoseconds, seconds};
use dermis_flow::output::write;

/// An output line with an answer.
#[derive(Serialize)]
struct Reply {
    id: Value,
    /// Nanoseconds since 1970 when the frame was acquired: as its line states, else when it entered the core, of one that says it,
    /// else when it was sent or requested.
    time_ns: i64,
    /// By how many ns the time at which it entered the core may differ from the true one.
    #[serde(skip_serializing_if = "Option::is_none")]
    time_error_ns: Option<u64>,
    /// Seconds since 1970 when the frame was sent, and when its answer was complete.
    sent_s: f64,
    answered_s: f64,
    /// What the board has scanned, row-major, in the unit of the readings.
    #[serde(skip_serializing_if = "Option::is_none")]
    readings: Option<Vec<f64>>,
    #[serde(flatten)]
    answer: PhysicalAnswer,
}

impl Reply {
    /// The line for an answer to `readings`, which were acquired at `time_ns` and requested at `sent`, with `checks`.
    fn new(
        model: &Model,
        checks: &mut StreamChecks,
        id: Value,
        (stated_ns, sent): (Option<i64>, SystemTime),
        readings: &Frame,
        answer: &BoardAnswer,
    ) -> Result<Reply> {
        let mut physical = PhysicalAnswer::new(model, readings, answer)?;
        checks.add(std::slice::from_ref(readings), physical.resultant_N, &mut physical.diagnostics());
        let (sent_s, answered_s) = (seconds(sent), seconds(answer.received_at));
        let acquired = answer.acquired.filter(|_| stated_ns.is_none());
        let time_ns = stated_ns.unwrap_or_else(|| acquired.map_or(nanoseconds(sent), |acquired| acquired.time_ns));
        let time_error_ns = acquired.map(|acquired| acquired.error_ns);
        Ok(Reply { id, time_ns, time_error_ns, sent_s, answered_s, readings: None, answer: physical })
    }
}

/// An output line for an input line that was refused.
#[derive(Serialize)]
struct Refusal {
    id: Value,
    line: u64,
    error: String,
}

/// Result of sending all frames.
pub struct FramesSent {
    /// Text for standard output; empty with `--stream`.
    pub text: String,
    /// Whether every compared answer was equal to the model's.
    pub equal: bool,
    /// Number of frames answered.
    pub answered: usize,
    /// Number of input lines that are not a valid frame.
    pub refused: usize,
}

/// Answers every line of `input`; an invalid line is answered with its error.
///
/// # Errors
/// A board that does not answer, streams that fail.
pub fn run(
    session: &mut Session,
    layout: Stated,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<FramesSent> {
    let mut sent = FramesSent { text: String::new(), equal: true, answered: 0, refused: 0 };
    let (mut bytes, mut checks) = (Vec::new(), StreamChecks::new(&session.model, CheckPace::Beside));
    let (mut times, mut frames) = (Acquisition::default(), Frames::new(&session.model.scene.sensor, layout));
    let mut input = BufReader::new(Decoded::new(input));
    for number in 1.. {
        let piece =
            line::read(&mut input, &mut bytes).map_err(|error| anyhow!("standard input, line {number}: {error}"))?;
        let mut brought = match piece {
            None => frames.finish(),
            Some(Piece::Line) if bytes.iter().all(u8::is_ascii_whitespace) => Vec::new(),
            Some(Piece::Line) => frames.push(&bytes, number),
            Some(piece) => frames.refuse(number, piece.refusal().unwrap_or_default()),
        };
        // Who waits for an answer sends no further line.
        if frames.is_waiting() && input.buffer().is_empty() {
            brought.extend(frames.settle());
        }
        if let Some(note) = frames.note() {
            say!("standard input: {note}");
        }
        for (number, frame) in brought {
            let text = match answer(session, &mut checks, &mut times, frame) {
                Ok(reply) => {
                    sent.equal &= reply.answer.equal != Some(false);
                    sent.answered += 1;
                    serde_json::to_string(&reply)?
                }
                // Without a working board no further line can be answered.
                Err((_, error)) if error.is::<HostError>() => return Err(error),
                Err((id, error)) => {
                    sent.refused += 1;
                    serde_json::to_string(&Refusal { id, line: number, error: error.to_string() })?
                }
            };
            if !write(output, format!("{text}\n").as_bytes())? {
                return Ok(sent);
            }
        }
        if piece.is_none() {
            break;
        }
    }
    Ok(sent)
}

/// The answer to the frame of a line, or the line's id (null if it cannot be parsed) with the error.
fn answer(
    session: &mut Session,
    checks: &mut StreamChecks,
    times: &mut Acquisition,
    frame: Result<LineFrame, NoFrame>,
) -> Result<Reply, (Value, anyhow::Error)> {
    let line = frame.map_err(|NoFrame { id, reason }| (id, anyhow!(reason)))?;
    let sent = SystemTime::now();
    let stated_ns = line.frame.time_ns.map(|stated| times.time_ns(Some(stated), nanoseconds(sent)));
    match reply(session, checks, &line.id, (stated_ns, sent), &line.frame) {
        Ok(mut reply) => {
            reply.answer.diagnostics().raise(line.flag());
            Ok(reply)
        }
        Err(error) => Err((line.id, error)),
    }
}

fn reply(
    session: &mut Session,
    checks: &mut StreamChecks,
    id: &Value,
    times: (Option<i64>, SystemTime),
    frame: &Frame,
) -> Result<Reply> {
    let (frame, answer) = session.request(frame)?;
    Reply::new(&session.model, checks, id.clone(), times, &frame, &answer)
}

/// Writes a line for each of so many scans of a board that scans its array.
///
/// # Errors
/// A board that does not answer, a stream that fails.
pub fn run_scans(
    session: &mut Session,
    scans: impl Iterator<Item = String>,
    output: &mut dyn Write,
) -> Result<FramesSent> {
    let mut sent = FramesSent { text: String::new(), equal: true, answered: 0, refused: 0 };
    let mut checks = StreamChecks::new(&session.model, CheckPace::Beside);
    for id in scans {
        let requested_at = SystemTime::now();
        let (readings, answer) = session.scan(&id)?;
        let reply = Reply::new(&session.model, &mut checks, id.into(), (None, requested_at), &readings, &answer)?;
        let reply = Reply { readings: Some(readings.stress_MPa), ..reply };
        sent.equal &= reply.answer.equal != Some(false);
        sent.answered += 1;
        if !write(output, (serde_json::to_string(&reply)? + "\n").as_bytes())? {
            break;
        }
    }
    Ok(sent)
}
