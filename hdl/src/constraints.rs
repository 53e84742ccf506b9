//! Timing constraints of a top module: `<top>.sdc`, of commands that are the same in Synopsys Design Constraints and in Vivado's XDC.
//!
//! ```text
//! clock of the top module, clock of its link ──> <top>.sdc
//! ```
//! There is no exception within a clock: the reset is synchronous, and every path has one cycle. The chip select of an SPI resets registers
//! of its clock at any time, but it is a pin, and no path begins at one without a stated delay.

use std::fmt::Write;

use crate::manifest::GeneratedFile;

/// A port that is a clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock<'p> {
    /// Name of the port.
    pub port: &'p str,
    /// Highest frequency.
    pub MHz: f64,
}

impl Clock<'_> {
    /// The period in ns: whole picoseconds, as Vivado has them, and not longer than it is.
    fn period_ns(&self) -> f64 {
        (1e6 / self.MHz).floor() / 1e3
    }
}

/// The constraints of the module `top`, whose clocks are `own` and, where its link has one, `of_link`, which comes from elsewhere.
pub(crate) fn constraints(top: &str, own: Clock, of_link: Option<Clock>) -> GeneratedFile {
    let mut text = format!(
        "\
# Generated with {top}.v; do not edit, build it again.
#
# Clocks of {top} where it is built alone, for tools that read SDC or XDC.
# In another design leave this file out: the clocks of that design count. The reset is synchronous; no path within a clock is left out.
"
    );
    for clock in [Some(own), of_link].into_iter().flatten() {
        let _ = writeln!(text, "create_clock -name {0} -period {1:.3} [get_ports {0}]", clock.port, clock.period_ns());
    }
    if let Some(of_link) = of_link {
        let groups = [own, of_link].map(|clock| format!(" -group [get_clocks {}]", clock.port)).concat();
        let _ = write!(
            text,
            "\
# {link} comes from the controller. Bytes cross to {own} and back beside a toggle that passes two registers, and stay meanwhile.
set_clock_groups -asynchronous{groups}
",
            link = of_link.port,
            own = own.port,
        );
    }
    GeneratedFile { name: format!("{top}.sdc"), text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_not_longer_than_that_of_the_clock() {
        for (MHz, ns) in [(100.0, 10.0), (25.5, 39.215), (62.5, 16.0), (48.0, 20.833)] {
            assert_eq!(Clock { port: "clk", MHz }.period_ns(), ns);
        }
    }
}
