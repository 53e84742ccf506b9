//! The engine of a scene whose case is chosen per frame: [`engine`](crate::engine) with [`Banks`](crate::stages::Banks)
//! in place of `Receive`. rust-hdl has no optional blocks, so the file `engine.rs` is compiled again with another
//! import of that name.

use crate::stages::{Banks as Receive, Search};

#[path = "engine.rs"]
#[allow(clippy::duplicate_mod)]
pub mod engine;
