//! Records of an MCAP file in its order, those of a chunk in the place of the chunk.
//!
//! ```text
//! magic, record, record, …, footer, magic          record: opcode, length of 64 bits, content
//! chunk: times, size, CRC-32, compression, length, records
//! ```
//! Memory is taken as bytes come: of a length that is wrong no more than the file holds, of a chunk's frames no more than windows of
//! 8 MiB, which the specification of zstd asks of a decoder (RFC 8878, section 3.1.1.1.2).

use std::io::{BufReader, Cursor, ErrorKind, Read};

use mcap::records::op;
use mcap::MAGIC;

use super::RecordingError;

type Result<T> = std::result::Result<T, RecordingError>;

/// Longest record in bytes that is taken.
const LONGEST: u64 = 1 << 28;
/// log2 of the largest window of zstd in bytes.
const WINDOW_LOG: u32 = 23;
/// Bytes of a record's opcode and length.
const HEAD: u64 = 9;

/// What comes next in a file.
pub(super) enum Next {
    /// A record: its opcode and its content.
    Record(u8, Vec<u8>),
    /// The end of the file.
    End,
    /// The file ends within a record, or without its end.
    Cut,
}

/// The records of a file; errors have no file's name.
pub(super) struct Records {
    file: Box<dyn Read + Send>,
    at: At,
    chunk: Option<Chunk>,
}

/// Where a file is read.
enum At {
    Begin,
    Records,
    /// Behind the last record.
    Footer,
    End,
}

/// A chunk whose records are read.
struct Chunk {
    records: Counted,
    /// Bytes and CRC-32 that its head states; a CRC of 0 is none.
    size: u64,
    crc: u32,
    /// The file ends within it.
    cut: bool,
}

/// Counts what is read, and takes its CRC.
struct Counted {
    inner: Box<dyn Read + Send>,
    count: u64,
    crc: crc32fast::Hasher,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.count += read as u64;
        self.crc.update(&buffer[..read]);
        Ok(read)
    }
}

/// Up to `length` bytes: fewer at the end of the input.
fn bytes(input: &mut dyn Read, length: u64) -> std::io::Result<Vec<u8>> {
    let mut all = Vec::new();
    input.take(length).read_to_end(&mut all).map(|_| all)
}

/// The next record of `input` as far as it is there, and whether all of it is; `None` at the end.
fn record(input: &mut dyn Read) -> std::io::Result<Option<(u8, Vec<u8>, bool)>> {
    let head = bytes(input, HEAD)?;
    let Some((&opcode, length)) = head.split_first() else { return Ok(None) };
    let Ok(length) = length.try_into().map(u64::from_le_bytes) else { return Ok(Some((opcode, Vec::new(), false))) };
    if length > LONGEST {
        return Err(std::io::Error::other(format!("a record has {length} bytes; at most {LONGEST} are read")));
    }
    let content = bytes(input, length)?;
    let whole = content.len() as u64 == length;
    Ok(Some((opcode, content, whole)))
}

impl Chunk {
    /// That of a record's content, all of it or what stands before the file's `cut`; `None` where it has no whole head.
    fn of(content: Vec<u8>, cut: bool) -> Result<Option<Chunk>> {
        let mut rest = Cursor::new(content);
        let mut number = |bytes: usize| -> Option<u64> {
            let mut number = [0; 8];
            rest.read_exact(&mut number[..bytes]).ok().map(|()| u64::from_le_bytes(number))
        };
        let head = [8, 8, 8, 4, 4].map(&mut number);
        let [Some(_), Some(_), Some(size), Some(crc), Some(length)] = head else { return Ok(None) };
        let name = bytes(&mut rest, length)?;
        if name.len() as u64 != length || bytes(&mut rest, 8)?.len() != 8 {
            return Ok(None);
        }
        let inner: Box<dyn Read + Send> = match name.as_slice() {
            b"" => Box::new(rest),
            b"zstd" => {
                let mut decoder = zstd::stream::read::Decoder::with_buffer(rest)?;
                decoder.window_log_max(WINDOW_LOG)?;
                Box::new(BufReader::new(decoder))
            }
            b"lz4" => Box::new(BufReader::new(lz4::Decoder::new(rest)?)),
            other => {
                let name = String::from_utf8_lossy(other).into_owned();
                return Err(RecordingError::new(format!(
                    "its chunks are compressed by {name}: zstd, lz4 and files without compression are read"
                )));
            }
        };
        let records = Counted { inner, count: 0, crc: crc32fast::Hasher::new() };
        Ok(Some(Chunk { records, size, crc: crc as u32, cut }))
    }

