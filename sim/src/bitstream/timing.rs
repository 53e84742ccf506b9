//! What a try of place and route reached.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::tools::ToolError;

/// nextpnr's report, the parts that are used.
#[derive(Clone, Debug, Deserialize)]
struct Report {
    fmax: BTreeMap<String, Fmax>,
    utilization: BTreeMap<String, Used>,
}

/// A clock, MHz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fmax {
    /// The highest that was reached.
    pub achieved: f64,
    /// What it is meant to be.
    pub constraint: f64,
}

impl Fmax {
    /// Whether the clock may be what it is meant to be.
    pub fn is_met(&self) -> bool {
        self.achieved >= self.constraint
    }
}

#[derive(Clone, Debug, Deserialize)]
struct Used {
    used: u64,
}

/// A placed and routed design.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The engine's clock, which the board's PLL gives.
    pub engine: Fmax,
    /// The clock that comes with the link, and its pin, where the link has one.
    pub link: Option<(&'static str, Fmax)>,
    /// Cells used, by the tool's names, and those of the netlist that it has under another one.
    pub cells: BTreeMap<String, u64>,
}

impl Placed {
    /// Reads the report of one try of a netlist of `cells`, whose link has the clock `link`. That is the clock in whose
    /// name the pin's is; the engine's is that with the least slack of the others.
    ///
    /// # Errors
    /// [`ToolError::File`], [`ToolError::Output`] for what is no report, or lacks a clock.
    pub fn read(
        path: &Path,
        mut cells: BTreeMap<String, u64>,
        link: Option<&'static str>,
    ) -> Result<Placed, ToolError> {
        let text = std::fs::read_to_string(path).map_err(ToolError::io(path))?;
        let wrong = |reason: String| ToolError::Output { path: path.to_owned(), reason };
        let report: Report = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        let (links, others): (Vec<_>, Vec<_>) =
            report.fmax.iter().partition(|(name, _)| link.is_some_and(|pin| name.contains(pin)));
        let least = |clocks: &[(&String, &Fmax)]| {
            let slack = |clock: &Fmax| clock.achieved / clock.constraint;
            clocks.iter().map(|(_, clock)| **clock).min_by(|a, b| slack(a).total_cmp(&slack(b)))
        };
        let engine = least(&others).ok_or_else(|| wrong("no clock in it".to_owned()))?;
        let of_pin = |pin: &'static str| match least(&links) {
            Some(clock) => Ok((pin, clock)),
            None => Err(wrong(format!("no clock {pin} in it"))),
        };
        let link = link.map(of_pin).transpose()?;
        cells.extend(report.utilization.into_iter().map(|(cell, used)| (cell, used.used)));
        Ok(Placed { engine, link, cells })
    }

    /// The clocks with their names: the engine's, and the link's where it has one.
    pub fn clocks(&self) -> impl Iterator<Item = (&'static str, Fmax)> {
        [("clk", self.engine)].into_iter().chain(self.link)
    }

    /// Whether all clocks are met.
    pub fn is_met(&self) -> bool {
        self.clocks().all(|(_, clock)| clock.is_met())
    }

    /// How many cells it takes whose names begin like this.
    pub fn count(&self, begin: &str) -> u64 {
        self.cells.iter().filter(|(cell, _)| cell.starts_with(begin)).map(|(_, count)| count).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(fmax: &str, link: Option<&'static str>) -> Result<Placed, ToolError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), format!("{{\"fmax\": {{{fmax}}}, \"utilization\": {{}}}}")).unwrap();
        Placed::read(file.path(), BTreeMap::new(), link)
    }

    #[test]
    fn the_links_clock_is_told_from_the_engines_and_both_must_be_met() {
        let clocks = |engine: f64, link: f64| {
            format!(
                "\"clk\": {{\"achieved\": {engine}, \"constraint\": 25.5}}, \
                 \"spi_sclk$SB_IO_IN_$glb_clk\": {{\"achieved\": {link}, \"constraint\": 25.0}}"
            )
        };
        let placed = |engine, link| read(&clocks(engine, link), Some("spi_sclk")).unwrap();
        // The link's clock has less slack, and is not the engine's for that.
        let one = placed(30.0, 25.1);
        assert_eq!((one.engine.constraint, one.link.map(|(_, clock)| clock.constraint)), (25.5, Some(25.0)));
        let met = [(30.0, 25.1), (30.0, 24.9), (25.4, 60.0)].map(|(engine, link)| placed(engine, link).is_met());
        assert_eq!(met, [true, false, false]);
        let error = read("\"clk\": {\"achieved\": 1.0, \"constraint\": 1.0}", Some("spi_sclk")).unwrap_err();
        assert!(error.to_string().ends_with(": no clock spi_sclk in it"), "{error}");
    }
}
