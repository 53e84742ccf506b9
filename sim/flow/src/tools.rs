//! The open tools of synthesis, place and route: looked up under two names, run with a log file and a time limit.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use dermis_golden::write::FileError;
use thiserror::Error;

/// Lines at the end of a failed tool's log that the error message repeats.
const LOG_LINES: usize = 12;
/// Interval at which a running tool is polled.
const POLL: Duration = Duration::from_millis(100);

/// Why a tool could not be used.
#[derive(Debug, Error)]
pub enum ToolError {
    /// The tool is not found under any of its names.
    #[error("{tool} is not installed; `make tools` installs it")]
    Missing {
        /// The tool.
        tool: &'static str,
    },
    /// The tool exited with an error.
    #[error("{tool} failed; {log} ends with:\n{end}")]
    Failed {
        /// The tool.
        tool: &'static str,
        /// File with its complete log.
        log: PathBuf,
        /// Last lines of the log.
        end: String,
    },
    /// The tool was stopped at its time limit.
    #[error("{tool} took longer than {minutes} min; log: {log}")]
    Late {
        /// The tool.
        tool: &'static str,
        /// The time limit.
        minutes: u32,
        /// File with its log so far.
        log: PathBuf,
    },
    /// The tool was stopped because it would not come to an end.
    #[error("{tool} does not converge; log: {log}")]
    Stuck {
        /// The tool.
        tool: &'static str,
        /// File with its log so far.
        log: PathBuf,
    },
    /// A file written by a tool, or the baselines file, cannot be used.
    #[error("{path}: {reason}")]
    Output {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// There are no models with which a netlist of the family can be simulated.
    #[error("the netlist of a device of family {family} cannot be simulated; it must be \"ecp5\" or \"ice40\"")]
    NoModels {
        /// The family.
        family: &'static str,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
}

impl ToolError {
    /// Turns an I/O error on `path` into [`ToolError::File`].
    pub fn io(path: &Path) -> impl FnOnce(io::Error) -> ToolError + '_ {
        |source| FileError::at(path)(source).into()
    }
}

/// The folders of PATH.
fn folders() -> Vec<PathBuf> {
    std::env::var_os("PATH").iter().flat_map(std::env::split_paths).collect()
}

/// A tool of the flow.
#[derive(Clone, Copy, Debug)]
pub struct Tool {
    /// Its name; packages from PyPI install it with the prefix `yowasp-`.
    pub name: &'static str,
}

impl Tool {
    /// The name under which it can be started.
    fn program(self) -> Result<String, ToolError> {
        let names = [self.name.to_owned(), format!("yowasp-{}", self.name)];
        let there = |name: &String| folders().iter().any(|folder| folder.join(name).is_file());
        names.into_iter().find(there).ok_or(ToolError::Missing { tool: self.name })
    }

    /// The folder of its data files, `<prefix>/share/<name>`.
    ///
    /// # Errors
    /// [`ToolError::Missing`]; [`ToolError::Output`] if the installation has no such folder.
    pub fn share(self) -> Result<PathBuf, ToolError> {
        let program = self.program()?;
        let of = |folder: &Path| Some(folder.parent()?.join("share").join(self.name));
        let shares = folders().into_iter().filter(|folder| folder.join(&program).is_file()).filter_map(|f| of(&f));
        let reason = || format!("no share/{} beside the folder of {program}", self.name);
        let path = PathBuf::from(&program);
        shares.into_iter().find(|share| share.is_dir()).ok_or_else(|| ToolError::Output { path, reason: reason() })
    }

    /// The first line of `--version` that contains a digit.
    ///
    /// # Errors
    /// [`ToolError::Missing`].
    pub fn version(self) -> Result<String, ToolError> {
        let output = Command::new(self.program()?).arg("--version").output();
        let output = output.map_err(|_| ToolError::Missing { tool: self.name })?;
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8_lossy(&text);
        Ok(text.lines().find(|line| line.contains(|c: char| c.is_ascii_digit())).unwrap_or_default().trim().to_owned())
    }

