//! A result as the page gets it.

use dermis_golden::data::frame::Frame;
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction};
use serde::Serialize;

use super::newest::Newest;
use dermis_host::stream::{Outcome, StreamAnswer};

/// The newest result with its frame.
#[derive(Serialize)]
pub struct Picture<'a> {
    /// Number of the result, from 0.
    pub sequence: u64,
    /// Seconds since 1970 when the frame was there.
    pub received_s: f64,
    /// Seconds since 1970 when the result was ready.
    pub answered_s: f64,
    /// Lines dropped so far, because a newer one was there.
    pub dropped: u64,
    /// Name of the estimator.
    pub estimator: &'a str,
    /// Lines refused so far.
    pub refused: u64,
    /// Number and error of the last refused line.
    pub refusal: Option<&'a str>,
    /// Stress of each taxel in MPa, row-major; null where a reading is missing.
    pub stress_MPa: Vec<f64>,
    /// The contacts of the result.
    pub contacts: Vec<FoundContact>,
    /// The result.
    pub result: &'a Reconstruction,
    /// What is known about the forces.
    pub truth: Option<Truth<'a>>,
}

/// The known forces of a generated frame.
#[derive(Serialize)]
pub struct Truth<'a> {
    /// Sum in N, [x, y, normal].
    resultant_N: [f64; 3],
    /// Force along x on each taxel's cell, N.
    fx: &'a [f64],
    /// Force along y on each taxel's cell, N.
    fy: &'a [f64],
    /// Normal force on each taxel's cell, N.
    fz: &'a [f64],
}

impl<'a> Truth<'a> {
    /// The known forces of a frame, if it has any.
    fn of(frame: &'a Frame) -> Option<Truth<'a>> {
        let cells = frame.cell_forces_N.as_ref()?;
        Some(Truth { resultant_N: frame.resultant_N?, fx: &cells.fx, fy: &cells.fy, fz: &cells.fz })
    }
}

/// Shows outcomes of a stream: answers at once, refusals with the answer that follows.
pub struct Show<'a> {
    newest: &'a Newest,
    refused: u64,
    refusal: Option<String>,
}

impl<'a> Show<'a> {
    /// Shows them as the `newest` picture.
    pub fn new(newest: &'a Newest) -> Self {
        Show { newest, refused: 0, refusal: None }
    }

    /// Shows one outcome.
    ///
    /// # Errors
    /// A result that cannot be written as JSON.
    pub fn outcome(&mut self, outcome: &Outcome) -> std::io::Result<()> {
        match outcome {
            Outcome::Refusal(refusal) => {
                self.refused += 1;
                // A frame without a name is named by its line already.
                let line = format!("line {}: ", refusal.line);
                let error = refusal.error.strip_prefix(&line).unwrap_or(refusal.error);
                self.refusal = Some(line.clone() + error);
            }
            // Said on standard error; the picture has the estimator.
            Outcome::Note(_) => (),
            Outcome::Answer(StreamAnswer {
                sequence,
                received_s,
                answered_s,
                dropped,
                estimator,
                frames,
                result,
                ..
            }) => {
                let Some(frame) = frames.last() else { return Ok(()) };
                let picture = Picture {
                    sequence: *sequence,
                    received_s: *received_s,
                    answered_s: *answered_s,
                    dropped: *dropped,
                    estimator,
                    refused: self.refused,
                    refusal: self.refusal.as_deref(),
                    stress_MPa: frame.readings(),
                    contacts: result.all_contacts(),
                    result,
                    truth: Truth::of(frame),
                };
                self.newest.publish(serde_json::to_string(&picture)?);
            }
        }
        Ok(())
    }
}
