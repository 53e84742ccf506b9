//! Dermis in hardware: the rust-hdl description of the fixed-point pipeline.
//!
//! ```text
//! codes → receive → normalise → fold → pass → rescale → unfold → search → force → send → beats, status
//! ```
//! [`engine`] wires the [`stages`] together; a stage is control and wiring in a `#[hdl_gen]` kernel around the
//! [`primitives`] that hold arithmetic and memory. All widths come from the formats of the bit-true model, which is also
//! what every simulation is compared with.
#![deny(missing_docs)]

/// A comment that `#[hdl_gen]` copies into the Verilog; nothing in Rust.
macro_rules! comment {
    ($text:literal) => {};
}

pub mod choosing;
pub mod device;
pub mod engine;
pub mod estimate;
pub mod explain;
pub mod link;
pub mod manifest;
pub mod primitives;
pub mod serial;
pub mod stages;
pub mod unsearched;
pub mod usage;
pub mod wire;

mod core_file;
mod generate;
mod simulate;
mod taps;

// The first and the search of [`engine`]; those of [`choosing`] and [`unsearched`] are others.
use stages::{Receive, Search};

pub use generate::{generate, Generated, GeneratedFile, HdlError, Refused};
pub use simulate::simulator;
