//! The serial engine: the arithmetic of the parallel engine for a device of a few thousand logic cells.
//!
//! Schedule, cycle counts and memories are described in [`dermis_golden::fixed::serial`]; the docs of each block say
//! what it does in which cycle. The ports are those of the parallel [`Engine`](crate::engine::Engine), so that test
//! bench, link and host are the same.
//!
//! ```text
//! receive -> rounder -> mixer -> pass -> raw -> rounder -> mixer -> unfold -> banks <-> walk, horner, nine, score
//!            normalise  fold                    rescale    unfold             '-> force -> rounder -> m_axis
//! ```
//! [`Solve`] sequences the blocks up to `unfold`, [`Walk`] the search, [`Force`] the output. [`Engine`] and [`Receive`]
//! are `#[hdl_gen]` kernels; the other blocks have a Rust `update()` for rust-hdl's simulation and hand-written
//! Verilog, which co-simulation compares.

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
