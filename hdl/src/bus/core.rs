//! A core's top module: an engine between its streams, and its registers behind a bus.

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use dermis_golden::wire::registers::{constants, ADDRESS_BITS, REGISTER_BITS};
use rust_hdl::prelude::*;

use super::stream_in::WORD_BYTES;
use super::{AxiLite, Bus, CoreShape, Registers, StreamIn, StreamOut, TablesIn, Wishbone, ID_BITS};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::language::RustHdl;
use crate::primitives::{Dff, Queue};
use crate::scan::require_stream;
use crate::wire::Wire;
use crate::{engine, serial};

/// Core `$name` with engine `$engine` and bus block `$bus`, whose pins are named as in that block. A macro, because rust-hdl
/// connects blocks by their fields and does not support type parameters for them.
macro_rules! core {
    (
        $name:ident, $engine:ty, $bus:ty,
        in [$($bit_in:ident),+], wide in [$($wire_in:ident: $in_bits:expr),+],
        out [$($bit_out:ident),+], wide out [$($wire_out:ident: $out_bits:expr),+]
    ) => {
        /// An engine with streams of whole words and registers on a bus; all ports change on the rising edge of `aclk`.
        #[derive(dermis_hdl_derive::Block)]
        pub struct $name {
            /// Clock of core and engine.
            pub aclk: Signal<In, Clock>,
            /// Synchronous reset, active low.
            pub aresetn: Signal<In, Bit>,
            /// A taxel's code, 32 bits signed, row-major; valid with `s_axis_tvalid`.
            pub s_axis_tdata: Wire<In>,
            /// Bytes of the beat that are there, all of them; valid with `s_axis_tvalid`.
            pub s_axis_tkeep: Wire<In>,
            /// Identifier of the frame, that of its first beat counts; valid with `s_axis_tvalid`.
            pub s_axis_tid: Wire<In>,
            /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
            pub s_axis_tvalid: Signal<In, Bit>,
            /// The core accepts a beat in this cycle.
            pub s_axis_tready: Signal<Out, Bit>,
            /// The beat is the last of its frame; valid with `s_axis_tvalid`.
            pub s_axis_tlast: Signal<In, Bit>,
            /// Words of 32 bits, fx, fy, fz of a taxel after the other, then status; valid with `m_axis_tvalid`.
            pub m_axis_tdata: Wire<Out>,
            /// Bytes of the beat that are there; valid with `m_axis_tvalid`.
            pub m_axis_tkeep: Wire<Out>,
            /// A bit per word that is no force, and above them whether the frame is spoiled; valid with `m_axis_tvalid`.
            pub m_axis_tuser: Wire<Out>,
            /// Identifier of the frame; valid with `m_axis_tvalid`.
            pub m_axis_tid: Wire<Out>,
            /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
            pub m_axis_tvalid: Signal<Out, Bit>,
            /// The receiver accepts a beat in this cycle.
            pub m_axis_tready: Signal<In, Bit>,
            /// The beat is the last of its frame; valid with `m_axis_tvalid`.
            pub m_axis_tlast: Signal<Out, Bit>,
            $(
                /// Pin of the bus.
                pub $bit_in: Signal<In, Bit>,
            )+
            $(
                /// Pins of the bus.
                pub $wire_in: Wire<In>,
            )+
            $(
                /// Pin of the bus.
                pub $bit_out: Signal<Out, Bit>,
            )+
            $(
                /// Pins of the bus.
                pub $wire_out: Wire<Out>,
            )+
            // Registered, because the engine is large and its reset has a long route.
            restart: RustHdl<Dff>,
            stream_in: StreamIn,
            tables_in: TablesIn,
            labels: RustHdl<Queue>,
            engine: $engine,
            stream_out: StreamOut,
            registers: Registers,
            bus: $bus,
            rst: Signal<Local, Bit>,
            unused: Signal<Local, Bit>,
        }

        impl $name {
            /// The core of the scene of `model`, with beats of `words` words at its output.
            pub fn new(model: &Model, words: usize) -> Self {
                let mut core = $name {
                    aclk: Default::default(),
                    aresetn: Default::default(),
                    s_axis_tdata: Wire::new(8 * WORD_BYTES),
                    s_axis_tkeep: Wire::new(WORD_BYTES),
                    s_axis_tid: Wire::new(ID_BITS),
                    s_axis_tvalid: Default::default(),
                    s_axis_tready: Default::default(),
                    s_axis_tlast: Default::default(),
                    m_axis_tdata: Wire::new(REGISTER_BITS * words),
                    m_axis_tkeep: Wire::new(REGISTER_BITS / 8 * words),
                    m_axis_tuser: Wire::new(words + 1),
                    m_axis_tid: Wire::new(ID_BITS),
                    m_axis_tvalid: Default::default(),
                    m_axis_tready: Default::default(),
                    m_axis_tlast: Default::default(),
                    $($bit_in: Default::default(),)+
                    $($wire_in: Wire::new($in_bits),)+
                    $($bit_out: Default::default(),)+
                    $($wire_out: Wire::new($out_bits),)+
                    restart: Default::default(),
                    stream_in: StreamIn::new(model.scene.sensor.taxels(), model.formats().code_bits as usize),
                    tables_in: TablesIn::new(model.formats().code_bits as usize, model.has_writable_tables()),
                    labels: RustHdl::new(Queue::new(ID_BITS + 1)),
                    engine: <$engine>::new(model),
                    stream_out: StreamOut::new(words, model.force_triples()),
                    registers: Registers::new(
                        &constants(model, REGISTER_BITS / 8 * words),
                        model.has_writable_tables(),
                    ),
                    bus: Default::default(),
                    rst: Default::default(),
                    unused: Default::default(),
                };
                core.connect_all();
                core
            }
        }

        impl Logic for $name {
            #[hdl_gen]
            fn update(&mut self) {
                self.restart.clk.next = self.aclk.val();
                self.stream_in.clk.next = self.aclk.val();
                self.tables_in.clk.next = self.aclk.val();
                self.labels.clk.next = self.aclk.val();
                self.engine.clk.next = self.aclk.val();
                self.stream_out.clk.next = self.aclk.val();
                self.registers.clk.next = self.aclk.val();
                self.bus.clk.next = self.aclk.val();
                self.rst.next = !self.aresetn.val();
                self.restart.d.next = self.rst.val() | self.registers.restart.val();
                self.bus.rst.next = self.rst.val();
                self.registers.rst.next = self.rst.val();
                self.stream_in.rst.next = self.restart.q.val();
                self.tables_in.rst.next = self.restart.q.val();
                self.labels.rst.next = self.restart.q.val();
                self.engine.rst.next = self.restart.q.val();
                self.stream_out.rst.next = self.restart.q.val();

                self.stream_in.s_axis_tdata.next = self.s_axis_tdata.val();
                self.stream_in.s_axis_tkeep.next = self.s_axis_tkeep.val();
                self.stream_in.s_axis_tid.next = self.s_axis_tid.val();
                self.stream_in.s_axis_tvalid.next = self.s_axis_tvalid.val() & !self.restart.q.val();
                self.stream_in.s_axis_tlast.next = self.s_axis_tlast.val();
                self.s_axis_tready.next = self.stream_in.s_axis_tready.val() & !self.restart.q.val();
                self.tables_in.s_axis_tdata.next = self.stream_in.m_axis_tdata.val();
                self.tables_in.s_axis_tvalid.next = self.stream_in.m_axis_tvalid.val();
                self.tables_in.s_axis_tlast.next = self.stream_in.m_axis_tlast.val();
                self.stream_in.m_axis_tready.next = self.tables_in.s_axis_tready.val();
                self.tables_in.octet.next = self.registers.octet.val();
                self.tables_in.octet_valid.next = self.registers.octet_valid.val();
                self.registers.octet_taken.next = self.tables_in.octet_taken.val();
                self.engine.s_axis_tdata.next = self.tables_in.m_axis_tdata.val();
                self.engine.s_axis_tvalid.next = self.tables_in.m_axis_tvalid.val();
                self.engine.s_axis_tlast.next = self.tables_in.m_axis_tlast.val();
                self.tables_in.m_axis_tready.next = self.engine.s_axis_tready.val();

                self.stream_in.room.next = self.labels.room.val();
                self.labels.reserve.next = self.stream_in.complete.val();
                self.labels.write.next = self.stream_in.complete.val();
                self.labels.last.next = self.stream_in.complete.val();
                self.labels.word.next = self.stream_in.label.val();
                self.labels.m_axis_tready.next = self.stream_out.sent.val();
                self.unused.next = self.labels.m_axis_tlast.val() | self.labels.m_axis_tvalid.val();

                self.stream_out.s_axis_tdata.next = self.engine.m_axis_tdata.val();
                self.stream_out.s_axis_tvalid.next = self.engine.m_axis_tvalid.val();
                self.stream_out.s_axis_tlast.next = self.engine.m_axis_tlast.val();
                self.engine.m_axis_tready.next = self.stream_out.s_axis_tready.val();
                self.stream_out.label.next = self.labels.m_axis_tdata.val();
                self.m_axis_tdata.next = self.stream_out.m_axis_tdata.val();
                self.m_axis_tkeep.next = self.stream_out.m_axis_tkeep.val();
                self.m_axis_tuser.next = self.stream_out.m_axis_tuser.val();
                self.m_axis_tid.next = self.stream_out.m_axis_tid.val();
                self.m_axis_tvalid.next = self.stream_out.m_axis_tvalid.val();
                self.stream_out.m_axis_tready.next = self.m_axis_tready.val();
                self.m_axis_tlast.next = self.stream_out.m_axis_tlast.val();

                $(self.bus.$bit_in.next = self.$bit_in.val();)+
                $(self.bus.$wire_in.next = self.$wire_in.val();)+
                $(self.$bit_out.next = self.bus.$bit_out.val();)+
                $(self.$wire_out.next = self.bus.$wire_out.val();)+
                self.registers.select.next = self.bus.select.val();
                self.registers.write.next = self.bus.write.val();
                self.registers.address.next = self.bus.address.val();
                self.registers.data.next = self.bus.data.val();
                self.registers.strobe.next = self.bus.strobe.val();
                self.bus.content.next = self.registers.content.val();
                self.bus.refused.next = self.registers.refused.val();
                self.registers.complete.next = self.stream_in.complete.val();
                self.registers.clipped.next = self.stream_in.clipped.val();
                self.registers.partial.next = self.stream_in.partial.val();
                self.registers.misframed.next = self.stream_in.misframed.val();
                self.registers.sent.next = self.stream_out.sent.val();
            }
        }
    };
}

