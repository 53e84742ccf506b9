//! An MCAP file that is whole after every part that is written to it.
//!
//! ```text
//! header │ chunk │ chunk │ … │ end            end: of the data, without index; 50 bytes
//!                            └ overwritten by the next chunk and an end behind it
//! ```
//!
//! Whatever stops the program between two writes leaves a valid file without an index. A write that fails, as on a full disk, is
//! taken back: the end takes the place of what was begun, in blocks that the file already has. Only what is stopped within a
//! write, by a signal, leaves part of a chunk at the end. What a loss of power leaves is up to the operating system.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Error, ErrorKind, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, Writer};

use super::message::{Header, Image, Message};
use super::read::{DOUBLE, SINGLE};
use super::{RecordingError, EXACT, LIBRARY, STRESS};

/// What the records of a file that is not completed end with: DataEnd without check sum, Footer without index, the magic.
const END: &[u8] = &[
    0x0f, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, //
    0x02, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, //
    0x89, b'M', b'C', b'A', b'P', b'0', b'\r', b'\n',
];
/// What each channel offers its subscribers, as rosbag2 writes it: the last ten messages, reliably, to those that listen.
const OFFERED_QOS: &str = "\
- history: 1
  depth: 10
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// A type of messages.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    name: &'static str,
    hash: fn() -> String,
    schema: fn() -> String,
}

impl Kind {
    /// That of `M`.
    pub fn of<M: Message>() -> Kind {
        Kind { name: M::NAME, hash: M::hash, schema: M::schema }
    }
}

/// Number of the result that a message belongs to, and the time at which it is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Stamp {
    /// Number of the result.
    pub sequence: u64,
    /// Nanoseconds since 1970 when the result was ready.
    pub logged: u64,
}

/// A recording that is being written; errors have no file's name.
pub struct RecordingFile {
    writer: Writer<NoSeek<Whole>>,
    /// Number of each channel so far by its topic.
    channels: BTreeMap<String, u16>,
}

impl RecordingFile {
    /// Begins a new file with the channels of frames, which is a whole one at once.
    ///
    /// # Errors
    /// A file that exists or cannot be made or written.
    pub fn create(path: &Path) -> Result<RecordingFile, RecordingError> {
        let file = File::create_new(path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => RecordingError::new("exists already, and a recording is never written over"),
            _ => error.into(),
        })?;
        RecordingFile::begin(file)
    }

    /// The same in a file that is empty.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn begin(file: File) -> Result<RecordingFile, RecordingError> {
        let whole = Whole { file, pending: Vec::new(), length: 0, failed: false };
        let library = format!("{LIBRARY}{}", env!("CARGO_PKG_VERSION"));
        // A chunk is compressed in some tenths of a millisecond: threads of its own take longer to wake.
        let options = WriteOptions::new().compression(Some(Compression::Zstd)).compression_threads(0);
        // The level before the default takes half of its time for files that are a twentieth larger.
        let options = options.compression_level(2).disable_seeking(true).profile("ros2").library(library);
        let mut own = RecordingFile { writer: options.create(NoSeek::new(whole))?, channels: BTreeMap::new() };
        // Before every message, and in a recording without a frame too: a reader takes the exact values.
        for topic in [EXACT, STRESS] {
            own.channel(topic, Kind::of::<Image>())?;
        }
        own.flush()?;
        Ok(own)
    }

    /// Adds a message, which is in the file after the next [`RecordingFile::flush`].
    ///
    /// # Errors
    /// Too many channels; a file that failed before.
    pub fn message(&mut self, topic: &str, kind: Kind, stamp: Stamp, cdr: &[u8]) -> Result<(), RecordingError> {
        let channel_id = self.channel(topic, kind)?;
        let Stamp { sequence, logged } = stamp;
        // 32 bits, after which they begin again.
        let sequence = sequence as u32;
        let header = MessageHeader { channel_id, sequence, log_time: logged, publish_time: logged };
        Ok(self.writer.write_to_known_channel(&header, cdr)?)
    }

    /// Announces a channel, with its schema; returns its number.
    ///
    /// # Errors
    /// As [`RecordingFile::message`].
    fn channel(&mut self, topic: &str, Kind { name, hash, schema }: Kind) -> Result<u16, RecordingError> {
        if let Some(channel) = self.channels.get(topic) {
            return Ok(*channel);
        }
        let schema = self.writer.add_schema(name, "ros2msg", schema().as_bytes())?;
        let metadata = [("offered_qos_profiles", OFFERED_QOS.to_owned()), ("topic_type_hash", hash())];
        let metadata = metadata.map(|(key, value)| (key.to_owned(), value)).into();
        let channel = self.writer.add_channel(schema, topic, "cdr", &metadata)?;
        self.channels.insert(topic.to_owned(), channel);
        Ok(channel)
    }

    /// Ends the chunk and writes it to the file; after an error the file is as it was before, and takes no more.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        Ok(self.writer.flush()?)
    }

    /// Writes the index and completes the file.
    ///
    /// # Errors
    /// A file that cannot be written, which is as after the last flush.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner().completed()?)
    }
}

