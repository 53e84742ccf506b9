//! A core's top module: an engine between its streams, and its registers behind a bus.

use dermis_golden::fixed::Model;
use dermis_golden::wire::registers::{constants, ADDRESS_BITS, REGISTER_BITS};

use super::stream_in::WORD_BYTES;
use super::{id_bits, AxiLite, Bus, CoreShape, Registers, StreamIn, StreamOut, TablesIn, Wishbone};
use crate::block;
use crate::engine::Engine;
use crate::error::HdlError;
use crate::language::{kernel_of, Block, Builder, Hierarchy, Inside};
use crate::primitives::{Arrays, Dff, Queue};
use crate::scan::require_stream;
use crate::streams::{arrive_at, sent_by, through};

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
        in s_axis_tdata: 8 * WORD_BYTES;
        /// Bytes of the beat that are there, all of them; valid with `s_axis_tvalid`.
        in s_axis_tkeep: WORD_BYTES;
        /// Identifier of the frame, the same in all its beats; of several arrays the low bits are the number of the frame's. Valid
        /// with `s_axis_tvalid`.
        in s_axis_tid: id_bits(*arrays);
        /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
        in s_axis_tvalid;
        /// The core accepts a beat in this cycle.
        out s_axis_tready;
        /// The beat is the last of its frame; valid with `s_axis_tvalid`.
        in s_axis_tlast;
        /// Words of 32 bits, fx, fy, fz of a taxel after the other, then status; valid with `m_axis_tvalid`.
        out m_axis_tdata: REGISTER_BITS * shape.words;
        /// Bytes of the beat that are there; valid with `m_axis_tvalid`.
        out m_axis_tkeep: REGISTER_BITS / 8 * shape.words;
        /// A bit per word that is no force, and above them whether the frame is spoiled; valid with `m_axis_tvalid`.
        out m_axis_tuser: shape.words + 1;
        /// Identifier of the frame; valid with `m_axis_tvalid`.
        out m_axis_tid: id_bits(*arrays);
        /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
        out m_axis_tvalid;
        /// The receiver accepts a beat in this cycle.
        in m_axis_tready;
        /// The beat is the last of its frame; valid with `m_axis_tvalid`.
        out m_axis_tlast;
        /// Address of a write in bytes; valid with `s_axil_awvalid`.
        in s_axil_awaddr: shape.bus.bits(Bus::AxiLite, ADDRESS_BITS);
        /// An address is offered; the sender holds it until `s_axil_awready`.
        in s_axil_awvalid: shape.bus.bits(Bus::AxiLite, 1);
        /// The address is accepted in this cycle.
        out s_axil_awready: shape.bus.bits(Bus::AxiLite, 1);
        /// Data of a write; valid with `s_axil_wvalid`.
        in s_axil_wdata: shape.bus.bits(Bus::AxiLite, REGISTER_BITS);
        /// Bytes of a write that count; valid with `s_axil_wvalid`.
        in s_axil_wstrb: shape.bus.bits(Bus::AxiLite, REGISTER_BITS / 8);
        /// Data are offered; the sender holds them until `s_axil_wready`.
        in s_axil_wvalid: shape.bus.bits(Bus::AxiLite, 1);
        /// The data are accepted in this cycle.
        out s_axil_wready: shape.bus.bits(Bus::AxiLite, 1);
        /// 0 or SLVERR; valid with `s_axil_bvalid`.
        out s_axil_bresp: shape.bus.bits(Bus::AxiLite, 2);
        /// The answer of a write; it is held until `s_axil_bready`.
        out s_axil_bvalid: shape.bus.bits(Bus::AxiLite, 1);
        /// The answer is accepted in this cycle.
        in s_axil_bready: shape.bus.bits(Bus::AxiLite, 1);
        /// Address of a read in bytes; valid with `s_axil_arvalid`.
        in s_axil_araddr: shape.bus.bits(Bus::AxiLite, ADDRESS_BITS);
        /// An address is offered; the sender holds it until `s_axil_arready`.
        in s_axil_arvalid: shape.bus.bits(Bus::AxiLite, 1);
        /// The address is accepted in this cycle.
        out s_axil_arready: shape.bus.bits(Bus::AxiLite, 1);
        /// Content of the register; valid with `s_axil_rvalid`.
        out s_axil_rdata: shape.bus.bits(Bus::AxiLite, REGISTER_BITS);
        /// 0 or SLVERR; valid with `s_axil_rvalid`.
        out s_axil_rresp: shape.bus.bits(Bus::AxiLite, 2);
        /// The answer of a read; it is held until `s_axil_rready`.
        out s_axil_rvalid: shape.bus.bits(Bus::AxiLite, 1);
        /// The answer is accepted in this cycle.
        in s_axil_rready: shape.bus.bits(Bus::AxiLite, 1);
        /// A cycle of the bus.
        in wb_cyc: shape.bus.bits(Bus::Wishbone, 1);
        /// An access, held with all that belongs to it until the answer; valid with `wb_cyc`.
        in wb_stb: shape.bus.bits(Bus::Wishbone, 1);
        /// The access is a write; valid with `wb_stb`.
        in wb_we: shape.bus.bits(Bus::Wishbone, 1);
        /// Number of the register; valid with `wb_stb`.
        in wb_adr: shape.bus.bits(Bus::Wishbone, ADDRESS_BITS - 2);
        /// Data of a write; valid with `wb_stb` and `wb_we`.
        in wb_dat_w: shape.bus.bits(Bus::Wishbone, REGISTER_BITS);
        /// Bytes of a write that count; valid with `wb_stb` and `wb_we`.
        in wb_sel: shape.bus.bits(Bus::Wishbone, REGISTER_BITS / 8);
        /// Content of the register; valid with `wb_ack`.
        out wb_dat_r: shape.bus.bits(Bus::Wishbone, REGISTER_BITS);
        /// The access is done.
        out wb_ack: shape.bus.bits(Bus::Wishbone, 1);
        /// The access is refused.
        out wb_err: shape.bus.bits(Bus::Wishbone, 1);
    }
}

