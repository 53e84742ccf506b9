//! A board's top module: an engine behind its link.

use dermis_golden::board::EngineKind;
use dermis_golden::fixed::Model;
use dermis_golden::link::{Identity, LinkError, LinkKind};
use rust_hdl::prelude::*;

use super::board::{Board, BoardOutputs};
use super::{Lamps, PacketLink, PowerOn, Shape, SpiSlave, Uart};
use crate::error::HdlError;
use crate::language::Hierarchy;
use crate::primitives::Dff;
use crate::scan::require_stream;
use crate::{engine, serial};

/// Board top `$name` with engine `$engine` and link block `$block`, which `$line` builds from an identity. A macro,
/// because rust-hdl connects blocks by their fields and does not support type parameters for them. The pins are named
/// as in the link block. A link that can receive a byte wrongly has an output for it, `$broken`; otherwise `$never` is
/// `false`.
macro_rules! board_top {
    ($name:ident, $engine:ty, $block:ty, $line:expr, [$($input:ident),+] -> $output:ident, [$($broken:ident)?], [$($never:tt)?]) => {
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
        #[derive(LogicBlock)]
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
            power_on: PowerOn,
            // Registered once more, because the engine is large and its reset has a long route.
            engine_rst: Dff,
            line: $block,
            link: PacketLink,
            engine: $engine,
            lamps: Lamps,
        }

        impl $name {
            /// The board of the scene of `model`.
            ///
            /// # Errors
            /// As [`Identity::of`].
            pub fn new(model: &Model) -> Result<Self, LinkError> {
                let identity = Identity::of(model)?;
                let line: fn(&Identity) -> $block = $line;
                let mut top = $name {
                    clk: Default::default(),
                    button: Default::default(),
                    $($input: Default::default(),)+
                    $output: Default::default(),
                    alive: Default::default(),
                    busy: Default::default(),
                    error: Default::default(),
                    power_on: PowerOn::default(),
                    engine_rst: Default::default(),
                    line: line(&identity),
                    link: PacketLink::new(&Shape::of(model), &identity),
                    engine: <$engine>::new(model),
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
                self.link.m_axis_tdata.next = self.engine.m_axis_tdata.val();
                self.link.m_axis_tvalid.next = self.engine.m_axis_tvalid.val();
                self.link.m_axis_tlast.next = self.engine.m_axis_tlast.val();
                self.engine.m_axis_tready.next = self.link.m_axis_tready.val();

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
                pins.into_iter().enumerate().for_each(|(at, pin)| pin.next = inputs >> at & 1 == 1);
                self.clk.next = clock.into();
            }

            fn outputs(&self) -> BoardOutputs {
                BoardOutputs {
                    to_host: self.$output.val(),
                    alive: self.alive.val(),
                    busy: self.busy.val(),
                    error: self.error.val(),
                }
            }
        }
    };
}

/// Board tops for the two links of an engine.
macro_rules! boards {
    ($uart:ident, $spi:ident, $engine:ty) => {
        board_top!($uart, $engine, Uart, Uart::new, [uart_rx] -> uart_tx, [broken], []);
        board_top!($spi, $engine, SpiSlave, |_| SpiSlave::default(), [spi_sclk, spi_cs_n, spi_mosi] -> spi_miso, [], [false]);
    };
}

boards!(BoardTop, SpiBoardTop, engine::Engine);
boards!(SerialBoardTop, SerialSpiBoardTop, serial::Engine);

/// The board of `model`, after rust-hdl's checks.
pub(super) fn board_top(model: &Model) -> Result<Box<dyn Board>, HdlError> {
    require_stream(model, "a board with a link around a scan")?;
    if model.formats().degree == 0 {
        return Err(HdlError::Unsupported {
            field: "search.mu_max",
            value: model.scene.search.mu_max.to_string(),
            what: "a board without a μ search",
        });
    }
    match (model.board.engine, model.scene.hardware.link) {
        (EngineKind::Parallel, LinkKind::Uart) => checked(BoardTop::new(model)?),
        (EngineKind::Parallel, LinkKind::Spi) => checked(SpiBoardTop::new(model)?),
        (EngineKind::Serial, LinkKind::Uart) => checked(SerialBoardTop::new(model)?),
        (EngineKind::Serial, LinkKind::Spi) => checked(SerialSpiBoardTop::new(model)?),
    }
}

fn checked<B: Board + 'static>(top: B) -> Result<Box<dyn Board>, HdlError> {
    Hierarchy::of(&top).check()?;
    check_all(&top).map_err(|error| HdlError::Check(format!("{error:?}")))?;
    Ok(Box::new(top))
}
