//! Measurements of the report: all engines on the same frames of each scene and case, their errors and times.
//!
//! ```text
//! scene × case ─┬─ literal baseline, CPU ─────────────────┐
//!               ├─ golden, CPU: hardware's estimator ─────┤
//!               ├─ golden, CPU: evidence ─────────────────┼─> errors, forces, time of a frame
//!               ├─ bit-true, CPU ─────────────────────────┤
//!               └─ hardware: co-simulation, cycles / clock ┘
//! scene ────────── devices: CPU, microcontroller, FPGA ──────> time, jitter, energy of a frame
//! ```
//!
//! First all results are computed and compared, several cases in parallel; then the CPU engines are timed one after the
//! other, with no other work in parallel.

mod clock;
mod devices;
mod engines;
mod formats;
mod machine;
mod measured;
mod noise;
mod objective_map;
mod recordings;
mod stability;
mod stages;
mod sweep;
mod timing;

pub use clock::{clock, Clock};
pub use devices::{devices, DeviceOptions, DeviceRow, Devices, CORE_W, DEVICE_FRAMES};
pub use engines::measure;
pub use formats::{formats, FormatRow};
pub use machine::machine;
pub use measured::{BitTrue, ContactCount, Implementation, Measured, Options, Point};
pub use noise::{noise, NoiseStudy};
pub use objective_map::{objective_map, ObjectiveMap};
pub use recordings::{recorded, Recorded, MOST_FRAMES};
pub use stability::{conditions, extremes};
pub use stages::{stages, trace, ComparedWords, StageRow};
pub use sweep::{sweep, SweepPoint};
