//! Progress lines on stderr, shown only when stderr is a terminal.

use std::sync::LazyLock;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// All progress lines of the process, one below the other.
static LINES: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// A progress line, shown until dropped.
pub struct Progress(ProgressBar);

impl Progress {
    /// Shows `message` with a spinner and the elapsed time.
    pub fn start(message: &str) -> Self {
        let bar = LINES.add(ProgressBar::new_spinner());
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.set_message(message.to_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Progress(bar)
    }

    /// Shows `message` with a bar of `total` steps.
    pub fn steps(message: &str, total: u64) -> Self {
        let bar = LINES.add(ProgressBar::new(total));
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} ({elapsed}, {eta} left)") {
            bar.set_style(style);
        }
        bar.set_message(message.to_owned());
        Progress(bar)
    }

    /// Steps of a bar of shares.
    pub const SHARES: f64 = 1000.0;

    /// Shows `message` with a bar of a share that is done.
    pub fn share(message: &str) -> Self {
        let bar = Progress::steps(message, Self::SHARES as u64);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {percent} % ({elapsed}, {eta} left)") {
            bar.0.set_style(style);
        }
        bar
    }

    /// Writes a line to stderr, above the bar.
    pub fn say(&self, line: &str) {
        LINES.suspend(|| say!("{line}"));
    }

    /// Sets the number of finished steps and their total.
    pub fn set_of(&self, done: u64, total: u64) {
        self.0.set_length(total);
        self.0.set_position(done);
    }

    /// Sets the number of finished steps.
    pub fn set(&self, done: u64) {
        self.0.set_position(done);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
