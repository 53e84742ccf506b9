//! Co-simulation of a scan: the hardware with its converters' pins, an array whose voltages are those of frames, and
//! converters modelled from their data sheet; compared with the bit-true model, code by code and beat by beat.
//!
//! ```text
//! frames -> Array -> answers by plan ------> stages::scan -> codes -> bit-true model -> beats ---+
//!             |                                                                                  +--> Findings
//!             '----> Converters <-- pins --> ScanDevice (Verilator, kernel) -> codes, beats ---+
//!                        '--> violations of the data sheet's times ------------------------------'
//! ```
//! Both ways take an answer from the same function of row, channel and number of the frame on the bus; by plan these are
//! those of the sequence that `dermis_golden::spec::adc` states, in the simulation those that the pins said in time.

mod array;
mod board;
mod converters;
mod device;
mod run;

pub use array::{Array, Fault};
pub use board::ScannedBoard;
pub use converters::Converters;
pub use device::VerilatedScan;
pub use run::{expected, simulate, verify_scan, Expected, Image, ScanTimes, ScannedFrame, VerifiedScan};
