//! Input side of the test bench: offers codes, and generates the stalls of both sides.

use dermis_hdl::device::Inputs;

use super::recording::{InputFrame, Times};
use super::Stimulus;

/// The receiver starts a long pause, which fills every buffer, once in so many cycles on average.
const LONG_PAUSE_EVERY: u32 = 64;
/// Length of a long pause in cycles.
const LONG_PAUSE_CYCLES: u32 = 40;

/// Offers codes to the device.
pub(super) struct Sender<'a> {
    /// All frames to send.
    pub(super) frames: &'a [InputFrame<'a>],
    /// Index of the frame being sent; the number of frames once all are sent.
    pub(super) frame: usize,
    /// Index of its next code.
    pub(super) taxel: usize,
    /// Whether a code is offered and not accepted yet.
    offering: bool,
}

impl<'a> Sender<'a> {
    pub(super) fn new(frames: &'a [InputFrame<'a>]) -> Self {
        Sender { frames, frame: 0, taxel: 0, offering: false }
    }

    pub(super) fn offer(&mut self, inputs: &mut Inputs, start: bool) {
        let Some(play) = self.frames.get(self.frame) else {
            return;
        };
        self.offering |= start;
        if self.offering {
            inputs.s_valid = true;
            inputs.s_data = play.codes[self.taxel];
            inputs.s_last = (self.taxel + 1).is_multiple_of(play.taxels);
        }
    }

    pub(super) fn accepted(&mut self, cycle: u64, times: &mut [Times]) {
        let times = &mut times[self.frame];
        times.first_in.get_or_insert(cycle);
        self.offering = false;
        self.taxel += 1;
        if self.taxel == self.frames[self.frame].codes.len() {
            times.last_in = Some(cycle);
            self.frame += 1;
            self.taxel = 0;
        }
    }
}

/// Decides in which cycles the sender starts to offer a code and the receiver is ready.
pub(super) struct StallGenerator {
    random: Option<fastrand::Rng>,
    pause: u32,
}

impl StallGenerator {
    pub(super) fn new(stimulus: Stimulus) -> Self {
        let random = match stimulus {
            Stimulus::FullSpeed => None,
            Stimulus::Stalls { seed } => Some(fastrand::Rng::with_seed(seed)),
        };
        StallGenerator { random, pause: 0 }
    }

    pub(super) fn sends(&mut self) -> bool {
        self.random.as_mut().is_none_or(|r| r.bool())
    }

    pub(super) fn receives(&mut self) -> bool {
        let Some(random) = &mut self.random else {
            return true;
        };
        if self.pause > 0 {
            self.pause -= 1;
            return false;
        }
        if random.u32(..LONG_PAUSE_EVERY) == 0 {
            self.pause = LONG_PAUSE_CYCLES;
        }
        random.bool()
    }
}
