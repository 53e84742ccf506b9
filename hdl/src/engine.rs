//! The engine: all stages of a scene's hardware behind two streams, as one of two kinds.
//!
//! | kind | for | stages |
//! |---|---|---|
//! | [`Parallel`] | devices with many multipliers | [`crate::stages`], in a pipeline |
//! | [`Serial`] | small devices | [`crate::serial`], one after the other |

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::parallel::Parallel;
use crate::serial::Serial;

/// Where blocks count that belong to no stage: what starts the stages and hands their results over.
pub(crate) const CONTROL: &str = "engine";

/// A stage of an engine: a block of its data flow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    /// Name of its instance.
    pub(crate) name: &'static str,
    /// Source of its block.
    pub(crate) source: &'static str,
}

/// The stages of an engine in the order of the data flow.
pub(crate) fn stages(engine: EngineKind) -> &'static [Stage] {
    match engine {
        EngineKind::Parallel => Parallel::STAGES,
        EngineKind::Serial => Serial::STAGES,
    }
}

/// Lists stages, each with the file of its block.
macro_rules! stage_list {
    ($($stage:ident: $source:literal,)+) => {
        /// The stages in the order of the data flow.
        pub(crate) const STAGES: &'static [$crate::engine::Stage] = &[
            $($crate::engine::Stage { name: stringify!($stage), source: include_str!($source) },)+
        ];
    };
}
pub(crate) use stage_list;

block! {
    /// The engine, the top module of the generated hardware.
    ///
    /// ```text
    ///                +---------+
    ///  s_axis_t* --> | engine  | --> m_axis_t*
    ///      clk, rst  +---------+
    /// ```
    /// | port | direction | width | meaning |
    /// |---|---|---|---|
    /// | `s_axis_tdata` | in | `stream_bits` | a taxel's code, two's complement; row-major, frame after frame; or a byte of an image of tables |
    /// | `m_axis_tdata` | out | 96 | `{fz, fy, fx}`, 32 bits signed each, row-major; then the status beats |
    /// | `…tvalid`, `…tready`, `…tlast` | | 1 | AXI-Stream handshake; `tlast` on a frame's last beat |
    ///
    /// Reset is synchronous; it clears all control registers, not the data.
    pub struct Engine {
        stream_bits: usize,
        kind: Kind,
    }
    ports EnginePorts {
        clock;
        reset;
        /// A taxel's code, two's complement, or a byte of an image of tables; valid with `s_axis_tvalid`.
        in s_axis_tdata: stream_bits;
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

/// Width of a beat of the output.
pub(crate) const BEAT_BITS: usize = 96;

/// The stages of an engine.
enum Kind {
    Parallel(Box<Parallel>),
    Serial(Box<Serial>),
}

impl Engine {
    /// The engine of `model`.
    pub fn new(model: &Model) -> Self {
        let kind = match model.board.engine {
            EngineKind::Parallel => Kind::Parallel(Box::new(Parallel::new(model))),
            EngineKind::Serial => Kind::Serial(Box::new(Serial::new(model))),
        };
        Engine { stream_bits: model.stream_bits() as usize, kind }
    }
}

impl Block for Engine {
    fn build<'k>(&'k self, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
        match &self.kind {
            Kind::Parallel(parallel) => parallel.build(k, io),
            Kind::Serial(serial) => serial.build(k, io),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
