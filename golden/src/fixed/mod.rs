//! The bit-true model: the hardware's arithmetic in integers, stage by stage.
//!
//! ```text
//! codes → prepare → receive → choose
//!       → normalise → fold → pass → rescale → unfold → search → forces → send → beats, status
//!                             ↑________|  v_ij of the next degree
//! ```
//! With a network `estimate` and `relax` take the place of the search, and with a μ for each contact v_00 passes `segment`,
//! each contact `window`, and every step of `relax` `shear` first.
//!
//! Each stage is one file in [`stages`] and one file of the same name in the hardware description. The [`Trace`] keeps
//! what every stage passes on under the stage's name; tests compare it word for word with every simulation of the
//! hardware. The difference from the floating-point model is measured by tests, never assumed.
//!
//! # Layers
//!
//! Each uses only those above it.
//!
//! | layer | content |
//! |---|---|
//! | [`words`] | integer arithmetic, formats of the words, quantised matrices, order of the products |
//! | [`stages`] | the stages, plain functions of words |
//! | [`plan`] | from scene and board: widths, lanes, memories, multipliers, cycles, partition cases |
//! | [`Model`] | runs the stages by the plan, and decodes what the hardware sends |

pub mod plan;
pub mod stages;
pub mod words;

#[cfg(test)]
mod bonded_tests;
mod contacts;
mod decode;
mod error;
mod model;
mod passes;
mod run;
mod specimen;
mod subarray;

pub use contacts::{Contact, FrameContacts};
pub use error::{FitSuggestion, FixedError, Shortage};
pub use model::Model;
pub use plan::contents::{CasePlan, Dropped, OwnTables, Plan};
pub use plan::cycles::Cycles;
pub use run::{Stage, Trace};
pub use specimen::Intake;
