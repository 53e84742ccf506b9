//! Description of the machine that ran the measurement.

use std::thread::available_parallelism;

/// Processor, number of cores and versions in one sentence.
pub fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let name = name.map_or("an unnamed processor", |(_, name)| name.trim());
    let cores = available_parallelism().map_or(1, usize::from);
    let verilator = dermis_cosim::verilator::version().unwrap_or("no Verilator").to_owned();
    format!("Measured by dermis {} on {cores} cores of {name}; {verilator}.", env!("CARGO_PKG_VERSION"))
}
