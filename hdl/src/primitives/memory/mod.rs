//! Registers, delays and memories.

pub(crate) mod delay;
pub(crate) mod dff;
pub(crate) mod enable_register;
pub(crate) mod ram;
