//! What starts the stages and hands subarrays over.

use dermis_golden::spec::scene::Condition;

use super::Parallel;
use crate::language::Expr;
use crate::primitives::{Arrival, BitDelay, CaseCounter, Dff, EnableRegister, FrameCycles};

/// Signals of the control.
pub(super) struct Control<'k> {
    /// A frame enters the passes.
    pub(super) begin_frame: Expr<'k>,
    /// Index of the case of the frame in the passes.
    pub(super) frame_case: Expr<'k>,
    /// The first subarray of a frame is complete.
    pub(super) arrives: Expr<'k>,
    /// A subarray starts, of this index; it is the frame's last; it meets the scene's condition.
    pub(super) start: Expr<'k>,
    pub(super) part: Expr<'k>,
    pub(super) last_part: Expr<'k>,
    pub(super) condition: Expr<'k>,
    /// A subarray goes to the search; the same one cycle later, and two.
    pub(super) hand_over: Expr<'k>,
    pub(super) handed: Expr<'k>,
    pub(super) seeks: Expr<'k>,
    /// The first values of a frame come next.
    pub(super) begin_values: Expr<'k>,
    /// The subarray that is searched meets the condition.
    pub(super) searched_condition: Expr<'k>,
    /// What the search gives.
    pub(super) values: Values<'k>,
    /// A frame is sent from now on; one is being sent.
    pub(super) begin_send: Expr<'k>,
    pub(super) unsent: Expr<'k>,
    /// Cycle counter of the frame.
    pub(super) cycles: Expr<'k>,
    /// A frame is under way behind the frame buffer.
    pub(super) computes: Expr<'k>,
}

/// p(μ*) of a subarray, and when; in a scene without a search p as it leaves the passes.
pub(super) struct Values<'k> {
    /// One step of values.
    pub(super) step: Expr<'k>,
    /// `step` holds values.
    pub(super) valid: Expr<'k>,
    /// The result is known; high for one cycle.
    pub(super) settled: Expr<'k>,
    /// The values can be read from now on; high for one cycle.
    pub(super) begin: Expr<'k>,
    /// All values have left; high for one cycle.
    pub(super) done: Expr<'k>,
    /// The last sweep of the search waits in this cycle.
    pub(super) stalled: Expr<'k>,
}

/// How much of a frame has arrived.
struct Arrived<'k> {
    /// Enough to begin the passes.
    ready: Expr<'k>,
    /// The frame in the passes is complete; high for one cycle.
    arrives: Expr<'k>,
    /// It is not complete yet; it was dropped. Neither where a frame begins only when it is complete.
    waits: Option<Expr<'k>>,
    discards: Option<Expr<'k>>,
}

/// `value`, but 0 where `condition`.
fn unless<'k>(value: Expr<'k>, condition: Option<Expr<'k>>) -> Expr<'k> {
    condition.map_or(value, |condition| value & !condition)
}

