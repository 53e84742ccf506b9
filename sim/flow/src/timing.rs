//! Results of a place-and-route run, from nextpnr's report.

use dermis_golden::plain_words::JsonError;
use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::tools::ToolError;

/// How far a constraint may be from the clock that is wanted: nextpnr counts periods in picoseconds.
const ROUNDING: f64 = 1e-3;

/// The parts of nextpnr's report that are used.
#[derive(Clone, Debug, Deserialize)]
struct Report {
    fmax: BTreeMap<String, Fmax>,
    utilization: BTreeMap<String, Used>,
    #[serde(default)]
    critical_paths: Vec<CriticalPath>,
}

/// Highest and required frequency of a clock, MHz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fmax {
    /// Highest frequency that the design reaches.
    pub achieved: f64,
    /// Required frequency.
    pub constraint: f64,
}

/// How many cells of a type a design takes, and how many the device has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Used {
    /// Number of the design.
    pub used: u64,
    /// Number of the device; `None` for a type that place and route makes into another.
    pub available: Option<u64>,
}

#[derive(Clone, Debug, Deserialize)]
struct CriticalPath {
    from: String,
    to: String,
    path: Vec<Step>,
}

#[derive(Clone, Debug, Deserialize)]
struct Step {
    r#type: String,
    delay: f64,
    from: End,
    to: End,
}

#[derive(Clone, Debug, Deserialize)]
struct End {
    cell: String,
}

/// The longest path of a clock to itself: its ends, and its parts in ns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LongestPath {
    /// Cell where it begins.
    pub from: String,
    /// Cell where it ends.
    pub to: String,
    /// Time in cells.
    pub logic_ns: f64,
    /// Time on wires.
    pub wires_ns: f64,
}

impl LongestPath {
    /// That of the clock on `net`; `None` without one.
    fn find(paths: &[CriticalPath], net: &str) -> Option<LongestPath> {
        let edge = format!("posedge {net}");
        let steps = &paths.iter().find(|path| path.from == edge && path.to == edge)?.path;
        let delay = |is_wire: bool| {
            let delays = steps.iter().filter(|step| (step.r#type == "routing") == is_wire).map(|step| step.delay);
            (delays.sum::<f64>() * 100.0).round() / 100.0
        };
        let (from, to) = (steps.first()?.from.cell.clone(), steps.last()?.to.cell.clone());
        Some(LongestPath { from, to, logic_ns: delay(false), wires_ns: delay(true) })
    }
}

/// A clock that a design has and must reach.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedClock {
    /// Name in messages.
    pub name: String,
    /// Part of the name that its net alone has; `None`: all nets that no other clock names, of which the slowest counts.
    pub net: Option<String>,
    /// Frequency, MHz.
    pub MHz: f64,
}

/// A clock as place and route found it.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// What was wanted.
    pub wanted: WantedClock,
    /// What nextpnr required and reached.
    pub fmax: Fmax,
    /// The longest path.
    pub longest_path: Option<LongestPath>,
}

impl Clock {
    /// The frequency to reach, MHz: nextpnr's rounded one must not make less of the wanted one.
    fn required_MHz(&self) -> f64 {
        self.fmax.constraint.max(self.wanted.MHz)
    }

    /// Reached over required frequency.
    fn slack(&self) -> f64 {
        self.fmax.achieved / self.required_MHz()
    }

    /// The frequency reached, MHz, rounded down: a clock that is just missed is missed.
    pub fn reached_MHz(&self) -> f64 {
        (self.fmax.achieved * 100.0).floor() / 100.0
    }

    /// Whether nextpnr was told the frequency that is wanted.
    pub fn is_constrained(&self) -> bool {
        (self.fmax.constraint / self.wanted.MHz - 1.0).abs() <= ROUNDING
    }

    /// What is said of a clock that is missed; `None` of one that is reached.
    pub fn missed(&self) -> Option<String> {
        let (name, required) = (&self.wanted.name, self.required_MHz());
        (self.slack() < 1.0).then(|| format!("{name} {:.2} MHz of {required} MHz", self.reached_MHz()))
    }
}

/// A placed and routed design.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The seed.
    pub seed: u32,
    /// The placer.
    pub placer: String,
    /// The clocks, as they were wanted, at least one.
    pub clocks: Vec<Clock>,
    /// Number of cells by type, with nextpnr's type names and the netlist's.
    pub cells: BTreeMap<String, Used>,
}

