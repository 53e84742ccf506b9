//! Tests of the program `dermis`, run as its user does, of its pages, and of the bench of the co-simulation (`toy`).
//!
//! One program, so that it is linked once and its tests fill all processors to the end.

mod bitstream;
mod boards;
mod browser;
mod cli;
mod contacts;
mod contract;
mod examples;
mod failing;
mod fake;
mod firmware;
mod guide;
mod guide_links;
mod host;
mod live;
mod live_sources;
mod lost_bytes;
mod network;
mod page;
mod place;
mod printed;
mod recording;
mod report;
mod stream;
mod testbench;
mod toy;
mod writes;
