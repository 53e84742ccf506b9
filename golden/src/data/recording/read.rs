//! Messages of an MCAP file in its order, and the frames among them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use mcap::records::{op, Record};

use super::message::{from_cdr, Image, Message};
use super::records::{no_mcap, Next, Records};
use super::{RecordingError, EXACT, LIBRARY, STRESS};
use crate::data::number::{NumberFormat, NumberKind};

type Result<T> = std::result::Result<T, RecordingError>;

/// Encoding of an image with a 64-bit value per pixel.
pub(super) const DOUBLE: &str = "64FC1";
/// Encoding of an image with a 32-bit value per pixel.
pub(super) const SINGLE: &str = "32FC1";
/// Encodings of images with one value per pixel: kind and bytes of the value.
const ENCODINGS: [(&str, NumberKind, usize); 9] = [
    (DOUBLE, NumberKind::Float, 8),
    (SINGLE, NumberKind::Float, 4),
    ("8UC1", NumberKind::Unsigned, 1),
    ("8SC1", NumberKind::Signed, 1),
    ("16UC1", NumberKind::Unsigned, 2),
    ("16SC1", NumberKind::Signed, 2),
    ("32SC1", NumberKind::Signed, 4),
    ("mono8", NumberKind::Unsigned, 1),
    ("mono16", NumberKind::Unsigned, 2),
];
/// Records that are read, of those that the parser knows.
const READ: [u8; 5] = [op::HEADER, op::FOOTER, op::SCHEMA, op::CHANNEL, op::MESSAGE];

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

impl Recorded {
    /// The message, if it is of the type `M`.
    ///
    /// # Errors
    /// Another type, bytes that are not of this one, in words.
    pub fn decoded<'a, M: Message + serde::Deserialize<'a>>(&'a self) -> std::result::Result<M, String> {
        match self.schema == M::NAME {
            true => from_cdr(&self.data),
            false => Err(format!("is a {:?}, wanted {:?}", self.schema, M::NAME)),
        }
    }
}

/// How a file ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// As its recorder completed it; or it is not read to its end.
    Complete,
    /// After a whole record, by a recorder of Dermis that was ended.
    Unfinished,
    /// Within a record, or without an end.
    Cut,
}

impl End {
    /// What is to be said of it.
    pub fn words(self) -> Option<&'static str> {
        match self {
            End::Complete => None,
            End::Unfinished => {
                Some("was not completed: its recorder was ended, or its disk was full; what it had written is whole")
            }
            End::Cut => Some("ends early: what stands before the cut is read"),
        }
    }
}

/// A channel of a file.
struct Channel {
    topic: String,
    schema: u16,
}

/// The messages of a file; errors have no file's name.
pub struct Messages {
    records: Records,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    /// Whether a recorder of Dermis has written it; `None` before its header.
    own: Option<bool>,
    end: End,
}

impl Messages {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn open(path: &Path) -> Result<Messages> {
        Ok(Messages::of(File::open(path)?))
    }

    /// The messages in the bytes of a file.
    pub fn of(file: impl Read + Send + 'static) -> Messages {
        let (schemas, channels) = (BTreeMap::new(), BTreeMap::new());
        Messages { records: Records::of(file), schemas, channels, own: None, end: End::Complete }
    }

