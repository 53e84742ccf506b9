//! Dermis in hardware: the fixed-point pipeline as blocks of a language inside Rust, from which the Verilog is generated.
//!
//! ```text
//! codes → prepare → receive → normalise → fold → pass → rescale → unfold → search → forces → send → beats, status
//! ```
//! [`engine`] is the block of all stages, of one of two kinds: the parallel one connects the [`stages`], built from
//! [`primitives`]; [`serial`] is that for small devices. [`link`] puts an engine behind a UART or an SPI, [`bus`] makes it a
//! core for a SoC, [`scan`] reads the converters of its array. All widths come from the formats of the bit-true model.
//!
//! What is derived from what:
//! - *Blocks of the [`language`]*: [`block!`](crate::block) declares parameters and ports, each once; a kernel, one graph of typed
//!   expressions with the instances of the blocks inside, is the behaviour. Kernel simulation, Verilog, memories and the
//!   estimate of the logic come from it.
//! - *Tests*: each block stands beside a test against plain integers, in kernel simulation and under Verilator, every output,
//!   every cycle, except the board tops: packets of whole frames test these against the bit-true model, in both simulations
//!   too. Kernel simulation and Verilog come from one graph, so that their agreement tests the printer, not the description;
//!   the bit-true model and the references in plain integers are what is independent.
//! - All modules are printed by the [`language`], with the memories placed as the bit-true model plans them. No block has a
//!   second description, and nothing reads Verilog back.
//! - Names, directions, widths and meanings of ports in Verilog and guide come from their declaration ([`describe`]).
//! - [`language::RustHdl`] carries any block in a design of rust-hdl, with its ports as signals (`examples/rust_hdl.rs`).

pub mod bus;
pub mod describe;
pub mod device;
pub mod engine;
pub mod explain;
pub mod language;
pub mod link;
pub mod manifest;
pub mod primitives;
pub mod scan;
pub mod serial;
pub mod stages;
pub mod state;
pub mod usage;
pub mod verilator;
pub mod wire;

mod constraints;
mod core_file;
mod error;
mod generate;
mod integration;
mod parallel;
#[cfg(test)]
mod scenes;
mod simulate;
mod streams;
mod taps;
mod testbench;
mod vivado;
mod waivers;

pub use error::HdlError;
pub use generate::{generate, generate_changed, Generated, Refused};
pub use manifest::GeneratedFile;
pub use simulate::simulator;
