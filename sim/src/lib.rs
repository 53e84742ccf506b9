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
//! | [`bitstream`] | `dermis bitstream`: synthesis, place and route with open tools, compared with committed baselines |
//! | [`drive`] | sends frames into a device and records every transfer with its cycle |
//! | [`cosim`] | compares a recording with the bit-true model |
//! | [`mod@faults`] | `dermis faults`: flips single bits and classifies the effect |
//! | [`drawn_frames`] | frames of random contacts, `dermis table --fresh` |
//! | [`mod@generate`] | `dermis generate`: frames with known forces from described contacts |
//! | [`block`] | `dermis block`: ports, Verilog and drawn timing of the blocks |
//! | [`board`] | a simulated board: its UART on a pseudo-terminal, or its SPI driven by a simulated controller |
//! | [`mod@guide`] | pages for users, by task, and one page per stage |
//! | [`guide_pages`] | `dermis guide`: tables and pictures of README and guide, made by the commands named there |
//! | [`hardware`] | a scene's generated hardware and its simulators |
//! | [`compare`] | differences between two force fields |
//! | [`mod@netlist`] | the netlist after synthesis, simulated |
//! | [`mod@noise`] | `dermis noise`: errors under noise beside the Cramér–Rao bound |
//! | [`verify`] | one scene's frames through all three models |
//! | [`report`] | text, JSON and CSV that the commands print; `dermis report`: measurements, pictures, files |
//! | [`host`] | `dermis host`: sends frames to a board over a serial port and reads back forces |
//! | [`stability`] | `dermis stability`: errors against condition number, extreme frames |
//! | [`mod@run_log`] | counts of long test runs, saved for the report |
//! | [`mod@stress`] | `dermis stress`: both streams under gaps, wrong `tlast` and resets |
//! | [`mod@study`] | `dermis study`: comparisons shown in the guide |
//! | [`jobs`] | tasks on several threads, until one fails or the user interrupts |
//! | [`mod@import`] | `dermis import`: recordings of real arrays as scene and frames |
//! | [`inputs`] | scene and frames from command-line arguments |
//! | [`tabulate`] | errors of scenes, cases and frames, `dermis table` |
//! | [`mod@waves`] | `dermis cosim --waves`: a run as a waveform file |
//! | [`cli`] | command-line arguments, commands, exit codes |
#![deny(missing_docs)]
// Field names end in their SI unit: `full_scale_MPa`.
#![allow(non_snake_case)]

mod artifact_cache;
pub mod bench;
pub mod bitstream;
pub mod block;
pub mod board;
pub mod cli;
pub mod compare;
pub mod cosim;
pub mod drawn_frames;
pub mod drive;
pub mod faults;
pub mod generate;
pub mod guide;
pub mod guide_pages;
pub mod hardware;
pub mod host;
pub mod import;
pub mod inputs;
pub mod jobs;
pub mod netlist;
pub mod noise;
mod progress;
pub mod report;
pub mod run_log;
pub mod stability;
pub mod stress;
pub mod study;
pub mod tabulate;
pub mod train;
pub mod verify;
pub mod verilator;
pub mod waves;
