//! What is kept of a frame while it is received, in the passes, searched and sent.

use super::control::Control;
use super::Parallel;

impl<'k> Parallel<'k, '_> {
    /// Case, `tlast` and number of frames follow their frame; shifts and saturations their subarray.
    pub(super) fn follow(&self, c: &Control<'k>) {
        let (k, s, model) = (self.k, &self.s, self.model);
        let chooses = model.chooses();
        k.comment("Case of the frame in the passes, searched, sent");
        s.fold.which.set(c.frame_case);
        s.rescale.which.set(c.frame_case);
        s.unfold.which.set(c.frame_case);
        let searched_case = self.held("searched_case", c.hand_over, c.frame_case, chooses);
        let sent_case = self.held("sent_case", c.begin_send, searched_case, chooses);
        if let Some(search) = &s.search {
            search.fill_which.set(c.frame_case);
            search.which.set(searched_case);
        }
        s.forces.which.set(sent_case);
        s.send.which.set(sent_case);

        k.comment("Whether `tlast` was early or missing");
        let framing = self.bit("framing", c.arrives, s.receive.framing);
        let searched_framing = self.bit("searched_framing", c.hand_over, framing);
        s.forces.framing.set(self.bit("sent_framing", c.begin_send, searched_framing));

        k.comment("Captured a cycle later, before the stages restart");
        let searched = |name: &str, word, varies| self.held(&format!("searched_{name}"), c.handed, word, varies);
        s.forces.normalise.set(searched("normalise", s.normalise.shift, true));
        s.forces.rescale.set(searched("rescale", s.rescale.shift, true));
        s.forces.saturations.set(searched("saturations", self.words().saturations, true));
        s.forces.damaged.set(searched("damaged", s.pass.damaged, model.has_coefficient_check()));

        k.comment("Frames in a sliding mean: received, in the passes, searched");
        let remembers = model.scene.input.has_memory();
        let frames = s.prepare.as_ref().map_or(self.zero(s.forces.frames.bits()), |prepare| prepare.frames);
        let received = self.held("received_frames", s.receive.accept, frames, remembers);
        let passing = self.held("frame_frames", c.begin_frame, received, remembers);
        s.forces.frames.set(self.held("searched_frames", c.hand_over, passing, remembers));
    }
}
