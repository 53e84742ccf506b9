//! Sensor faults: how many spoiled frames of a real sensor's kinds give a wrong force without a flag.
//!
//! ```text
//! drawn press ── moments of a stream, with noise ── fault ─┬─ last frame ── engine ── force, flags ─┐
//!                                                          └─ all frames ── history ── flags ───────┴─ verdict
//! ```
//!
//! | verdict | |
//! |---|---|
//! | flagged | a flag that the engine does not raise on every clean frame of the scene, or the frame is refused |
//! | silently wrong | none, and e_t > 20 % or e_n > 10 %; or a force where nothing presses |
//! | right | neither |
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scenes, number of presses, seed, noise | – | noise as a share of the press's largest stress |
//! | out: [`FaultRow`] per fault and size | frames of each verdict, per engine | – |
//! | out: worst z of the frames without a flag | per engine | largest error over its standard deviation |
//!
//! [`faults`] has the faults, each of them once. One frame cannot tell [`Kind::Hidden`] ones from another force.

pub mod faults;
mod study;
#[cfg(test)]
mod tests;

pub use faults::{Fault, Kind, FAULTS};
pub use study::{sensor_faults, spoiled_frames, Counts, FaultRow, Path, SensorFaults, Spoiled, ENGINES};
