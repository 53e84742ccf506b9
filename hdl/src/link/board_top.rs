//! A board's top module: an engine behind its link.

use std::thread;

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::EngineKind;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::wire::link::Identity;
use rust_hdl::prelude::*;

use super::board::{Board, BoardOutputs};
use super::{FrameGate, Lamps, PacketLink, PowerOn, Shape, SpiSlave, Uart};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::language::RustHdl;
use crate::primitives::{Dff, RegisterSlice};
use crate::scan::{ScanPins, WritableScanCore};
use crate::wire::Wire;
use crate::{engine, serial};

/// Board top `$name` with engine `$engine` and link block `$block`, which `$line` builds from an identity. A macro,
/// because rust-hdl connects blocks by their fields and does not support type parameters for them. The pins are named
/// as in the link block. A link that can receive a byte wrongly has an output for it, `$broken`; otherwise `$never` is
/// `false`. `$source` is the block whose beats the link sends: `engine`, or `gate`, which stands behind an engine that scans
/// its array, with the pins of the scan; `$unused` takes what only a gate needs.
macro_rules! board_top {
    (
        $name:ident, $engine:ty, $source:ident, [$($gate:ident, $slice:ident, $row:ident, $miso:ident)?], [$($unused:ident)?],
        $block:ty, $line:expr, [$($input:ident),+] -> $output:ident, [$($broken:ident)?], [$($never:tt)?]
    ) => {
        /// ```text
        ///               +-----------+
        ///  link's pins <->  board   |
        ///     button -->|  engine   |--> alive, busy, error
        ///        clk -->+-----------+
        /// ```
        /// | port | meaning |
        /// |---|---|
        /// | `clk` | clock of link and engine |
        /// | `button` | reset while high; needs no debouncing |
        #[doc = concat!("| ", $("`", stringify!($input), "`, ",)+ "`", stringify!($output), "` | pins of the link |")]
        /// | `alive`, `busy`, `error` | status LEDs, high when lit |
        $(
            #[doc = concat!("| `", stringify!($row), "`, `adc_sclk`, `adc_cs_n`, `adc_mosi`, `", stringify!($miso), "` | pins of the scan |")]
        )?
        #[derive(dermis_hdl_derive::Block)]
        pub struct $name {
            /// Clock of link and engine.
            pub clk: Signal<In, Clock>,
            /// Reset button, high when pressed; asynchronous to the clock.
            pub button: Signal<In, Bit>,
            $(
                /// Input pin of the link, asynchronous to the clock.
                pub $input: Signal<In, Bit>,
            )+
            /// Output pin of the link.
            pub $output: Signal<Out, Bit>,
            /// Status LED: blinks while the clock runs.
            pub alive: Signal<Out, Bit>,
            /// Status LED: lit while a packet is received, computed or sent.
            pub busy: Signal<Out, Bit>,
            /// Status LED: lit briefly when a packet is dropped.
            pub error: Signal<Out, Bit>,
            $(
                /// Address of the row that is driven, unsigned; valid after the reset.
                pub $row: Wire<Out>,
                /// Serial clock of all converters.
                pub adc_sclk: Signal<Out, Bit>,
                /// Chip select of all converters, active low.
                pub adc_cs_n: Signal<Out, Bit>,
                /// Commands to all converters.
                pub adc_mosi: Signal<Out, Bit>,
                /// Outputs of the converters, one bit each; valid while `adc_cs_n` is low.
                pub $miso: Wire<In>,
                // Registers the way back of `ready` from the link's requests to the engine.
                $slice: RustHdl<RegisterSlice>,
                $gate: FrameGate,
            )?
            $($unused: Signal<Local, Bit>,)?
            power_on: PowerOn,
            // Registered once more, because the engine is large and its reset has a long route.
            engine_rst: RustHdl<Dff>,
            line: $block,
            link: PacketLink,
            engine: $engine,
            lamps: Lamps,
        }

        impl $name {
            /// The board of the scene of `model`.
            ///
            /// # Errors
            /// As [`Identity::of`]; as [`WritableScanCore::new`] with such an engine.
            pub fn new(model: &Model) -> Result<Self, HdlError> {
                let identity = Identity::of(model)?;
                let engine = <$engine>::of(model)?;
                let line: fn(&Identity) -> $block = $line;
                let mut top = $name {
                    clk: Default::default(),
                    button: Default::default(),
                    $($input: Default::default(),)+
                    $output: Default::default(),
                    alive: Default::default(),
                    busy: Default::default(),
                    error: Default::default(),
                    $(
                        $row: Wire::new(engine.row.width()),
                        adc_sclk: Default::default(),
                        adc_cs_n: Default::default(),
                        adc_mosi: Default::default(),
                        $miso: Wire::new(engine.adc_miso.width()),
                        $slice: RustHdl::new(RegisterSlice::new(BEAT, true)),
                        $gate: FrameGate::default(),
                    )?
                    $($unused: Default::default(),)?
                    power_on: PowerOn::default(),
                    engine_rst: Default::default(),
                    line: line(&identity),
                    link: PacketLink::new(&Shape::of(model), &identity),
                    engine,
                    lamps: Lamps::new(identity.clock_hz),
                };
                top.connect_all();
                Ok(top)
            }
        }

        impl Logic for $name {
            #[hdl_gen]
            fn update(&mut self) {
                self.power_on.clk.next = self.clk.val();
                self.engine_rst.clk.next = self.clk.val();
                self.line.clk.next = self.clk.val();
                self.link.clk.next = self.clk.val();
                self.engine.clk.next = self.clk.val();
                self.lamps.clk.next = self.clk.val();
                self.power_on.button.next = self.button.val();
                self.line.rst.next = self.power_on.rst.val();
                self.link.rst.next = self.power_on.rst.val();
                self.engine_rst.d.next = self.power_on.rst.val();
                self.engine.rst.next = self.engine_rst.q.val();
                self.lamps.rst.next = self.power_on.rst.val();

                $(self.line.$input.next = self.$input.val();)+
                self.$output.next = self.line.$output.val();
                self.link.receive_data.next = self.line.data.val();
                self.link.receive_valid.next = self.line.valid.val();
                $(self.link.receive_broken.next = self.line.$broken.val();)?
                $(self.link.receive_broken.next = $never;)?
                self.line.send_data.next = self.link.send_data.val();
                self.line.send_valid.next = self.link.send_valid.val();
                self.link.send_ready.next = self.line.send_ready.val();

                self.engine.s_axis_tdata.next = self.link.s_axis_tdata.val();
                self.engine.s_axis_tvalid.next = self.link.s_axis_tvalid.val();
                self.engine.s_axis_tlast.next = self.link.s_axis_tlast.val();
                self.link.s_axis_tready.next = self.engine.s_axis_tready.val();
                self.link.m_axis_tdata.next = self.$source.m_axis_tdata.val();
                self.link.m_axis_tvalid.next = self.$source.m_axis_tvalid.val();
                self.link.m_axis_tlast.next = self.$source.m_axis_tlast.val();
                self.$source.m_axis_tready.next = self.link.m_axis_tready.val();
                $(
                    self.$slice.clk.next = self.clk.val();
                    self.$slice.rst.next = self.power_on.rst.val();
                    self.$slice.s_axis_tdata.next = self.engine.m_axis_tdata.val();
                    self.$slice.s_axis_tvalid.next = self.engine.m_axis_tvalid.val();
                    self.$slice.s_axis_tlast.next = self.engine.m_axis_tlast.val();
                    self.engine.m_axis_tready.next = self.$slice.s_axis_tready.val();
                    self.$gate.clk.next = self.clk.val();
                    self.$gate.rst.next = self.power_on.rst.val();
                    self.$gate.requested.next = self.link.requested.val();
                    self.$gate.s_axis_tdata.next = self.$slice.m_axis_tdata.val();
                    self.$gate.s_axis_tvalid.next = self.$slice.m_axis_tvalid.val();
                    self.$gate.s_axis_tlast.next = self.$slice.m_axis_tlast.val();
                    self.$slice.m_axis_tready.next = self.$gate.s_axis_tready.val();
                    self.engine.enable.next = !self.$gate.busy.val();
                    self.$row.next = self.engine.row.val();
                    self.adc_sclk.next = self.engine.adc_sclk.val();
                    self.adc_cs_n.next = self.engine.adc_cs_n.val();
                    self.adc_mosi.next = self.engine.adc_mosi.val();
                    self.engine.adc_miso.next = self.$miso.val();
                )?

                $(self.$unused.next = self.link.requested.val();)?

                self.lamps.activity.next = self.link.activity.val();
                self.lamps.dropped.next = self.link.dropped.val();
                self.alive.next = self.lamps.alive.val();
                self.busy.next = self.lamps.busy.val();
                self.error.next = self.lamps.error.val();
            }
        }

        impl Board for $name {
            fn drive(&mut self, inputs: u64, clock: bool) {
                let pins = [$(&mut self.$input),+];
                let rest = pins.into_iter().fold(inputs, |rest, pin| {
                    pin.next = rest & 1 == 1;
                    rest >> 1
                });
                [$(&mut self.$miso)?].into_iter().for_each(|miso: &mut Wire<In>| miso.next = rest.into());
                self.clk.next = clock.into();
            }

            fn outputs(&self) -> BoardOutputs {
                let scan: &[ScanPins] = &[$(ScanPins {
                    row: self.$row.val().word().number(),
                    sclk: self.adc_sclk.val(),
                    cs_n: self.adc_cs_n.val(),
                    mosi: self.adc_mosi.val(),
                })?];
                BoardOutputs {
                    to_host: self.$output.val(),
                    alive: self.alive.val(),
                    busy: self.busy.val(),
                    error: self.error.val(),
                    scan: scan.first().copied().unwrap_or_default(),
                }
            }
        }
    };
}

