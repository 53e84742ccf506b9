//! What both engines have: the ports, streams between blocks, and how their stages are listed.

use crate::block;
use crate::language::{Expr, Net};
use crate::primitives::Arrays;

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

/// Lists the stages of an engine in the order of the data flow: name, block as it follows from a [`Model`], file of the block.
/// A stage that only some scenes have is an `Option`; in braces what several blocks follow from. From the list follow `STAGES`, names and sources, and the struct
/// `Stages` of the ports of their instances.
///
/// [`Model`]: dermis_golden::fixed::Model
macro_rules! stage_list {
    (
        |$model:ident| { $(let $name:ident = $value:expr;)* }
        $($stage:ident: $block:ty = $new:expr, $source:literal;)+
    ) => {
        /// The stages in the order of the data flow.
        pub(crate) const STAGES: &[$crate::streams::Stage] = &[
            $($crate::streams::Stage { name: stringify!($stage), source: include_str!($source) },)+
        ];

        /// The ports of the instances of the stages.
        struct Stages<'k> {
            $($stage: <$block as $crate::language::Instantiate>::Ports<'k>,)+
        }

        impl<'k> Stages<'k> {
            /// The stages of `model` as instances in `k`.
            fn new(k: &'k $crate::language::Builder, $model: &dermis_golden::fixed::Model) -> Self {
                $(let $name = $value;)*
                Stages { $($stage: k.instance(stringify!($stage), $new),)+ }
            }
        }
    };
}
pub(crate) use stage_list;

/// A stream of beats from a sender, on its way to a receiver.
#[derive(Clone, Copy)]
pub(crate) struct Beats<'k> {
    /// Data of a beat; valid with `valid`.
    pub(crate) data: Expr<'k>,
    /// A beat is offered.
    pub(crate) valid: Expr<'k>,
    /// The beat is the last of its frame; valid with `valid`.
    pub(crate) last: Expr<'k>,
    /// The receiver accepts a beat: for the receiver to assign.
    pub(crate) ready: Net<'k>,
}

/// The [`Beats`] that an instance sends on its ports `m_axis`.
macro_rules! sent_by {
    ($block:expr) => {
        $crate::streams::Beats {
            data: $block.m_axis_tdata,
            valid: $block.m_axis_tvalid,
            last: $block.m_axis_tlast,
            ready: $block.m_axis_tready,
        }
    };
}
pub(crate) use sent_by;

/// Connects [`Beats`] to the ports `s_axis` of an instance.
macro_rules! arrive_at {
    ($beats:expr, $block:expr) => {{
        let beats: $crate::streams::Beats = $beats;
        $block.s_axis_tdata.set(beats.data);
        $block.s_axis_tvalid.set(beats.valid);
        $block.s_axis_tlast.set(beats.last);
        beats.ready.set($block.s_axis_tready);
    }};
}
pub(crate) use arrive_at;

/// The [`Beats`] that an instance sends of those that arrive at it; the same beats where there is none.
macro_rules! through {
    ($beats:expr, $block:expr) => {
        match &$block {
            None => $beats,
            Some(block) => {
                $crate::streams::arrive_at!($beats, block);
                $crate::streams::sent_by!(block)
            }
        }
    };
}
pub(crate) use through;

/// Sends [`Beats`] on the ports `m_axis` of a block.
macro_rules! leave_by {
    ($beats:expr, $io:expr) => {{
        let beats: $crate::streams::Beats = $beats;
        $io.m_axis_tdata.set(beats.data);
        $io.m_axis_tvalid.set(beats.valid);
        $io.m_axis_tlast.set(beats.last);
        beats.ready.set($io.m_axis_tready);
    }};
}
pub(crate) use leave_by;

block! {
    /// The two streams of an engine.
    pub struct Streams {
        /// Width of a beat of the input.
        pub bits: usize,
        /// Those whose frames come.
        pub arrays: Arrays,
    }
    ports EnginePorts {
        clock;
        reset;
        /// A taxel's code, two's complement, or a byte of an image of tables; valid with `s_axis_tvalid`.
        in s_axis_tdata: bits;
        /// Array of the frame, from 0, that of its first beat; valid with `s_axis_tvalid`.
        in s_axis_tid: arrays.bits;
        /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
        in s_axis_tvalid;
        /// The block accepts a beat in this cycle.
        out s_axis_tready;
        /// The beat is the last of its frame; valid with `s_axis_tvalid`.
        in s_axis_tlast;
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
        out m_axis_tdata: BEAT_BITS;
        /// Array of the frame; valid with `m_axis_tvalid`.
        out m_axis_tid: arrays.bits;
        /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
        out m_axis_tvalid;
        /// The receiver accepts a beat in this cycle.
        in m_axis_tready;
        /// The beat is the last of its frame; valid with `m_axis_tvalid`.
        out m_axis_tlast;
    }
}
