//! Outcomes of a stream into a file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{anyhow, Error, Result};
use dermis_golden::data::frame::Forces;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::sensor::Sensor;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

use super::contacts::contacts;
use super::message::{Header, Image, Message, PointCloud2, PointField, Time, Wrench, WrenchStamped};
use super::read::DOUBLE;
use super::{contact_channel, FORCES, RESULT, STRESS};
use crate::stream::{seconds, Answer, Outcome};

/// Coordinate system of all messages.
const FRAME_ID: &str = "dermis";
/// Metres of a millimetre.
const METRES: f64 = 1e-3;
/// Bytes of a pixel and of a point's value, of 64 bits.
const PIXEL: usize = 8;
/// Bytes of a point's place: three values of 32 bits, and as many as bring the next one to a multiple of its size.
const PLACE: usize = 16;

/// A recording that is being written.
pub struct Recorder {
    writer: Writer<BufWriter<File>>,
    path: PathBuf,
    sensor: Sensor,
    /// Number of each channel so far by its topic.
    channels: BTreeMap<String, u16>,
    results: u64,
}

/// When and as the how-manieth result messages are recorded.
#[derive(Clone, Copy)]
struct Stamp {
    sequence: u64,
    /// Nanoseconds since 1970 when the result was ready.
    logged: u64,
}

impl Recorder {
    /// Begins the recording of a sensor in a new file.
    ///
    /// # Errors
    /// A file that exists or cannot be made.
    pub fn create(path: &Path, sensor: &Sensor) -> Result<Recorder> {
        let file = File::create_new(path).map_err(at(path))?;
        let library = concat!("dermis ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).profile("ros2").library(library);
        let writer = options.create(BufWriter::new(file)).map_err(at(path))?;
        let (path, sensor, channels) = (path.to_owned(), sensor.clone(), BTreeMap::new());
        let mut recorder = Recorder { writer, path, sensor, channels, results: 0 };
        // Present in a recording without a frame too.
        recorder.channel::<Image>(STRESS)?;
        Ok(recorder)
    }

    /// Records an outcome.
    ///
    /// # Errors
    /// A file that cannot be written, with its name.
    pub fn outcome(&mut self, outcome: &Outcome) -> Result<()> {
        match outcome {
            Outcome::Answer(answer) => {
                let stamp = Stamp { sequence: answer.sequence, logged: nanoseconds(answer.answered_s) };
                self.answer(answer, stamp)?;
                self.results += 1;
                self.line(outcome, stamp)
            }
            Outcome::Note(_) => Ok(()),
            // Numbered as the result that follows it.
            Outcome::Refusal(_) => {
                let logged = nanoseconds(seconds(SystemTime::now()));
                self.line(outcome, Stamp { sequence: self.results, logged })
            }
        }
    }

    /// Writes the index and closes the file; returns the number of results.
    ///
    /// # Errors
    /// A file that cannot be written, with its name.
    pub fn finish(mut self) -> Result<u64> {
        self.writer.finish().map_err(at(&self.path))?;
        self.writer.into_inner().flush().map_err(at(&self.path))?;
        Ok(self.results)
    }

    fn answer(&mut self, answer: &Answer, stamp: Stamp) -> Result<()> {
        for (frame, received_s) in answer.frames.iter().zip(answer.received) {
            let data = bytes(&frame.readings());
            self.message(STRESS, stamp, &image(&self.sensor, header(*received_s), &data))?;
        }
        let header = header(answer.received_s);
        if !answer.result.forces_N.fz.is_empty() {
            let points = Points::new(&self.sensor, answer.result);
            self.message(FORCES, stamp, &points.cloud(&self.sensor, header.clone()))?;
        }
        for (index, contact) in contacts(answer.result).iter().enumerate() {
            // Without compressive force there is no place at which the force acts.
            let Some(centre_mm) = contact.centre_mm else { continue };
            let wrench = Wrench { force: contact.force_N, torque: torque(centre_mm, contact.force_N) };
            self.message(&contact_channel(index + 1), stamp, &WrenchStamped { header: header.clone(), wrench })?;
        }
        Ok(())
    }

    fn line(&mut self, outcome: &Outcome, stamp: Stamp) -> Result<()> {
        let channel = match self.channels.get(RESULT) {
            Some(channel) => *channel,
            None => self.add(RESULT, 0, "json")?,
        };
        self.write(channel, stamp, &serde_json::to_vec(outcome)?)
    }

    fn message<M: Message>(&mut self, topic: &str, stamp: Stamp, message: &M) -> Result<()> {
        let channel = self.channel::<M>(topic)?;
        let bytes = message.to_cdr().map_err(|error| anyhow!("{}: {topic}: {error}", self.path.display()))?;
        self.write(channel, stamp, &bytes)
    }

    /// Number of a channel; a new one is announced with its schema.
    fn channel<M: Message>(&mut self, topic: &str) -> Result<u16> {
        if let Some(channel) = self.channels.get(topic) {
            return Ok(*channel);
        }
        let schema = self.writer.add_schema(M::NAME, "ros2msg", M::schema().as_bytes());
        let schema = schema.map_err(at(&self.path))?;
        self.add(topic, schema, "cdr")
    }

    fn add(&mut self, topic: &str, schema: u16, encoding: &str) -> Result<u16> {
        let channel = self.writer.add_channel(schema, topic, encoding, &BTreeMap::new());
        let channel = channel.map_err(at(&self.path))?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    fn write(&mut self, channel_id: u16, stamp: Stamp, bytes: &[u8]) -> Result<()> {
        let Stamp { sequence, logged } = stamp;
        // 32 bits, after which they begin again.
        let sequence = sequence as u32;
        let header = MessageHeader { channel_id, sequence, log_time: logged, publish_time: logged };
        self.writer.write_to_known_channel(&header, bytes).map_err(at(&self.path))
    }
}

/// An error on a file with its name and its cause, for `map_err`.
fn at<E: Into<Error>>(path: &Path) -> impl FnOnce(E) -> Error + '_ {
    move |error| anyhow!("{}: {:#}", path.display(), error.into())
}

/// Nanoseconds since 1970.
fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

fn header(received_s: f64) -> Header {
    Header { stamp: Time::from(nanoseconds(received_s)), frame_id: FRAME_ID.into() }
}

fn bytes(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn image<'a>(sensor: &Sensor, header: Header, data: &'a [u8]) -> Image<'a> {
    let [height, width] = [sensor.rows as u32, sensor.cols as u32];
    let step = width * PIXEL as u32;
    Image { header, height, width, encoding: DOUBLE.into(), is_bigendian: 0, step, data }
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
            fields.push(field(name, PLACE + PIXEL * index, PointField::FLOAT64));
        }
        let mut data = Vec::with_capacity(fz.len() * (PLACE + PIXEL * columns.len()));
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
