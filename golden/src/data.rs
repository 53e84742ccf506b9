//! Data: frames of stress, where they come from, and what a converter makes of them.
//!
//! | module | content |
//! |---|---|
//! | [`frame`] | stress on every taxel, with known forces if there are any; JSON, CSV, frames shipped with the crate |
//! | [`generator`] | frames computed from described or random contacts, with their exact forces |
//! | [`import`] | recordings of real arrays as scene and frames |
//! | [`input`] | averaging, calibration and dead taxels of a real sensor |
//! | [`recording`] | frames in MCAP files, with the message types of ROS 2 |
//! | [`number`] | numbers in the bytes of other programs' files |
//! | [`text`] | frames in lines of numbers, as other programs write them |
//! | [`quantise`], [`reception`] | stress as the codes of a converter; the condition for a search, and centroids |

pub mod frame;
pub mod generator;
pub mod import;
pub mod input;
pub mod number;
pub mod quantise;
pub mod reception;
pub mod recording;
pub mod text;
