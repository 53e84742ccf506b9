//! A core's top module: an engine between its streams, and its registers behind a bus.

use dermis_golden::fixed::Model;
use dermis_golden::wire::registers::{constants, REGISTER_BITS};

use super::bundles::id_bits;
use super::interfaces::{attributes, Interface};
use super::{
    AxiLite, AxiLitePins, Bus, CoreShape, CoreStream, Registers, StreamIn, StreamOut, TablesIn, Wishbone, WishbonePins,
};
use crate::block;
use crate::engine::Engine;
use crate::error::HdlError;
use crate::language::{kernel_of, Block, Builder, Hierarchy, Inside};
use crate::primitives::{through, Arrays, Dff, Queue};
use crate::scan::require_stream;

block! {
    /// An engine with streams of whole words and registers on a bus; all ports change on the rising edge of `aclk`.
    pub struct Core {
        shape: CoreShape,
        arrays: Arrays,
        stream_in: StreamIn,
        tables_in: Option<TablesIn>,
        engine: Engine,
        stream_out: StreamOut,
        registers: Registers,
    }
    ports CorePorts {
        clock aclk;
        /// Synchronous reset, active low.
        in aresetn;
        /// A taxel's code, 32 bits signed, row-major; valid with `s_axis_tvalid`.
        sink<CoreStream> s_axis: CoreStream::of_codes(*arrays);
        /// Words of 32 bits, fx, fy, fz of a taxel after the other, then status; valid with `m_axis_tvalid`.
        source<CoreStream> m_axis: CoreStream::of_words(shape.words, *arrays);
        /// The bus, where it is AXI4-Lite.
        sink<AxiLitePins> s_axil: AxiLitePins { there: shape.bus == Bus::AxiLite };
        /// The bus, where it is Wishbone.
        sink<WishbonePins> wb: WishbonePins { there: shape.bus == Bus::Wishbone };
    }
}

impl Core {
    /// The core of the scene of `model`.
    pub fn new(model: &Model, shape: CoreShape) -> Self {
        let (code_bits, writable) = (model.formats().code_bits as usize, model.has_writable_tables());
        let arrays = Arrays::of_model(model);
        let constants = constants(model, REGISTER_BITS / 8 * shape.words);
        Core {
            shape,
            arrays,
            stream_in: StreamIn::new(model.scene.sensor.taxels(), code_bits, arrays),
            tables_in: writable.then(|| TablesIn::new(code_bits, arrays)),
            engine: Engine::new(model),
            stream_out: StreamOut::new(shape.words, model.force_triples(), arrays),
            registers: Registers::new(&constants, writable, arrays),
        }
    }
}

impl Block for Core {
    fn build<'k>(&'k self, k: &'k Builder, io: CorePorts<Inside<'k>>) {
        let restart = k.instance("restart", Dff {});
        let stream_in = k.instance("stream_in", &self.stream_in);
        let tables_in = k.instance("tables_in", self.tables_in.as_ref());
        let labels = k.instance("labels", Queue::new(id_bits(self.arrays) + 1));
        let engine = k.instance("engine", &self.engine);
        let stream_out = k.instance("stream_out", &self.stream_out);
        let registers = k.instance("registers", &self.registers);
        let rst = k.wire("rst", !io.aresetn);
        k.comment("Registered, because the engine is large and its reset has a long route.");
        restart.d.set(rst | registers.restart);
        registers.rst.set(rst);
        registers.restarting.set(restart.q);
        k.comment("A reset by register does not take back what is offered to the receiver: it ends the frame.");
        stream_out.rst.set(rst);
        stream_out.abandon.set(restart.q);
        k.reset_instances(restart.q);

        stream_in.s_axis.data.set(io.s_axis.data);
        stream_in.s_axis.keep.set(io.s_axis.keep);
        stream_in.s_axis.id.set(io.s_axis.id);
        stream_in.s_axis.valid.set(io.s_axis.valid & !restart.q);
        stream_in.s_axis.last.set(io.s_axis.last);
        io.s_axis.ready.set(stream_in.s_axis.ready & !restart.q);
        match &tables_in {
            None => {
                registers.octet_taken.set(k.constant(1, 0));
                k.unused([registers.octet, registers.octet_valid]);
            }
            Some(tables_in) => {
                tables_in.octet.set(registers.octet);
                tables_in.octet_valid.set(registers.octet_valid);
                registers.octet_taken.set(tables_in.octet_taken);
            }
        }
        through!(stream_in.m_axis, tables_in).connect(&engine.s_axis);
        // Its identifier, of which the array is a part, comes from `labels`.
        k.unused([engine.m_axis.array]);

        stream_in.room.set(labels.room);
        labels.reserve.set(stream_in.complete);
        labels.write.set(stream_in.complete);
        labels.last.set(stream_in.complete);
        labels.word.set(stream_in.label);
        labels.m_axis.ready.set(stream_out.whole);
        k.unused([labels.m_axis.last, labels.m_axis.valid]);

        engine.m_axis.connect(&stream_out.s_axis);
        stream_out.label.set(labels.m_axis.data);
        stream_out.m_axis.connect(&io.m_axis);

        match self.shape.bus {
            Bus::AxiLite => {
                let bus = k.instance("bus", AxiLite::default());
                bus.rst.set(rst);
                io.s_axil.connect(&bus.s_axil);
                bus.access.connect(&registers.access);
            }
            Bus::Wishbone => {
                let bus = k.instance("bus", Wishbone::default());
                bus.rst.set(rst);
                io.wb.connect(&bus.wb);
                bus.access.connect(&registers.access);
            }
        }
        registers.complete.set(stream_in.complete);
        registers.clipped.set(stream_in.clipped);
        registers.partial.set(stream_in.partial);
        registers.misframed.set(stream_in.misframed);
        registers.whole.set(stream_out.whole);
        registers.sent.set(stream_out.sent);
    }
}

/// The hierarchy of the core of `model`, checked.
///
/// # Errors
/// [`HdlError::Unsupported`]: a scene with several frames per result; [`HdlError::Check`].
pub(super) fn hierarchy(model: &Model, shape: CoreShape) -> Result<Hierarchy, HdlError> {
    require_stream(model, "a core for a SoC around a scan")?;
    if model.scene.input.frames_per_result() > 1 {
        let value = model.scene.input.average.to_string();
        return Err(HdlError::Unsupported {
            field: "input.average",
            value,
            what: "a core with several frames per result",
        });
    }
    let hierarchy = Hierarchy::of_kernel(kernel_of(&Core::new(model, shape)))
        .with_port_attributes(attributes(&Interface::of_core(shape.bus)));
    hierarchy.check()?;
    Ok(hierarchy)
}
