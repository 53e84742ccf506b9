//! Top module of a scan: sequencer, capture, engine, status; with writable tables, the way of their images, and codes behind the
//! forces.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use rust_hdl::prelude::*;

use super::pins::{Beat, ScanInputs, ScanOutputs, ScanPins, Scanner};
use super::{ScanCapture, ScanCodes, ScanSequencer, ScanStatus, ScanTables, Shape};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::language::RustHdl;
use crate::primitives::Dff;
use crate::wire::{Wire, Word};
use crate::{engine, serial};

/// Width of a beat of the engine.
const BEAT: usize = 96;

/// Top module `$name` with engine `$engine`. A macro, because rust-hdl connects blocks by their fields and does not support
/// type parameters for them. `$source` is the block from which the engine gets its beats: `capture`, or `tables`, which
/// lets images in between, with their stream. `$output` is the last block: `told`, or `codes`, which adds the codes.
/// `$unused` takes what only the other kind needs.
macro_rules! scan_core {
    ($name:ident, $engine:ty, $source:ident, $output:ident, [$($tables:ident, $codes:ident, $unused:ident)?]) => {
        /// An engine that reads the converters of its array by itself; ports as of the fields.
        #[derive(dermis_hdl_derive::Block)]
        pub struct $name {
            /// Clock; registers change on its rising edge.
            pub clk: Signal<In, Clock>,
            /// Synchronous reset, active high.
            pub rst: Signal<In, Bit>,
            /// A scan may begin; high to scan all the time.
            pub enable: Signal<In, Bit>,
            $(
                /// A byte of an image of tables, as a beat of the engine's stream; valid with `s_axis_tvalid`.
                pub s_axis_tdata: Wire<In>,
                /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
                pub s_axis_tvalid: Signal<In, Bit>,
                /// A beat is accepted in this cycle.
                pub s_axis_tready: Signal<Out, Bit>,
                /// The beat is the last of its image; valid with `s_axis_tvalid`.
                pub s_axis_tlast: Signal<In, Bit>,
                $tables: RustHdl<ScanTables>,
                $codes: RustHdl<ScanCodes>,
                $unused: Signal<Local, Bit>,
            )?
            /// Address of the row that is driven, unsigned; valid after the reset.
            pub row: Wire<Out>,
            /// Serial clock of all converters.
            pub adc_sclk: Signal<Out, Bit>,
            /// Chip select of all converters, active low.
            pub adc_cs_n: Signal<Out, Bit>,
            /// Commands to all converters.
            pub adc_mosi: Signal<Out, Bit>,
            /// Outputs of the converters, one bit each; valid while `adc_cs_n` is low.
            pub adc_miso: Wire<In>,
            /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
            pub m_axis_tdata: Wire<Out>,
            /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
            pub m_axis_tvalid: Signal<Out, Bit>,
            /// The receiver accepts a beat in this cycle.
            pub m_axis_tready: Signal<In, Bit>,
            /// The beat is the last of its frame; valid with `m_axis_tvalid`.
            pub m_axis_tlast: Signal<Out, Bit>,
            // Registered, because the engine is large and its reset has a long route.
            restart: RustHdl<Dff>,
            sequencer: RustHdl<ScanSequencer>,
            capture: RustHdl<ScanCapture>,
            engine: $engine,
            told: RustHdl<ScanStatus>,
        }

        impl $name {
            /// The scan and the engine of the scene of `model`.
            ///
            /// # Errors
            /// [`HdlError::Unsupported`] where codes come as a stream.
            pub fn new(model: &Model) -> Result<Self, HdlError> {
                let shape = Shape::of(model)?;
                let mut core = $name {
                    clk: Default::default(),
                    rst: Default::default(),
                    enable: Default::default(),
                    $(
                        s_axis_tdata: Wire::new(model.stream_bits() as usize),
                        s_axis_tvalid: Default::default(),
                        s_axis_tready: Default::default(),
                        s_axis_tlast: Default::default(),
                        $tables: RustHdl::new(ScanTables::new(shape.code_bits as usize)),
                        $codes: RustHdl::new(ScanCodes::new(model.scene.sensor.taxels(), shape.code_bits as usize)),
                        $unused: Default::default(),
                    )?
                    row: Wire::new(count_bits(shape.rows)),
                    adc_sclk: Default::default(),
                    adc_cs_n: Default::default(),
                    adc_mosi: Default::default(),
                    adc_miso: Wire::new(shape.scan.converters),
                    m_axis_tdata: Wire::new(BEAT),
                    m_axis_tvalid: Default::default(),
                    m_axis_tready: Default::default(),
                    m_axis_tlast: Default::default(),
                    restart: Default::default(),
                    sequencer: RustHdl::new(ScanSequencer::new(&shape)),
                    capture: RustHdl::new(ScanCapture::new(&shape)),
                    engine: <$engine>::new(model),
                    told: RustHdl::new(ScanStatus::new(model.force_beats())),
                };
                core.connect_all();
                Ok(core)
            }
        }

        impl Logic for $name {
            #[hdl_gen]
            fn update(&mut self) {
                self.restart.clk.next = self.clk.val();
                self.sequencer.clk.next = self.clk.val();
                self.capture.clk.next = self.clk.val();
                self.engine.clk.next = self.clk.val();
                self.told.clk.next = self.clk.val();
                self.restart.d.next = self.rst.val();
                self.sequencer.rst.next = self.restart.q.val();
                self.capture.rst.next = self.restart.q.val();
                self.engine.rst.next = self.restart.q.val();
                self.told.rst.next = self.restart.q.val();

                comment!("Scan");
                self.sequencer.clear.next = self.capture.clear.val();
                self.sequencer.room.next = self.told.room.val() & self.enable.val() $(& self.$codes.room.val())?;
                self.row.next = self.sequencer.row.val();
                self.adc_sclk.next = self.sequencer.sclk.val();
                self.adc_cs_n.next = self.sequencer.cs_n.val();
                self.adc_mosi.next = self.sequencer.mosi.val();
                self.capture.miso.next = self.adc_miso.val();
                self.capture.take.next = self.sequencer.take.val();
                self.capture.done.next = self.sequencer.done.val();
                self.capture.result.next = self.sequencer.result.val();
                self.capture.opens.next = self.sequencer.opens.val();
                self.capture.closes.next = self.sequencer.closes.val();
                self.capture.ends.next = self.sequencer.ends.val();
                self.capture.channel.next = self.sequencer.channel.val();
                self.capture.alive.next = self.sequencer.alive.val();

                comment!("Codes to the engine");
                $(
                    self.$tables.clk.next = self.clk.val();
                    self.$tables.rst.next = self.restart.q.val();
                    self.$tables.code.next = self.capture.m_axis_tdata.val();
                    self.$tables.code_valid.next = self.capture.m_axis_tvalid.val();
                    self.$tables.code_last.next = self.capture.m_axis_tlast.val();
                    self.capture.m_axis_tready.next = self.$tables.code_ready.val();
                    self.$tables.s_axis_tdata.next = self.s_axis_tdata.val();
                    self.$tables.s_axis_tvalid.next = self.s_axis_tvalid.val();
                    self.$tables.s_axis_tlast.next = self.s_axis_tlast.val();
                    self.s_axis_tready.next = self.$tables.s_axis_tready.val();
                )?
                self.engine.s_axis_tdata.next = self.$source.m_axis_tdata.val();
                self.engine.s_axis_tvalid.next = self.$source.m_axis_tvalid.val();
                self.engine.s_axis_tlast.next = self.$source.m_axis_tlast.val();
                self.$source.m_axis_tready.next = self.engine.s_axis_tready.val();

                comment!("Forces, and marks in the status");
                self.told.complete.next = self.$source.complete.val();
                self.told.rail.next = self.capture.rail.val();
                self.told.other.next = self.capture.other.val();
                self.told.s_axis_tdata.next = self.engine.m_axis_tdata.val();
                self.told.s_axis_tvalid.next = self.engine.m_axis_tvalid.val();
                self.told.s_axis_tlast.next = self.engine.m_axis_tlast.val();
                self.engine.m_axis_tready.next = self.told.s_axis_tready.val();
                $(
                    self.$unused.next = self.capture.complete.val();
                    self.$codes.clk.next = self.clk.val();
                    self.$codes.rst.next = self.restart.q.val();
                    self.$codes.code.next = self.capture.m_axis_tdata.val();
                    self.$codes.passed.next = self.$tables.passed.val();
                    self.$codes.complete.next = self.$tables.complete.val();
                    self.$codes.broken.next = self.$tables.broken.val();
                    self.$codes.s_axis_tdata.next = self.told.m_axis_tdata.val();
                    self.$codes.s_axis_tvalid.next = self.told.m_axis_tvalid.val();
                    self.$codes.s_axis_tlast.next = self.told.m_axis_tlast.val();
                    self.told.m_axis_tready.next = self.$codes.s_axis_tready.val();
                )?
                self.m_axis_tdata.next = self.$output.m_axis_tdata.val();
                self.m_axis_tvalid.next = self.$output.m_axis_tvalid.val();
                self.$output.m_axis_tready.next = self.m_axis_tready.val();
                self.m_axis_tlast.next = self.$output.m_axis_tlast.val();
            }
        }

        impl Scanner for $name {
            fn drive(&mut self, inputs: &ScanInputs, clock: bool) {
                self.rst.next = inputs.rst;
                self.enable.next = inputs.enable;
                self.adc_miso.next = inputs.miso.into();
                $(
                    let bits = self.$tables.s_axis_tdata.width();
                    self.s_axis_tdata.next = Word::of_fields(&[inputs.s_data.into()], bits).into();
                    self.s_axis_tvalid.next = inputs.s_valid;
                    self.s_axis_tlast.next = inputs.s_last;
                )?
                self.m_axis_tready.next = inputs.m_ready;
                self.clk.next = clock.into();
            }

            fn pins(&self) -> ScanOutputs {
                let [data, beat] = [&self.m_axis_tdata, &self.$source.m_axis_tdata].map(|wire| wire.val().word());
                let taken = self.$source.m_axis_tvalid.val() & self.engine.s_axis_tready.val();
                let beat = Beat {
                    data: beat.signed(0, self.$source.m_axis_tdata.width()) as i32,
                    last: self.$source.m_axis_tlast.val(),
                };
                ScanOutputs {
                    pins: ScanPins {
                        row: self.row.val().word().number(),
                        sclk: self.adc_sclk.val(),
                        cs_n: self.adc_cs_n.val(),
                        mosi: self.adc_mosi.val(),
                    },
                    m_valid: self.m_axis_tvalid.val(),
                    m_last: self.m_axis_tlast.val(),
                    m_data: [0, 1, 2].map(|word| data.signed(word, 32) as i32),
                    s_ready: [$(self.$tables.s_axis_tready.val())?].contains(&true),
                    taken: taken.then_some(beat),
                }
            }
        }
    };
}

scan_core!(ScanCore, engine::Engine, capture, told, []);
scan_core!(WritableScanCore, engine::Engine, tables, codes, [tables, codes, unused]);
scan_core!(SerialScanCore, serial::Engine, capture, told, []);

/// The top module of `model`, after rust-hdl's checks.
pub(super) fn scanner(model: &Model) -> Result<Box<dyn Scanner>, HdlError> {
    let core: Box<dyn Scanner> = match (model.board.engine, model.has_writable_tables()) {
        (EngineKind::Parallel, false) => Box::new(ScanCore::new(model)?),
        (EngineKind::Parallel, true) => Box::new(WritableScanCore::new(model)?),
        (EngineKind::Serial, _) => Box::new(SerialScanCore::new(model)?),
    };
    Hierarchy::of(&*core).check()?;
    check_all(&*core).map_err(|error| HdlError::Check(format!("{error:?}")))?;
    Ok(core)
}
