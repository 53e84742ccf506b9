//! Outcomes of a stream into a file.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{sync_channel, Receiver, RecvTimeoutError, SyncSender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{anyhow, Result};
use dermis_flow::say;
use dermis_golden::data::recording::message::{Image, Message, Text, Wrench, WrenchStamped};
use dermis_golden::data::recording::{frame_messages, Kind, RecordingError, RecordingFile, Stamp};
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;

use super::arrows::Arrows;
use super::points::Points;
use super::{contact_channel, header, torque, ARROWS, FORCES, FRAME_ID, RESULT};
use crate::stream::{seconds, Outcome, StreamAnswer};

/// After this time what was recorded is in the file: a chunk is at most half a second, the rest is for the disk.
const CHUNK: Duration = Duration::from_millis(400);
/// Outcomes that wait for the disk; then the stream waits.
const WAITING: usize = 256;

/// A recording that is being written, by a thread of its own: a disk that is slow or full does not hold up the answers.
pub struct Recorder {
    path: PathBuf,
    sensor: Sensor,
    arrows: Arrows,
    /// Results so far.
    results: u64,
    entries: SyncSender<Entry>,
    thread: JoinHandle<Written>,
}

/// The messages of one outcome.
struct Entry {
    /// When it was made.
    made: Instant,
    stamp: Stamp,
    /// Channel, type and bytes of each.
    messages: Vec<(String, Kind, Vec<u8>)>,
    is_result: bool,
}

impl Entry {
    fn add<M: Message>(&mut self, topic: impl Into<String>, message: &M) -> Result<()> {
        let topic = topic.into();
        let bytes = message.to_cdr().map_err(|error| anyhow!("{topic}: {error}"))?;
        self.messages.push((topic, Kind::of::<M>(), bytes));
        Ok(())
    }
}

/// What the thread has done.
struct Written {
    /// Results in the file.
    results: u64,
    /// Why the file has no more of them.
    error: Option<RecordingError>,
}

impl Recorder {
    /// Begins the recording of a scene's sensor in a new file.
    ///
    /// # Errors
    /// A file that exists or cannot be made.
    pub fn create(path: &Path, scene: &Scene) -> Result<Recorder> {
        let file = RecordingFile::create(path).map_err(|error| anyhow!("{}: {error}", path.display()))?;
        let (entries, waiting) = sync_channel(WAITING);
        let (path, sensor, arrows) = (path.to_owned(), scene.sensor.clone(), Arrows::of(scene));
        let name = path.display().to_string();
        let thread = std::thread::spawn(move || write_all(file, &waiting, &name));
        Ok(Recorder { path, sensor, arrows, results: 0, entries, thread })
    }

    /// Records an outcome; one that cannot be written any more is left out, and [`Recorder::finish`] says so.
    ///
    /// # Errors
    /// A text or list that a message cannot represent, with the file's name.
    pub fn outcome(&mut self, outcome: &Outcome) -> Result<()> {
        let (sequence, logged_s) = match outcome {
            Outcome::Note(_) => return Ok(()),
            Outcome::Answer(answer) => (answer.sequence, answer.answered_s),
            // Numbered as the result that follows it.
            Outcome::Refusal(_) => (self.results, seconds(SystemTime::now())),
        };
        let stamp = Stamp { sequence, logged: nanoseconds(logged_s) };
        let mut entry = Entry {
            made: Instant::now(),
            stamp,
            messages: Vec::new(),
            is_result: matches!(outcome, Outcome::Answer(_)),
        };
        if let Outcome::Answer(answer) = outcome {
            self.answer(answer, &mut entry).map_err(|error| anyhow!("{}: {error}", self.path.display()))?;
            self.results += 1;
        }
        entry.add(RESULT, &Text { data: serde_json::to_string(outcome)? })?;
        // The thread takes entries as long as there is a sender, unless it has panicked: `finish` says so.
        let _ = self.entries.send(entry);
        Ok(())
    }

    /// Writes the index and closes the file; returns the number of results.
    ///
    /// # Errors
    /// A file that cannot be written, with its name and the number of results that it has.
    pub fn finish(self) -> Result<u64> {
        let Recorder { path, results, entries, thread, .. } = self;
        drop(entries);
        let path = path.display();
        let written = thread.join().map_err(|_| anyhow!("{path}: the thread that writes it has ended"))?;
        match written.error {
            None => Ok(written.results),
            Some(error) => Err(anyhow!("{path}: {error}; it has {} of {results} results", written.results)),
        }
    }

    fn answer(&self, answer: &StreamAnswer, entry: &mut Entry) -> Result<()> {
        for (frame, time_ns) in answer.frames.iter().zip(answer.times_ns) {
            let shape = [self.sensor.rows, self.sensor.cols];
            for (topic, cdr) in frame_messages(shape, &header(FRAME_ID, *time_ns), &frame.readings())? {
                entry.messages.push((topic.to_owned(), Kind::of::<Image>(), cdr));
            }
        }
        let header = header(FRAME_ID, answer.time_ns());
        if !answer.result.forces_N.fz.is_empty() {
            let points = Points::new(&self.sensor, answer.result);
            entry.add(FORCES, &points.cloud(&self.sensor, header.clone()))?;
        }
        let contacts = answer.result.all_contacts();
        for (index, contact) in contacts.iter().enumerate() {
            // Without compressive force there is no place at which the force acts.
            let Some(centre_mm) = contact.centre_mm else { continue };
            let wrench = Wrench { force: contact.force_N, torque: torque(centre_mm, contact.force_N) };
            entry.add(contact_channel(index + 1), &WrenchStamped { header: header.clone(), wrench })?;
        }
        entry.add(ARROWS, &self.arrows.markers(&self.sensor, answer.result, &contacts, &header))
    }
}

/// Writes all entries; says at once where one cannot be written, and takes the others without writing them.
fn write_all(file: RecordingFile, entries: &Receiver<Entry>, name: &str) -> Written {
    let mut results = 0;
    let error = write_until_failure(file, entries, &mut results).err();
    if let Some(error) = &error {
        say!("{name}: {error}; it ends with {results} results, the answers go on");
        entries.iter().for_each(drop);
    }
    Written { results, error }
}

/// Writes entries until there are no more; `results` are those in the file.
fn write_until_failure(
    mut file: RecordingFile,
    entries: &Receiver<Entry>,
    results: &mut u64,
) -> Result<(), RecordingError> {
    let mut waiting = 0;
    // Since when something is not in the file.
    let mut since: Option<Instant> = None;
    loop {
        let wait = since.map_or(CHUNK, |since| CHUNK.saturating_sub(since.elapsed()));
        match entries.recv_timeout(wait) {
            Ok(Entry { made, stamp, messages, is_result }) => {
                for (topic, kind, bytes) in messages {
                    file.message(&topic, kind, stamp, &bytes)?;
                }
                waiting += u64::from(is_result);
                since.get_or_insert(made);
            }
            Err(RecvTimeoutError::Timeout) => (),
            Err(RecvTimeoutError::Disconnected) => {
                file.finish()?;
                *results += waiting;
                return Ok(());
            }
        }
        if since.is_some_and(|since| since.elapsed() >= CHUNK) {
            file.flush()?;
            *results += std::mem::take(&mut waiting);
            since = None;
        }
    }
}

/// Nanoseconds since 1970.
fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}
