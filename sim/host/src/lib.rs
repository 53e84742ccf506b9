//! Host: what answers frames on a computer, with a board or without one.
//!
//! | module | holds |
//! |---|---|
//! | [`mod@engine`] | engines by name, models and simulated hardware, and the one way to their results |
//! | [`batch`] | results of frames that do not depend on each other, on all cores |
//! | [`stream`] | frames from standard input, a file, a serial port or UDP, answered line by line |
//! | [`recording`] | frames and results of a stream in an MCAP file, with the message types of ROS 2 |
//! | [`mod@link`] | the host end of a board's link, of real and of simulated boards |
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

pub mod batch;
pub mod engine;
pub mod link;
pub mod recording;
pub mod stream;
