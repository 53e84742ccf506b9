//! Dermis.
#![deny(missing_docs)]

pub mod board;
pub mod device;
