//! Co-simulation of the generated hardware, its reports and the `dermis` command line.
//!
//! ```text
//! frame -> codes --+--> bit-true model ------------> Trace ----+
//!                  |                                           +--> cosim::compare_recording -> report
//!                  +--> drive -> Device (Verilator,            |
//!                                rust-hdl) -> Recording -------+
//! ```
//!
//! | module | does |
//! |---|---|
//! | [`mod@bench`] | the Verilog wrapper that packs pins and taps into two vectors |
//! | [`verilator`] | builds, caches and loads a verilated design as a [`Device`](dermis_hdl::device::Device) |
//! | [`bitstream`] | a bitstream by open tools, its clock and cells against the committed ones |
//! | [`drive`] | plays frames into a device and records every transfer with its cycle |
//! | [`cosim`] | compares a recording with the bit-true model |
//! | [`mod@faults`] | `dermis faults`: single bits flipped, and what comes of it |
//! | [`drawn_frames`] | frames of drawn contacts for `dermis table --fresh` |
//! | [`mod@generate`] | `dermis generate`: frames with known forces from described contacts |
//! | [`board`] | a simulated board, its UART on a pseudo-terminal or its SPI under a controller |
//! | [`mod@guide`] | pages: method, formats, architecture, adding a sensor or a board, the engine in a design, limits |
//! | [`hardware`] | a scene's generated hardware and its simulators |
//! | [`compare`] | how far two force fields are apart |
//! | [`mod@netlist`] | the netlist after synthesis, simulated |
//! | [`verify`] | one scene's frames through all three models |
//! | [`report`] | tables and the JSON contract; `dermis report`, measured and drawn |
//! | [`host`] | frames to a board over a serial port, forces back |
//! | [`stability`] | `dermis stability`: errors against condition, extreme frames |
//! | [`mod@run_log`] | what long runs have tried, kept for the report |
//! | [`mod@stress`] | `dermis stress`: both streams under gaps, wrong `tlast` and resets |
//! | [`jobs`] | tasks on several threads, until one fails or the user interrupts |
//! | [`inputs`] | scene and frames from what the command line names |
//! | [`mod@waves`] | a run as a waveform file |
//! | [`cli`] | arguments, commands, exit codes |
#![deny(missing_docs)]
// Names carry their unit as SI writes it: `full_scale_MPa`.
#![allow(non_snake_case)]

mod artifact_cache;
pub mod bench;
pub mod bitstream;
pub mod board;
pub mod cli;
pub mod compare;
pub mod cosim;
pub mod drawn_frames;
pub mod drive;
pub mod faults;
pub mod generate;
pub mod guide;
pub mod hardware;
pub mod host;
pub mod inputs;
pub mod jobs;
pub mod netlist;
mod progress;
pub mod report;
pub mod run_log;
pub mod stability;
pub mod stress;
pub mod tabulate;
pub mod verify;
pub mod verilator;
pub mod waves;
