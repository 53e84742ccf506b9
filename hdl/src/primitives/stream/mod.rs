//! Parts of a stream of beats.

pub(crate) mod beats;
pub(crate) mod queue;
pub(crate) mod register_slice;