/// Cores for the two buses of an engine.
macro_rules! cores {
    ($axi:ident, $wishbone:ident, $engine:ty) => {
        core!(
            $axi, $engine, AxiLite,
            in [s_axil_awvalid, s_axil_wvalid, s_axil_bready, s_axil_arvalid, s_axil_rready],
            wide in [
                s_axil_awaddr: ADDRESS_BITS, s_axil_wdata: REGISTER_BITS, s_axil_wstrb: REGISTER_BITS / 8,
                s_axil_araddr: ADDRESS_BITS
            ],
            out [s_axil_awready, s_axil_wready, s_axil_bvalid, s_axil_arready, s_axil_rvalid],
            wide out [s_axil_bresp: 2, s_axil_rdata: REGISTER_BITS, s_axil_rresp: 2]
        );
        core!(
            $wishbone, $engine, Wishbone,
            in [wb_cyc, wb_stb, wb_we],
            wide in [wb_adr: ADDRESS_BITS - 2, wb_dat_w: REGISTER_BITS, wb_sel: REGISTER_BITS / 8],
            out [wb_ack, wb_err],
            wide out [wb_dat_r: REGISTER_BITS]
        );
    };
}

cores!(AxiCore, WishboneCore, engine::Engine);
cores!(SerialAxiCore, SerialWishboneCore, serial::Engine);

