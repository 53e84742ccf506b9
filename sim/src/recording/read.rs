//! Messages of an MCAP file in its order, and the frames among them; memory is bounded by the file's largest record.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{anyhow, bail, Result};
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::McapError;

use super::message::{from_cdr, Image, Message};
use super::STRESS;

/// Encoding of an image with a 64-bit value per pixel.
pub(super) const DOUBLE: &str = "64FC1";
/// Encoding of an image with a 32-bit value per pixel.
const SINGLE: &str = "32FC1";
/// Longest record in bytes that is taken.
const LONGEST_RECORD: usize = 1 << 28;
/// Bytes that are read at a time, at least.
const PART: usize = 1 << 16;

/// One message of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Its channel.
    pub topic: String,
    /// Name of its type; empty without a schema.
    pub schema: String,
    /// Number of the result that it belongs to.
    pub sequence: u32,
    /// Nanoseconds since 1970 when it was logged.
    pub logged: u64,
    /// Its bytes.
    pub data: Vec<u8>,
}

/// A channel of a file.
struct Channel {
    topic: String,
    schema: u16,
}

/// The messages of a file; errors have no file's name.
pub struct Messages {
    file: File,
    reader: LinearReader,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
}

impl Messages {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn open(path: &Path) -> Result<Messages> {
        let options = LinearReaderOptions::default().with_validate_chunk_crcs(true);
        let reader = LinearReader::new_with_options(options.with_record_length_limit(LONGEST_RECORD));
        Ok(Messages { file: File::open(path)?, reader, schemas: BTreeMap::new(), channels: BTreeMap::new() })
    }

    /// The next message; `None` at the end of the file.
    ///
    /// # Errors
    /// What is no MCAP, ends early or was changed.
    pub fn next_message(&mut self) -> Result<Option<Recorded>> {
        loop {
            let (opcode, data) = match self.reader.next_event() {
                None => return Ok(None),
                Some(Err(error)) => return Err(named(error)),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let read = self.file.read(self.reader.insert(bytes.max(PART)))?;
                    self.reader.notify_read(read);
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => (opcode, data),
            };
            match mcap::parse_record(opcode, data).map_err(named)? {
                Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
                Record::Channel(own) => {
                    drop(self.channels.insert(own.id, Channel { topic: own.topic, schema: own.schema_id }));
                }
                Record::Message { header, data } => {
                    let unknown = || anyhow!("a message is of channel {}, which is not described", header.channel_id);
                    let Channel { topic, schema } = self.channels.get(&header.channel_id).ok_or_else(unknown)?;
                    return Ok(Some(Recorded {
                        topic: topic.clone(),
                        schema: self.schemas.get(schema).cloned().unwrap_or_default(),
                        sequence: header.sequence,
                        logged: header.log_time,
                        data: data.into_owned(),
                    }));
                }
                _ => (),
            }
        }
    }

    /// Names of the channels so far, in words.
    pub fn channels(&self) -> String {
        let topics: Vec<&str> = self.channels.values().map(|channel| channel.topic.as_str()).collect();
        if topics.is_empty() {
            "none".into()
        } else {
            topics.join(", ")
        }
    }
}

/// An error in words of the file.
fn named(error: McapError) -> anyhow::Error {
    match error {
        McapError::BadMagic => anyhow!("is no MCAP file"),
        McapError::UnexpectedEof => anyhow!("ends early, in the middle of a record or without its index"),
        McapError::UnsupportedCompression(name) => {
            anyhow!("its chunks are compressed by {name}: only files without compression are read")
        }
        other => anyhow!(other),
    }
}

/// One recorded frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// Nanoseconds since 1970 when it was received.
    pub received: u64,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Stress of each taxel in MPa, row-major; NaN where a reading is missing.
    pub stress_MPa: Vec<f64>,
}

/// The frames of a file; errors have no file's name.
pub struct Frames {
    messages: Messages,
    /// Shape of all frames.
    shape: Option<[usize; 2]>,
    count: u64,
}

