//! What both engines have: the ports, and how their stages are listed.

use crate::block;

/// Width of a beat of the output.
pub(crate) const BEAT_BITS: usize = 96;

/// A stage of an engine: a block of its data flow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    /// Name of its instance.
    pub(crate) name: &'static str,
    /// Source of its block.
    pub(crate) source: &'static str,
}

/// Lists stages, each with the file of its block.
macro_rules! stage_list {
    ($($stage:ident: $source:literal,)+) => {
        /// The stages in the order of the data flow.
        pub(crate) const STAGES: &'static [$crate::streams::Stage] = &[
            $($crate::streams::Stage { name: stringify!($stage), source: include_str!($source) },)+
        ];
    };
}
pub(crate) use stage_list;

block! {
    /// The two streams of an engine.
    pub struct Streams {
        /// Width of a beat of the input.
        pub bits: usize,
    }
    ports EnginePorts {
        clock;
        reset;
        /// A taxel's code, two's complement, or a byte of an image of tables; valid with `s_axis_tvalid`.
        in s_axis_tdata: bits;
        /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
        in s_axis_tvalid;
        /// The block accepts a beat in this cycle.
        out s_axis_tready;
        /// The beat is the last of its frame; valid with `s_axis_tvalid`.
        in s_axis_tlast;
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
        out m_axis_tdata: BEAT_BITS;
        /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
        out m_axis_tvalid;
        /// The receiver accepts a beat in this cycle.
        in m_axis_tready;
        /// The beat is the last of its frame; valid with `m_axis_tvalid`.
        out m_axis_tlast;
    }
}