impl Bus {
    /// The width of a pin of `bits` bits of the bus `other`: 0 with this one.
    fn bits(self, other: Bus, bits: usize) -> usize {
        if self == other {
            bits
        } else {
            0
        }
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

/// Connects the instance `$bus` of a bus: its pins, and registers behind it.
macro_rules! connect {
    ($bus:ident, $io:ident, $registers:ident, $rst:ident, in [$($input:ident),+], out [$($output:ident),+]) => {
        $($bus.$input.set($io.$input);)+
        $($io.$output.set($bus.$output);)+
        $registers.select.set($bus.select);
        $registers.write.set($bus.write);
        $registers.address.set($bus.address);
        $registers.data.set($bus.data);
        $registers.strobe.set($bus.strobe);
        $bus.content.set($registers.content);
        $bus.refused.set($registers.refused);
        $bus.rst.set($rst);
    };
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

        stream_in.s_axis_tdata.set(io.s_axis_tdata);
        stream_in.s_axis_tkeep.set(io.s_axis_tkeep);
        stream_in.s_axis_tid.set(io.s_axis_tid);
        stream_in.s_axis_tvalid.set(io.s_axis_tvalid & !restart.q);
        stream_in.s_axis_tlast.set(io.s_axis_tlast);
        io.s_axis_tready.set(stream_in.s_axis_tready & !restart.q);
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
        arrive_at!(through!(sent_by!(stream_in), tables_in), engine);
        engine.s_axis_tid.set(tables_in.as_ref().map_or(stream_in.m_axis_tid, |tables_in| {
            tables_in.s_axis_tid.set(stream_in.m_axis_tid);
            tables_in.m_axis_tid
        }));
        // Its identifier, of which the array is a part, comes from `labels`.
        k.unused([engine.m_axis_tid]);

        stream_in.room.set(labels.room);
        labels.reserve.set(stream_in.complete);
        labels.write.set(stream_in.complete);
        labels.last.set(stream_in.complete);
        labels.word.set(stream_in.label);
        labels.m_axis_tready.set(stream_out.whole);
        k.unused([labels.m_axis_tlast, labels.m_axis_tvalid]);

        arrive_at!(sent_by!(engine), stream_out);
        stream_out.label.set(labels.m_axis_tdata);
        io.m_axis_tdata.set(stream_out.m_axis_tdata);
        io.m_axis_tkeep.set(stream_out.m_axis_tkeep);
        io.m_axis_tuser.set(stream_out.m_axis_tuser);
        io.m_axis_tid.set(stream_out.m_axis_tid);
        io.m_axis_tvalid.set(stream_out.m_axis_tvalid);
        stream_out.m_axis_tready.set(io.m_axis_tready);
        io.m_axis_tlast.set(stream_out.m_axis_tlast);

        match self.shape.bus {
            Bus::AxiLite => {
                let bus = k.instance("bus", AxiLite::default());
                connect!(
                    bus, io, registers, rst,
                    in [
                        s_axil_awaddr, s_axil_awvalid, s_axil_wdata, s_axil_wstrb, s_axil_wvalid, s_axil_bready,
                        s_axil_araddr, s_axil_arvalid, s_axil_rready
                    ],
                    out [
                        s_axil_awready, s_axil_wready, s_axil_bresp, s_axil_bvalid, s_axil_arready, s_axil_rdata,
                        s_axil_rresp, s_axil_rvalid
                    ]
                );
            }
            Bus::Wishbone => {
                let bus = k.instance("bus", Wishbone::default());
                connect!(
                    bus, io, registers, rst,
                    in [wb_cyc, wb_stb, wb_we, wb_adr, wb_dat_w, wb_sel], out [wb_dat_r, wb_ack, wb_err]
                );
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
    let hierarchy = Hierarchy::of_kernel(kernel_of(&Core::new(model, shape)));
    hierarchy.check()?;
    Ok(hierarchy)
}
