//! The C interface as C calls it: its header, an example that is compiled and run, wrong arguments, the link.
#![allow(unsafe_code, reason = "calls the C interface as C does")]

mod batch;
mod board;
mod example;
mod header;
mod input;
mod link;
mod stream;
mod stress;
