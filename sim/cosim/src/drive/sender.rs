//! Input side of the test bench: offers codes.

use dermis_hdl::device::Inputs;

use super::recording::{InputFrame, Times};

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
            // That of the first beat counts.
            inputs.s_array = if self.taxel == 0 { play.array } else { 0 };
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
