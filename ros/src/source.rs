//! The lines or frames of a patch: a source that is opened again when it fails or ends, with a word each time.
//!
//! | source | at its end | where it fails |
//! |---|---|---|
//! | standard input | ends | ends |
//! | recording | ends, or begins again | ends |
//! | UDP, serial port, file, pipe | is opened again | is opened again, at first after a second |

use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use dermis_flow::say;
use dermis_golden::data::recording::FrameOptions;
use dermis_golden::spec::board::Board;
use dermis_host::recording::{Pace, Paced};
use dermis_host::stream::{DueFrame, Input, Source};

use crate::diagnostics::PatchState;
use crate::patches::{Origin, Patch};

/// Time after which a source that failed is opened again: the first, doubled up to the second.
const RETRY: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(16)];
/// Put behind a line that a failure has cut, so that a number that was cut is not taken for another one.
const CUT: &[u8] = b" cut off\n";

/// What a patch reads; `state` says how its source is.
pub fn input(patch: &Patch, state: Arc<PatchState>) -> Input {
    match &patch.origin {
        Origin::Lines(source) => Input::Bytes(Box::new(Reopened::new(patch, source.clone(), state))),
        Origin::Recording(path) => Input::Frames(Box::new(recorded(patch, path, state))),
    }
}

/// The frames of a recording.
fn recorded(
    patch: &Patch,
    path: &Path,
    state: Arc<PatchState>,
) -> impl Iterator<Item = Result<DueFrame>> + Send + use<> {
    let shape = Some([patch.scene.sensor.rows, patch.scene.sensor.cols]);
    let options = FrameOptions { shape, ..FrameOptions::default() };
    let opened = Paced::open(path.to_owned(), options, Pace::Recorded, [patch.fields.repeat, true]);
    let mut frames: Box<dyn Iterator<Item = Result<DueFrame>> + Send> = match opened {
        Ok(frames) => {
            state.source(Ok(()));
            Box::new(frames)
        }
        // Who reads the frames names the source.
        Err(error) => Box::new(std::iter::once(Err(Error::other(error)))),
    };
    std::iter::from_fn(move || {
        let next = frames.next();
        match &next {
            None => state.ended(None),
            Some(Ok(_)) => (),
            Some(Err(error)) => state.ended(Some(error.to_string())),
        }
        next
    })
}

/// A source of lines, whose bytes go on when it fails.
struct Reopened {
    name: String,
    source: Source,
    baud: Option<u32>,
    state: Arc<PatchState>,
    open: Option<Box<dyn Read + Send>>,
    /// The last byte was the end of a line.
    whole: bool,
    /// To be read before the next byte of the source.
    rest: &'static [u8],
    wait: Duration,
}

impl Reopened {
    /// The source of a patch, which is opened when it is first read; `state` says how it is.
    fn new(patch: &Patch, source: Source, state: Arc<PatchState>) -> Reopened {
        let board = || Board::load(patch.scene.hardware.board_name()).ok()?.uart_baud;
        Reopened {
            name: patch.fields.name.clone(),
            source,
            baud: patch.fields.baud.or_else(board),
            state,
            open: None,
            whole: true,
            rest: &[],
            wait: RETRY[0],
        }
    }

    /// Whether it is opened again.
    fn goes_on(&self) -> bool {
        matches!(self.source, Source::Udp(_) | Source::Path(_))
    }

    /// Says what ended it; waits where that was a failure, so that one that never opens takes no time.
    fn lost(&mut self, words: &str, wait: bool) {
        say!("{}: {words}", self.name);
        self.state.source(Err(words.to_owned()));
        self.open = None;
        self.rest = if self.whole { &[] } else { CUT };
        self.whole = true;
        if wait {
            std::thread::sleep(self.wait);
            self.wait = (2 * self.wait).min(RETRY[1]);
        }
    }
}

