//! The engine of a scene without a search: the same description, with [`Unsearched`](crate::stages::Unsearched) in the
//! place of the search. rust-hdl has no optional blocks, so the file is read twice; what it calls `Search` is the
//! module's.

use crate::stages::{Receive, Unsearched as Search};

#[path = "engine.rs"]
#[allow(clippy::duplicate_mod)]
pub mod engine;
