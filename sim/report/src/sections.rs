//! Sections of the report, one file each.

mod choice;
mod devices;
mod fields;
mod lookup;
mod noise;
mod paper;
mod power;
mod published;
mod ratios;
mod recordings;
mod resources;
mod run_logs;
mod search;
mod stability;
mod stages;
mod sweeps;
mod time;

pub use choice::{choice, choose, frames, Choice};
pub use devices::{device_picture, device_table, device_text, devices, DEVICE_SCENES};
pub use fields::fields;
pub use noise::noise;
pub use paper::paper;
pub use power::power;
pub use published::published;
pub use ratios::ratios;
pub use recordings::recordings;
pub use resources::resources;
pub use run_logs::run_logs;
pub use search::search;
pub use stability::{extremes, stability, stability_picture};
pub use stages::stages;
pub use sweeps::sweeps;
pub use time::{pictures as time_pictures, time};
