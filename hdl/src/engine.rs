//! The engine: all stages of a scene's hardware behind two streams, as one of two kinds.
//!
//! | kind | for | stages |
//! |---|---|---|
//! | parallel | devices with many multipliers | [`crate::stages`], in a pipeline |
//! | serial | small devices | [`crate::serial`], one after the other |

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;

use crate::language::{Block, Builder, Inside, Interface, Make, View, Visit, VisitMut};
use crate::primitives::Arrays;
use crate::streams::{EnginePorts, Stage, Streams};
use crate::{parallel, serial};

/// Where blocks count that belong to no stage: what starts the stages and hands their results over.
pub(crate) const CONTROL: &str = "engine";

/// The stages of an engine in the order of the data flow.
pub(crate) fn stages(engine: EngineKind) -> &'static [Stage] {
    match engine {
        EngineKind::Parallel => parallel::STAGES,
        EngineKind::Serial => serial::STAGES,
    }
}

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
/// | `…tid` | | width of the number of an array | of several arrays the one that the frame is of |
/// | `…tvalid`, `…tready`, `…tlast` | | 1 | AXI-Stream handshake; `tlast` on a frame's last beat |
///
/// Reset is synchronous; it clears all control registers, not the data.
pub struct Engine {
    streams: Streams,
    model: Model,
}

impl Engine {
    /// The engine of `model`.
    pub fn new(model: &Model) -> Self {
        let streams = Streams { bits: model.stream_bits() as usize, arrays: Arrays::of_model(model) };
        Engine { streams, model: model.clone() }
    }
}

impl Interface for Engine {
    type Ports<V: View> = EnginePorts<V>;

    const NAME: &'static str = "Engine";

    const CLOCK: Option<&'static str> = Streams::CLOCK;

    fn ports<V: View>(&self, make: &mut dyn Make<V>) -> EnginePorts<V> {
        self.streams.ports(make)
    }

    fn visit<V: View>(ports: &EnginePorts<V>, visitor: &mut dyn Visit<V>) {
        Streams::visit(ports, visitor);
    }

    fn visit_mut<V: View>(ports: &mut EnginePorts<V>, visitor: &mut dyn VisitMut<V>) {
        Streams::visit_mut(ports, visitor);
    }
}

impl Block for Engine {
    fn build<'k>(&'k self, k: &'k Builder, io: EnginePorts<Inside<'k>>) {
        match self.model.board.engine {
            EngineKind::Parallel => parallel::build(&self.model, k, io),
            EngineKind::Serial => serial::build(&self.model, k, io),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
