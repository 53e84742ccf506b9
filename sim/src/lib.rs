//! Co-simulation of the generated hardware, its reports and the `dermis` command line.
//!
//! ```text
//! frame -> codes --+--> bit-true model ------------> Trace ----+
//!                  |                                           +--> cosim::judge -> report
//!                  +--> drive -> Device (Verilator,            |
//!                                rust-hdl) -> Recording -------+
//! ```
//!
//! | module | does |
//! |---|---|
//! | [`bench`] | the Verilog wrapper that packs pins and taps into two vectors |
//! | [`verilator`] | builds, caches and loads a verilated design as a [`Device`](dermis_hdl::device::Device) |
//! | [`drive`] | plays frames into a device and records every transfer with its cycle |
//! | [`cosim`] | compares a recording with the bit-true model |
//! | [`compare`] | differences between two reconstructions |
//! | [`report`] | tables and the JSON contract |
//! | [`engine`] | one frame through the golden, the fixed or the hardware engine |
//! | [`cli`] | arguments and commands |
#![deny(missing_docs)]

pub mod bench;
pub mod cosim;
pub mod drive;
mod progress;
pub mod verilator;