/// The hierarchy of the core of `model`, after rust-hdl's checks.
///
/// # Errors
/// [`HdlError::Unsupported`]: a scene with several frames per result; [`HdlError::Check`].
pub(super) fn hierarchy(model: &Model, shape: CoreShape) -> Result<Hierarchy, HdlError> {
    require_stream(model, "a core for a SoC around a scan")?;
    if model.scene.input.average > 0 {
        let value = model.scene.input.average.to_string();
        return Err(HdlError::Unsupported {
            field: "input.average",
            value,
            what: "a core with several frames per result",
        });
    }
    let words = shape.words;
    match (model.board.engine, shape.bus) {
        (EngineKind::Parallel, Bus::AxiLite) => checked(&AxiCore::new(model, words)),
        (EngineKind::Parallel, Bus::Wishbone) => checked(&WishboneCore::new(model, words)),
        (EngineKind::Serial, Bus::AxiLite) => checked(&SerialAxiCore::new(model, words)),
        (EngineKind::Serial, Bus::Wishbone) => checked(&SerialWishboneCore::new(model, words)),
    }
}

fn checked(core: &dyn Block) -> Result<Hierarchy, HdlError> {
    let hierarchy = Hierarchy::of(core);
    hierarchy.check()?;
    check_all(core).map_err(|error| HdlError::Check(format!("{error:?}")))?;
    Ok(hierarchy)
}
