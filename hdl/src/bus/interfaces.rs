//! Bus interfaces of a core and of its arbiter, from which the descriptions for tools that connect or package cores are made.
//!
//! ```text
//! ports of the top module ──> which belong together, and as what ──> IP-XACT, script for Vivado
//! ```
//! A port belongs to the interface with whose prefix its name begins; its name there is the rest, in capitals for AXI. The senders
//! of an arbiter stand side by side in the same ports: a part of each belongs to the interface of one.

use super::Bus;

/// A port of the top module: name, whether it is an output, width in bits, meaning.
pub(super) type TopPort = (String, bool, usize, String);

/// The clock of a core.
pub(super) const CLOCK: &str = "aclk";
/// Its reset, active low.
pub(super) const RESET: &str = "aresetn";

/// What an interface speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Protocol {
    /// AXI4-Stream.
    Stream,
    /// AXI4-Lite.
    AxiLite,
    /// Wishbone B4, classic.
    Wishbone,
}

impl Protocol {
    /// Vendor, library, name and version of its definition in IP-XACT.
    pub(super) fn definition(self) -> [&'static str; 4] {
        match self {
            Protocol::Stream => ["amba.com", "AMBA4", "AXI4Stream", "r0p0_1"],
            Protocol::AxiLite => ["amba.com", "AMBA4", "AXI4-Lite", "r0p0_0"],
            Protocol::Wishbone => ["opencores.org", "bus", "wishbone", "b4"],
        }
    }

    /// Name of its definition in Vivado, which has none of Wishbone.
    pub(super) fn vivado(self) -> Option<&'static str> {
        match self {
            Protocol::Stream => Some("axis"),
            Protocol::AxiLite => Some("aximm"),
            Protocol::Wishbone => None,
        }
    }
}

/// The definitions in Vivado of clocks and resets: kind of the interface, and name of the port in it.
pub(super) const SIGNALS: [(&str, &str, &str); 2] = [(CLOCK, "signal:clock", "CLK"), (RESET, "signal:reset", "RST")];

/// Parameters in Vivado of the clock or the reset `port` of a core: name and value. No frequency is among them, because that of the clock
/// in a design counts.
pub(super) fn parameters(port: &str, interfaces: &[Interface]) -> Vec<(&'static str, String)> {
    if port == RESET {
        return vec![("POLARITY", "ACTIVE_LOW".to_owned())];
    }
    let known = interfaces.iter().filter(|own| own.protocol.vivado().is_some());
    let names: Vec<&str> = known.map(|own| own.name.as_str()).collect();
    vec![("ASSOCIATED_BUSIF", names.join(":")), ("ASSOCIATED_RESET", RESET.to_owned())]
}

/// Attributes of clock and reset in the Verilog of a core, for a block design of Vivado that takes the Verilog itself.
pub(super) fn attributes(interfaces: &[Interface]) -> [(&'static str, String); 2] {
    SIGNALS.map(|(port, kind, signal)| {
        let own = parameters(port, interfaces).into_iter().map(|(name, value)| format!("{name} {value}"));
        let own: Vec<String> = own.collect();
        let info = format!("X_INTERFACE_INFO = \"xilinx.com:{kind}:1.0 {port} {signal}\"");
        (port, format!("{info}, X_INTERFACE_PARAMETER = \"{}\"", own.join(", ")))
    })
}

/// Ports of a top module that belong together.
#[derive(Clone, Debug)]
pub(super) struct Interface {
    pub name: String,
    /// With what the names of its ports begin.
    pub prefix: &'static str,
    pub protocol: Protocol,
    pub is_master: bool,
    /// Number of its part of each port, the lowest bits first, and how many parts of the same width there are.
    pub part: (usize, usize),
}

impl Interface {
    fn new(prefix: &'static str, protocol: Protocol, is_master: bool) -> Self {
        Interface { name: prefix.to_owned(), prefix, protocol, is_master, part: (0, 1) }
    }

    /// The interfaces of a core: streams, and the bus of the registers.
    pub(super) fn of_core(bus: Bus) -> Vec<Self> {
        let registers = match bus {
            Bus::AxiLite => Interface::new("s_axil", Protocol::AxiLite, false),
            Bus::Wishbone => Interface::new("wb", Protocol::Wishbone, false),
        };
        let stream = |prefix, is_master| Interface::new(prefix, Protocol::Stream, is_master);
        vec![stream("s_axis", false), stream("m_axis", true), registers]
    }

    /// The interfaces of an arbiter: a stream of each of so many senders, `s0_axis` and so on, and that to the core.
    pub(super) fn of_arbiter(senders: usize) -> Vec<Self> {
        let stream =
            |is_master| Interface::new(if is_master { "m_axis" } else { "s_axis" }, Protocol::Stream, is_master);
        let sender = |at| Interface { name: format!("s{at}_axis"), part: (at, senders), ..stream(false) };
        (0..senders).map(sender).chain([stream(true)]).collect()
    }

    /// Whether the registers are behind it.
    pub(super) fn has_registers(&self) -> bool {
        self.protocol != Protocol::Stream
    }

    /// Its ports among `ports`, each behind its name in the definition.
    pub(super) fn ports<'p>(&self, ports: &'p [TopPort]) -> impl Iterator<Item = (String, &'p TopPort)> + use<'p, '_> {
        let logical = |port: &'p TopPort| {
            let own = port.0.strip_prefix(self.prefix)?.strip_prefix('_')?;
            let name = if self.protocol == Protocol::Wishbone { own.to_owned() } else { own.to_uppercase() };
            Some((name, port))
        };
        ports.iter().filter_map(logical)
    }
}
