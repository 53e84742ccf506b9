//! The bytes of a file or stream as UTF-8 in lines that end with a line feed.

use std::io::{Read, Result};

/// Bytes that are read at once.
const PIECE: usize = 8192;

/// How characters are written.
#[derive(Clone, Copy)]
enum Units {
    /// One byte each, or several: handed on as they are.
    Bytes,
    /// Two bytes each, by the mark at the begin of the stream.
    Utf16(fn([u8; 2]) -> u16),
}

/// An input that is read as UTF-8 where its mark says UTF-16, each of whose lines ends with a line feed alone, whether it had a carriage
/// return, a line feed or both.
pub struct Decoded<R> {
    input: R,
    /// `None` before the first two bytes.
    units: Option<Units>,
    /// Bytes that were read and wait for those behind them.
    rest: Vec<u8>,
    /// What is to be handed on, from `at` on.
    ready: Vec<u8>,
    at: usize,
    /// The last character, if it has ended a line and the other one may follow that belongs to it.
    end: Option<u8>,
}

impl<R: Read> Decoded<R> {
    /// The bytes of an input.
    pub fn new(input: R) -> Decoded<R> {
        Decoded { input, units: None, rest: Vec::new(), ready: Vec::new(), at: 0, end: None }
    }

    /// Reads the next piece; false at the end.
    fn fill(&mut self) -> Result<bool> {
        let before = self.rest.len();
        self.rest.resize(before + PIECE, 0);
        let read = self.input.read(&mut self.rest[before..]);
        self.rest.truncate(before + *read.as_ref().unwrap_or(&0));
        let is_end = read? == 0;
        let bytes = std::mem::take(&mut self.rest);
        let units = match (self.units, &bytes[..]) {
            (Some(units), _) => units,
            (None, [0xff, 0xfe, ..]) => Units::Utf16(u16::from_le_bytes),
            (None, [0xfe, 0xff, ..]) => Units::Utf16(u16::from_be_bytes),
            (None, [0xfe | 0xff]) if !is_end => {
                self.rest = bytes;
                return Ok(true);
            }
            (None, _) => Units::Bytes,
        };
        self.units = self.units.or(Some(units).filter(|_| !bytes.is_empty()));
        match units {
            // Nearly all are so.
            Units::Bytes if !bytes.contains(&b'\r') && self.end != Some(b'\r') => {
                self.end =
                    bytes.last().copied().filter(|byte| *byte == b'\n').or(self.end.filter(|_| bytes.is_empty()));
                // The room of both is used again.
                self.rest = std::mem::replace(&mut self.ready, bytes);
            }
            Units::Bytes => bytes.into_iter().for_each(|byte| self.push(byte)),
            Units::Utf16(of) => {
                let mut pairs = bytes.chunks_exact(2);
                for pair in pairs.by_ref() {
                    // Half of a pair is a character beyond those that a number has.
                    let own = char::from_u32(of([pair[0], pair[1]]).into()).unwrap_or(char::REPLACEMENT_CHARACTER);
                    own.encode_utf8(&mut [0; 4]).bytes().for_each(|byte| self.push(byte));
                }
                self.rest = pairs.remainder().to_vec();
            }
        }
        Ok(!is_end)
    }

    fn push(&mut self, byte: u8) {
        let is_end = matches!(byte, b'\r' | b'\n');
        if is_end && self.end.is_some_and(|before| before != byte) {
            self.end = None;
            return;
        }
        self.end = Some(byte).filter(|_| is_end);
        self.ready.push(if is_end { b'\n' } else { byte });
    }
}

impl<R: Read> Read for Decoded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        while self.at == self.ready.len() && !buffer.is_empty() {
            self.at = 0;
            self.ready.clear();
            if !self.fill()? && self.ready.is_empty() {
                return Ok(0);
            }
        }
        let bytes = (&self.ready[self.at..]).read(buffer)?;
        self.at += bytes;
        Ok(bytes)
    }
}

/// The text of a file: UTF-8, or UTF-16 where its mark says so, else Latin-1; without the mark, and each line ends with a line feed.
///
/// ```
/// use dermis_golden::data::text::decoded;
///
/// let utf_16: Vec<u8> = "\u{feff}1\t2\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
/// assert_eq!(decoded(&utf_16), "1\t2\n");
/// assert_eq!([decoded(b"1,2\r3,4\r"), decoded(b"5 \xb0C\r\n")], ["1,2\n3,4\n", "5 °C\n"]);
/// ```
pub fn decoded(bytes: &[u8]) -> String {
    let mut lines = Vec::with_capacity(bytes.len());
    // Bytes in memory can be read.
    let _ = Decoded::new(bytes).read_to_end(&mut lines);
    match String::from_utf8(lines) {
        Ok(text) => text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text),
        Err(other) => other.into_bytes().into_iter().map(char::from).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};

    /// One byte at a time.
    struct Slow<'a>(&'a [u8]);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
            let most = buffer.len().min(1);
            self.0.read(&mut buffer[..most])
        }
    }

    #[test]
    fn every_encoding_and_end_of_a_line_gives_the_same_lines() {
        let utf_16 =
            |of: fn(u16) -> [u8; 2]| "\u{feff}1,2 µ\r\n3,4\r\n".encode_utf16().flat_map(of).collect::<Vec<u8>>();
        let texts = [
            "1,2 µ\n3,4\n".into(),
            "1,2 µ\r\n3,4\r\n".into(),
            "1,2 µ\n\r3,4\n\r".into(),
            "1,2 µ\r3,4\r".into(),
            utf_16(u16::to_le_bytes),
            utf_16(u16::to_be_bytes),
        ];
        for bytes in texts {
            let bytes: Vec<u8> = bytes;
            let whole: Vec<String> =
                BufReader::new(Decoded::new(&bytes[..])).lines().map(|line| line.unwrap()).collect();
            let slow: Vec<String> =
                BufReader::new(Decoded::new(Slow(&bytes))).lines().map(|line| line.unwrap()).collect();
            assert_eq!(whole, slow);
            let whole: Vec<&str> = whole.iter().map(|line| line.trim_start_matches('\u{feff}')).collect();
            assert_eq!(whole, ["1,2 µ", "3,4"], "{bytes:?}");
        }
        // Blank lines count, and an end of a line is handed on at once.
        let mut text = String::new();
        Decoded::new(&b"1\r\n\r\n2\r\r3"[..]).read_to_string(&mut text).unwrap();
        assert_eq!(text, "1\n\n2\n\n3");
    }
}
