//! Links: how a board exchanges frames and forces with a host, and the pins of its top module.

/// The link of a board, `hardware.link` in a scene; the top module has the pins of this link only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkKind {
    /// A serial port.
    #[default]
    Uart,
    /// An SPI slave, mode 0, most significant bit first.
    Spi,
}

impl LinkKind {
    /// Every link with its name in a scene file.
    pub const NAMES: [(&'static str, LinkKind); 2] = [("uart", LinkKind::Uart), ("spi", LinkKind::Spi)];

    /// Name in a scene file.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, kind)| *kind == self).map_or("", |(name, _)| name)
    }

    /// The input pins, as the board's top module names them.
    pub fn inputs(self) -> &'static [&'static str] {
        match self {
            LinkKind::Uart => &["uart_rx"],
            LinkKind::Spi => &["spi_sclk", "spi_cs_n", "spi_mosi"],
        }
    }

    /// The output pin, as the board's top module names it.
    pub fn output(self) -> &'static str {
        match self {
            LinkKind::Uart => "uart_tx",
            LinkKind::Spi => "spi_miso",
        }
    }

    /// The input pin that is a clock; `None` for the UART.
    pub fn clock(self) -> Option<&'static str> {
        match self {
            LinkKind::Uart => None,
            LinkKind::Spi => self.inputs().first().copied(),
        }
    }
}
