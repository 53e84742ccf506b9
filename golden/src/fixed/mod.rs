//! The bit-true model: the hardware's arithmetic in integers, stage by stage.
//!
//! ```text
//! codes → receive → normalise → fold → pass → rescale → unfold → search → force → send → beats, status
//!                                  ↑______________|  v_ij of the next degree
//! ```
//! Each stage is one file here and one file of the same name in the hardware description. The [`Trace`] keeps what
//! every stage passes on under the stage's name; tests compare it word for word with every simulation of the hardware.
//! The difference from the floating-point model is measured by tests, never assumed.

pub mod plan;
pub mod stages;
pub mod words;

mod model;
mod subarray;

pub use model::{FixedError, Model, Stage, Trace};
pub use plan::cases::Dropped;
pub use plan::cycles::Cycles;