impl Reopened {
    /// Reads as [`Read::read`] does, from a source that is opened where it is not.
    fn read_on(&mut self, buffer: &mut [u8]) -> Result<usize> {
        loop {
            if !self.rest.is_empty() {
                return self.rest.read(buffer);
            }
            let Some(open) = &mut self.open else {
                match self.source.open(self.baud) {
                    Ok((input, _)) => {
                        self.open = Some(input);
                        self.state.source(Ok(()));
                    }
                    Err(error) if self.goes_on() => self.lost(&format!("{error}; tried again"), true),
                    Err(error) => return Err(error),
                }
                continue;
            };
            match open.read(buffer) {
                Ok(0) if buffer.is_empty() => return Ok(0),
                Ok(0) if self.goes_on() => self.lost("the source has ended; opened again", false),
                Ok(bytes) => {
                    self.whole = bytes == 0 || buffer[bytes - 1] == b'\n';
                    self.wait = RETRY[0];
                    return Ok(bytes);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => (),
                Err(error) if self.goes_on() => self.lost(&format!("{error}; opened again"), true),
                Err(error) => return Err(error),
            }
        }
    }
}

impl Read for Reopened {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let read = self.read_on(buffer);
        match &read {
            Ok(0) if !buffer.is_empty() => self.state.ended(None),
            Ok(_) => (),
            Err(error) => self.state.ended(Some(error.to_string())),
        }
        read
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Changes;
    use crate::patches::PatchFile;
    use std::io::{BufRead, BufReader};
    use std::net::UdpSocket;
    use std::sync::atomic::{AtomicBool, Ordering};

    fn patch(source: &str) -> Patch {
        let text = format!("[[patch]]\nname = \"a\"\nscene = \"sensor-1\"\nsource = \"{source}\"\n");
        PatchFile::parse(&text, Path::new("")).unwrap().patches.remove(0)
    }

    fn opened(source: &str) -> Input {
        let state = PatchState::new(0, "a", "b", Duration::from_secs(1), Arc::new(Changes::default()));
        input(&patch(source), Arc::new(state))
    }

    fn reopened(source: &str) -> Box<dyn Read + Send> {
        let Input::Bytes(lines) = opened(source) else { panic!("{source} is a recording") };
        lines
    }

    /// A line that its writer did not end is not taken for a whole one, and what the next writer sends is read.
    #[test]
    fn a_pipe_whose_writer_ends_is_opened_again() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("lines");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let mut lines = BufReader::new(reopened(&pipe.display().to_string()));
        let named = pipe.clone();
        let writer = std::thread::spawn(move || {
            std::fs::write(&named, "1,2\n3,").unwrap();
            // The reader has seen the end once it opens the pipe again.
            std::thread::sleep(Duration::from_millis(300));
            std::fs::write(&named, "5,6\n").unwrap();
        });
        let read: Vec<String> = lines.by_ref().lines().take(3).map(Result::unwrap).collect();
        writer.join().unwrap();
        assert_eq!(read, ["1,2", "3, cut off", "5,6"]);
    }

    #[test]
    fn a_port_that_is_taken_is_tried_again() {
        let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = taken.local_addr().unwrap();
        let mut source = reopened(&format!("udp://{address}"));
        let read = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(200));
                drop(taken);
                let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
                while !read.load(Ordering::Relaxed) {
                    sender.send_to(b"1,2", address).unwrap();
                    std::thread::sleep(Duration::from_millis(50));
                }
            });
            let mut bytes = [0; 4];
            source.read_exact(&mut bytes).unwrap();
            read.store(true, Ordering::Relaxed);
            assert_eq!(&bytes, b"1,2\n");
        });
    }

    #[test]
    fn a_recording_that_is_none_ends_with_a_word() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("press.mcap");
        std::fs::write(&path, "no recording").unwrap();
        let Input::Frames(mut frames) = opened(&path.display().to_string()) else { panic!("not a recording") };
        assert_eq!(frames.next().unwrap().unwrap_err().to_string(), "is no MCAP file");
    }
}
