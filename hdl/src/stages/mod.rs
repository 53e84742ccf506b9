//! The stages of the pipeline, one file each, named as in the bit-true model.
//!
//! Every stage is a `#[hdl_gen]` kernel: single-bit control and wiring between the
//! [primitives](crate::primitives). A stage begins on the `done` pulse of the one before.

mod banks;
mod choose;
mod fold;
mod force;
mod normalise;
mod pass;
mod prepare;
mod receive;
mod rescale;
mod search;
mod send;
mod unfold;
mod unsearched;

pub use banks::Banks;
pub use choose::Choose;
pub use fold::Fold;
pub use force::Force;
pub use normalise::Normalise;
pub use pass::Pass;
pub use prepare::Prepare;
pub use receive::Receive;
pub use rescale::Rescale;
pub use search::Search;
pub use send::Send;
pub use unfold::Unfold;
pub use unsearched::Unsearched;
