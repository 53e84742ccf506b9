//! The `dermis` program: its commands, the live page, and the guide.
//!
//! | crate, in its folder here | holds |
//! |---|---|
//! | [`dermis_flow`] | board flow and C for microcontrollers; jobs, progress, output |
//! | [`dermis_cosim`] | co-simulation: the hardware under Verilator and in kernel simulation, compared with the bit-true model |
//! | [`dermis_host`] | engines by name, streams, recordings, the host end of a board |
//! | [`dermis_report`] | measurements, and text, JSON, CSV, pictures and pages of all results |
//!
//! | module of this one | holds |
//! |---|---|
//! | [`live`] | a page in the browser that shows the newest result of a stream or of a drawn finger |
//! | [`commands`] | command-line arguments, commands, exit codes |
//! | [`mod@guide`] | pages for users, by task, and one page per stage |
//!
//! Each crate uses those above it alone.
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

pub mod commands;
pub mod guide;
pub mod live;
