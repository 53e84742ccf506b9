//! What both engines have: the ports, and how their stages are listed.

use crate::block;
use crate::primitives::{Arrays, Stream};

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
        sink<Stream> s_axis: (*bits, arrays.bits);
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
        source<Stream> m_axis: (BEAT_BITS, arrays.bits);
    }
}
