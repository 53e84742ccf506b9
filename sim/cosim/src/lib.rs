//! Co-simulation: the generated hardware under its simulators, compared with the bit-true model and disturbed.
//!
//! ```text
//! frame -> codes --+--> bit-true model ------------> Trace ----+
//!                  |                                           +--> compare_recording -> Findings
//!                  +--> drive -> Device (Verilator,            |
//!                                  kernel) -> Recording -------+
//! ```
//!
//! | module | does |
//! |---|---|
//! | [`mod@bench`] | the Verilog wrapper that packs pins and taps into two vectors |
//! | [`verilator`] | builds, caches and loads a verilated design as a [`Device`](dermis_hdl::device::Device) |
//! | [`drive`] | sends frames into a device and records every transfer with its cycle |
//! | [`run`], [`compare_recording`] | compare a recording with the bit-true model |
//! | [`array_frames`] | which array each frame is of, and the results in their order |
//! | [`hardware`] | a scene's generated hardware in its simulators |
//! | [`simulator`] | their names |
//! | [`VerilatedBoard`] | a board's top module under Verilator |
//! | [`verify`] | one scene's frames through all three models |
//! | [`faults`] | flips single bits and classifies the effect |
//! | [`scan`] | a scan by the hardware with its array and modelled converters |
//! | [`stress`] | both streams under gaps, wrong `tlast` and resets |
//! | [`block_timing`] | the cycles of a frame in which a block's handshakes change |
//! | [`power`] | the engine's power, estimated from the register bits that change |
//! | [`toggles`] | counts the register bits that change |
//! | [`waves`] | a run as a waveform file |
//!
//! [`compare`] measures differences between two force fields, and [`device_error`] takes errors of devices through an engine.
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

mod against_model;
pub mod array_frames;
pub mod bench;
pub mod block_timing;
mod board;
pub mod compare;
pub mod device_error;
pub mod drive;
pub mod faults;
mod findings;
pub mod hardware;
pub mod power;
pub mod scan;
pub mod simulator;
pub mod stress;
pub mod toggles;
pub mod verify;
pub mod verilator;
pub mod waves;

pub use against_model::{compare_recording, run, DeviceUnderTest, Vector};
pub use board::VerilatedBoard;
pub use findings::{Findings, Mismatch, KEPT_PER_FRAME};

/// Scenes whose co-simulation takes seconds: those of the short report, of `dermis table --cosim` and, on their shipped frames,
/// of the tests.
pub const QUICK_SCENES: [&str; 6] = [
    "sensor-1",
    "sensor-1-noisy",
    "sensor-1-bonded",
    "eight-by-eight",
    "eight-by-eight-bonded",
    "eight-by-eight-contacts",
];
