//! Output: lines on standard error and bytes on standard output, of which either may be closed or full.
//!
//! | | closed | full |
//! |---|---|---|
//! | standard output | ends the work without error, as `dermis … \| head` asks for | an error that names it |
//! | standard error | what is said there is lost, and the work goes on | the same |
//!
//! `eprintln!` and `println!` panic instead; lints of this crate refuse them.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};

use anyhow::{anyhow, Result};
use dermis_golden::plain_words::without_numbers;

/// Writes to standard output, and on to what reads it; whether anything does.
///
/// # Errors
/// Standard output takes no more, as on a full disk.
pub fn write(output: &mut dyn Write, bytes: &[u8]) -> Result<bool> {
    match output.write_all(bytes).and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(anyhow!("standard output: {error}")),
        Ok(()) => Ok(true),
    }
}

/// Writes a line to standard error, if that takes it; without the numbers of the operating system's errors, which have words.
pub fn line(text: Arguments) {
    // In one piece, so that the lines of threads do not mix.
    let text = without_numbers(&format!("{text}\n"));
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Writes a line to standard error, if that takes it; takes what `format!` takes.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => {
        $crate::output::line(format_args!($($text)*))
    };
}
