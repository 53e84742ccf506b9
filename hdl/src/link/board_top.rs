//! A board's top module: an engine behind its link.

use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::wire::link::Identity;

use super::{FrameGate, Lamps, PacketLink, PacketParams, PowerOn, SpiSlave, Uart};
use crate::block;
use crate::engine::Engine;
use crate::error::HdlError;
use crate::language::{kernel_of, Block, Builder, Expr, Hierarchy, Inside, Net};
use crate::primitives::{Dff, RegisterSlice};
use crate::scan::ScanCore;
use crate::streams::BEAT_BITS;

block! {
    /// ```text
    ///               +-----------+
    ///  link's pins <->  board   |
    ///     button -->|  engine   |--> alive, busy, error
    ///        clk -->+-----------+
    /// ```
    /// With a scan, its pins besides.
    pub struct BoardTop {
        link: LinkKind,
        identity: Identity,
        packets: PacketLink,
        source: Source,
    }
    ports BoardTopPorts {
        clock;
        /// Reset button, high when pressed; asynchronous to the clock.
        in button;
        /// Input pin of the link, asynchronous to the clock.
        in uart_rx: link.pin(LinkKind::Uart);
        /// Output pin of the link.
        out uart_tx: link.pin(LinkKind::Uart);
        /// Input pin of the link, asynchronous to the clock.
        in spi_sclk: link.pin(LinkKind::Spi);
        /// Input pin of the link, asynchronous to the clock.
        in spi_cs_n: link.pin(LinkKind::Spi);
        /// Input pin of the link, asynchronous to the clock.
        in spi_mosi: link.pin(LinkKind::Spi);
        /// Output pin of the link.
        out spi_miso: link.pin(LinkKind::Spi);
        /// Status LED: blinks while the clock runs.
        out alive;
        /// Status LED: lit while a packet is received, computed or sent.
        out busy;
        /// Status LED: lit briefly when a packet is dropped.
        out error;
        /// Address of the row that is driven, unsigned; valid after the reset.
        out row: source.scan().map_or(0, |scan| scan.widths().row);
        /// Serial clock of all converters.
        out adc_sclk: usize::from(source.scan().is_some());
        /// Chip select of all converters, active low.
        out adc_cs_n: usize::from(source.scan().is_some());
        /// Commands to all converters.
        out adc_mosi: usize::from(source.scan().is_some());
        /// Outputs of the converters, one bit each; valid while `adc_cs_n` is low.
        in adc_miso: source.scan().map_or(0, |scan| scan.widths().adc_miso);
    }
}

/// What computes the forces.
enum Source {
    /// An engine, whose codes come over the link.
    Engine(Box<Engine>),
    /// An engine that reads its array by itself.
    Scan(Box<ScanCore>),
}

impl Source {
    fn scan(&self) -> Option<&ScanCore> {
        match self {
            Source::Engine(_) => None,
            Source::Scan(scan) => Some(scan),
        }
    }
}

/// The width of a pin of a link.
trait Pin {
    /// 1 of the link itself, else 0.
    fn pin(self, of: LinkKind) -> usize;
}

impl Pin for LinkKind {
    fn pin(self, of: LinkKind) -> usize {
        usize::from(self == of)
    }
}

impl BoardTop {
    /// The board of the scene of `model`.
    ///
    /// # Errors
    /// As [`Identity::of`]; [`HdlError::Unsupported`] for what a board does not have.
    pub fn new(model: &Model) -> Result<Self, HdlError> {
        let scans = model.scene.hardware.adc_scan.is_some();
        if scans && !model.has_writable_tables() {
            return Err(HdlError::Unsupported {
                field: "hardware.tables",
                value: "rom".to_owned(),
                what:
                    "a board that scans its array without writable tables, over whose link zero and gain of the array \
                       come,",
            });
        }
        if model.scene.hardware.arrays > 1 {
            return Err(HdlError::Unsupported {
                field: "hardware.arrays",
                value: model.scene.hardware.arrays.to_string(),
                what: "a board's link, whose packets are of one array",
            });
        }
        if model.formats().degree == 0 {
            return Err(HdlError::Unsupported {
                field: "search.mu_max",
                value: model.scene.search.mu_max.to_string(),
                what: "a board without a μ search",
            });
        }
        let identity = Identity::of(model)?;
        let source = match scans {
            false => Source::Engine(Box::new(Engine::new(model))),
            true => Source::Scan(Box::new(ScanCore::new(model)?)),
        };
        let packets = PacketLink::new(&PacketParams::of(model), &identity);
        Ok(BoardTop { link: model.scene.hardware.link, identity, packets, source })
    }
}

