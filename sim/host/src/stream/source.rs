//! Where lines come from: standard input, a file that grows, a serial port, UDP; all are read as bytes.
//!
//! | written | source | ends | while nothing reads it |
//! |---|---|---|---|
//! | `-` | standard input | with it | waits |
//! | `udp:HOST:PORT`, `udp://HOST:PORT` | datagrams of one or more whole lines, sent to this address | never | loses lines |
//! | a character device, perhaps as `serial:PATH` | a serial port, from its first end of a line on | with an error, when it is unplugged | loses lines |
//! | a regular file | the file from its start, then what is added; from the start again, with a word, if it becomes shorter or another file takes its name | never | waits |
//! | a pipe | the pipe | with it | waits |

use dermis_flow::say;
use std::fs::File;
use std::io::{Cursor, Error, ErrorKind, Read, Result, Seek};
use std::net::UdpSocket;
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// How often a file that grows is looked at.
const POLL: Duration = Duration::from_millis(5);
/// Wait for a byte of a serial port, after which it is tried again.
const SERIAL_WAIT: Duration = Duration::from_millis(200);
/// Largest datagram in bytes.
pub(crate) const DATAGRAM: usize = 1 << 16;

/// A source as it is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// `-`
    StandardInput,
    /// `udp:HOST:PORT`
    Udp(String),
    /// A file, a pipe or a serial port.
    Path(String),
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Source, String> {
        if let Some(path) = text.strip_prefix("serial:") {
            return Ok(Source::Path(path.to_owned()));
        }
        match text.strip_prefix("udp:").map(|address| address.strip_prefix("//").unwrap_or(address)) {
            Some(address) if address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()) => {
                Ok(Source::Udp(address.to_owned()))
            }
            Some(address) => Err(format!("udp:{address}: wanted udp:HOST:PORT")),
            None if text == "-" => Ok(Source::StandardInput),
            None => Ok(Source::Path(text.to_owned())),
        }
    }
}

impl Source {
    /// Opens the source; `baud` is the bit rate of a serial port, which only that needs. Of UDP also the address at which it listens.
    ///
    /// # Errors
    /// The error of the operating system, with the source's name.
    pub fn open(&self, baud: Option<u32>) -> Result<(Box<dyn Read + Send>, Option<std::net::SocketAddr>)> {
        let named = |name: &str, error: Error| Error::new(error.kind(), format!("{name}: {error}"));
        match self {
            Source::StandardInput => Ok((Box::new(std::io::stdin()), None)),
            Source::Udp(address) => {
                let socket = UdpSocket::bind(address).map_err(|error| named(address, error))?;
                let local = socket.local_addr().ok();
                Ok((Box::new(Datagrams { socket, line: Cursor::default() }), local))
            }
            Source::Path(path) => {
                let kind = std::fs::metadata(path).map_err(|error| named(path, error))?.file_type();
                let opened: Box<dyn Read + Send> = if kind.is_char_device() {
                    let unknown = "a serial port needs a bit rate, --baud, because the scene's board has no uart_baud";
                    let baud = baud.ok_or_else(|| named(path, Error::new(ErrorKind::InvalidInput, unknown)))?;
                    let port = serialport::new(path, baud).timeout(SERIAL_WAIT).open();
                    Box::new(Serial { port: port.map_err(|error| named(path, error.into()))?, begun: false })
                } else {
                    let file = File::open(Path::new(path)).map_err(|error| named(path, error))?;
                    match kind.is_file() {
                        true => Box::new(Growing { path: path.into(), file, at: 0, whole: true, rest: &[] }),
                        false => Box::new(file),
                    }
                };
                Ok((opened, None))
            }
        }
    }

    /// Whether lines that are not read in time are lost: the program reads them whatever waits.
    pub fn loses_lines(&self) -> bool {
        match self {
            Source::StandardInput => false,
            Source::Udp(_) => true,
            Source::Path(path) => std::fs::metadata(path).is_ok_and(|own| own.file_type().is_char_device()),
        }
    }

    /// Whether lines come in their own time; standard input from a file has them all at once.
    pub fn is_live(&self) -> bool {
        let file = |stdin: std::os::fd::OwnedFd| File::from(stdin).metadata().is_ok_and(|own| own.is_file());
        *self != Source::StandardInput || !std::io::stdin().as_fd().try_clone_to_owned().is_ok_and(file)
    }

    /// The source's name in messages.
    pub fn name(&self) -> &str {
        match self {
            Source::StandardInput => "standard input",
            Source::Udp(address) => address,
            Source::Path(path) => path,
        }
    }
}

/// A file that another program adds to, cuts, or replaces by a new one of the same name.
struct Growing {
    path: PathBuf,
    file: File,
    /// Bytes read.
    at: u64,
    /// The last byte was the end of a line.
    whole: bool,
    /// To be read before the next byte of the file.
    rest: &'static [u8],
}

impl Growing {
    /// Put behind a line whose end the file lost, so that a number that was cut is not taken for another one.
    const CUT: &'static [u8] = b" cut off\n";

    /// Goes to the start of the file of that name if the one that is read was cut or replaced; otherwise waits.
    fn look(&mut self) -> Result<()> {
        let own = self.file.metadata()?;
        // Between two files of the name there may be none.
        let named = std::fs::metadata(&self.path).ok();
        let replaced = named.is_some_and(|named| (named.dev(), named.ino()) != (own.dev(), own.ino()));
        if !replaced && own.len() >= self.at {
            std::thread::sleep(POLL);
            return Ok(());
        }
        let what = if replaced { "another file has this name" } else { "the file was cut" };
        say!("{}: {what}: read from its start", self.path.display());
        if replaced {
            self.file = File::open(&self.path)?;
        } else {
            self.file.rewind()?;
        }
        self.rest = if self.whole { &[] } else { Growing::CUT };
        (self.at, self.whole) = (0, true);
        Ok(())
    }
}

