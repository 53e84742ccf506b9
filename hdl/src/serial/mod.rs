//! The serial engine: the parallel engine's arithmetic for a device of a few thousand logic cells.
//!
//! Schedule, cycles and memories are in [`dermis_golden::fixed::serial`]; what each block does in which cycle stands at its
//! head. The ports are those of the parallel [`Engine`](crate::engine::Engine), so that bench, link and host know no
//! difference.
//!
//! ```text
//! receive --> rounder --> mixer --> pass --> raw --> rounder --> mixer --> unfold --> banks <--> walk, horner, nine, score
//!             normalise   fold                       rescale     unfold                 '--> force --> rounder --> m_axis
//! ```
//! [`Solve`] leads the words of the upper line, [`Walk`] those of the search, [`Force`] those of the output.

mod banks;
mod engine;
mod force;
mod halve;
mod horner;
mod mixer;
mod nine;
mod order;
mod pass;
mod receive;
mod rounder;
mod score;
mod solve;
mod unfold;
mod walk;

#[cfg(test)]
mod tests;

pub use banks::Banks;
pub use engine::Engine;
pub use force::Force;
pub use halve::Halve;
pub use horner::Horner;
pub use mixer::Mixer;
pub use nine::Nine;
pub use order::Order;
pub use pass::{Pass, LOW_FILE, WIDE_FILE};
pub use receive::Receive;
pub use rounder::Rounder;
pub use score::Score;
pub use solve::Solve;
pub use unfold::Unfold;
pub use walk::Walk;
