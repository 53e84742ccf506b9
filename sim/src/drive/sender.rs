//! The input side of the bench: offers codes, and decides in which cycles each side is willing.

use dermis_hdl::device::Inputs;

use super::recording::{InputFrame, Times};
use super::Stimulus;

/// One of so many cycles starts a long pause of the receiver, which fills every buffer behind it.
const LONG_PAUSE_EVERY: u32 = 64;
/// Length of a long pause.
const LONG_PAUSE_CYCLES: u32 = 40;

/// Offers the codes.
pub(super) struct Sender<'a> {
    /// All frames to send.
    pub(super) frames: &'a [InputFrame<'a>],
    /// The frame being sent; their number when all are.
    pub(super) frame: usize,
    /// Its next taxel.
    pub(super) taxel: usize,
    /// A beat is offered and not taken yet.
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

/// When the two sides of the bench are willing.
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