    /// The next message; `None` at the end of the file, of which [`Messages::end`] knows more.
    ///
    /// # Errors
    /// What is no MCAP or was changed.
    pub fn next_message(&mut self) -> Result<Option<Recorded>> {
        loop {
            if self.end == End::Cut {
                return Ok(None);
            }
            let (opcode, data) = match self.records.next()? {
                Next::Record(opcode, data) => (opcode, data),
                Next::End => return Ok(None),
                // A file that is cut before its header may be anything.
                Next::Cut if self.own.is_none() => return Err(no_mcap()),
                Next::Cut => {
                    self.end = End::Cut;
                    return Ok(None);
                }
            };
            if !READ.contains(&opcode) {
                continue;
            }
            if !lengths_fit(opcode, &data) {
                return Err(RecordingError::new("a record has a text or list that is longer than the record"));
            }
            match mcap::parse_record(opcode, &data)? {
                Record::Header(header) => self.own = Some(header.library.starts_with(LIBRARY)),
                Record::Footer(footer) if footer.summary_start == 0 && self.own == Some(true) => {
                    self.end = End::Unfinished;
                }
                Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
                Record::Channel(own) => {
                    drop(self.channels.insert(own.id, Channel { topic: own.topic, schema: own.schema_id }));
                }
                Record::Message { header, data } => {
                    let unknown = || {
                        RecordingError::new(format!(
                            "a message is of channel {}, which is not described",
                            header.channel_id
                        ))
                    };
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

    /// How the file ends, once there is no further message.
    pub fn end(&self) -> End {
        self.end
    }

    /// Whether a channel is announced so far.
    fn has(&self, topic: &str) -> bool {
        self.channels.values().any(|channel| channel.topic == topic)
    }

    /// That no message of a channel was found, with the names and types of those that are announced.
    pub fn without(&self, topic: &str) -> RecordingError {
        let named = |own: &Channel| match self.schemas.get(&own.schema) {
            Some(schema) => format!("{} ({schema})", own.topic),
            None => own.topic.clone(),
        };
        let topics: Vec<String> = self.channels.values().map(named).collect();
        let topics = if topics.is_empty() { "none".into() } else { topics.join(", ") };
        RecordingError::new(format!("has no message of channel {topic}; its channels: {topics}"))
    }
}

/// Whether the texts and lists of a record, each behind its length, end within it; the parser takes memory for any length.
fn lengths_fit(opcode: u8, data: &[u8]) -> bool {
    // Numbers in front of the texts, and how many there are.
    let (numbers, count) = match opcode {
        op::HEADER => (0, 2),
        op::SCHEMA => (2, 3),
        op::CHANNEL => (4, 3),
        _ => return true,
    };
    let next = |rest: &'_ [u8]| -> Option<usize> {
        let length = u32::from_le_bytes(rest.first_chunk().copied()?) as usize;
        Some(4 + length).filter(|end| *end <= rest.len())
    };
    let Some(mut rest) = data.get(numbers..) else { return false };
    let mut last = rest;
    for _ in 0..count {
        let Some(end) = next(rest) else { return false };
        (last, rest) = (&rest[4..end], &rest[end..]);
    }
    // The last of a channel is a list of texts.
    while opcode == op::CHANNEL && !last.is_empty() {
        let Some(end) = next(last) else { return false };
        last = &last[end..];
    }
    true
}

/// One recorded frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// Nanoseconds since 1970 when it was acquired.
    pub time_ns: u64,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Stress of each taxel in MPa, row-major; NaN where a reading is missing.
    pub stress_MPa: Vec<f64>,
}

/// Which images are frames, and how they are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameOptions {
    /// Rows and columns of all frames; those of the first one if not given.
    pub shape: Option<[usize; 2]>,
    /// Channel; if not given [`EXACT`], or [`STRESS`] in a file without that.
    pub topic: Option<String>,
    /// Stress of one count in MPa, for images of integers.
    pub MPa_per_count: Option<f64>,
}

/// The frames of a file; errors have no file's name.
pub struct Frames {
    messages: Messages,
    options: FrameOptions,
    count: u64,
}

impl Frames {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn open(path: &Path, options: FrameOptions) -> Result<Frames> {
        Ok(Frames { messages: Messages::open(path)?, options, count: 0 })
    }

    /// The frames in the bytes of a file.
    pub fn of(file: impl Read + Send + 'static, options: FrameOptions) -> Frames {
        Frames { messages: Messages::of(file), options, count: 0 }
    }

    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// As [`Messages::next_message`]; a file without frames, a message that is none, another shape: with channel and number.
    pub fn next_frame(&mut self) -> Result<Option<RecordedFrame>> {
        while let Some(message) = self.messages.next_message()? {
            if self.options.topic.is_none() && [EXACT, STRESS].contains(&message.topic.as_str()) {
                let topic = if self.messages.has(EXACT) { EXACT } else { STRESS };
                self.options.topic = Some(topic.to_owned());
            }
            if self.options.topic.as_ref() != Some(&message.topic) {
                continue;
            }
            let (topic, number) = (&message.topic, self.count);
            let frame = self
                .frame(&message)
                .map_err(|error| RecordingError::new(format!("{topic}, message {number}: {error}")))?;
            self.count += 1;
            return Ok(Some(frame));
        }
        match self.count {
            // What is missing may have had frames.
            0 if self.end() == End::Cut => Ok(None),
            0 if self.options.topic.is_some() || self.messages.has(STRESS) => {
                Err(self.messages.without(self.options.topic.as_deref().unwrap_or(STRESS)))
            }
            0 => {
                let without = self.messages.without(STRESS);
                Err(RecordingError::new(format!("{without}; --topic takes an image of another one")))
            }
            _ => Ok(None),
        }
    }

