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
        let line = Progress::new(message, ProgressBar::new_spinner(), "{spinner} {msg} ({elapsed})");
        line.0.enable_steady_tick(Duration::from_millis(120));
        line
    }

    /// Shows `message` with a bar of `total` steps; 0 if their number is known later.
    pub fn steps(message: &str, total: u64) -> Self {
        // A bar of no steps would be full.
        let bar = if total == 0 { ProgressBar::no_length() } else { ProgressBar::new(total) };
        Progress::new(message, bar, "{msg} [{bar:30}] {pos}/{len} ({elapsed}, {eta} left)")
    }

    /// Steps of a bar of shares.
    const SHARES: f64 = 1000.0;

    /// Shows `message` with a bar of a share that is done.
    pub fn share(message: &str) -> Self {
        let bar = ProgressBar::new(Self::SHARES as u64);
        Progress::new(message, bar, "{msg} [{bar:30}] {percent} % ({elapsed}, {eta} left)")
    }

    /// Sets the share that is done, 0 to 1.
    pub fn set_share(&self, done: f64) {
        self.set((Self::SHARES * done) as u64);
    }

    /// The line of `bar`, which is drawn when it is added.
    fn new(message: &str, bar: ProgressBar, template: &str) -> Self {
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Progress(LINES.add(bar.with_style(style).with_message(message.to_owned())))
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