    /// Its next record; `None` at its end.
    fn next(&mut self) -> Result<Option<Next>> {
        match record(&mut self.records) {
            Ok(Some((opcode, content, true))) => Ok(Some(Next::Record(opcode, content))),
            Ok(_) if self.cut => Ok(Some(Next::Cut)),
            Ok(Some(_)) => Err(RecordingError::new("a chunk ends within a record")),
            Ok(None) => self.checked().map(|()| None),
            Err(error) if self.cut && error.kind() == ErrorKind::UnexpectedEof => Ok(Some(Next::Cut)),
            Err(error) => Err(RecordingError::new(format!("a chunk cannot be read: {error}"))),
        }
    }

    /// Compares what was read with its head.
    fn checked(&mut self) -> Result<()> {
        let (count, crc) = (self.records.count, self.records.crc.clone().finalize());
        if count != self.size {
            return Err(RecordingError::new(format!("a chunk has {count} bytes, its head says {}", self.size)));
        }
        match self.crc == 0 || self.crc == crc {
            true => Ok(()),
            false => Err(RecordingError::new("a chunk's CRC is wrong: it was changed after it was recorded")),
        }
    }
}

impl Records {
    /// Those in the bytes of a file.
    pub fn of(file: impl Read + Send + 'static) -> Records {
        Records { file: Box::new(BufReader::new(file)), at: At::Begin, chunk: None }
    }

    /// What comes next.
    ///
    /// # Errors
    /// What is no MCAP or was changed; a file that cannot be read.
    pub fn next(&mut self) -> Result<Next> {
        loop {
            if let Some(chunk) = &mut self.chunk {
                match chunk.next()? {
                    Some(next) => return Ok(next),
                    None => self.chunk = None,
                }
            }
            match self.at {
                At::Begin => match bytes(&mut self.file, MAGIC.len() as u64)? {
                    magic if magic == MAGIC => self.at = At::Records,
                    _ => return Err(no_mcap()),
                },
                At::Records => match record(&mut self.file)? {
                    Some((op::CHUNK, content, whole)) => match Chunk::of(content, !whole)? {
                        Some(chunk) => self.chunk = Some(chunk),
                        None if whole => return Err(RecordingError::new("a chunk has no head")),
                        None => return Ok(Next::Cut),
                    },
                    Some((opcode, content, true)) => {
                        self.at = if opcode == op::FOOTER { At::Footer } else { At::Records };
                        return Ok(Next::Record(opcode, content));
                    }
                    Some((_, _, false)) | None => return Ok(Next::Cut),
                },
                At::End => return Ok(Next::End),
                At::Footer => match bytes(&mut self.file, MAGIC.len() as u64)? {
                    magic if magic == MAGIC => self.at = At::End,
                    magic if magic.len() < MAGIC.len() => return Ok(Next::Cut),
                    _ => return Err(no_mcap()),
                },
            }
        }
    }
}

