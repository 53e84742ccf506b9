//! Specification: what is stated before any stress is read. It uses no other folder.
//!
//! | module | content |
//! |---|---|
//! | [`scene`] | sensor, method, number formats and hardware of a run, from TOML |
//! | [`sensor`], [`partition`] | the taxel array, and its division into subarrays |
//! | [`quads`], [`window`] | the mirror images of a taxel that share a memory word; the rectangle of taxels that a network reads |
//! | [`sliding`], [`mean_window`] | gains and variance of a sliding mean; the windows of an adaptive one |
//! | [`adc`] | converters that the hardware reads by itself, and the timing of a scan |
//! | [`mod@plain_text`] | doc comments as plain text |
//! | [`board`], [`link_kind`] | the device for which hardware is generated, and the links to a host |

pub mod adc;
pub mod board;
pub mod link_kind;
pub mod mean_window;
pub mod partition;
pub mod plain_text;
pub mod quads;
pub mod scene;
pub mod sensor;
pub mod sliding;
pub mod window;

mod suggest;
