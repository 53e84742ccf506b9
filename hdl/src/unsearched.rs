//! The engine of a scene without a search: [`engine`](crate::engine) with [`Unsearched`](crate::stages::Unsearched) in
//! place of `Search`. rust-hdl has no optional blocks, so the file `engine.rs` is compiled again with another import of
//! that name.

use crate::stages::{Receive, Unsearched as Search};

#[path = "engine.rs"]
#[allow(clippy::duplicate_mod)]
pub mod engine;
