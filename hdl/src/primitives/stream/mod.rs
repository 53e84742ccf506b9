//! Parts of a stream of beats.

pub(crate) mod lane_broadcast;
pub(crate) mod pass_through;
pub(crate) mod queue;
pub(crate) mod register_slice;
pub(crate) mod slice;
