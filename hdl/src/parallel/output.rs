//! The search, forces, statuses, the output.

use super::control::{Control, Values};
use super::Parallel;
use crate::language::{Expr, Inside};
use crate::primitives::{position_bits, through, Beats, BitDelay};
use crate::streams::EnginePorts;

/// What is stored of a subarray or a contact for its status.
struct Status<'k> {
    start: Expr<'k>,
    part: Expr<'k>,
    position: [Expr<'k>; 2],
    score: Expr<'k>,
    found: Expr<'k>,
    condition: Expr<'k>,
}

impl<'k> Parallel<'k, '_> {
    /// The values of the search, which starts with `seeks`. Without one the taxels of the last vector are the values, all there
    /// before `seeks`; since the force memory is written while the passes run, a frame is then not computed before the
    /// previous one has been sent.
    pub(super) fn values(&self, seeks: Expr<'k>) -> Values<'k> {
        let (k, unfold) = (self.k, &self.s.unfold);
        let wires = |step, valid| (k.wire("values", step), k.wire("values_valid", valid));
        if let Some(search) = &self.s.search {
            let (step, valid) = wires(search.values, search.values_valid);
            let (settled, begin, done, stalled) = (search.settled, search.values_begin, search.done, search.stalled);
            return Values { step, valid, settled, begin, done, stalled };
        }
        let last = self.model.formats().vectors() as u64 - 1;
        let valid = unfold.taxels_valid;
        let (step, valid) = wires(unfold.taxels, if last > 0 { valid & unfold.index.is(last) } else { valid });
        let began = k.instance("began", BitDelay::new(1));
        began.d.set(seeks);
        Values { step, valid, settled: began.q, begin: began.q, done: began.q, stalled: self.zero(1) }
    }

    /// Beats of a subarray may be requested: its values begin, of contacts once the last status is stored.
    pub(super) fn begins(&self, values: &Values<'k>) -> Expr<'k> {
        self.s.contacts.as_ref().map_or(values.begin, |contacts| contacts.begins)
    }

    /// A subarray is out of the passes and the search.
    pub(super) fn ended(&self, values: &Values<'k>) -> Expr<'k> {
        self.s.contacts.as_ref().map_or(values.done, |contacts| contacts.ended)
    }

    /// Coefficients go to the search, where there is one.
    pub(super) fn search(&self, c: &Control<'k>) {
        let (k, unfold) = (self.k, &self.s.unfold);
        let Some(search) = &self.s.search else { return };
        k.comment("unfold -> search");
        search.fill_quad.set(unfold.taxels);
        search.fill.set(unfold.taxels_valid);
        search.fill_index.set(unfold.index);
        search.fill_address.set(unfold.address);
        search.start.set(c.seeks);
        search.enabled.set(c.searched_condition);
        search.ready.set(if self.is_single() { !c.unsent } else { k.constant(1, 1) });
    }

    /// The status from the stage that found μ; without any μ is 0.
    fn status(&self, c: &Control<'k>) -> Status<'k> {
        let s = &self.s;
        if let Some(contacts) = &s.contacts {
            return Status {
                start: contacts.status_valid,
                part: contacts.status_label,
                position: [contacts.status_x, contacts.status_y],
                score: contacts.status_ln_sigma,
                found: contacts.status_condition,
                condition: contacts.status_condition,
            };
        }
        let (start, condition) = (c.values.settled, c.searched_condition);
        let part = self.held("searched_part", c.hand_over, c.part, true);
        let (position, score, found) = match (&s.estimate, &s.search) {
            (Some(network), _) => ([network.position_x, network.position_y], network.ln_sigma, condition),
            (None, Some(search)) => ([search.best_x, search.best_y], search.score, search.found),
            (None, None) => ([self.zero(position_bits()); 2], self.zero(s.forces.score.bits()), self.zero(1)),
        };
        Status { start, part, position, score, found, condition }
    }

    /// Values and statuses go to `forces`, beats that `send` requests to the output.
    pub(super) fn send(&self, io: &EnginePorts<Inside<'k>>, c: &Control<'k>, searched_array: Option<Expr<'k>>) {
        let (k, s) = (self.k, &self.s);
        k.comment("search -> forces -> send");
        s.forces.values.set(c.values.step);
        s.forces.values_valid.set(c.values.valid);
        s.forces.begin_frame.set(c.begin_values);
        let Status { start, part, position: [x, y], score, found, condition } = self.status(c);
        s.forces.start.set(start);
        s.forces.part.set(part);
        s.forces.position_x.set(x);
        s.forces.position_y.set(y);
        s.forces.score.set(score);
        s.forces.found.set(found);
        s.forces.condition.set(condition);
        self.assign(&s.forces.labels, &s.segment, |segment| segment.labels);
        self.assign(&s.forces.overflow, &s.segment, |segment| segment.overflow);
        s.forces.cycles.set(c.cycles);
        s.send.start.set(c.begin_send);
        s.send.begins.set(self.begins(&c.values));
        s.send.room.set(s.forces.room);
        s.forces.offer.set(s.send.offer);
        s.forces.beat.set(s.send.beat);
        s.forces.beat_part.set(s.send.part);
        s.forces.address.set(s.send.address);
        s.forces.lane.set(s.send.lane);

        s.send.m_axis_tvalid.set(s.forces.m_axis.valid);
        s.send.m_axis_tlast.set(s.forces.m_axis.last);
        s.send.m_axis_tready.set(*s.forces.m_axis.ready);
        let beats = through!(s.forces.m_axis, s.label_beats);
        if let (Some(beats), Some(segment)) = (&s.label_beats, &s.segment) {
            beats.labels.set(segment.labels);
        }
        let beats = through!(beats, s.resultants);
        Beats { array: self.sent_array(io, c, beats, searched_array), ..beats }.connect(&io.m_axis);
        if let Some(prepare) = &s.prepare {
            k.comment("Tables are written while no frame is under way");
            prepare.idle.set(!(s.receive.full | c.computes | beats.valid));
        }
    }
}