    /// How the file ends, once there is no further frame.
    pub fn end(&self) -> End {
        self.messages.end()
    }

    fn frame(&mut self, message: &Recorded) -> std::result::Result<RecordedFrame, String> {
        let image: Image = message.decoded()?;
        let Some((_, kind, width)) = ENCODINGS.into_iter().find(|(name, ..)| *name == image.encoding) else {
            let names = ENCODINGS.map(|(name, ..)| name).join(", ");
            return Err(format!("encoding {:?} is not available: {names}", image.encoding));
        };
        let scale = match (kind, self.options.MPa_per_count) {
            (NumberKind::Float, _) => 1.0,
            (_, Some(MPa)) => MPa,
            (_, None) => {
                return Err(format!(
                    "pixels of {} are counts without a unit: give the stress of one count, dermis replay --mpa-per-count MPA",
                    image.encoding
                ))
            }
        };
        let shape = [image.height as usize, image.width as usize];
        let (row, step) = (width.saturating_mul(shape[1]), image.step as usize);
        if shape.contains(&0) || step < row || Some(image.data.len()) != step.checked_mul(shape[0]) {
            let (rows, cols, bytes) = (shape[0], shape[1], image.data.len());
            return Err(format!(
                "{bytes} bytes with {step} per row are not {rows}×{cols} pixels of {}",
                image.encoding
            ));
        }
        let wanted = *self.options.shape.get_or_insert(shape);
        if wanted != shape {
            return Err(format!("{}×{} taxels, wanted {}×{}", shape[0], shape[1], wanted[0], wanted[1]));
        }
        let number = NumberFormat { kind, width, big_endian: image.is_bigendian != 0 };
        let rows = image.data.chunks_exact(step);
        let pixels = rows.flat_map(|own| own[..row].chunks_exact(width).map(|bytes| number.value(bytes)));
        let stress_MPa: Vec<f64> = pixels.map(|value| value * scale).collect();
        if let Some(taxel) = stress_MPa.iter().position(|stress| stress.is_infinite()) {
            let (row, col) = (taxel / shape[1], taxel % shape[1]);
            return Err(format!("row {row}, column {col}: {} is not a finite number", stress_MPa[taxel]));
        }
        Ok(RecordedFrame { time_ns: image.header.stamp.nanoseconds(), shape, stress_MPa })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::message::{Header, Time};
    use mcap::records::MessageHeader;
    use mcap::Compression;
    use mcap::{WriteOptions, Writer};
    use std::io::Cursor;

    /// An image of 2×3 taxels.
    fn image(encoding: &str, data: &[u8]) -> Vec<u8> {
        ordered(encoding, 0, data)
    }

    fn ordered(encoding: &str, is_bigendian: u8, data: &[u8]) -> Vec<u8> {
        let header = Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: String::new() };
        let (encoding, step) = (encoding.to_owned(), (data.len() / 2) as u32);
        Image { header, height: 2, width: 3, encoding, is_bigendian, step, data }.to_cdr().unwrap()
    }

    /// A file with messages of a type on a channel.
    fn file(topic: &str, schema: &str, messages: &[Vec<u8>]) -> tempfile::NamedTempFile {
        compressed(None, topic, schema, messages)
    }

    fn compressed(
        compression: Option<Compression>,
        topic: &str,
        schema: &str,
        messages: &[Vec<u8>],
    ) -> tempfile::NamedTempFile {
        let mut writer: Writer<Cursor<Vec<u8>>> =
            WriteOptions::new().compression(compression).create(Cursor::new(Vec::new())).unwrap();
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
        read(file, FrameOptions { shape, ..FrameOptions::default() })
    }

    fn read(file: &tempfile::NamedTempFile, options: FrameOptions) -> Result<Vec<RecordedFrame>> {
        let mut frames = Frames::open(file.path(), options)?;
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
        assert_eq!((read[0].time_ns, read[0].shape), (1_000_000_002, [2, 3]));
    }