impl<'k> Parallel<'k, '_> {
    /// `word` of the last cycle in which `enable` was high; `word` itself where it never varies.
    pub(super) fn held(&self, name: &str, enable: Expr<'k>, word: Expr<'k>, varies: bool) -> Expr<'k> {
        if !varies {
            return word;
        }
        let register = self.k.instance(name, EnableRegister::new(word.bits()));
        register.enable.set(enable);
        register.word.set(word);
        register.held
    }

    /// A bit that takes `value` where `takes` is high.
    pub(super) fn bit(&self, name: &str, takes: Expr<'k>, value: Expr<'k>) -> Expr<'k> {
        let bit = self.k.instance(name, Dff {});
        bit.d.set(takes.mux(value, bit.q));
        bit.q
    }

    /// `value` one cycle later, 0 after a restart.
    fn later(&self, name: &str, value: Expr<'k>) -> Expr<'k> {
        let later = self.k.instance(name, BitDelay::new(1));
        later.d.set(value);
        later.q
    }

    /// The frame that arrives; `begins` and `complete` are those of the frame in the passes.
    fn arrived(&self, begins: Expr<'k>, complete: Expr<'k>) -> Arrived<'k> {
        let (k, receive) = (self.k, &self.s.receive);
        if !self.model.begins_with_first_row() {
            return Arrived { ready: receive.full, arrives: begins, waits: None, discards: None };
        }
        let arrival = k.instance("arrival", Arrival {});
        arrival.row_end.set(receive.row_end);
        arrival.dropped.set(receive.dropped);
        arrival.free.set(self.frees());
        arrival.full.set(receive.full);
        arrival.begins.set(begins);
        arrival.complete.set(complete);
        let (waits, discards) = (Some(arrival.waits), Some(arrival.discards));
        Arrived { ready: arrival.ready, arrives: arrival.arrives, waits, discards }
    }

    /// What starts the stages and hands their results over.
    pub(super) fn control(&self) -> Control<'k> {
        let (k, s, parts) = (self.k, &self.s, self.parts());
        let restart = self.restart;
        let flag = |name: &str| k.instance(name, Dff {});
        let [computing, filled, first] = ["computing", "filled", "first"].map(flag);
        let [searching, sending] = ["searching", "sending"].map(flag);
        let [begins, again, handed] = ["begins", "again", "handed"].map(|name| k.instance(name, BitDelay::new(1)));
        let seeks = self.later("seeks", handed.q);
        let values = self.values(seeks);

        k.comment("A frame starts: buffer full, or its first row of subarrays in it;");
        k.comment("previous frame out of the passes");
        let complete = k.wire("complete", filled.q | s.unfold.done);
        let Arrived { ready, arrives, waits, discards } = self.arrived(begins.q, complete);
        let idle = ready & !begins.q & !computing.q;
        begins.d.set(if self.is_ahead() { idle } else { idle & !sending.q });
        let begin_frame = k.wire("begin_frame", begins.q);
        let frame_case = self.held("frame_case", begin_frame, s.receive.case_index, parts.len() > 1);
        let start = k.wire("start", begin_frame | again.q);
        let (positive, negative) = (s.receive.positive, s.receive.negative);
        let meets = match self.model.scene.partition.condition {
            Condition::BothSigns => positive & negative,
            _ => positive | negative,
        };
        let condition = self.bit("condition", start, meets);

        k.comment("A subarray goes to the search when the search is idle;");
        k.comment("the first of several also waits for the previous send,");
        k.comment("as does one that is not searched: its only sweep reads");
        k.comment("the memory that the next frame is written to");
        let unsent = k.wire("unsent", sending.q & !s.send.done);
        let behind = first.q & unsent;
        let behind = k.wire("behind", if self.is_single() { behind & !condition } else { behind });
        let hand_over = unless(complete, waits) & !behind & (!searching.q | values.done);
        let hand_over = k.wire("hand_over", hand_over);
        handed.d.set(hand_over);
        filled.d.set(unless(complete & !hand_over, discards) & !restart);
        searching.d.set((hand_over | (searching.q & !values.done)) & !restart);
        first.d.set(begin_frame | (first.q & !hand_over));
        let searched_first = self.bit("searched_first", hand_over, first.q);
        let begin_send = k.wire("begin_send", self.begins(&values) & searched_first);
        sending.d.set((begin_send | (sending.q & !s.send.done)) & !restart);

        k.comment("Then the next subarray starts");
        let part = k.instance("part", CaseCounter::new(&parts));
        part.case_index.set(frame_case);
        part.clear.set(restart);
        part.enable.set(hand_over);
        again.d.set(hand_over & !part.last);
        let passed = match self.is_ahead() {
            true => hand_over & part.last,
            false => self.ended(&values) & self.bit("searched_last", hand_over, part.last),
        };
        let passed = k.wire("passed", passed);
        computing.d.set(unless(begin_frame | (computing.q & !passed), discards) & !restart);

        k.comment("Waiting for frames or their rest is not counted");
        let frame_cycles = k.instance("frame_cycles", FrameCycles::default());
        frame_cycles.begin_frame.set(begin_frame);
        frame_cycles.waits.set(complete & first.q & !hand_over);
        frame_cycles.hand_over.set(hand_over & first.q);
        frame_cycles.stalled.set(values.stalled);
        Control {
            begin_frame,
            frame_case,
            arrives,
            start,
            part: part.value,
            last_part: part.last,
            condition,
            hand_over,
            handed: handed.q,
            seeks,
            begin_values: match (self.is_ahead(), self.is_single()) {
                (true, false) => self.later("opens", hand_over & first.q),
                (true, true) => values.settled,
                (false, _) => begin_frame,
            },
            searched_condition: self.bit("searched_condition", hand_over, condition),
            values,
            begin_send,
            unsent,
            cycles: frame_cycles.cycles,
            computes: begins.q | computing.q | filled.q | searching.q | sending.q,
        }
    }
}
