//! A progress line on stderr while something slow runs, only when stderr is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Shown from [`Progress::start`] until dropped.
pub struct Progress(ProgressBar);

impl Progress {
    /// Shows `message` with a moving mark and the elapsed time. Hidden when stderr is not a terminal.
    pub fn start(message: &str) -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.set_message(message.to_owned());
        bar.enable_steady_tick(Duration::from_millis(120));
        Progress(bar)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
