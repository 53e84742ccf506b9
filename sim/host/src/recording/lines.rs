//! Recorded frames at a pace, as values or as lines of a stream.

use std::io::{Cursor, Error, Read};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use dermis_golden::data::recording::{End, FrameOptions, Frames, RecordedFrame, RecordingError};
use serde_json::json;

use crate::stream::DueFrame;

/// When frames are handed out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// As fast as they are taken.
    Unbounded,
    /// This many per second.
    Rate(f64),
    /// As far apart as they were acquired.
    Recorded,
}

/// Most bytes of the values of a file that is repeated, which are kept so that it is read once.
const REPEATED_BYTES: usize = 4 << 20;

/// The frames of a file that begins again.
#[derive(Default)]
struct Repeated {
    frames: Vec<RecordedFrame>,
    bytes: usize,
    /// Number of the next frame, once all are there.
    next: Option<usize>,
}

impl Repeated {
    /// Keeps a frame; whether there was room.
    fn add(&mut self, frame: &RecordedFrame) -> bool {
        self.bytes += size_of_val(&frame.stress_MPa[..]);
        let fits = self.bytes <= REPEATED_BYTES;
        if fits {
            self.frames.push(frame.clone());
        }
        fits
    }
}

/// A moment that no program lives to see, of a frame whose own one is beyond the range of the clock.
fn far_away() -> Instant {
    Instant::now() + Duration::from_secs(u32::MAX.into())
}

/// The frames of a file, each with the moment at which it is due by their pace; errors have no file's name.
pub struct Paced {
    path: PathBuf,
    options: FrameOptions,
    pace: Pace,
    /// Begin again at the end.
    repeat: bool,
    /// The frames so far of a file that begins again and is not too long.
    repeated: Option<Repeated>,
    /// Take a file that is cut like one that ends.
    partial: bool,
    frames: Frames,
    /// When the first frame is handed out, and when it was acquired.
    begun: Option<(Instant, u64)>,
    /// Number of frames since then.
    count: u64,
    /// When the last frame was due since then, and how long after the one before.
    due: Duration,
    gap: Duration,
}

impl Paced {
    /// Opens a file; with `repeat` it begins again at its end. One that is cut ends with an error, unless it may be `partial`.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn open(
        path: PathBuf,
        options: FrameOptions,
        pace: Pace,
        [repeat, partial]: [bool; 2],
    ) -> Result<Paced, RecordingError> {
        let frames = Frames::open(&path, options.clone())?;
        let (due, gap) = (Duration::ZERO, Duration::ZERO);
        let repeated = repeat.then(Repeated::default);
        Ok(Paced { path, options, pace, repeat, repeated, partial, frames, begun: None, count: 0, due, gap })
    }

    /// How the file ends, once there is no further frame.
    pub fn end(&self) -> End {
        self.frames.end()
    }

    /// The next frame of the file.
    fn read_next(&mut self) -> Result<Option<RecordedFrame>, RecordingError> {
        let next = self.frames.next_frame()?;
        if let (End::Cut, Some(words), false) = (self.end(), self.end().words(), self.partial) {
            return Err(RecordingError::new(words));
        }
        if let Some(frame) = &next {
            self.repeated = self.repeated.take().and_then(|mut all| all.add(frame).then_some(all));
        }
        Ok(next)
    }

    /// The same of the frames that are kept, once all are: they begin again.
    fn next_kept(&mut self) -> Option<RecordedFrame> {
        let Repeated { frames, next, .. } = self.repeated.as_mut()?;
        let number = next.as_mut()?;
        let frame = frames.get(*number).cloned();
        *number += 1;
        frame
    }

    /// The next frame, and when it is due; `None` at the end.
    fn advance(&mut self) -> Result<Option<DueFrame>, RecordingError> {
        let all_kept = self.repeated.as_ref().is_some_and(|repeated| repeated.next.is_some());
        let mut next = if all_kept { self.next_kept() } else { self.read_next()? };
        if next.is_none() && self.repeat {
            (self.begun, self.count, self.due) = (None, 0, Duration::ZERO);
            next = match self.repeated.as_mut().filter(|repeated| !repeated.frames.is_empty()) {
                Some(repeated) => {
                    repeated.next = Some(0);
                    self.next_kept()
                }
                None => {
                    self.frames = Frames::open(&self.path, self.options.clone())?;
                    self.read_next()?
                }
            };
        }
        let Some(frame) = next else { return Ok(None) };
        // From the last frame to the first one as long as from the last but one to the last.
        let (begun, first) = *self.begun.get_or_insert((Instant::now() + self.gap, frame.time_ns));
        let due = match self.pace {
            Pace::Unbounded => Duration::ZERO,
            Pace::Rate(rate) => Duration::try_from_secs_f64(self.count as f64 / rate).unwrap_or(Duration::MAX),
            Pace::Recorded => Duration::from_nanos(frame.time_ns.saturating_sub(first)),
        };
        // Times may go back.
        (self.gap, self.due) = (due.saturating_sub(self.due), due);
        self.count += 1;
        Ok(Some((begun.checked_add(due).unwrap_or_else(far_away), frame)))
    }
}

impl Iterator for Paced {
    type Item = std::io::Result<DueFrame>;

    /// The next frame, and when it is due; an error of a file that is no recording, was changed or is cut.
    fn next(&mut self) -> Option<Self::Item> {
        self.advance().map_err(Error::other).transpose()
    }
}

/// The frames of a file, read as lines that a stream takes.
pub struct Lines {
    frames: Paced,
    line: Cursor<Vec<u8>>,
}

