//! Flow: from a scene to a bitstream with open tools, to the netlist that can be simulated, and to C for a microcontroller.
//!
//! ```text
//! scene -> board top (Verilog) --yosys--> netlist --register packing, floor plan--> netlist
//!     netlist --nextpnr, several seeds--> best --pack--> bitstream    ([`place`]: of any netlist)
//!             ^-- pins, PLL of the board       |--> cells, clocks -> table, baselines
//! ```
//! All files and one log per tool lie in `<build-dir>/<scene>/<board>/`. [`microcontroller`] writes the bit-true engine of a scene as C99,
//! compiled and run for a Cortex-M.
//!
//! | what long work needs | does |
//! |---|---|
//! | [`artifact_cache`] | folders that are built once |
//! | [`jobs`] | tasks on several threads, until one fails or the user interrupts |
//! | [`output`] | standard output and standard error, where either is closed or full |
//! | [`progress`] | progress lines on a terminal |
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

#[macro_use]
pub mod output;

pub mod artifact_cache;
pub mod baseline;
pub mod bitstream;
pub mod family;
pub mod floor_plan;
pub mod jobs;
pub mod microcontroller;
pub mod netlist;
pub mod pins;
pub mod place;
pub mod progress;
pub mod register_packing;
pub mod synthesis;
pub mod timing;
pub mod tools;
