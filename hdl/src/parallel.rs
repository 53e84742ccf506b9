//! The parallel engine: all stages connected, one subarray after the other through the same matrices.
//!
//! ```text
//! prepare -> receive -> normalise -> fold -> pass -> rescale -> unfold -> search -> forces -> send
//!  s_axis -->  |  frame buffer         |      ^________|  v_ij             |                  |--> m_axis
//!              '--- magnitude, signs --'                                   '--- μ, score -----'
//! ```
//! A stage is made only where the scene needs it; in other scenes what follows it takes what it would have got.
//!
//! Where a network gives μ, rows of its layers go from `pass` to `estimate`, whose images are operands again; `relax`, between
//! `rescale` and `unfold`, adds v_00 to the products of each step.
//!
//! Where each contact has a μ of its own, `contacts` starts the stages in turn: v_00 goes to `segment`; for each contact `window`
//! gives the operands of the first layer; for each step `shear` gives those of the products; `label_beats` adds the labels to the
//! stream, or `resultants` sums the forces of each label. The frame buffer is free when the last window has been read.
//!
//! Overlaps shorten the frame interval:
//! - While a frame is computed, the next is received; the frame buffer is free as soon as `fold` has read it.
//! - The passes of several rows of subarrays begin once the first row is in the buffer. [`Arrival`](crate::primitives::Arrival)
//!   holds the first subarray back until the frame is complete.
//! - While one subarray is searched, the v_ij of the next are computed, or those of the next frame's first.
//! - Subarrays whose values are complete are sent while the next ones are searched.
//! - While a frame is sent, the next is searched. Of a single subarray that is searched, only the last sweep waits until the
//!   previous frame has been sent. Several subarrays, and one that is not searched, are handed over only then: their first
//!   sweep reads the memory that the next frame is written to, and must not wait.
//!
//! Without a search, and where block RAM is too short for a memory of the next frame, a frame starts when the previous
//! one has been sent. Where the case is chosen per frame, it is chosen while the frame is received.
//!
//! | chapter | connects |
//! |---|---|
//! | `control` | what starts the stages and hands subarrays over |
//! | `follow` | what is kept of a frame while it is received, in the passes, searched and sent |
//! | `receive` | input to `fold`, tables |
//! | `passes` | the products, the network, contacts |
//! | `output` | the search, forces, statuses, output |

mod control;
mod follow;
mod output;
mod passes;
mod receive;

use dermis_golden::fixed::Model;

use crate::language::{Builder, Expr, Inside, Net};
use crate::stages::{
    Contacts, Estimate, Fold, Forces, LabelBeats, Normalise, Pass, Prepare, Receive, Relax, Rescale, Resultants,
    Search, Segment, Send, Shear, Unfold, Window,
};
use crate::streams::{stage_list, EnginePorts};
use crate::taps::observe;

stage_list! {
    |model| {}
    prepare: Option<Prepare> = Prepare::of_model(model), "stages/prepare.rs";
    receive: Receive = Receive::new(model), "stages/receive.rs";
    normalise: Normalise = Normalise::new(model.formats().input_bits as usize), "stages/normalise.rs";
    fold: Fold = Fold::new(model), "stages/fold.rs";
    pass: Pass = Pass::new(model), "stages/pass.rs";
    segment: Option<Segment> = Segment::of_model(model), "stages/segment.rs";
    contacts: Option<Contacts> = Contacts::of_model(model), "stages/contacts.rs";
    window: Option<Window> = Window::of_model(model), "stages/window.rs";
    estimate: Option<Estimate> = Estimate::of_model(model), "stages/estimate.rs";
    shear: Option<Shear> = Shear::of_model(model), "stages/shear.rs";
    rescale: Rescale = Rescale::new(model), "stages/rescale.rs";
    relax: Option<Relax> = Relax::of_model(model), "stages/relax.rs";
    unfold: Unfold = Unfold::new(model), "stages/unfold.rs";
    search: Option<Search> = Search::of_model(model), "stages/search.rs";
    forces: Forces = Forces::new(model), "stages/forces.rs";
    send: Send = Send::new(model), "stages/send.rs";
    label_beats: Option<LabelBeats> = LabelBeats::of_model(model), "stages/label_beats.rs";
    resultants: Option<Resultants> = Resultants::of_model(model), "stages/resultants.rs";
}

/// Connects the stages of `model` between the ports `io`.
pub(crate) fn build<'k>(model: &Model, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
    let s = Stages::new(k, model);
    // Where tables are written, a restart clears all stages but the first, which asks for it.
    let restart = s.prepare.as_ref().map_or(io.rst, |prepare| {
        prepare.rst.set(io.rst);
        prepare.restart
    });
    k.reset_instances(restart);
    let engine = Parallel { k, model, restart, s };
    let c = engine.control();
    engine.follow(&c);
    let array = engine.searched_array(&c);
    engine.receive(&io, &c, array);
    engine.multiply(&c);
    engine.find_contacts(&c);
    engine.search(&c);
    engine.send(&io, &c, array);
    engine.unused();
    observe(k, model);
}

/// The engine under construction.
struct Parallel<'k, 'm> {
    k: &'k Builder,
    model: &'m Model,
    /// Resets all stages.
    restart: Expr<'k>,
    s: Stages<'k>,
}

impl<'k> Parallel<'k, '_> {
    /// Subarrays, by case.
    fn parts(&self) -> Vec<usize> {
        self.model.cases().iter().map(|case| case.parts.len()).collect()
    }

    /// Whether every case has one subarray.
    fn is_single(&self) -> bool {
        self.parts().iter().all(|&parts| parts == 1)
    }

    /// Whether a frame is computed while the previous one is sent.
    fn is_ahead(&self) -> bool {
        self.model.resources.overlaps
    }

    /// A constant 0 of so many bits.
    fn zero(&self, bits: usize) -> Expr<'k> {
        self.k.constant(bits, 0)
    }

    /// What `of` gives of a stage for an input of another, 0 where there is no such stage.
    fn assign<P>(&self, input: &Net<'k>, stage: &Option<P>, of: impl FnOnce(&P) -> Expr<'k>) {
        input.set(stage.as_ref().map_or_else(|| self.zero(input.bits()), of));
    }

    /// Signals that are read only where a scene has the stages for them.
    fn unused(&self) {
        let (k, s) = (self.k, &self.s);
        k.unused([
            s.receive.row_end,
            s.receive.dropped,
            s.fold.free,
            s.pass.layer_valid,
            s.unfold.index,
            s.unfold.address,
        ]);
        k.unused([s.rescale.operands, s.rescale.operands_valid, s.forces.label_address]);
        k.unused(s.estimate.iter().map(|estimate| estimate.known));
        k.unused(s.contacts.iter().map(|contacts| contacts.ended));
    }
}
