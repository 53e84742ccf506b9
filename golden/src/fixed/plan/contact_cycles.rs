//! Cycles of the passes of a frame where each contact has a μ of its own. They depend on what [`segment`] finds.
//!
//! ```text
//! v_00 ── segment ── for each contact: 2, window, layers, μ ── 1 ── for each step: shear, products, relax, unfold
//! ```
//! [`segment`]: crate::fixed::stages::segment

use super::contents::{CasePlan, ContactPlan, Plan};
use super::timeline::{timeline, Begins, RELAX, UNFOLD};
use crate::fixed::stages::{shear, window};
use crate::fixed::words::schedule::{sections, Section};

/// Cycles from the end of the segmentation, or from the μ of a contact, to the start of the next contact's window: the middle
/// of the contact, the start.
const PLACE: u64 = 2;
/// Cycles from the last μ, or from the end of the segmentation without a contact, to the start of the first step.
const STEP: u64 = 1;

/// Data-dependent quantities that determine the cycles of a frame with contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContactTiming {
    /// Cycles of the segmentation.
    pub segment: u64,
    /// Number of contacts with a μ of their own.
    pub contacts: usize,
}

/// Cycles from the start of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ContactCycles {
    /// Until the frame buffer is free.
    pub free: u64,
    /// Until the passes are complete.
    pub complete: u64,
}

impl ContactTiming {
    /// The one with most cycles: as many contacts as there may be, and the longest segmentation. `None` where there is one μ.
    pub fn longest(plan: &Plan) -> Option<ContactTiming> {
        let segment = plan.by_contact.as_ref()?.segmentation(&plan.scene).longest();
        Some(ContactTiming { segment, contacts: plan.contacts() })
    }
}

impl ContactCycles {
    /// Of a frame of this timing.
    pub fn new(case: &CasePlan, contacts: &ContactPlan, timing: ContactTiming) -> ContactCycles {
        let CasePlan { formats, storage, .. } = case;
        let quads = formats.quads as u64;
        let all = sections(formats);
        let unfolded =
            |section: &Section, begins| timeline(formats, storage, section, begins).last_row + RELAX + UNFOLD;
        let first = unfolded(&all[0], Begins::first(storage));
        let window = window::cycles(&contacts.window);
        // A quad can be read one cycle after it was written, and the mask follows the window.
        let given = [window, window + contacts.window.quads().len() as u64];
        let mu = timeline(formats, storage, &all[1], Begins { issue: 1, given }).known - 1;
        let read = shear::cycles(formats.quads) + 1;
        let step = unfolded(&all[2], Begins { issue: 1, given: [read - quads, read] });
        let known = first + timing.segment + timing.contacts as u64 * (PLACE + mu);
        let free = known + STEP;
        ContactCycles { free, complete: free + formats.degree as u64 * step }
    }
}

#[cfg(test)]
mod tests {
    use crate::data::generator::draws::{DrawOptions, DrawnFrame, Draws};
    use crate::estimate::learned::{with_network, Training};
    use crate::fixed::plan::cycles::Cycles;
    use crate::fixed::Model;
    use crate::spec::partition::Case;
    use crate::spec::scene::{EstimatorKind, Scene};

    /// At 100 MHz every frame is within its millisecond, whatever is found; eight frames of up to four drawn contacts take less.
    #[test]
    fn any_frame_is_within_a_millisecond() {
        for (sensor, bound, drawn) in [("sensor-1", 37_193, [6_730, 10_998]), ("sensor-3", 56_429, [27_420, 28_149])] {
            let mut scene = Scene::builtin(sensor).unwrap();
            scene.partition.case = Case::Contacts;
            scene.hardware.estimator = Some(EstimatorKind::Network);
            let (scene, _file) = with_network(scene, &Training::trial(&[80, 40, 20])).unwrap();
            let model = Model::without_fit_check(&scene).unwrap();
            let longest = Cycles::longest(&model).latency;
            assert!(longest == bound && longest < 100_000, "{sensor}: {longest} cycles");
            let draws = Draws::new(&scene, DrawOptions { contacts: 4, seed: 6, ..Default::default() }).unwrap();
            let frames: Vec<_> = (0..8).filter_map(|number| draws.frame(number).ok()).collect();
            assert!(!frames.is_empty());
            let cycles = |frame: &DrawnFrame| model.run(&model.codes(&frame.frame).unwrap().codes).cycles.latency;
            let all: Vec<u64> = frames.iter().map(cycles).collect();
            assert_eq!([all.iter().min(), all.iter().max()], [0, 1].map(|k| Some(&drawn[k])), "{sensor}");
        }
    }
}
