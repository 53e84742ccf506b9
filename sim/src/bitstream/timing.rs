//! What a try of place and route reached.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::tools::ToolError;

/// nextpnr's report, the parts that are used.
#[derive(Clone, Debug, Deserialize)]
struct Report {
    fmax: BTreeMap<String, Fmax>,
    utilization: BTreeMap<String, Used>,
}

#[derive(Clone, Debug, Deserialize)]
struct Fmax {
    achieved: f64,
    constraint: f64,
}

#[derive(Clone, Debug, Deserialize)]
struct Used {
    used: u64,
}

/// A placed and routed design.
#[derive(Clone, Debug, PartialEq)]
#[allow(non_snake_case)]
pub struct Placed {
    /// Highest clock, MHz.
    pub fmax_MHz: f64,
    /// Clock that the board's PLL gives, MHz.
    pub clock_MHz: f64,
    /// Cells used, by the tool's names, and those of the netlist that it has under another one.
    pub cells: BTreeMap<String, u64>,
}

impl Placed {
    /// Reads the report of one try of a netlist of `cells`. The engine's clock is that with the least slack: a board has no other that counts.
    ///
    /// # Errors
    /// [`ToolError::File`], [`ToolError::Output`] for what is no report.
    pub fn read(path: &Path, mut cells: BTreeMap<String, u64>) -> Result<Placed, ToolError> {
        let text = std::fs::read_to_string(path).map_err(ToolError::io(path))?;
        let wrong = |reason: String| ToolError::Output { path: path.to_owned(), reason };
        let report: Report = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        let slack = |clock: &&Fmax| clock.achieved / clock.constraint;
        let clock = report.fmax.values().min_by(|a, b| slack(a).total_cmp(&slack(b)));
        let clock = clock.ok_or_else(|| wrong("no clock in it".to_owned()))?;
        cells.extend(report.utilization.into_iter().map(|(cell, used)| (cell, used.used)));
        Ok(Placed { fmax_MHz: clock.achieved, clock_MHz: clock.constraint, cells })
    }

    /// Whether the board's clock is met.
    pub fn is_met(&self) -> bool {
        self.fmax_MHz >= self.clock_MHz
    }

    /// How many cells it takes whose names begin like this.
    pub fn count(&self, begin: &str) -> u64 {
        self.cells.iter().filter(|(cell, _)| cell.starts_with(begin)).map(|(_, count)| count).sum()
    }
}