impl Read for Growing {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        loop {
            if !self.rest.is_empty() {
                return self.rest.read(buffer);
            }
            match self.file.read(buffer)? {
                0 => self.look()?,
                bytes => {
                    self.at += bytes as u64;
                    self.whole = buffer[bytes - 1] == b'\n';
                    return Ok(bytes);
                }
            }
        }
    }
}

/// A serial port, which has no end. What comes before its first end of a line is left out.
struct Serial<P> {
    port: P,
    /// A line has ended: what came before its end may be the rest of one.
    begun: bool,
}

impl<P: Read> Read for Serial<P> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        loop {
            match self.port.read(buffer) {
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => (),
                Ok(bytes) if !self.begun && bytes > 0 => {
                    // The end itself stays: the line counts, as a blank one.
                    let is_end = |byte: &u8| matches!(byte, b'\r' | b'\n');
                    let Some(end) = buffer[..bytes].iter().position(is_end) else { continue };
                    buffer.copy_within(end..bytes, 0);
                    self.begun = true;
                    return Ok(bytes - end);
                }
                other => return other,
            }
        }
    }
}

/// Datagrams, each ended as a line.
struct Datagrams {
    socket: UdpSocket,
    /// The last one.
    line: Cursor<Vec<u8>>,
}

impl Read for Datagrams {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        loop {
            match self.line.read(buffer)? {
                0 if !buffer.is_empty() => (),
                bytes => return Ok(bytes),
            }
            let line = self.line.get_mut();
            line.resize(DATAGRAM, 0);
            let bytes = self.socket.recv(line)?;
            line.truncate(bytes);
            if bytes > 0 && line.last() != Some(&b'\n') {
                line.push(b'\n');
            }
            self.line.set_position(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader, Write};

    #[test]
    fn sources_are_read_as_written() {
        let source = |text: &str| text.parse::<Source>();
        assert_eq!(source("-"), Ok(Source::StandardInput));
        assert_eq!(source("udp:[::1]:9000"), Ok(Source::Udp("[::1]:9000".into())));
        assert_eq!(source("udp:9000"), Err("udp:9000: wanted udp:HOST:PORT".into()));
        assert_eq!(source("udp://0.0.0.0:9000"), Ok(Source::Udp("0.0.0.0:9000".into())));
        for text in ["/dev/ttyUSB0", "serial:/dev/ttyUSB0"] {
            assert_eq!(source(text), Ok(Source::Path("/dev/ttyUSB0".into())));
        }
        // A character device and datagrams do not wait.
        let loses = ["-", "udp:9000:1", "/dev/null", "/"].map(|text| source(text).unwrap().loses_lines());
        assert_eq!(loses, [false, true, true, false]);
        let absent = source("absent.csv").unwrap().open(Some(9600)).err().unwrap().to_string();
        assert!(absent.starts_with("absent.csv: No such file"), "{absent}");
    }

    #[test]
    fn a_serial_port_is_read_from_its_first_end_of_a_line_on() {
        // The first piece has lost the begin of its first number.
        for (bytes, wanted) in [
            ("1,0.02\r\n0.01,0.02\n", "\r\n0.01,0.02\n"),
            ("1,0.02\r0.01,0.02\r", "\r0.01,0.02\r"),
            ("\n0.01,0.02\n", "\n0.01,0.02\n"),
            ("1,0.02", ""),
        ] {
            for size in [1, 4, 64] {
                let mut serial = Serial { port: bytes.as_bytes(), begun: false };
                let (mut read, mut buffer) = (Vec::new(), vec![0; size]);
                while let count @ 1.. = serial.read(&mut buffer).unwrap() {
                    read.extend(&buffer[..count]);
                }
                assert_eq!(String::from_utf8(read).unwrap(), wanted, "{size} bytes at once");
            }
        }
    }

    #[test]
    fn datagrams_become_lines() {
        let (opened, address) = "udp:127.0.0.1:0".parse::<Source>().unwrap().open(None).unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        for datagram in ["1,2", "", "3\n4\n"] {
            sender.send_to(datagram.as_bytes(), address.unwrap()).unwrap();
        }
        let lines: Vec<String> = BufReader::new(opened).lines().take(3).map(Result::unwrap).collect();
        assert_eq!(lines, ["1,2", "3", "4"]);
    }

    #[test]
    fn a_file_is_followed_and_begun_again_when_cut_or_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::write(&path, "first\nsec").unwrap();
        let add = |text: &str| std::fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(text.as_bytes());
        let mut lines = BufReader::new(path.to_str().unwrap().parse::<Source>().unwrap().open(None).unwrap().0).lines();
        let mut next = || lines.next().unwrap().unwrap();
        assert_eq!(next(), "first");
        add("ond\n").unwrap();
        assert_eq!(next(), "second");
        std::fs::write(&path, "new\n").unwrap();
        assert_eq!(next(), "new");
        // As logrotate does: moved away and begun anew, the last line of the old file cut inside a number.
        add("0.1,0.25").unwrap();
        std::thread::sleep(4 * POLL);
        std::fs::rename(&path, folder.path().join("log.csv.1")).unwrap();
        std::thread::sleep(4 * POLL);
        std::fs::write(&path, "3\n").unwrap();
        assert_eq!([next(), next()], ["0.1,0.25 cut off", "3"]);
    }
}
