//! Dermis in hardware: the fixed-point pipeline as a rust-hdl description, from which the Verilog is generated.
//!
//! ```text
//! codes → prepare → receive → normalise → fold → pass → rescale → unfold → search → force → send → beats, status
//! ```
//! [`engine`] connects the [`stages`], built from [`primitives`]; [`serial`] is the engine for small devices; [`link`]
//! puts either behind a UART or an SPI. All widths come from the formats of the bit-true model.
//!
//! What is derived from what:
//! - Engines, most stages and the link's top levels are `#[hdl_gen]` kernels: rust-hdl simulates them and derives their
//!   Verilog from the same Rust. They hold single-bit control and connections.
//! - Kernels of the [`language`], the blocks with a field `kernel`: simulation, Verilog and estimate of the logic from
//!   one graph of typed expressions, each tested against plain integers in both simulations, every output, every cycle.
//! - All other blocks, which hold the arithmetic, the memories and most state machines, are written twice: a Rust
//!   `update()` for rust-hdl's simulation, and a hand-written Verilog text (`Verilog::Custom`), which is synthesised.
//!   Co-simulation compares both with the bit-true model: the streams between the stages word by word, the output
//!   beats, the cycle counts.
#![deny(missing_docs)]

/// A comment that `#[hdl_gen]` copies into the Verilog; expands to nothing in Rust. One short line: rust-hdl breaks a
/// long one.
macro_rules! comment {
    ($text:literal) => {};
}

pub mod describe;
pub mod device;
pub mod engine;
pub mod estimate;
pub mod explain;
pub mod language;
pub mod link;
pub mod manifest;
pub mod primitives;
pub mod serial;
pub mod stages;
pub mod usage;
pub mod wire;

mod core_file;
mod generate;
mod ports;
mod simulate;
mod taps;

pub use generate::{generate, Generated, GeneratedFile, HdlError, Refused};
pub use simulate::simulator;