/// That a file has not the form of an MCAP file.
pub(super) fn no_mcap() -> RecordingError {
    RecordingError::new("is no MCAP file")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record.
    fn of(opcode: u8, content: &[u8]) -> Vec<u8> {
        [&[opcode][..], &(content.len() as u64).to_le_bytes(), content].concat()
    }

    /// A chunk that states these bytes and this CRC.
    fn chunk(compression: &str, size: u64, crc: u32, records: &[u8]) -> Vec<u8> {
        let name = compression.as_bytes();
        let head = [&[0; 16], &size.to_le_bytes()[..], &crc.to_le_bytes(), &(name.len() as u32).to_le_bytes(), name];
        of(op::CHUNK, &[&head.concat(), &(records.len() as u64).to_le_bytes()[..], records].concat())
    }

    /// Opcodes and contents of the records of a file, and whether it has its end.
    type Read = std::result::Result<(Vec<(u8, Vec<u8>)>, bool), String>;

    fn read(records: &[Vec<u8>]) -> Read {
        let file = [MAGIC, &records.concat(), MAGIC].concat();
        let (mut read, mut all) = (Records::of(Cursor::new(file)), Vec::new());
        loop {
            match read.next().map_err(|error| error.to_string())? {
                Next::Record(opcode, content) => all.push((opcode, content)),
                Next::End => return Ok((all, true)),
                Next::Cut => return Ok((all, false)),
            }
        }
    }

    #[test]
    fn records_of_chunks_stand_in_their_place() {
        let inner = [of(op::MESSAGE, b"one"), of(op::MESSAGE, b"two")].concat();
        let (size, crc) = (inner.len() as u64, crc32fast::hash(&inner));
        let mut lz4 = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
        std::io::Write::write_all(&mut lz4, &inner).unwrap();
        let packed = [("", inner.clone()), ("zstd", zstd::encode_all(&inner[..], 3).unwrap()), ("lz4", lz4.finish().0)];
        for (name, packed) in packed {
            for crc in [0, crc] {
                let (all, ends) = read(&[chunk(name, size, crc, &packed), of(op::FOOTER, b"end")]).unwrap();
                let expected = [(op::MESSAGE, &b"one"[..]), (op::MESSAGE, b"two"), (op::FOOTER, b"end")];
                assert!(ends && all.iter().map(|(opcode, own)| (*opcode, &own[..])).eq(expected), "{name}: {all:?}");
            }
            let wrong = |size, crc| read(&[chunk(name, size, crc, &packed), of(op::FOOTER, b"")]).unwrap_err();
            assert!(wrong(size, crc ^ 1).contains("CRC is wrong"));
            assert!(wrong(size + 1, 0).contains(&format!("a chunk has {size} bytes, its head says {}", size + 1)));
        }
        assert!(read(&[chunk("brotli", 0, 0, b"")]).unwrap_err().contains("its chunks are compressed by brotli"));
    }

    /// Of a length that is wrong no memory is taken, nor for a window that a few bytes ask for.
    #[test]
    fn lengths_and_windows_that_are_wrong_are_errors() {
        let longer = |length: u64| [&[op::MESSAGE][..], &length.to_le_bytes(), b"few"].concat();
        assert!(read(&[longer(LONGEST + 1)]).unwrap_err().contains("at most 268435456 are read"));
        assert_eq!(read(&[longer(LONGEST)]).unwrap(), (vec![], false));
        let error = read(&[chunk("", 12, 0, &longer(LONGEST)), of(op::FOOTER, b"")]).unwrap_err();
        assert!(error.contains("a chunk ends within a record"), "{error}");
        // A frame of zstd with a block of no bytes.
        let frame = |log: u8| [0x28, 0xb5, 0x2f, 0xfd, 0x00, (log - 10) << 3, 0x01, 0x00, 0x00];
        assert!(read(&[chunk("zstd", 0, 0, &frame(23)), of(op::FOOTER, b"")]).unwrap().1);
        for log in [24, 27, 31, 41] {
            let error = read(&[chunk("zstd", 0, 0, &frame(log)), of(op::FOOTER, b"")]).unwrap_err();
            assert!(error.contains("a chunk cannot be read"), "2^{log}: {error}");
        }
    }
}
