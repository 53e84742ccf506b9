//! The products, the network, contacts.

use super::control::Control;
use super::Parallel;
use crate::language::{Expr, Interface, Outside};
use crate::primitives::OperandSource;
use crate::stages::{Estimate, Relax};

/// The ports of an instance of `B`.
type Ports<'k, B> = <B as Interface>::Ports<Outside<'k>>;

/// Words of `rescale`, or with a network their sums with v_00.
pub(super) struct Words<'k> {
    /// Four parities of p, or of v_ij; valid with `valid`.
    words: Expr<'k>,
    valid: Expr<'k>,
    /// The same as operands; valid with `operands_valid`.
    operands: Expr<'k>,
    operands_valid: Expr<'k>,
    /// Saturations of the subarray.
    pub(super) saturations: Expr<'k>,
}

impl<'k> Parallel<'k, '_> {
    /// The words that go to `unfold` and, as operands, back to `pass`.
    pub(super) fn words(&self) -> Words<'k> {
        match &self.s.relax {
            Some(relax) => Words {
                words: relax.sums,
                valid: relax.sums_valid,
                operands: relax.operands,
                operands_valid: relax.operands_valid,
                saturations: relax.saturations,
            },
            None => {
                let rescale = &self.s.rescale;
                Words {
                    words: rescale.words,
                    valid: rescale.words_valid,
                    operands: rescale.operands,
                    operands_valid: rescale.operands_valid,
                    saturations: rescale.saturations,
                }
            }
        }
    }

    /// The products and, with a network, its layers between them.
    pub(super) fn multiply(&self, c: &Control<'k>) {
        let (k, s) = (self.k, &self.s);
        k.comment("fold -> pass -> rescale -> unfold, and back to pass");
        s.fold.read_address.set(s.pass.input_address);
        s.pass.input_quad.set(s.fold.read_quad);
        let contacts = s.contacts.as_ref();
        s.pass.section.set(contacts.map_or(c.frame_case, |contacts| contacts.section));
        s.pass.start.set(contacts.map_or(s.fold.readable, |contacts| contacts.pass_start));
        s.rescale.start.set(c.start);
        s.rescale.quad.set(s.pass.quad);
        s.rescale.quad_valid.set(s.pass.quad_valid);
        s.rescale.quad_soon.set(s.pass.quad_soon);
        s.unfold.start.set(c.start);
        let Words { words, valid, operands, operands_valid, .. } = self.words();
        s.unfold.words.set(words);
        s.unfold.words_valid.set(valid);

        self.assign(&s.pass.position_x, &s.estimate, |estimate| estimate.position_x);
        self.assign(&s.pass.position_y, &s.estimate, |estimate| estimate.position_y);
        let (quad, valid) = match (&s.estimate, &s.relax) {
            (Some(estimate), Some(relax)) => {
                self.network(c, estimate, relax);
                self.contact_operands(estimate).unwrap_or_else(|| {
                    let images = estimate.operands_valid;
                    (images.mux(estimate.operands, operands), images | operands_valid)
                })
            }
            _ => (operands, operands_valid),
        };
        s.pass.vector_quad.set(quad);
        s.pass.vector_valid.set(valid);
    }

    /// Rows of layers go to `estimate`, products to `relax`.
    fn network(&self, c: &Control<'k>, estimate: &Ports<'k, Estimate>, relax: &Ports<'k, Relax>) {
        let s = &self.s;
        let contacts = s.contacts.as_ref();
        estimate.start.set(contacts.map_or(c.start, |contacts| contacts.estimate_start));
        estimate.enabled.set(contacts.map_or(c.condition, |contacts| contacts.enabled));
        estimate.clear.set(c.start);
        estimate.quad.set(s.pass.quad);
        estimate.valid.set(s.pass.layer_valid);
        relax.start.set(c.start);
        relax.words.set(s.rescale.words);
        relax.words_valid.set(s.rescale.words_valid);
        relax.rescaled.set(s.rescale.saturations);
        relax.estimated.set(estimate.saturations);
        self.assign(&relax.sheared, &s.shear, |shear| shear.saturations);
    }

    /// With contacts, the operands of windows, layers and steps.
    fn contact_operands(&self, estimate: &Ports<'k, Estimate>) -> Option<(Expr<'k>, Expr<'k>)> {
        let (Some(window), Some(shear)) = (&self.s.window, &self.s.shear) else { return None };
        let source = self.k.instance("operand_source", OperandSource::of_model(self.model))?;
        source.images.set(estimate.operands);
        source.images_valid.set(estimate.operands_valid);
        source.window_quad.set(window.write_quad);
        source.mask.set(window.mask_quad);
        source.window_valid.set(window.write);
        source.sheared.set(shear.sheared);
        source.sheared_valid.set(shear.sheared_valid);
        Some((source.quad, source.valid))
    }

    /// With contacts, the stages that find and separate them.
    pub(super) fn find_contacts(&self, c: &Control<'k>) {
        let (k, s) = (self.k, &self.s);
        let (Some(contacts), Some(segment), Some(window)) = (&s.contacts, &s.segment, &s.window) else { return };
        let (Some(shear), Some(estimate), Some(relax)) = (&s.shear, &s.estimate, &s.relax) else { return };
        k.comment("Contacts: segment -> window -> pass, relax -> shear -> pass");
        contacts.start.set(c.start);
        contacts.readable.set(s.fold.readable);
        contacts.taxels_valid.set(s.unfold.taxels_valid);
        contacts.segmented.set(segment.done);
        contacts.count.set(segment.count);
        contacts.known.set(estimate.known);
        contacts.positive.set(window.positive);
        contacts.negative.set(window.negative);
        contacts.position_x.set(estimate.position_x);
        contacts.position_y.set(estimate.position_y);
        contacts.ln_sigma.set(estimate.ln_sigma);
        contacts.values_begin.set(c.values.begin);
        contacts.fold_address.set(s.fold.quad_address);
        contacts.window_address.set(window.quad_address);
        contacts.shear_address.set(shear.label_address);
        contacts.forces_address.set(s.forces.label_address);
        self.assign(&contacts.sent_address, &s.label_beats, |beats| beats.label_address);
        self.assign(&contacts.sends_labels, &s.label_beats, |beats| beats.reads);
        segment.fill_quad.set(s.unfold.taxels);
        segment.fill.set(contacts.fills);
        segment.fill_address.set(s.unfold.address);
        segment.start.set(contacts.segment_start);
        segment.label_address.set(contacts.label_address);
        segment.contact.set(contacts.contact);
        window.start.set(contacts.window_start);
        window.middle_row.set(segment.middle_row);
        window.middle_col.set(segment.middle_col);
        window.label.set(contacts.label);
        window.quad.set(s.receive.quad);
        window.labels.set(segment.labels);
        shear.clear.set(c.start);
        shear.operands.set(relax.operands);
        shear.operands_valid.set(relax.operands_valid);
        shear.start.set(contacts.shear_start);
        shear.labels.set(segment.labels);
        shear.positions_x.set(contacts.positions_x);
        shear.positions_y.set(contacts.positions_y);
    }
}
