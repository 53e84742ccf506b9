//! Simulation, board flow and reports of the generated hardware, and the `dermis` command line.
//!
//! Nine folders and `engine`; each uses only those above it and the files beside them.
//!
//! | folder | holds |
//! |---|---|
//! | [`flow`] | board flow: netlist and bitstream with open tools, compared with committed baselines |
//! | [`cosim`] | co-simulation: the hardware under Verilator and in kernel simulation, compared with the bit-true model, stressed, with faults |
//! | [`microcontroller`] | the bit-true engine of a scene as C99, compiled and run for a Cortex-M |
//! | [`mod@engine`] | engines by name, models and simulated hardware, and the one way to their results |
//! | [`stream`] | frames from standard input, a file, a serial port or UDP, answered line by line |
//! | [`recording`] | frames and results of a stream in an MCAP file, with the message types of ROS 2 |
//! | [`mod@link`] | the host end of a board's link, of real and of simulated boards |
//! | [`report`] | measurements, and text, JSON, CSV, pictures and pages of all results |
//! | [`live`] | a page in the browser that shows the newest result of a stream or of a drawn finger |
//! | [`commands`] | command-line arguments, commands, exit codes |
//!
//! | beside them | does |
//! |---|---|
//! | [`batch`] | results of frames that do not depend on each other, on all cores |
//! | [`compare`] | differences between two force fields |
//! | [`drawn_frames`] | frames of random contacts, `dermis table --fresh` |
//! | [`mod@guide`] | pages for users, by task, and one page per stage |
//! | [`jobs`] | tasks on several threads, until one fails or the user interrupts |
//! | [`output`] | standard output and standard error, where either is closed or full |
//! | [`mod@run_log`] | counts of long test runs, saved for the report |
// Field names end in their SI unit: `full_scale_MPa`.
#![allow(non_snake_case)]
// They panic where nothing takes the text.
#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

#[macro_use]
pub mod output;

mod artifact_cache;
pub mod batch;
pub mod commands;
pub mod compare;
pub mod cosim;
mod device_error;
pub mod drawn_frames;
pub mod engine;
pub mod flow;
pub mod guide;
pub mod jobs;
pub mod link;
pub mod live;
pub mod microcontroller;
mod progress;
pub mod recording;
pub mod report;
pub mod run_log;
pub mod stream;
