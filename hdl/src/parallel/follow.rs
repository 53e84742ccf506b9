//! What is kept of a frame while it is received, in the passes, searched and sent.

use super::control::Control;
use super::Parallel;
use crate::language::{Expr, Inside};
use crate::primitives::{Arrays, Beats, BitDelay, FrameCheck, Queue, CHECK_LATENCY};
use crate::streams::EnginePorts;

impl<'k> Parallel<'k, '_> {
    /// Case, `tlast` and number of frames follow their frame; shifts and saturations their subarray.
    pub(super) fn follow(&self, c: &Control<'k>) {
        let (k, s, model) = (self.k, &self.s, self.model);
        let chooses = model.chooses();
        k.comment("Case of the frame in the passes, searched, sent");
        s.fold.case_index.set(c.frame_case);
        s.rescale.case_index.set(c.frame_case);
        s.unfold.case_index.set(c.frame_case);
        let searched_case = self.held("searched_case", c.hand_over, c.frame_case, chooses);
        let sent_case = self.held("sent_case", c.begin_send, searched_case, chooses);
        if let Some(search) = &s.search {
            search.fill_case.set(c.frame_case);
            search.case_index.set(searched_case);
        }
        s.forces.case_index.set(sent_case);
        s.send.case_index.set(sent_case);

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

    /// Of several arrays the one of the frame that is searched.
    pub(super) fn searched_array(&self, c: &Control<'k>) -> Option<Expr<'k>> {
        let (k, s) = (self.k, &self.s);
        let prepare = s.prepare.as_ref().filter(|_| Arrays::of_model(self.model).bits > 0)?;
        k.comment("Array of the frame received, in the passes, searched");
        let received = self.held("received_array", s.receive.accept, prepare.m_axis.array, true);
        let passing = self.held("frame_array", c.begin_frame, received, true);
        Some(self.held("searched_array", c.hand_over, passing, true))
    }

    /// Of several arrays the one of the frame whose `beats` come out, which was `searched`: those that wait in the output may be of
    /// several frames.
    pub(super) fn sent_array(
        &self,
        io: &EnginePorts<Inside<'k>>,
        c: &Control<'k>,
        beats: Beats<'k>,
        searched: Option<Expr<'k>>,
    ) -> Expr<'k> {
        let (k, Some(searched)) = (self.k, searched) else { return self.zero(1) };
        k.comment("Arrays of the frames that are sent");
        let sent = k.instance("sent_arrays", Queue::new(searched.bits()));
        sent.reserve.set(c.begin_send);
        sent.write.set(c.begin_send);
        sent.last.set(c.begin_send);
        sent.word.set(searched);
        sent.m_axis.ready.set(beats.valid & beats.last & io.m_axis.ready);
        // A frame has at least two beats, so that those of fewer frames than there are places wait.
        k.unused([sent.room, sent.m_axis.valid, sent.m_axis.last]);
        sent.m_axis.data
    }

    /// The `codes` of a frame are checked as they arrive; their faults follow it as its other bits do, [`CHECK_LATENCY`] cycles
    /// later. With an adaptive mean they are known before its words arrive, and the codes of the next frame come meanwhile.
    pub(super) fn check(&self, codes: Beats<'k>, c: &Control<'k>) {
        let (k, s) = (self.k, &self.s);
        let Some(check) = k.instance("check", FrameCheck::of_model(self.model)) else {
            s.forces.faults.set(self.zero(s.forces.faults.bits()));
            return;
        };
        k.comment("What the codes show");
        check.accept.set(codes.valid & *codes.ready);
        check.code.set(codes.data);
        check.tlast.set(codes.last);
        let adapts = self.model.prepare.adaptive.is_some();
        let follow = |state: &str, enters: Expr<'k>, faults: Expr<'k>| {
            let entered = match adapts {
                true => enters,
                false => {
                    let entered = k.instance(&format!("{state}_checked"), BitDelay::new(CHECK_LATENCY));
                    entered.d.set(enters);
                    entered.q
                }
            };
            self.held(&format!("{state}_faults"), entered, faults, true)
        };
        let faults = match adapts {
            true => self.held("received_faults", s.receive.accept, check.faults, true),
            false => check.faults,
        };
        let faults = follow("frame", c.arrives, faults);
        let faults = follow("searched", c.hand_over, faults);
        s.forces.faults.set(follow("sent", c.begin_send, faults));
    }
}