/// The clocks `wanted` and the cells in the report of one run.
///
/// # Errors
/// [`ToolError::File`]; [`ToolError::Output`] if the report cannot be parsed, lacks a clock or has one that is not known.
pub(crate) fn read(path: &Path, wanted: &[WantedClock]) -> Result<(Vec<Clock>, BTreeMap<String, Used>), ToolError> {
    let text = std::fs::read_to_string(path).map_err(ToolError::io(path))?;
    let wrong = |reason: String| ToolError::Output { path: path.to_owned(), reason };
    let report: Report = serde_json::from_str(&text).map_err(|error| wrong(JsonError::new(&error).to_string()))?;
    let parts: Vec<&str> = wanted.iter().filter_map(|clock| clock.net.as_deref()).collect();
    let (named, others): (Vec<_>, Vec<_>) =
        report.fmax.iter().partition(|(net, _)| parts.iter().any(|part| net.contains(part)));
    let list = |nets: &[(&String, &Fmax)]| nets.iter().map(|(net, _)| net.as_str()).collect::<Vec<_>>().join(", ");
    if parts.len() == wanted.len() && !others.is_empty() {
        return Err(wrong(format!("clocks {}: known are {}", list(&others), parts.join(", "))));
    }
    let find = |clock: &WantedClock| {
        let own = match &clock.net {
            Some(part) => named.iter().filter(|(net, _)| net.contains(part)).copied().collect(),
            None => others.clone(),
        };
        if let (Some(part), false) = (&clock.net, own.len() == 1) {
            let (name, count, all) = (&clock.name, own.len(), list(&report.fmax.iter().collect::<Vec<_>>()));
            return Err(wrong(format!("clock {name}: {count} of the clocks have {part} in their names: {all}")));
        }
        let of = |(net, fmax): (&String, &Fmax)| {
            let longest_path = LongestPath::find(&report.critical_paths, net);
            Clock { wanted: clock.clone(), fmax: *fmax, longest_path }
        };
        let slowest = own.into_iter().map(of).min_by(|a, b| a.slack().total_cmp(&b.slack()));
        slowest.ok_or_else(|| wrong(format!("clock {}: the report has no clock", clock.name)))
    };
    let clocks = wanted.iter().map(find).collect::<Result<_, _>>()?;
    Ok((clocks, report.utilization))
}

impl Placed {
    /// What is said of the clocks that are missed.
    pub fn missed(&self) -> Vec<String> {
        self.clocks.iter().filter_map(Clock::missed).collect()
    }

    /// Whether all clocks are met.
    pub fn is_met(&self) -> bool {
        self.missed().is_empty()
    }

    /// By how much one result is better than another: of those that meet all clocks the one whose first clock is faster, of
    /// those that miss one the one that misses it by less.
    pub(crate) fn rank(&self) -> (bool, f64) {
        let slack = self.clocks.iter().map(Clock::slack).fold(f64::INFINITY, f64::min);
        match self.is_met() {
            true => (true, self.clocks.first().map_or(0.0, |clock| clock.fmax.achieved)),
            false => (false, slack),
        }
    }

    /// Number of cells whose type begins with `prefix`.
    pub fn count(&self, prefix: &str) -> Used {
        let add = |sum: Option<u64>, more: Option<u64>| more.map_or(sum, |more| Some(sum.unwrap_or(0) + more));
        let cells = self.cells.iter().filter(|(cell, _)| cell.starts_with(prefix));
        cells.fold(Used::default(), |sum, (_, cell)| Used {
            used: sum.used + cell.used,
            available: add(sum.available, cell.available),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{json, Value};

    fn wanted(name: &str, net: Option<&str>, MHz: f64) -> WantedClock {
        WantedClock { name: name.to_owned(), net: net.map(str::to_owned), MHz }
    }

    fn read_value(report: &Value, wanted: &[WantedClock]) -> Result<Placed, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), report.to_string()).unwrap();
        let (clocks, cells) = read(file.path(), wanted).map_err(|error| error.to_string())?;
        Ok(Placed { seed: 1, placer: "heap".to_owned(), clocks, cells })
    }

    #[test]
    fn the_links_clock_is_told_from_the_engines_and_both_must_be_met() {
        let wanted = [wanted("clk", None, 25.5), wanted("spi_sclk", Some("spi_sclk"), 25.0)];
        let placed = |engine: f64, link: f64| {
            let clock = |achieved: f64, constraint: f64| json!({"achieved": achieved, "constraint": constraint});
            // Another clock of the board that has more room.
            let fmax = json!({
                "clk": clock(engine, 25.5), "clk12": clock(99.0, 12.0), "spi_sclk$SB_IO_IN_$glb_clk": clock(link, 25.0)
            });
            read_value(&json!({"fmax": fmax, "utilization": {}}), &wanted).unwrap()
        };
        // The link's clock has less slack, but is still not taken for the engine's.
        let one = placed(30.0, 25.1);
        assert_eq!([0, 1].map(|clock| one.clocks[clock].fmax.constraint), [25.5, 25.0]);
        let met = [(30.0, 25.1), (30.0, 24.9), (25.4, 60.0)].map(|(engine, link)| placed(engine, link).is_met());
        assert_eq!(met, [true, false, false]);
        assert_eq!(placed(30.0, 24.999).missed(), ["spi_sclk 24.99 MHz of 25 MHz"]);
        // A faster engine is better, but not where the link's clock is missed.
        assert!(placed(30.0, 25.1).rank() > placed(40.0, 24.9).rank());
        assert!(placed(31.0, 25.1).rank() > placed(30.0, 26.0).rank());
        assert!(placed(30.0, 24.9).rank() > placed(40.0, 24.8).rank());
    }

