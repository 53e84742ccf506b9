//! What leaves: forces, sums of forces, status.

pub(crate) mod force_unit;
pub(crate) mod status_code;
