//! The stages of the pipeline, one file each, named as in the bit-true model. A stage starts on the `done` pulse of the
//! one before.
//!
//! `prepare`, `receive`, `fold`, `pass`, `rescale`, `unfold`, `search`, `forces` and `send` are made of instances of
//! [primitives](crate::primitives), with single-bit control between them; the others have the logic in their own kernel.
//!
//! `banks`, with `choose`, is `receive` where the case is chosen per frame. `search` is made where μ is searched, `estimate` and
//! `relax` where a network gives it, `segment`, `contacts`, `window`, `shear` and `label_beats` where it gives one for each
//! contact, `resultants` where sums of forces are sent.

mod banks;
mod choose;
mod contacts;
mod estimate;
mod fold;
mod forces;
mod label_beats;
mod normalise;
mod pass;
mod prepare;
mod receive;
mod relax;
mod rescale;
mod resultants;
mod search;
mod segment;
mod send;
mod shear;
mod unfold;
mod window;

pub use choose::Choose;
pub use contacts::Contacts;
pub use estimate::Estimate;
pub use fold::Fold;
pub use forces::Forces;
pub use label_beats::LabelBeats;
pub use normalise::Normalise;
pub use pass::Pass;
pub use prepare::Prepare;
#[cfg(test)]
pub(crate) use receive::tests::Reception;
pub use receive::Receive;
pub use relax::Relax;
pub use rescale::Rescale;
pub use resultants::Resultants;
pub use search::Search;
pub use segment::Segment;
pub use send::Send;
pub use shear::Shear;
pub use unfold::Unfold;
pub use window::Window;
