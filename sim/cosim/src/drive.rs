//! Sends frames into a [`Device`] and records every transfer with its cycle.
//!
//! Full speed: one code per cycle, output always ready, a frame starts when the previous one has left completely.
//! Back to back: the same, but the next frame is offered as soon as the device accepts it. Stalls: seeded random gaps on both streams, the next frame offered as soon as the device accepts it. Input codes
//! follow the AXI4-Stream rule (once valid, a beat stays unchanged until it is accepted); the same rule is checked on
//! the output. Before a run with stalls the device is left with a frame in progress, which the reset must clear.
//!
//! Cycles are numbered from 0 at the first cycle of reset. A beat is transferred in the cycle in which valid and ready
//! are both high. Latency = cycle of the last output beat − cycle of the last input beat; total = cycle of the last
//! output beat − cycle of the first input beat + 1.

mod axis_stability;
mod receiver;
mod recording;
mod sender;
mod stimulus;

pub(crate) use axis_stability::{StabilityCheck, STABILITY_RULE};
pub use recording::{Beat, InputFrame, ProtocolViolation, Recording, TapWord, Times};
pub use stimulus::Stimulus;

use dermis_hdl::device::{Device, Inputs};
use receiver::Receiver;
use sender::Sender;
use stimulus::StallGenerator;

/// Cycles of reset before the first frame.
const RESET_CYCLES: u64 = 4;
/// Cycles after the last expected beat during which no further beat may come.
const TAIL_CYCLES: u64 = 64;

/// Sends `frames` and records the output and `taps` taps; stops after `watchdog` cycles without a transfer.
pub fn record(
    device: &mut dyn Device,
    taps: usize,
    frames: &[InputFrame],
    stimulus: Stimulus,
    watchdog: u64,
) -> Recording {
    if let (Stimulus::Stalls { .. }, Some(first)) = (stimulus, frames.first()) {
        leave_work_in_progress(device, first);
    }
    let mut receiver = Receiver::new(taps, frames);
    let mut sender = Sender::new(frames);
    let mut stalls = StallGenerator::new(stimulus);
    let wanted: usize = frames.iter().map(|f| f.beats).sum();
    let mut idle = 0;
    let mut tail = TAIL_CYCLES;
    for cycle in 0.. {
        let mut inputs = Inputs { rst: cycle < RESET_CYCLES, ..Inputs::default() };
        if !inputs.rst {
            let may_start = stimulus != Stimulus::FullSpeed || receiver.frame >= sender.frame;
            sender.offer(&mut inputs, may_start && stalls.sends());
            inputs.m_ready = stalls.receives();
        }
        let outputs = device.cycle(&inputs);
        if inputs.rst {
            continue;
        }
        let accepted = inputs.s_valid && outputs.s_ready;
        if accepted {
            sender.accepted(cycle, &mut receiver.recording.times);
            receiver.skip_unanswered(&sender);
        }
        // Surplus beats do not count, so that the watchdog also ends a device that sends forever.
        let delivered = receiver.observe(cycle, &inputs, outputs) && receiver.recording.beats.len() <= wanted;
        idle = if accepted || delivered { 0 } else { idle + 1 };
        if receiver.recording.beats.len() >= wanted && sender.frame == frames.len() {
            tail -= 1;
            if tail == 0 {
                break;
            }
        } else if idle >= watchdog {
            receiver.time_out(cycle, watchdog, &sender);
            break;
        }
    }
    receiver.recording
}

/// Leaves the device with work in progress: resets it in the middle of a frame, then sends a whole frame and stops
/// while it is being computed. The next reset must clear both.
fn leave_work_in_progress(device: &mut dyn Device, play: &InputFrame) {
    let (half, whole) = (play.codes.len() / 2, play.codes.len());
    for count in [half, whole] {
        for _ in 0..RESET_CYCLES {
            device.cycle(&Inputs { rst: true, ..Inputs::default() });
        }
        for (taxel, &s_data) in play.codes[..count].iter().enumerate() {
            let s_last = (taxel + 1).is_multiple_of(play.taxels);
            let s_array = play.array;
            device.cycle(&Inputs { s_valid: true, s_data, s_array, s_last, ..Inputs::default() });
        }
        for _ in 0..count {
            device.cycle(&Inputs::default());
        }
    }
}