/// Board tops for the two links of an engine.
macro_rules! boards {
    ($uart:ident, $spi:ident, $engine:ty, $source:ident, $scan:tt, $unused:tt) => {
        board_top!($uart, $engine, $source, $scan, $unused, Uart, Uart::new, [uart_rx] -> uart_tx, [broken], []);
        board_top!(
            $spi, $engine, $source, $scan, $unused,
            SpiSlave, |_| SpiSlave::default(), [spi_sclk, spi_cs_n, spi_mosi] -> spi_miso, [], [false]
        );
    };
}

boards!(BoardTop, SpiBoardTop, engine::Engine, engine, [], [unused]);
boards!(SerialBoardTop, SerialSpiBoardTop, serial::Engine, engine, [], [unused]);
boards!(ScanBoardTop, SpiScanBoardTop, WritableScanCore, gate, [gate, slice, row, adc_miso], []);

/// An engine for a board.
trait OfModel: Sized {
    /// That of `model`.
    fn of(model: &Model) -> Result<Self, HdlError>;
}

impl OfModel for engine::Engine {
    fn of(model: &Model) -> Result<Self, HdlError> {
        Ok(engine::Engine::new(model))
    }
}

impl OfModel for serial::Engine {
    fn of(model: &Model) -> Result<Self, HdlError> {
        Ok(serial::Engine::new(model))
    }
}