    /// Runs it in `folder` with `arguments`; its output goes to the file `log` there. It is stopped after `minutes`.
    ///
    /// # Errors
    /// As [`ToolError`] lists.
    pub fn run(self, folder: &Path, arguments: &[String], log: &str, minutes: u32) -> Result<(), ToolError> {
        self.run_unless(folder, arguments, log, minutes, |_| false)
    }

    /// As [`Tool::run`]; it is stopped, too, when the end of its log `is_stuck`.
    ///
    /// # Errors
    /// As [`ToolError`] lists.
    pub fn run_unless(
        self,
        folder: &Path,
        arguments: &[String],
        log: &str,
        minutes: u32,
        is_stuck: impl Fn(&str) -> bool,
    ) -> Result<(), ToolError> {
        let log = folder.join(log);
        let file = File::create(&log).map_err(ToolError::io(&log))?;
        let copy = file.try_clone().map_err(ToolError::io(&log))?;
        let mut child = Command::new(self.program()?)
            .current_dir(folder)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(file)
            .stderr(copy)
            .spawn()
            .map_err(|_| ToolError::Missing { tool: self.name })?;
        let begun = Instant::now();
        let limit = Duration::from_secs(60 * u64::from(minutes));
        loop {
            if let Some(status) = child.try_wait().map_err(ToolError::io(&log))? {
                return if status.success() { Ok(()) } else { Err(self.failed(log)) };
            }
            let late = begun.elapsed() > limit;
            if late || is_stuck(&end_of(&log).map_err(ToolError::io(&log))?) {
                child.kill().and_then(|()| child.wait()).map_err(ToolError::io(&log))?;
                return Err(match late {
                    true => ToolError::Late { tool: self.name, minutes, log },
                    false => ToolError::Stuck { tool: self.name, log },
                });
            }
            sleep(POLL);
        }
    }

    fn failed(self, log: PathBuf) -> ToolError {
        let text = std::fs::read(&log).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let lines: Vec<&str> = text.lines().collect();
        let end = lines[lines.len().saturating_sub(LOG_LINES)..].join("\n");
        ToolError::Failed { tool: self.name, log, end }
    }
}

/// Bytes of a log that [`Tool::run_unless`] looks at.
const LOG_END: u64 = 2048;

/// The end of a log.
fn end_of(log: &Path) -> io::Result<String> {
    let mut file = File::open(log)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LOG_END)))?;
    let mut end = Vec::new();
    file.take(LOG_END).read_to_end(&mut end)?;
    Ok(String::from_utf8_lossy(&end).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(script: &str, minutes: u32) -> ToolError {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["-c".to_owned(), script.to_owned()];
        Tool { name: "sh" }.run(folder.path(), &arguments, "sh.log", minutes).unwrap_err()
    }

    #[test]
    fn a_failure_repeats_the_end_of_the_log() {
        let error = run("seq 1 30; echo wrong >&2; exit 3", 1).to_string();
        assert!(error.contains("sh failed") && error.contains("\n20\n") && !error.contains("\n19\n"), "{error}");
        assert!(error.ends_with("wrong"), "{error}");
    }

    #[test]
    fn a_tool_is_stopped_at_its_limit() {
        let error = run("sleep 50", 0).to_string();
        assert!(error.starts_with("sh took longer than 0 min"), "{error}");
    }

    #[test]
    fn a_tool_is_stopped_when_its_log_says_that_it_is_stuck() {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["-c".to_owned(), "seq 1 9; echo round 10; sleep 50".to_owned()];
        let stuck = |end: &str| end.contains("round 10");
        let error = Tool { name: "sh" }.run_unless(folder.path(), &arguments, "sh.log", 1, stuck).unwrap_err();
        assert!(error.to_string().starts_with("sh does not converge; log: "), "{error}");
    }

    #[test]
    fn a_missing_tool_says_how_to_get_it() {
        let error = Tool { name: "no-such-tool" }.version().unwrap_err().to_string();
        assert_eq!(error, "no-such-tool is not installed; `make tools` installs it");
    }
}
