//! The serial engine: the arithmetic of the parallel engine for a device of a few thousand logic cells.
//!
//! Schedule, cycle counts and memories are described in [`dermis_golden::fixed::plan::serial`]; the docs of each block
//! say what it does in which cycle. The ports are those of the parallel [`Engine`](crate::engine::Engine), so that test
//! bench, link and host are the same.
//!
//! ```text
//! receive -> rounder -> butterfly -> pass -> raw -> rounder -> butterfly -> unfold -> banks -> forces -> rounder -> m_axis
//!            normalise  fold                        rescale    unfold                  ^
//!                                                                                      '-> along_x, transposed, along_y,
//!                                                                                          candidates, score
//! ```
//! [`PassSequencer`] sequences the blocks up to `unfold`, [`SearchSequencer`] the search, [`Forces`] the output.
//! `engine` connects them.

mod banks;
mod candidates;
mod coefficient_shift;
mod engine;
mod forces;
mod horner;
mod pass;
mod pass_sequencer;
mod receive;
mod rounder;
mod score;
mod search_sequencer;
mod serial_butterfly;
mod taxel_reorder;
mod unfold;

pub use banks::Banks;
pub use candidates::Candidates;
pub use coefficient_shift::CoefficientShift;
pub(crate) use engine::{build, STAGES};
pub use forces::Forces;
pub use horner::Horner;
pub use pass::Pass;
pub use pass_sequencer::PassSequencer;
pub use receive::Receive;
pub use rounder::Rounder;
pub use score::Score;
pub use search_sequencer::SearchSequencer;
pub use serial_butterfly::SerialButterfly;
pub use taxel_reorder::TaxelReorder;
pub use unfold::Unfold;

use crate::language::{concat, Builder, Expr};

/// Whether `signal` is one of `numbers`.
fn one_of<'k>(k: &'k Builder, signal: Expr<'k>, numbers: &[usize]) -> Expr<'k> {
    let terms = numbers.iter().map(|&number| signal.is(number as u64));
    terms.reduce(|a, b| a | b).unwrap_or(k.constant(1, 0))
}

/// A word of `width` bits of which `bit` gives each, from the number of the bit.
fn bits_of<'k>(width: usize, bit: impl Fn(usize) -> Expr<'k>) -> Expr<'k> {
    concat(&(0..width).rev().map(bit).collect::<Vec<_>>())
}
