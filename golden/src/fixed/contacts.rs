//! Contacts: a μ for each contact of the array, and p with the μ of each taxel's contact.
//!
//! ```text
//! v_00 ── unfold ── segment ── for each contact: window ── network ── μ
//! p ← v_00 − (Ax (m1∘p) + Ay (m2∘p))                  m: μ of each taxel's contact, as many steps as for one μ
//! ```
//! As [`crate::estimate::float::contacts`] does it with a network, in words.

use super::passes::{Passes, QuadStream};
use super::plan::contents::ContactPlan;
use super::stages::segment::{self, segment};
use super::stages::shear::shear;
use super::stages::window::{window, Array};
use super::words::network::WordNetwork;

/// The contacts of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameContacts {
    /// Contact of each taxel, row-major, as [`segment`](segment::Segmented::labels) numbers them.
    pub labels: Vec<usize>,
    /// The contacts, that with the largest load first.
    pub all: Vec<Contact>,
    /// Whether there were more contacts or basins than there may be.
    pub overflow: bool,
    /// Cycles of the segmentation.
    pub segment_cycles: u64,
}

/// One contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contact {
    /// Row and column of the taxel in its middle.
    pub middle: [usize; 2],
    /// Whether its taxels in the window meet the scene's condition.
    pub condition: bool,
    /// Position of μ in mu_max/384, [x, y]; 0 where the condition is not met.
    pub position: [i32; 2],
    /// ln of the standard deviation of μ over mu_max in 1/384, [x, y].
    pub ln_sigma: [i32; 2],
}

impl Passes<'_> {
    /// The contacts of the array, whose words in the frame buffer are `codes`, and p in words of the search.
    pub fn by_contact(
        &mut self,
        network: &WordNetwork,
        contacts: &ContactPlan,
        codes: &[i32],
    ) -> (FrameContacts, QuadStream) {
        let (plan, formats, layout) = (self.plan, self.formats, self.layout);
        let first = self.first();
        let words: Vec<i64> = layout.unpack(&first.taxels).iter().map(|p| segment::word(formats, *p)).collect();
        let sensor = &plan.scene.sensor;
        let found = segment(sensor, &contacts.segmenter, &words, plan.scene.partition.max_contacts);
        let labels = layout.pack(&found.labels);
        self.streams.segmented = labels.iter().map(|quad| quad.map(|label| label as i64)).collect();

        let array = Array { sensor, codes, dead: &plan.dead, floor: plan.noise_floor() };
        let mut all = Vec::with_capacity(found.middles.len());
        for (index, &middle) in found.middles.iter().enumerate() {
            let read = window(formats, &contacts.window, &array, middle, &|taxel| found.labels[taxel] == index + 1);
            self.streams.windows.extend(read.input.iter().chain(&read.mask));
            self.operands.window = [read.input, read.mask];
            let estimate = self.evaluate(network);
            let condition = read.own.meets(plan.scene.partition.condition);
            let position = if condition { estimate.position } else { [0; 2] };
            self.push_position(position);
            all.push(Contact { middle, condition, position, ln_sigma: estimate.ln_sigma });
        }
        let positions: Vec<[i64; 2]> = all.iter().map(|contact| contact.position.map(i64::from)).collect();
        let values = self.relaxed(first, |passes, operands| {
            let (sheared, clipped) = shear(formats, &operands, &labels, &positions);
            passes.saturations += clipped;
            passes.streams.sheared.extend(sheared.iter().flatten());
            passes.operands.sheared.push(sheared);
        });
        let segment_cycles = found.cycles;
        (FrameContacts { labels: found.labels, all, overflow: found.overflow, segment_cycles }, values)
    }
}

#[cfg(test)]
mod tests;
