//! A board: an engine behind a UART.

use dermis_golden::fixed::Model;
use dermis_golden::link::{Identity, LinkError};
use rust_hdl::prelude::*;

use super::{Board, BoardOutputs, Lamps, PacketLink, PowerOn, Shape, UartReceiver, UartTransmitter};
use crate::{engine, serial};

/// The board of an engine: rust-hdl connects blocks by their fields, so that a type parameter cannot stand for it.
macro_rules! board_top {
    ($name:ident, $engine:ty) => {
        /// ```text
        ///             +-----------+
        ///  uart_rx -->| board top |--> uart_tx
        ///  button  -->|  engine   |--> alive, busy, error
        ///     clk  -->+-----------+
        /// ```
        /// | port | meaning |
        /// |---|---|
        /// | `clk` | the engine's clock |
        /// | `button` | reset as long as it is high; needs no debouncing |
        /// | `uart_rx`, `uart_tx` | the board's side of the UART |
        /// | `alive`, `busy`, `error` | lamps |
        #[derive(LogicBlock)]
        pub struct $name {
            /// Clock.
            pub clk: Signal<In, Clock>,
            /// Reset, asynchronous to the clock.
            pub button: Signal<In, Bit>,
            /// From the host, asynchronous to the clock.
            pub uart_rx: Signal<In, Bit>,
            /// To the host.
            pub uart_tx: Signal<Out, Bit>,
            /// Blinks while the clock runs.
            pub alive: Signal<Out, Bit>,
            /// Lit while something comes, is computed or goes.
            pub busy: Signal<Out, Bit>,
            /// Lit for a moment when a packet is dropped.
            pub error: Signal<Out, Bit>,
            power_on: PowerOn,
            // The engine is large: its reset has a register of its own, which may lie far from the button.
            engine_rst: DFF<Bit>,
            receiver: UartReceiver,
            transmitter: UartTransmitter,
            link: PacketLink,
            engine: $engine,
            lamps: Lamps,
        }

        impl $name {
            /// The board of a scene.
            ///
            /// # Errors
            /// As [`Identity::of`].
            pub fn new(model: &Model) -> Result<Self, LinkError> {
                let identity = Identity::of(model)?;
                let mut top = $name {
                    clk: Default::default(),
                    button: Default::default(),
                    uart_rx: Default::default(),
                    uart_tx: Default::default(),
                    alive: Default::default(),
                    busy: Default::default(),
                    error: Default::default(),
                    power_on: PowerOn::default(),
                    engine_rst: Default::default(),
                    receiver: UartReceiver::new(identity.baud, identity.clock_hz),
                    transmitter: UartTransmitter::new(identity.baud, identity.clock_hz),
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
                self.engine_rst.clock.next = self.clk.val();
                self.receiver.clk.next = self.clk.val();
                self.transmitter.clk.next = self.clk.val();
                self.link.clk.next = self.clk.val();
                self.engine.clk.next = self.clk.val();
                self.lamps.clk.next = self.clk.val();
                self.power_on.button.next = self.button.val();
                self.receiver.rst.next = self.power_on.rst.val();
                self.transmitter.rst.next = self.power_on.rst.val();
                self.link.rst.next = self.power_on.rst.val();
                self.engine_rst.d.next = self.power_on.rst.val();
                self.engine.rst.next = self.engine_rst.q.val();
                self.lamps.rst.next = self.power_on.rst.val();

                self.receiver.line.next = self.uart_rx.val();
                self.link.receive_data.next = self.receiver.data.val();
                self.link.receive_valid.next = self.receiver.valid.val();
                self.link.receive_broken.next = self.receiver.broken.val();
                self.transmitter.data.next = self.link.send_data.val();
                self.transmitter.valid.next = self.link.send_valid.val();
                self.link.send_ready.next = self.transmitter.ready.val();
                self.uart_tx.next = self.transmitter.line.val();

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
            fn drive(&mut self, uart_rx: bool, clock: bool) {
                self.uart_rx.next = uart_rx;
                self.clk.next = clock.into();
            }

            fn outputs(&self) -> BoardOutputs {
                BoardOutputs {
                    uart_tx: self.uart_tx.val(),
                    alive: self.alive.val(),
                    busy: self.busy.val(),
                    error: self.error.val(),
                }
            }

            fn verilog(&self) -> String {
                generate_verilog_unchecked(self)
            }
        }
    };
}

board_top!(BoardTop, engine::Engine);
board_top!(SerialBoardTop, serial::Engine);