/// The messages of a frame of `rows` × `cols` readings in MPa, NaN where one is missing: channel and bytes of each.
///
/// # Errors
/// A header that CDR cannot represent.
pub fn frame_messages(
    [rows, cols]: [usize; 2],
    header: &Header,
    readings_MPa: &[f64],
) -> Result<[(&'static str, Vec<u8>); 2], RecordingError> {
    let exact: Vec<u8> = readings_MPa.iter().flat_map(|value| value.to_le_bytes()).collect();
    let rounded: Vec<u8> = readings_MPa.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    let image = |encoding: &str, data: &[u8]| {
        let (height, width, step) = (rows as u32, cols as u32, (data.len() / rows.max(1)) as u32);
        let image =
            Image { header: header.clone(), height, width, encoding: encoding.into(), is_bigendian: 0, step, data };
        image.to_cdr().map_err(RecordingError::new)
    };
    Ok([(EXACT, image(DOUBLE, &exact)?), (STRESS, image(SINGLE, &rounded)?)])
}

/// A file of whole records with an end behind them.
struct Whole {
    file: File,
    /// Whole records that are not in the file.
    pending: Vec<u8>,
    /// Bytes of those that are, without the end.
    length: u64,
    failed: bool,
}

impl Whole {
    /// Removes the end behind an index, which has its own.
    fn completed(self) -> std::io::Result<()> {
        self.file.set_len(self.length)?;
        self.file.sync_data()
    }

    /// Whether a write failed; the library would complete the file without what that one had.
    fn usable(&self) -> std::io::Result<()> {
        if self.failed {
            return Err(Error::other("a write failed before"));
        }
        Ok(())
    }
}

impl Write for Whole {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.usable()?;
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.usable()?;
        let bytes = self.pending.len() as u64;
        self.pending.extend_from_slice(END);
        // Not synchronised: a disk that takes a second for that would hold up what comes next.
        let appended = self.file.write_all_at(&self.pending, self.length);
        self.pending.clear();
        match appended {
            Ok(()) => self.length += bytes,
            Err(_) => {
                self.failed = true;
                // The blocks of the former end are still there. Where even that fails, the readers recover the file.
                let _ = self.file.write_all_at(END, self.length);
                let _ = self.file.set_len(self.length + END.len() as u64);
            }
        }
        appended
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::message::{from_cdr, Text};
    use crate::data::recording::{End, Messages};
    use mcap::records::Record;

    #[test]
    fn the_end_of_a_file_that_is_not_completed_has_no_index() {
        let options = mcap::sans_io::LinearReaderOptions::default().with_skip_start_magic(true);
        let mut reader = mcap::sans_io::LinearReader::new_with_options(options);
        reader.insert(END.len()).copy_from_slice(END);
        reader.notify_read(END.len());
        let mut records = Vec::new();
        while let Some(event) = reader.next_event() {
            let mcap::sans_io::LinearReadEvent::Record { data, opcode } = event.unwrap() else { panic!("too short") };
            records.push(mcap::parse_record(opcode, data).unwrap().into_owned());
        }
        let [Record::DataEnd(end), Record::Footer(footer)] = &records[..] else { panic!("{records:?}") };
        assert_eq!((end.data_section_crc, footer.summary_start, footer.summary_crc), (0, 0, 0));
    }

    fn texts(path: &Path) -> (Vec<String>, End) {
        let mut messages = Messages::open(path).unwrap();
        let mut texts = Vec::new();
        while let Some(message) = messages.next_message().unwrap() {
            texts.push(from_cdr::<Text>(&message.data).unwrap().data);
        }
        (texts, messages.end())
    }

    #[test]
    fn a_file_is_whole_after_every_flush_and_as_before_one_that_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text.mcap");
        let mut file = RecordingFile::create(&path).unwrap();
        assert_eq!(texts(&path), (vec![], End::Unfinished));
        let kind = Kind::of::<Text>();
        let add = |file: &mut RecordingFile, text: &str| {
            let cdr = Text { data: text.into() }.to_cdr().unwrap();
            file.message("/text", kind, Stamp { sequence: 0, logged: 1 }, &cdr).unwrap();
        };
        for count in 1..4 {
            add(&mut file, "pressed");
            assert_eq!(texts(&path).0.len(), count - 1);
            file.flush().unwrap();
            assert_eq!(texts(&path), (vec!["pressed".to_owned(); count], End::Unfinished));
        }
        let unfinished = std::fs::read(&path).unwrap();
        // The same file opened for reading: no byte can be written, and none is lost.
        let mut whole = Whole { file: File::open(&path).unwrap(), pending: vec![1; 9], length: 7, failed: false };
        assert!(whole.flush().is_err() && whole.flush().is_err() && whole.write(&[1]).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), unfinished);
        file.finish().unwrap();
        assert_eq!(texts(&path), (vec!["pressed".to_owned(); 3], End::Complete));
    }
}