    /// Nets of the core's clock and of Ethernet's, as nextpnr names them.
    const NETS: [&str; 2] = ["$glbnet$ecp5pll_clkout", "$glbnet$eth_clocks0_rx$TRELLIS_IO_IN"];

    fn two_clocks() -> (Value, [WantedClock; 2]) {
        let fmax = json!({
            NETS[0]: {"achieved": 70.0, "constraint": 62.5}, NETS[1]: {"achieved": 140.0, "constraint": 125.0}
        });
        let wanted = [wanted("core", Some("pll_clkout"), 62.5), wanted("Ethernet", Some("eth_clocks0_rx"), 125.0)];
        (json!({"fmax": fmax, "utilization": {"DP16KD": {"used": 7, "available": 108}}}), wanted)
    }

    #[test]
    fn a_clock_that_is_not_checked_is_found() {
        let (right, wanted) = two_clocks();
        let placed = read_value(&right, &wanted).unwrap();
        assert!(placed.is_met() && placed.clocks.iter().all(Clock::is_constrained));
        assert_eq!(placed.count("DP16KD"), Used { used: 7, available: Some(108) });
        let changed = |change: &dyn Fn(&mut serde_json::Map<String, Value>)| {
            let (mut report, wanted) = two_clocks();
            change(report["fmax"].as_object_mut().unwrap());
            read_value(&report, &wanted)
        };
        let error = changed(&|fmax| drop(fmax.remove(NETS[0]))).unwrap_err();
        assert!(error.contains("clock core: 0 of the clocks have pll_clkout in their names: $glbnet$eth"), "{error}");
        let again =
            |fmax: &mut serde_json::Map<String, Value>| drop(fmax.insert("pll_clkout2".into(), fmax[NETS[0]].clone()));
        let error = changed(&again).unwrap_err();
        assert!(error.contains("clock core: 2 of the clocks have pll_clkout in their names"), "{error}");
        let error = changed(&|fmax| drop(fmax.insert("clkout".into(), fmax[NETS[0]].clone()))).unwrap_err();
        assert!(error.contains("clocks clkout: known are pll_clkout, eth_clocks0_rx"), "{error}");
        let placed = changed(&|fmax| fmax[NETS[0]]["constraint"] = json!(62.4)).unwrap();
        assert!(!placed.clocks[0].is_constrained() && placed.clocks[1].is_constrained());
        // What nextpnr takes for reached, as it rounds the constraint, is not always.
        let placed = changed(&|fmax| fmax[NETS[0]] = json!({"achieved": 62.498, "constraint": 62.497})).unwrap();
        assert_eq!(placed.missed(), ["core 62.49 MHz of 62.5 MHz"]);
    }

    #[test]
    fn the_longest_path_of_a_clock_is_one_to_itself() {
        let (mut report, wanted) = two_clocks();
        let step = |kind: &str, delay: f64, from: &str, to: &str| json!({"type": kind, "delay": delay, "from": {"cell": from}, "to": {"cell": to}});
        let edge = format!("posedge {}", NETS[0]);
        let steps = [
            step("clk-to-q", 0.5, "a", "b"),
            step("routing", 9.0, "b", "c"),
            step("logic", 4.0, "c", "d"),
            step("routing", 2.0, "d", "e"),
            step("setup", 0.1, "e", "e"),
        ];
        let other = [step("routing", 20.0, "f", "g")];
        report["critical_paths"] =
            json!([{"from": "<async>", "to": edge, "path": other}, {"from": edge, "to": edge, "path": steps}]);
        let placed = read_value(&report, &wanted).unwrap();
        let path = LongestPath { from: "a".into(), to: "e".into(), logic_ns: 4.6, wires_ns: 11.0 };
        let found: Vec<_> = placed.clocks.into_iter().map(|clock| clock.longest_path).collect();
        assert_eq!(found, [Some(path), None]);
    }
}
