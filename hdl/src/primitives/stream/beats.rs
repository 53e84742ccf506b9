//! A stream of beats between two blocks.

use crate::bundle;
use crate::language::Outside;

bundle! {
    /// A stream of beats, as AXI-Stream has it.
    pub struct Stream {
        /// Width of a beat; without one there is no stream.
        bits: usize,
        /// Width of the number of an array; 0 without.
        array_bits: usize,
    }
    signals StreamSignals: *bits > 0 => {
        out data "tdata": bits;
        /// Array of the frame; valid with `{}_tvalid`.
        out array "tid": array_bits;
        /// A beat is offered on `{}_tdata`; it is held until `{}_tready`.
        out valid "tvalid";
        /// The beat is accepted in this cycle.
        in ready "tready";
        /// The beat is the last of its frame; valid with `{}_tvalid`.
        out last "tlast";
    }
}

impl From<usize> for Stream {
    fn from(bits: usize) -> Self {
        Stream { bits, array_bits: 0 }
    }
}

impl From<&usize> for Stream {
    fn from(bits: &usize) -> Self {
        Stream::from(*bits)
    }
}

/// Of frames of several arrays, whose number has so many bits.
impl From<(usize, usize)> for Stream {
    fn from((bits, array_bits): (usize, usize)) -> Self {
        Stream { bits, array_bits }
    }
}

/// A stream on its way between instances.
pub(crate) type Beats<'k> = StreamSignals<Outside<'k>>;

/// What an instance sends of the [`Beats`] that arrive at it; the same beats where there is none.
macro_rules! through {
    ($beats:expr, $block:expr) => {
        match &$block {
            None => $beats,
            Some(block) => {
                $beats.connect(&block.s_axis);
                block.m_axis
            }
        }
    };
}
pub(crate) use through;