impl Lines {
    /// The lines of these frames.
    pub fn of(frames: Paced) -> Lines {
        Lines { frames, line: Cursor::default() }
    }

    /// How the file ends, once there is no further line.
    pub fn end(&self) -> End {
        self.frames.end()
    }

    /// Takes the next line, once it is due; returns whether there is one.
    fn advance(&mut self) -> std::io::Result<bool> {
        let frame = self.frames.next().transpose()?.map(|(due, frame)| {
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            frame
        });
        // NaN, a missing reading, is written as null.
        let line =
            frame.map(|frame| format!("{}\n", json!({"time_ns": frame.time_ns, "stress_MPa": frame.stress_MPa})));
        let is_there = line.is_some();
        self.line = Cursor::new(line.unwrap_or_default().into_bytes());
        Ok(is_there)
    }
}

impl Read for Lines {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self.line.read(buffer)? {
            0 if !buffer.is_empty() && self.advance()? => self.line.read(buffer),
            bytes => Ok(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recorder;
    use crate::stream::{Outcome, StreamAnswer};
    use dermis_golden::data::frame::Frame;
    use dermis_golden::estimate::float::Golden;
    use dermis_golden::spec::scene::Scene;
    use std::io::{BufRead, BufReader};

    /// A recording of the scene's first frame, received at these seconds.
    fn recorded(folder: &std::path::Path, seconds: &[f64]) -> (PathBuf, Frame) {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frames = Frame::shipped(&scene)[..1].to_vec();
        let result = &Golden::reference(&scene).unwrap().run(&frames[0]).unwrap();
        let path = folder.join("press.mcap");
        let mut recorder = Recorder::create(&path, &scene).unwrap();
        for (sequence, received_s) in (0..).zip(seconds) {
            let (received_s, frames) = (*received_s, &frames[..]);
            let time_ns = (received_s * 1e9).round() as i64;
            let answer = StreamAnswer {
                sequence,
                line: sequence + 1,
                received_s,
                answered_s: received_s,
                dropped: 0,
                estimator: "search",
                estimator_change: None,
                frames,
                times_ns: &[time_ns],
                result,
            };
            recorder.outcome(&Outcome::Answer(answer)).unwrap();
        }
        assert_eq!(recorder.finish().unwrap(), seconds.len() as u64);
        (path, frames[0].clone())
    }

    #[test]
    fn frames_are_kept_while_there_is_room() {
        let frame = |bytes: usize| RecordedFrame { time_ns: 1, shape: [1, 1], stress_MPa: vec![0.0; bytes / 8] };
        let (mut repeated, half) = (Repeated::default(), frame(REPEATED_BYTES / 2));
        assert!(repeated.add(&half) && repeated.add(&half) && !repeated.add(&frame(8)));
    }

    #[test]
    fn frames_are_lines_at_their_pace_and_again() {
        let folder = tempfile::tempdir().unwrap();
        let (path, frame) = recorded(folder.path(), &[100.0, 100.05, 100.15]);
        let of = |ms: i64| json!({"time_ns": ms * 1_000_000, "stress_MPa": frame.stress_MPa}).to_string();
        let recorded = [100_000, 100_050, 100_150].map(of);
        let options = || FrameOptions { shape: Some([8, 8]), ..FrameOptions::default() };
        let read = |pace, repeat, count: usize| {
            let begun = Instant::now();
            let frames = Paced::open(path.clone(), options(), pace, [repeat, false]).unwrap();
            let lines = BufReader::new(Lines::of(frames)).lines();
            let lines: Vec<String> = lines.take(count).map(Result::unwrap).collect();
            assert!(lines.iter().zip(recorded.iter().cycle()).all(|(own, line)| own == line));
            (lines.len(), begun.elapsed().as_secs_f64())
        };
        assert_eq!(read(Pace::Unbounded, false, 9).0, 3);
        assert_eq!(read(Pace::Unbounded, true, 9).0, 9);
        let (count, took) = read(Pace::Recorded, false, 9);
        assert!(count == 3 && took >= 0.15, "{count} in {took} s");
        // Again after 0.1 s, as long as before the last one.
        let (count, took) = read(Pace::Recorded, true, 4);
        assert!(count == 4 && took >= 0.25, "{count} in {took} s");
        let (count, took) = read(Pace::Rate(20.0), false, 9);
        assert!(count == 3 && took >= 0.1, "{count} in {took} s");
        // One that is cut is an error at its end, also where it would begin again.
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        for repeat in [false, true] {
            let frames = Paced::open(path.clone(), options(), Pace::Unbounded, [repeat, false]).unwrap();
            let lines: Vec<_> = BufReader::new(Lines::of(frames)).lines().take(4).collect();
            assert!(lines.len() == 4 && lines[..3].iter().all(|line| line.is_ok()));
            assert!(lines[3].as_ref().unwrap_err().to_string().starts_with("ends early"));
        }
        // A file without frames is no endless loop.
        let empty = folder.path().join("empty.mcap");
        Recorder::create(&empty, &Scene::builtin("eight-by-eight").unwrap()).unwrap().finish().unwrap();
        let frames = Paced::open(empty, FrameOptions::default(), Pace::Unbounded, [true, false]).unwrap();
        let error = Lines::of(frames).read(&mut [0; 8]).unwrap_err().to_string();
        assert!(
            error.starts_with("has no message of channel /dermis/stress; its channels: /dermis/stress_exact ("),
            "{error}"
        );
    }
}
