//! What leaves: forces, sums of forces, status, cycle counts.

pub(crate) mod balance;
pub(crate) mod force_unit;
pub(crate) mod frame_cycles;
pub(crate) mod parts_begun;
pub(crate) mod status_bits;
pub(crate) mod status_code;
