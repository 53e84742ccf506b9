//! Counts of long test runs: how many inputs were tried and with which outcomes, saved in the build folder for the
//! report.
//!
//! ```text
//! make fuzz, dermis stress, dermis faults ─> build/tried/<name>.json ─> dermis report, section "Inputs tried"
//! ```
//!
//! | JSON field | holds |
//! |---|---|
//! | `command` | the command that repeats the run |
//! | `lines` | per target: unit, number tried, counts by outcome, seconds |
//!
//! A run replaces an earlier one of the same name.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{anyhow, Context, Result};
use serde::{Deserialize, Serialize};

use dermis_golden::plain_words::JsonError;
use dermis_golden::write::write;

/// Name of the folder within the build folder.
const FOLDER: &str = "tried";

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunLog {
    /// The command that repeats the run.
    pub command: String,
    /// The run's targets, in order.
    #[serde(rename = "lines")]
    pub targets: Vec<TargetCounts>,
}

/// One target of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetCounts {
    /// Name of the target, for example a file format or a scene with an experiment.
    #[serde(rename = "what")]
    pub target: String,
    /// Unit of `count`: inputs, frames, cycles, …
    pub unit: String,
    /// Number tried.
    #[serde(rename = "tried")]
    pub count: u64,
    /// Count of each outcome by its name; failures are listed even where their count is 0.
    pub outcomes: BTreeMap<String, u64>,
    /// Time in s.
    pub seconds: f64,
}

impl fmt::Display for TargetCounts {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let TargetCounts { target, unit, count, seconds, .. } = self;
        write!(f, "{target}: {count} {unit}: {}; {seconds:.1} s", self.outcomes_text())
    }
}

impl TargetCounts {
    /// Counts of one target; `outcomes` are pairs of name and count.
    pub fn new(
        target: impl Into<String>,
        unit: &str,
        count: u64,
        outcomes: impl IntoIterator<Item = (&'static str, u64)>,
        seconds: f64,
    ) -> TargetCounts {
        let outcomes = outcomes.into_iter().map(|(name, times)| (name.to_owned(), times)).collect();
        TargetCounts { target: target.into(), unit: unit.to_owned(), count, outcomes, seconds }
    }

    /// The outcomes as text: `2 refused, 1 taken`.
    pub fn outcomes_text(&self) -> String {
        self.outcomes.iter().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>().join(", ")
    }
}

impl RunLog {
    /// A run without targets yet.
    pub fn new(command: &str) -> RunLog {
        RunLog { command: command.to_owned(), targets: Vec::new() }
    }

    /// Writes the run to `build/tried/<name>.json`, completely or not at all.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn save(&self, build: &Path, name: &str) -> Result<()> {
        let folder = build.join(FOLDER);
        fs::create_dir_all(&folder).map_err(|error| anyhow!("{}: {error}", folder.display()))?;
        let text = serde_json::to_string_pretty(self)? + "\n";
        Ok(write(&folder.join(format!("{name}.json")), text.as_bytes())?)
    }

    /// All saved runs, sorted by name; none where the folder does not exist.
    ///
    /// # Errors
    /// A file that cannot be read or parsed, with its path.
    pub fn load_all(build: &Path) -> Result<Vec<RunLog>> {
        let Ok(entries) = fs::read_dir(build.join(FOLDER)) else { return Ok(Vec::new()) };
        let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        // Skips temporary files of an interrupted write.
        paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
        paths.sort();
        let read = |path: &std::path::PathBuf| -> Result<RunLog> {
            let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
            serde_json::from_str(&text).map_err(|error| anyhow!("{}, {}", path.display(), JsonError::new(&error)))
        };
        paths.iter().map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_runs_are_loaded_again() {
        let build = tempfile::tempdir().unwrap();
        assert_eq!(RunLog::load_all(build.path()).unwrap(), []);
        let mut run = RunLog::new("make fuzz");
        run.targets.push(TargetCounts {
            target: "scene".into(),
            unit: "inputs".into(),
            count: 3,
            outcomes: [("taken".to_owned(), 1), ("refused".to_owned(), 2)].into(),
            seconds: 0.25,
        });
        run.save(build.path(), "b").unwrap();
        RunLog::new("other").save(build.path(), "a").unwrap();
        assert_eq!(RunLog::load_all(build.path()).unwrap(), [RunLog::new("other"), run.clone()]);
        assert_eq!(run.targets[0].to_string(), "scene: 3 inputs: 2 refused, 1 taken; 0.2 s");
        fs::write(build.path().join("tried/c.json"), "{}").unwrap();
        assert!(format!("{:#}", RunLog::load_all(build.path()).unwrap_err()).contains("c.json, line 1, column "));
    }
}
