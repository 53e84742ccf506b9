//! Outcomes of a stream into a file.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{sync_channel, Receiver, RecvTimeoutError, SyncSender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{anyhow, Result};
use dermis_golden::data::frame::Forces;
use dermis_golden::data::recording::message::{
    Header, Image, Message, PointCloud2, PointField, Text, Time, Wrench, WrenchStamped,
};
use dermis_golden::data::recording::{frame_messages, Kind, RecordingError, RecordingFile, Stamp};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use dermis_golden::spec::sensor::Sensor;

use super::arrows::Arrows;
use super::{contact_channel, ARROWS, FORCES, METRES, RESULT};
use crate::stream::{seconds, Answer, Outcome};

/// Coordinate system of all messages.
const FRAME_ID: &str = "dermis";
/// Bytes of a point's value, of 64 bits.
const VALUE: usize = 8;
/// Bytes of a point's place: three values of 32 bits, and as many as bring the next one to a multiple of its size.
const PLACE: usize = 16;
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

    fn answer(&self, answer: &Answer, entry: &mut Entry) -> Result<()> {
        for (frame, time_ns) in answer.frames.iter().zip(answer.times_ns) {
            let shape = [self.sensor.rows, self.sensor.cols];
            for (topic, cdr) in frame_messages(shape, &header(*time_ns), &frame.readings())? {
                entry.messages.push((topic.to_owned(), Kind::of::<Image>(), cdr));
            }
        }
        let header = header(answer.time_ns());
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

/// Header of a message of this time in ns since 1970.
pub(crate) fn header(time_ns: i64) -> Header {
    Header { stamp: Time::from(u64::try_from(time_ns).unwrap_or(0)), frame_id: FRAME_ID.into() }
}

/// Torque in N·m about the array's centre of a force in N that acts on the surface at a place in mm.
fn torque([x, y]: [f64; 2], [fx, fy, fz]: [f64; 3]) -> [f64; 3] {
    [y * fz, -x * fz, x * fy - y * fx].map(|moment| moment * METRES)
}

/// The taxels as points.
struct Points {
    fields: Vec<PointField>,
    data: Vec<u8>,
    /// Whether no value is undefined.
    dense: bool,
}

impl Points {
    /// The taxels with what the result has of each.
    fn new(sensor: &Sensor, result: &Reconstruction) -> Points {
        let Forces { fx, fy, fz } = &result.forces_N;
        let mut columns = vec![("fx", fx.clone()), ("fy", fy.clone()), ("fz", fz.clone())];
        columns.extend(ratios(sensor, result));
        let field = |name: &str, offset: usize, datatype| {
            let (name, offset) = (name.to_owned(), offset as u32);
            PointField { name, offset, datatype, count: 1 }
        };
        // Viewers require places of 32 bits.
        let places = ["x", "y", "z"].into_iter().enumerate();
        let mut fields: Vec<PointField> =
            places.map(|(index, name)| field(name, 4 * index, PointField::FLOAT32)).collect();
        for (index, (name, _)) in columns.iter().enumerate() {
            fields.push(field(name, PLACE + VALUE * index, PointField::FLOAT64));
        }
        let mut data = Vec::with_capacity(fz.len() * (PLACE + VALUE * columns.len()));
        for taxel in 0..fz.len() {
            let [x, y] = sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols);
            for place in [x, y, 0.0, 0.0] {
                data.extend(((place * METRES) as f32).to_le_bytes());
            }
            columns.iter().for_each(|(_, values)| data.extend(values[taxel].to_le_bytes()));
        }
        let dense = columns.iter().all(|(_, values)| values.iter().all(|value| value.is_finite()));
        Points { fields, data, dense }
    }

    fn cloud(&self, sensor: &Sensor, header: Header) -> PointCloud2<'_> {
        let [height, width] = [sensor.rows as u32, sensor.cols as u32];
        let row_step = (self.data.len() / sensor.rows) as u32;
        PointCloud2 {
            header,
            height,
            width,
            fields: self.fields.clone(),
            is_bigendian: false,
            point_step: row_step / width,
            row_step,
            data: &self.data,
            is_dense: self.dense,
        }
    }
}

/// Taxels with the same μ: which they are, μ, its standard deviation.
type Part = (Vec<usize>, [f64; 2], Option<[f64; 2]>);

/// μ of each taxel and its standard deviation, of its region or subarray, as far as the result has them; undefined for
/// taxels in none. The contacts of the estimator `evidence` overlap: theirs are not those of taxels.
fn ratios(sensor: &Sensor, result: &Reconstruction) -> Vec<(&'static str, Vec<f64>)> {
    if result.extra.contacts.is_some() {
        return Vec::new();
    }
    let parts: Vec<Part> = match &result.extra.regions {
        Some(regions) => regions.iter().map(|own| (own.taxels.clone(), own.mu, own.mu_sigma)).collect(),
        None => {
            let taxels = |row0: usize, col0: usize, rows: usize, cols: usize| {
                (0..rows * cols).map(|k| (row0 + k / cols) * sensor.cols + col0 + k % cols).collect()
            };
            let own = result.subarrays.iter();
            own.map(|own| (taxels(own.row0, own.col0, own.rows, own.cols), own.mu, own.mu_sigma)).collect()
        }
    };
    let mut columns: Vec<(&str, Vec<f64>)> = Vec::new();
    let mut column = |name, axis: usize, of: &dyn Fn([f64; 2], Option<[f64; 2]>) -> Option<[f64; 2]>| {
        if parts.iter().all(|(_, mu, sigma)| of(*mu, *sigma).is_none()) {
            return;
        }
        let mut values = vec![f64::NAN; sensor.taxels()];
        for (taxels, mu, sigma) in &parts {
            let Some(own) = of(*mu, *sigma) else { continue };
            taxels.iter().for_each(|taxel| values[*taxel] = own[axis]);
        }
        columns.push((name, values));
    };
    for (axis, name) in ["mu_x", "mu_y"].into_iter().enumerate() {
        column(name, axis, &|mu, _| Some(mu));
    }
    for (axis, name) in ["mu_sigma_x", "mu_sigma_y"].into_iter().enumerate() {
        column(name, axis, &|_, sigma| sigma);
    }
    columns
}
