//! From the input to `fold`; tables.

use super::control::Control;
use super::Parallel;
use crate::language::{Expr, Inside};
use crate::streams::{arrive_at, through, Beats, EnginePorts};

impl<'k> Parallel<'k, '_> {
    /// The frame buffer has been read: by `fold`, or the last window.
    pub(super) fn frees(&self) -> Expr<'k> {
        self.s.contacts.as_ref().map_or(self.s.fold.free, |contacts| contacts.free)
    }

    /// Tables and frames go to `prepare`, frames on to `fold`.
    pub(super) fn receive(&self, io: &EnginePorts<Inside<'k>>, c: &Control<'k>) {
        let (k, s) = (self.k, &self.s);
        k.comment("prepare -> receive -> normalise -> fold");
        let (data, valid, last) = (io.s_axis_tdata, io.s_axis_tvalid, io.s_axis_tlast);
        let codes = Beats { data, valid, last, ready: io.s_axis_tready.net() };
        arrive_at!(through!(codes, s.prepare), s.receive);
        if let Some(prepare) = &s.prepare {
            prepare.s_axis_tid.set(io.s_axis_tid);
        }
        self.check(codes, c);
        let fold_address = s.fold.quad_address;
        s.receive.quad_address.set(s.contacts.as_ref().map_or(fold_address, |contacts| contacts.quad_address));
        s.receive.free.set(self.frees());
        s.receive.reported.set(c.arrives);
        s.receive.part.set(c.part);
        s.normalise.start.set(c.start);
        s.normalise.magnitude.set(s.receive.magnitude);
        s.normalise.quad.set(s.receive.quad);
        s.fold.begin_frame.set(c.begin_frame);
        s.fold.start.set(c.start);
        s.fold.last_part.set(c.last_part);
        s.fold.normalised.set(s.normalise.shifted);

        k.comment("Tables");
        self.assign(&s.pass.coefficient_write, &s.prepare, |prepare| prepare.coefficient_write);
        self.assign(&s.pass.coefficient_word, &s.prepare, |prepare| prepare.coefficient_word);
        self.assign(&s.pass.coefficient_pair, &s.prepare, |prepare| prepare.coefficient_pair);
        self.assign(&s.pass.coefficient_data, &s.prepare, |prepare| prepare.coefficient_data);
        self.assign(&s.receive.floor, &s.prepare, |prepare| prepare.noise_floor);
        if let Some(window) = &s.window {
            self.assign(&window.floor, &s.prepare, |prepare| prepare.noise_floor);
        }
        self.assign(&s.forces.threshold, &s.prepare, |prepare| prepare.threshold);
        self.assign(&s.forces.version, &s.prepare, |prepare| prepare.version);
        self.assign(&s.forces.incomplete, &s.prepare, |prepare| prepare.incomplete);
    }
}
