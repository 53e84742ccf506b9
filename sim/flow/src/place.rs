//! Place and route of a netlist with several seeds, and the bitstream of the best: for the boards of [`bitstream`](super::bitstream)
//! and for designs of others.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Error, Result};
use dermis_golden::spec::board::Tries;

use super::family::{Part, Routing};
use super::synthesis;
use super::timing::{self, Placed, WantedClock};
use super::tools::ToolError;
use crate::jobs::{parallel, Interrupt};

/// A netlist on its way to a bitstream.
#[derive(Debug)]
pub struct Design<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// Tools of the device's family.
    pub routing: &'a Routing,
    /// The device.
    pub part: Part,
    /// Folder of all files, in which the tools run.
    pub folder: &'a Path,
    /// Name of the netlist there, in Yosys's JSON format.
    pub netlist: &'a str,
    /// Name of the pin file.
    pub pins: &'a str,
    /// Name of the bitstream that is made.
    pub bitstream: &'a str,
    /// The clocks to reach, at least one.
    pub clocks: Vec<WantedClock>,
    /// How it is tried.
    pub tries: Tries,
}

/// Which seeds are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeds {
    /// All, so many at a time.
    All {
        /// Number of seeds at a time.
        jobs: u32,
    },
    /// One after the other until one reaches all clocks.
    UntilMet,
}

impl Design<'_> {
    /// Removes an earlier bitstream: where place and route fails there is none.
    ///
    /// # Errors
    /// [`ToolError::File`].
    pub fn remove_bitstream(&self) -> Result<(), ToolError> {
        let path = self.folder.join(self.bitstream);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(ToolError::io(&path)(error)),
            _ => Ok(()),
        }
    }

    /// Places and routes; returns the seeds that completed, at least one, the best first.
    ///
    /// # Errors
    /// [`ToolError`]: a tool is missing; none of the seeds could be placed and routed; [`timing`] of its report.
    pub fn place(&self, seeds: Seeds) -> Result<Vec<Placed>> {
        let is_met = AtomicBool::new(false);
        let place = |seed| {
            if seeds == Seeds::UntilMet && is_met.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let placed = self.place_seed(seed);
            match placed {
                Ok(_) | Err(ToolError::Late { .. } | ToolError::Stuck { .. } | ToolError::Failed { .. }) => (),
                Err(error) => return Err(error.into()),
            }
            is_met.fetch_or(placed.as_ref().is_ok_and(Placed::is_met), Ordering::Relaxed);
            Ok(Some(placed))
        };
        let jobs = match seeds {
            Seeds::All { jobs } => jobs as usize,
            Seeds::UntilMet => 1,
        };
        let what = format!("{}: place and route", self.name);
        let tried = parallel(&what, (1..=self.tries.seeds).collect(), jobs, &Interrupt::default(), place)?;
        let (mut all, mut failures) = (Vec::new(), Vec::new());
        // A seed that does not converge is skipped as long as there are others.
        for seed in tried.into_iter().flatten() {
            match seed {
                Ok(placed) => all.push(placed),
                Err(error) => failures.push(error),
            }
        }
        if let (true, Some(failure)) = (all.is_empty(), failures.pop()) {
            let (count, folder) = (self.tries.seeds, self.folder.display());
            let reason = format!("{}: none of {count} seeds could be placed and routed; logs in {folder}", self.name);
            return Err(Error::from(failure).context(reason));
        }
        all.sort_by(|a, b| b.rank().partial_cmp(&a.rank()).unwrap_or(std::cmp::Ordering::Equal));
        Ok(all)
    }

    /// Places and routes one seed with the first of the placers that converges.
    fn place_seed(&self, seed: u32) -> Result<Placed, ToolError> {
        let Design { routing, folder, part, netlist, pins, clocks, tries, .. } = self;
        let name = seed_prefix(seed);
        let mut last = ToolError::Missing { tool: routing.place.name };
        for placer in &tries.placers {
            let arguments = routing.place_arguments(part, [netlist, pins], seed, placer, &name);
            let log = format!("{name}.{placer}.log");
            match routing.place.run_unless(folder, &arguments, &log, tries.minutes, is_stuck) {
                Err(error) => last = error,
                Ok(()) => {
                    let (clocks, used) = timing::read(&folder.join(format!("{name}.report.json")), clocks)?;
                    // Of types that both count the report's number is the one of the device.
                    let mut cells = synthesis::cells(&folder.join(netlist))?;
                    cells.extend(used);
                    return Ok(Placed { seed, placer: placer.clone(), clocks, cells });
                }
            }
        }
        Err(last)
    }

    /// Makes the bitstream of a seed.
    ///
    /// # Errors
    /// [`ToolError`]: the tool is missing or failed.
    pub fn pack(&self, placed: &Placed) -> Result<(), ToolError> {
        let configuration = format!("{}.config", seed_prefix(placed.seed));
        let arguments = self.routing.pack_arguments(&configuration, self.bitstream);
        self.routing.pack.run(self.folder, &arguments, "pack.log", synthesis::MINUTES)
    }
}

/// Prefix of a seed's files.
fn seed_prefix(seed: u32) -> String {
    format!("seed{seed}")
}

/// Iterations of nextpnr's static placer after which it does not converge: where it does, it takes a third of them.
const MOST_ITERATIONS: u32 = 1500;

/// Whether the end of nextpnr's log says that its placer does not converge.
fn is_stuck(log: &str) -> bool {
    let iteration = log.rsplit_once("iter=").and_then(|(_, rest)| rest.split_whitespace().next()?.parse::<u32>().ok());
    iteration.is_some_and(|iteration| iteration > MOST_ITERATIONS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_placer_is_stuck_after_many_iterations() {
        let log =
            |iteration: u32| format!("Info: iter={iteration} steplen=1.9 a=1.0\nInfo: overlap: COMB=4.7%, RAM=24.8%\n");
        assert!([log(1500), String::new(), "iter=".into()].iter().all(|log| !is_stuck(log)));
        assert!(is_stuck(&(log(1500) + &log(1501))));
    }
}