    #[test]
    fn integers_big_endian_values_and_compressed_files_are_read() {
        let counts: [i64; 6] = [0, 1, 100, 127, 3, 42];
        for (encoding, kind, width) in ENCODINGS {
            for big_endian in [false, true] {
                let data: Vec<u8> = counts
                    .iter()
                    .flat_map(|count| {
                        let word = match (kind, width) {
                            (NumberKind::Float, 4) => u64::from((*count as f32).to_bits()),
                            (NumberKind::Float, _) => (*count as f64).to_bits(),
                            _ => *count as u64,
                        };
                        let mut bytes = word.to_le_bytes()[..width].to_vec();
                        if big_endian {
                            bytes.reverse();
                        }
                        bytes
                    })
                    .collect();
                for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
                    let message = ordered(encoding, u8::from(big_endian), &data);
                    let file = compressed(compression, "/tactile/left", Image::NAME, &[message]);
                    let scale = 0.5;
                    let options = FrameOptions {
                        topic: Some("/tactile/left".into()),
                        MPa_per_count: Some(scale),
                        ..FrameOptions::default()
                    };
                    let scale = if kind == NumberKind::Float { 1.0 } else { scale };
                    let wanted: Vec<f64> = counts.iter().map(|count| *count as f64 * scale).collect();
                    assert_eq!(read(&file, options.clone()).unwrap()[0].stress_MPa, wanted, "{encoding}");
                    if kind != NumberKind::Float {
                        let error =
                            read(&file, FrameOptions { MPa_per_count: None, ..options }).unwrap_err().to_string();
                        assert!(error.contains("counts without a unit"), "{error}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_frame_is_named_with_channel_and_number() {
        let good = image(DOUBLE, &bytes(VALUES));
        let mut infinite = VALUES;
        infinite[4] = f64::INFINITY;
        let cases: [(&str, &str, Vec<u8>, &str); 7] = [
            ("/camera", Image::NAME, good.clone(), "has no message of channel /dermis/stress; its channels: /camera (sensor_msgs/msg/Image); --topic takes"),
            (
                STRESS,
                "std_msgs/msg/String",
                good.clone(),
                "is a \"std_msgs/msg/String\", wanted \"sensor_msgs/msg/Image\"",
            ),
            (STRESS, Image::NAME, image("rgb8", &[0; 6]), "encoding \"rgb8\" is not available: 64FC1, 32FC1, 8UC1"),
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
    fn a_file_that_ends_early_gives_what_is_whole_and_a_changed_one_an_error() {
        let whole = file(STRESS, Image::NAME, &vec![image(DOUBLE, &bytes(VALUES)); 3]);
        let text = std::fs::read(whole.path()).unwrap();
        let read = |bytes: &[u8]| -> std::result::Result<(usize, End), String> {
            std::fs::write(whole.path(), bytes).unwrap();
            let mut messages = Messages::open(whole.path()).unwrap();
            let mut count = 0;
            loop {
                match messages.next_message().map_err(|error| error.to_string())? {
                    Some(message) => assert_eq!(message.data, image(DOUBLE, &super::tests::bytes(VALUES))),
                    None => return Ok((count, messages.end())),
                }
                count += 1;
            }
        };
        assert_eq!(read(&text), Ok((3, End::Complete)));
        for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
            let own = compressed(compression, STRESS, Image::NAME, &vec![image(DOUBLE, &bytes(VALUES)); 3]);
            let text = std::fs::read(own.path()).unwrap();
            assert_eq!(read(&text), Ok((3, End::Complete)));
            let mut least = 0;
            for length in 0..text.len() {
                match read(&text[..length]) {
                    Err(error) => assert_eq!((error.as_str(), least), ("is no MCAP file", 0)),
                    Ok((count, end)) => {
                        assert!(count >= least && end == End::Cut, "{compression:?} {length}: {count}, {end:?}");
                        least = count;
                    }
                }
            }
            assert_eq!(least, 3, "{compression:?}");
        }
        assert_eq!(read(b"0.1,0.2\n0.3,0.4\n").unwrap_err(), "is no MCAP file");
        let stored = VALUES[5].to_le_bytes();
        let at = text.windows(8).position(|bytes| bytes == stored).unwrap();
        let mut changed = text.clone();
        changed[at] ^= 1;
        std::fs::write(whole.path(), changed).unwrap();
        assert!(frames(&whole, None).unwrap_err().to_string().contains("CRC"));
    }
}
