//! Output side of the test bench: records beats and taps and checks the protocol.

use dermis_hdl::device::{Inputs, Outputs};

use super::axis_stability::{StabilityCheck, STABILITY_RULE};
use super::recording::{Beat, InputFrame, ProtocolViolation, Recording, TapWord, Times};
use super::sender::Sender;

/// Records beats and taps and checks the output's protocol.
pub(super) struct Receiver {
    /// The recording so far.
    pub(super) recording: Recording,
    /// Cumulative number of beats at the end of each frame.
    ends: Vec<usize>,
    /// Array of each frame.
    arrays: Vec<usize>,
    /// Number of frames received completely.
    pub(super) frame: usize,
    stability: StabilityCheck,
}

impl Receiver {
    pub(super) fn new(taps: usize, frames: &[InputFrame]) -> Self {
        let ends = frames.iter().scan(0, |sum, f| {
            *sum += f.beats;
            Some(*sum)
        });
        let recording = Recording {
            taps: vec![Vec::new(); taps],
            times: vec![Times::default(); frames.len()],
            ..Recording::default()
        };
        let arrays = frames.iter().map(|frame| frame.array).collect();
        Receiver { recording, ends: ends.collect(), arrays, frame: 0, stability: StabilityCheck::default() }
    }

    fn add_violation(&mut self, cycle: u64, rule: String) {
        let beat = self.recording.beats.len();
        self.recording.violations.push(ProtocolViolation { cycle, beat, rule });
    }

    /// Passes over images of tables, which have no answer, once they have been sent.
    pub(super) fn skip_unanswered(&mut self, sender: &Sender) {
        while self.frame < sender.frame && sender.frames.get(self.frame).is_some_and(|frame| frame.beats == 0) {
            self.frame += 1;
        }
    }

    /// Observes one cycle; whether a beat was transferred.
    pub(super) fn observe(&mut self, cycle: u64, inputs: &Inputs, outputs: Outputs) -> bool {
        let (transferred, stable) = self.stability.observe(&outputs, inputs.m_ready);
        if !stable {
            self.add_violation(cycle, STABILITY_RULE.into());
        }
        for (stream, word) in self.recording.taps.iter_mut().zip(outputs.taps) {
            if let Some(fields) = word {
                stream.push(TapWord { cycle, fields });
            }
        }
        let Some((data, last, array)) = transferred else {
            return false;
        };
        match self.recording.times.get(self.frame).map(|t| t.last_in) {
            None => self.add_violation(cycle, "no beat may follow the last frame".into()),
            Some(None) => self.add_violation(cycle, "no beat may precede the frame's last input beat".into()),
            Some(Some(_)) => {
                let end = self.ends[self.frame];
                if array != self.arrays[self.frame] {
                    let rule = format!("tid is {array}, of a frame of array {}", self.arrays[self.frame]);
                    self.add_violation(cycle, rule);
                }
                let final_beat = self.recording.beats.len() + 1 == end;
                if last != final_beat {
                    let rule = if last {
                        "tlast is only allowed on the last status beat"
                    } else {
                        "tlast is missing on the last status beat"
                    };
                    self.add_violation(cycle, rule.into());
                }
                if final_beat {
                    self.recording.times[self.frame].last_out = Some(cycle);
                    self.frame += 1;
                }
            }
        }
        self.recording.beats.push(Beat { cycle, data, last });
        true
    }

    pub(super) fn time_out(&mut self, cycle: u64, watchdog: u64, sender: &Sender) {
        let awaited = match sender.frames.get(sender.frame) {
            // The output is behind the input: a beat is missing.
            Some(_) if self.frame < sender.frame => self.awaited_beat(),
            Some(play) => format!("s_axis_tready for taxel {} of {}", sender.taxel, play.codes.len()),
            None => self.awaited_beat(),
        };
        let rule = format!("no transfer for {watchdog} cycles while waiting for {awaited}");
        let beat = self.recording.beats.len();
        self.recording.timeout = Some(ProtocolViolation { cycle, beat, rule });
    }

    fn awaited_beat(&self) -> String {
        let before = self.frame.checked_sub(1).map_or(0, |f| self.ends[f]);
        let end = self.ends.get(self.frame).copied().unwrap_or(before);
        format!("output beat {} of {}", self.recording.beats.len() - before, end - before)
    }
}
