//! The engine of a scene whose case is chosen per frame: the same description, with [`Banks`](crate::stages::Banks) in
//! the place of `receive`. rust-hdl has no optional blocks, so the file is read once more; what it calls `Receive` is
//! the module's.

use crate::stages::{Banks as Receive, Search};

#[path = "engine.rs"]
#[allow(clippy::duplicate_mod)]
pub mod engine;
