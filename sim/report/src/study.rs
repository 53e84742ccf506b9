//! Comparisons that the guide shows, each one table.
//!
//! | study | compares |
//! |---|---|
//! | [`input_bits`] | golden and bit-true model at 20 and 16 bits of input |
//! | [`dead_taxels`] | errors and latency with taxels that are left out |
//! | [`contacts`] | case 0, `adaptive` and `contacts` on frames of several contacts |
//! | [`devices`] | time and energy of a frame on CPU, microcontroller and FPGA |
//! | [`link_times`] | time of a frame's packets on each link |
//! | [`sensor_faults`] | engines on frames that a sensor's faults spoil |
//! | [`blind_gains`] | errors without gains and with those found from presses of unknown load |

pub mod blind_gains;
pub mod contacts;
pub mod dead_taxels;
pub mod devices;
mod drawn;
pub mod input_bits;
pub mod link_times;
pub mod sensor_faults;

pub use drawn::{one_contact, tangential, FRAMES};
