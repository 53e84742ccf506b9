//! Where a word is: counters, addresses of quads, order of the matrices' columns.

pub(crate) mod case_counter;
pub(crate) mod case_equal;
pub(crate) mod constant_product;
pub(crate) mod counter;
pub(crate) mod lane_mask;
pub(crate) mod quad_address;
pub(crate) mod scan;
pub(crate) mod transposed_place;