impl Frames {
    /// Opens a file whose frames have `shape`, rows and columns, if that is given.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn open(path: &Path, shape: Option<[usize; 2]>) -> Result<Frames> {
        Ok(Frames { messages: Messages::open(path)?, shape, count: 0 })
    }

    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// As [`Messages::next_message`]; a file without frames, a message that is none, another shape: with channel and number.
    pub fn next_frame(&mut self) -> Result<Option<RecordedFrame>> {
        while let Some(message) = self.messages.next_message()? {
            if message.topic != STRESS {
                continue;
            }
            let number = self.count;
            let frame = self.frame(&message).map_err(|error| anyhow!("{STRESS}, message {number}: {error}"))?;
            self.count += 1;
            return Ok(Some(frame));
        }
        match self.count {
            0 => bail!("has no message of channel {STRESS}; its channels: {}", self.messages.channels()),
            _ => Ok(None),
        }
    }

    fn frame(&mut self, message: &Recorded) -> Result<RecordedFrame, String> {
        if message.schema != Image::NAME {
            return Err(format!("is a {:?}, wanted {:?}", message.schema, Image::NAME));
        }
        let image: Image = from_cdr(&message.data)?;
        let size = match image.encoding.as_str() {
            DOUBLE => 8,
            SINGLE => 4,
            other => return Err(format!("encoding {other:?} is not available: {DOUBLE}, {SINGLE}")),
        };
        if image.is_bigendian != 0 {
            return Err(format!("is_bigendian = {} is not available: 0", image.is_bigendian));
        }
        let shape = [image.height as usize, image.width as usize];
        let (row, step) = (size * shape[1], image.step as usize);
        if shape.contains(&0) || step < row || Some(image.data.len()) != step.checked_mul(shape[0]) {
            let (rows, cols, bytes) = (shape[0], shape[1], image.data.len());
            return Err(format!(
                "{bytes} bytes with {step} per row are not {rows}×{cols} pixels of {}",
                image.encoding
            ));
        }
        let wanted = *self.shape.get_or_insert(shape);
        if wanted != shape {
            return Err(format!("{}×{} taxels, wanted {}×{}", shape[0], shape[1], wanted[0], wanted[1]));
        }
        let value = |bytes: &[u8]| match *bytes {
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => f64::NAN,
        };
        let rows = image.data.chunks_exact(step);
        let stress_MPa: Vec<f64> = rows.flat_map(|own| own[..row].chunks_exact(size).map(value)).collect();
        if let Some(taxel) = stress_MPa.iter().position(|stress| stress.is_infinite()) {
            let (row, col) = (taxel / shape[1], taxel % shape[1]);
            return Err(format!("row {row}, column {col}: {} is not a finite number", stress_MPa[taxel]));
        }
        Ok(RecordedFrame { received: image.header.stamp.nanoseconds(), shape, stress_MPa })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::message::{Header, Time};
    use mcap::records::MessageHeader;
    use mcap::{WriteOptions, Writer};
    use std::io::Cursor;

    /// An image of 2×3 taxels.
    fn image(encoding: &str, data: &[u8]) -> Vec<u8> {
        let header = Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: String::new() };
        let (encoding, step) = (encoding.to_owned(), (data.len() / 2) as u32);
        Image { header, height: 2, width: 3, encoding, is_bigendian: 0, step, data }.to_cdr().unwrap()
    }

    /// A file with messages of a type on a channel.
    fn file(topic: &str, schema: &str, messages: &[Vec<u8>]) -> tempfile::NamedTempFile {
        let mut writer: Writer<Cursor<Vec<u8>>> =
            WriteOptions::new().compression(None).create(Cursor::new(Vec::new())).unwrap();
        let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        for message in messages {
            let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, message).unwrap();
        }
        writer.finish().unwrap();
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), writer.into_inner().into_inner()).unwrap();
        file
    }

    fn frames(file: &tempfile::NamedTempFile, shape: Option<[usize; 2]>) -> Result<Vec<RecordedFrame>> {
        let mut frames = Frames::open(file.path(), shape)?;
        std::iter::from_fn(|| frames.next_frame().transpose()).collect()
    }

    fn bytes(values: [f64; 6]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    const VALUES: [f64; 6] = [0.1, -0.2, 1e-300, 0.0, f64::MAX, 1.0 / 3.0];

    #[test]
    fn both_encodings_and_padded_rows_are_read() {
        let single: Vec<u8> = [0.5f32, 1.5, -2.0, 0.0, 4.0, 8.0].iter().flat_map(|value| value.to_le_bytes()).collect();
        let padded = [&single[..12], &[9; 4], &single[12..], &[9; 4]].concat();
        let messages = [image(DOUBLE, &bytes(VALUES)), image(SINGLE, &single), image(SINGLE, &padded)];
        let read = frames(&file(STRESS, Image::NAME, &messages), Some([2, 3])).unwrap();
        let stress: Vec<&[f64]> = read.iter().map(|frame| &frame.stress_MPa[..]).collect();
        let small = [0.5, 1.5, -2.0, 0.0, 4.0, 8.0];
        assert_eq!(stress, [&VALUES[..], &small, &small]);
        assert_eq!((read[0].received, read[0].shape), (1_000_000_002, [2, 3]));
    }

    #[test]
    fn what_is_no_frame_is_named_with_channel_and_number() {
        let good = image(DOUBLE, &bytes(VALUES));
        let mut infinite = VALUES;
        infinite[4] = f64::INFINITY;
        let cases: [(&str, &str, Vec<u8>, &str); 7] = [
            ("/camera", Image::NAME, good.clone(), "has no message of channel /dermis/stress; its channels: /camera"),
            (
                STRESS,
                "std_msgs/msg/String",
                good.clone(),
                "is a \"std_msgs/msg/String\", wanted \"sensor_msgs/msg/Image\"",
            ),
            (STRESS, Image::NAME, image("mono8", &[0; 6]), "encoding \"mono8\" is not available: 64FC1, 32FC1"),
            (STRESS, Image::NAME, image(DOUBLE, &[0; 40]), "40 bytes with 20 per row are not 2×3 pixels of 64FC1"),
            (STRESS, Image::NAME, image(DOUBLE, &bytes(infinite)), "row 1, column 1: inf is not a finite number"),
            (STRESS, Image::NAME, good[..50].to_vec(), "message 1: "),
            (STRESS, Image::NAME, vec![0, 1], "has 2 bytes, wanted CDR"),
        ];
        for (topic, schema, message, wanted) in cases {
            let messages =
                if topic == STRESS && schema == Image::NAME { vec![good.clone(), message] } else { vec![message] };
            let error = frames(&file(topic, schema, &messages), None).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
            if topic == STRESS {
                assert!(error.starts_with(&format!("{STRESS}, message {}: ", messages.len() - 1)), "{error}");
            }
        }
        let other = frames(&file(STRESS, Image::NAME, &[good]), Some([3, 2])).unwrap_err().to_string();
        assert_eq!(other, "/dermis/stress, message 0: 2×3 taxels, wanted 3×2");
    }

    #[test]
    fn every_file_that_ends_early_or_was_changed_is_an_error() {
        let whole = file(STRESS, Image::NAME, &vec![image(DOUBLE, &bytes(VALUES)); 3]);
        let text = std::fs::read(whole.path()).unwrap();
        let read = |bytes: &[u8]| {
            std::fs::write(whole.path(), bytes).unwrap();
            frames(&whole, None).map_err(|error| error.to_string())
        };
        assert_eq!(read(&text).unwrap().len(), 3);
        for length in 0..text.len() {
            let error = read(&text[..length]).unwrap_err();
            assert!(error == "is no MCAP file" || error.starts_with("ends early"), "{length}: {error}");
        }
        assert_eq!(read(b"0.1,0.2\n0.3,0.4\n").unwrap_err(), "is no MCAP file");
        let stored = VALUES[5].to_le_bytes();
        let at = text.windows(8).position(|bytes| bytes == stored).unwrap();
        let mut changed = text.clone();
        changed[at] ^= 1;
        assert!(read(&changed).unwrap_err().contains("CRC"));
    }
}
