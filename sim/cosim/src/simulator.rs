//! What the hardware runs under.

/// Simulator of the hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulator {
    /// The generated Verilog, under Verilator.
    Verilator,
    /// The same design in kernel simulation.
    Kernel,
    /// The netlist synthesised for the scene's board, under Verilator.
    Netlist,
}

impl Simulator {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Simulator::Verilator => "verilator",
            Simulator::Kernel => "kernel",
            Simulator::Netlist => "netlist",
        }
    }
}
