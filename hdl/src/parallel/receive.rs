//! From the input to `fold`; tables.

use dermis_golden::fixed::OwnTables;

use super::control::Control;
use super::Parallel;
use crate::language::{Expr, Inside};
use crate::primitives::{through, THRESHOLD_BITS};
use crate::streams::EnginePorts;

impl<'k> Parallel<'k, '_> {
    /// The frame buffer has been read: by `fold`, or the last window.
    pub(super) fn frees(&self) -> Expr<'k> {
        self.s.contacts.as_ref().map_or(self.s.fold.free, |contacts| contacts.free)
    }

    /// Tables and frames go to `prepare`, frames on to `fold`.
    pub(super) fn receive(&self, io: &EnginePorts<Inside<'k>>, c: &Control<'k>, searched_array: Option<Expr<'k>>) {
        let (k, s) = (self.k, &self.s);
        k.comment("prepare -> receive -> normalise -> fold");
        let codes = io.s_axis.inward();
        through!(codes, s.prepare).connect(&s.receive.s_axis);
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
        self.assign(&s.forces.version, &s.prepare, |prepare| prepare.version);
        self.assign(&s.forces.incomplete, &s.prepare, |prepare| prepare.incomplete);
        match searched_array {
            None => self.limits(),
            Some(searched) => self.limits_of_arrays(c, searched),
        }
    }

    /// Noise floor and threshold, where they are written.
    fn limits(&self) {
        let s = &self.s;
        self.assign(&s.receive.floor, &s.prepare, |prepare| prepare.noise_floor);
        if let Some(window) = &s.window {
            self.assign(&window.floor, &s.prepare, |prepare| prepare.noise_floor);
        }
        self.assign(&s.forces.threshold, &s.prepare, |prepare| prepare.threshold);
    }

    /// The same of the array of a frame, where they are written or each array has its own.
    fn limits_of_arrays(&self, c: &Control<'k>, searched: Expr<'k>) {
        let (k, s, model) = (self.k, &self.s, self.model);
        let Some(prepare) = &s.prepare else { return };
        let written = model.has_writable_tables();
        k.unused([prepare.noise_floor, prepare.threshold]);
        let of_each = |of: &dyn Fn(&OwnTables) -> u64| model.own.iter().map(of).collect::<Vec<u64>>();
        k.comment("Noise floor of the frame received, in the passes; threshold of the one that is sent");
        let (varies, bits) = (model.built_in_floor().is_none(), s.receive.floor.bits());
        let offered = match (varies, written) {
            (false, _) => self.zero(bits),
            (true, true) => prepare.noise_floor,
            (true, false) => prepare.m_axis.array.table(bits, &of_each(&|own| own.floor_word(bits as u32) as u64)),
        };
        let received = self.held("received_floor", s.receive.accept, offered, varies);
        s.receive.floor.set(received);
        if let Some(window) = &s.window {
            window.floor.set(self.held("frame_floor", c.begin_frame, received, varies));
        }
        let varies = model.built_in_threshold().is_none();
        let sent = self.held("sent_array", c.begin_send, searched, written || varies);
        if written {
            prepare.sent_array.set(sent);
        }
        s.forces.threshold.set(match (varies, written) {
            (false, _) => self.zero(THRESHOLD_BITS),
            (true, true) => prepare.threshold,
            (true, false) => {
                let own = sent.table(THRESHOLD_BITS, &of_each(&|own| own.threshold_word().into()));
                k.delay("threshold", own)
            }
        });
    }
}
