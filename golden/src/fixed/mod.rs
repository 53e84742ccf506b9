//! The bit-true model: the hardware's arithmetic in integers, stage by stage.
//!
//! ```text
//! codes → receive → normalise → fold → pass → rescale → unfold → search → force → send → beats, status
//!                                  ↑______________|  v_ij of the next degree
//! ```
//! Each stage is one file here and one file of the same name in the hardware description. The [`Trace`] keeps what
//! every stage passes on under the stage's name; tests compare it word for word with every simulation of the hardware.
//! The difference from the floating-point model is measured by tests, never assumed.

pub mod arith;
pub mod check;
pub mod choose;
pub mod coefficients;
pub mod cycles;
pub mod fit_suggestions;
pub mod fold;
pub mod force;
pub mod formats;
pub mod normalise;
pub mod pass;
pub mod prepare;
pub mod quads;
pub mod receive;
pub mod rescale;
pub mod resources;
pub mod resultants;
pub mod schedule;
pub mod search;
pub mod send;
pub mod serial;
pub mod storage;
pub mod unfold;

mod cases;
pub mod feature_costs;

mod model;
mod subarray;

pub use cases::Dropped;
pub use cycles::Cycles;
pub use model::{FixedError, Model, Stage, Trace};