/// The bytes of a link: those received, with whether one is wrong, and the way of those to send.
struct Bytes<'k> {
    data: Expr<'k>,
    valid: Expr<'k>,
    broken: Expr<'k>,
    send_data: Net<'k>,
    send_valid: Net<'k>,
    send_ready: Expr<'k>,
}

impl BoardTop {
    /// The instance of the link's line, with its pins.
    fn line<'k>(&self, k: &'k Builder, io: &BoardTopPorts<Inside<'k>>, rst: Expr<'k>) -> Bytes<'k> {
        match self.link {
            LinkKind::Uart => {
                let uart = k.instance("line", Uart::new(&self.identity));
                uart.rst.set(rst);
                uart.uart_rx.set(io.uart_rx);
                io.uart_tx.set(uart.uart_tx);
                Bytes {
                    data: uart.data,
                    valid: uart.valid,
                    broken: uart.broken,
                    send_data: uart.send_data,
                    send_valid: uart.send_valid,
                    send_ready: uart.send_ready,
                }
            }
            LinkKind::Spi => {
                let spi = k.instance("line", SpiSlave::default());
                spi.rst.set(rst);
                spi.spi_sclk.set(io.spi_sclk);
                spi.spi_cs_n.set(io.spi_cs_n);
                spi.spi_mosi.set(io.spi_mosi);
                io.spi_miso.set(spi.spi_miso);
                Bytes {
                    data: spi.data,
                    valid: spi.valid,
                    // No byte of an SPI is wrong by itself.
                    broken: k.constant(1, 0),
                    send_data: spi.send_data,
                    send_valid: spi.send_valid,
                    send_ready: spi.send_ready,
                }
            }
        }
    }
}

impl Block for BoardTop {
    fn build<'k>(&'k self, k: &'k Builder, io: BoardTopPorts<Inside<'k>>) {
        let power_on = k.instance("power_on", PowerOn::default());
        k.comment("Registered once more, because the engine is large and its reset has a long route.");
        let engine_rst = k.instance("engine_rst", Dff {});
        let line = self.line(k, &io, power_on.rst);
        let link = k.instance("link", &self.packets);
        let lamps = k.instance("lamps", Lamps::new(self.identity.clock_hz));
        power_on.button.set(io.button);
        link.rst.set(power_on.rst);
        engine_rst.d.set(power_on.rst);
        lamps.rst.set(power_on.rst);

        link.receive_data.set(line.data);
        link.receive_valid.set(line.valid);
        link.receive_broken.set(line.broken);
        line.send_data.set(link.send_data);
        line.send_valid.set(link.send_valid);
        link.send_ready.set(line.send_ready);

        match &self.source {
            Source::Engine(engine) => {
                let engine = k.instance("engine", &**engine);
                engine.rst.set(engine_rst.q);
                link.s_axis.connect(&engine.s_axis);
                engine.m_axis.connect(&link.m_axis);
                k.unused([link.requested]);
            }
            Source::Scan(scan) => {
                let engine = k.instance("engine", &**scan);
                let gate = k.instance("gate", FrameGate::default());
                k.comment("Registers the way back of `ready` from the link's requests to the engine.");
                let slice = k.instance("slice", RegisterSlice::new(BEAT_BITS));
                engine.rst.set(engine_rst.q);
                slice.rst.set(power_on.rst);
                gate.rst.set(power_on.rst);
                link.s_axis.connect(&engine.s_axis);
                engine.m_axis.connect(&slice.s_axis);
                gate.requested.set(link.requested);
                slice.m_axis.connect(&gate.s_axis);
                gate.m_axis.connect(&link.m_axis);
                engine.enable.set(!gate.busy);
                io.row.set(engine.row);
                io.adc_sclk.set(engine.adc_sclk);
                io.adc_cs_n.set(engine.adc_cs_n);
                io.adc_mosi.set(engine.adc_mosi);
                engine.adc_miso.set(io.adc_miso);
            }
        }

        lamps.activity.set(link.activity);
        lamps.dropped.set(link.dropped);
        io.alive.set(lamps.alive);
        io.busy.set(lamps.busy);
        io.error.set(lamps.error);
    }
}

/// The board of `model`, checked.
///
/// # Errors
/// As [`BoardTop::new`].
pub(super) fn board_top(model: &Model) -> Result<Hierarchy, HdlError> {
    let hierarchy = Hierarchy::of_kernel(kernel_of(&BoardTop::new(model)?));
    hierarchy.check()?;
    Ok(hierarchy)
}
