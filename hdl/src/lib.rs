//! Dermis in hardware: the fixed-point pipeline as a rust-hdl description, from which the Verilog is generated.
//!
//! ```text
//! codes → prepare → receive → normalise → fold → pass → rescale → unfold → search → forces → send → beats, status
//! ```
//! [`engine`] connects the [`stages`], built from [`primitives`]; [`serial`] is the engine for small devices; [`link`]
//! puts either behind a UART or an SPI, [`bus`] makes it a core for a SoC, [`scan`] reads the converters of its array. All widths come from the formats of the bit-true model.
//!
//! What is derived from what:
//! - *Kernels of the [`language`]*, the blocks with a field `kernel`: rust-hdl's simulation, the body of the Verilog
//!   module, memories and the estimate of the logic come from one graph of typed expressions.
//! - *`#[hdl_gen]` blocks*, which connect others: engines, most stages and the link's top levels. rust-hdl simulates
//!   them, and the assignments that it reads off the same Rust become a kernel too ([`language::Hierarchy`]), from which
//!   Verilog and estimate follow. They hold single-bit control and connections.
//! - *Tests*: each of both stands beside a test against plain integers, in rust-hdl's simulation or the kernel's own and
//!   under Verilator, every output, every cycle, except the board tops: packets of whole frames test these against the
//!   bit-true model, in both simulations too.
//! - rust-hdl's probe gives the hierarchy; all modules are printed by the [`language`], with the memories placed as the
//!   bit-true model plans them. No block has a second description, and nothing reads Verilog back.
//! - Widths, names and directions of ports in the guide come from the built engine, their meaning from the comments of
//!   the fields ([`describe`]).
#![deny(missing_docs)]

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

mod core_file;
mod error;
mod generate;
mod integration;
mod parallel;
#[cfg(test)]
mod scenes;
mod simulate;
mod taps;
mod testbench;
mod vivado;
mod waivers;

pub use error::HdlError;
pub use generate::{generate, generate_changed, Generated, Refused};
pub use manifest::GeneratedFile;
pub use simulate::simulator;