impl OfModel for WritableScanCore {
    fn of(model: &Model) -> Result<Self, HdlError> {
        WritableScanCore::new(model)
    }
}

/// Width of a beat of the engine.
const BEAT: usize = 96;
/// Stack on which a board is made: it is moved several times while it grows around its engine, and is large.
const STACK_BYTES: usize = 64 << 20;

/// The board of `model`, after rust-hdl's checks.
pub(super) fn board_top(model: &Model) -> Result<Box<dyn Board>, HdlError> {
    thread::scope(|scope| {
        let made = thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, || made(model));
        let made = made.map_err(|error| HdlError::Check(format!("no thread: {error}")))?;
        made.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn made(model: &Model) -> Result<Box<dyn Board>, HdlError> {
    let scans = model.scene.hardware.adc_scan.is_some();
    if scans && !model.has_writable_tables() {
        return Err(HdlError::Unsupported {
            field: "hardware.tables",
            value: "rom".to_owned(),
            what:
                "a board that scans its array without writable tables, over whose link zero and gain of the array come,",
        });
    }
    if model.formats().degree == 0 {
        return Err(HdlError::Unsupported {
            field: "search.mu_max",
            value: model.scene.search.mu_max.to_string(),
            what: "a board without a μ search",
        });
    }
    match (model.board.engine, model.scene.hardware.link, scans) {
        (EngineKind::Parallel, LinkKind::Uart, false) => checked(BoardTop::new(model)?),
        (EngineKind::Parallel, LinkKind::Spi, false) => checked(SpiBoardTop::new(model)?),
        (EngineKind::Parallel, LinkKind::Uart, true) => checked(ScanBoardTop::new(model)?),
        (EngineKind::Parallel, LinkKind::Spi, true) => checked(SpiScanBoardTop::new(model)?),
        // Has no writable tables, so it does not scan here.
        (EngineKind::Serial, LinkKind::Uart, _) => checked(SerialBoardTop::new(model)?),
        (EngineKind::Serial, LinkKind::Spi, _) => checked(SerialSpiBoardTop::new(model)?),
    }
}

fn checked<B: Board + 'static>(top: B) -> Result<Box<dyn Board>, HdlError> {
    Hierarchy::of(&top).check()?;
    check_all(&top).map_err(|error| HdlError::Check(format!("{error:?}")))?;
    Ok(Box::new(top))
}
