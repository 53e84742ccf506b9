//! A simulated board on a pseudo-terminal, which a host opens like a serial port.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::JoinHandle;

use anyhow::Result;
use dermis_golden::wire::link::Identity;
use rustix::event::{poll, PollFd, PollFlags, Timespec};
use rustix::fs::{fcntl_setfl, OFlags};
use rustix::pty::{grantpt, openpt, ptsname, unlockpt, OpenptFlags};
use rustix::termios::{tcgetattr, tcsetattr, OptionalActions};

use super::host_uart::{require_uart, HostUart, UartSymbol};
use super::noisy_channel::{ChannelFaults, NoisyChannel};
use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;

/// Clock cycles simulated between two polls of the pseudo-terminal.
const SLICE: u64 = 200;
/// Cycles without activity on the line after which the simulation waits for bytes; longer than any frame's computation.
const QUIET: u64 = 100_000;
/// Longest wait for bytes in ns, so that a request to stop is noticed.
const WAIT_NS: i64 = 20_000_000;

/// A running board; stops when dropped.
pub struct PseudoTerminal {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<HostUart>>>,
}

impl PseudoTerminal {
    /// Starts the whole board of a scene under Verilator on a pseudo-terminal, over error-free channels.
    ///
    /// # Errors
    /// As [`Hardware::board`]; no pseudo-terminal, a link other than a UART.
    pub fn of(hardware: &Hardware) -> Result<Self> {
        let ideal = || NoisyChannel::new(ChannelFaults::default());
        PseudoTerminal::with_channels(hardware, ideal(), ideal())
    }

    /// The same over the given channels.
    ///
    /// # Errors
    /// As [`PseudoTerminal::of`].
    pub fn with_channels(hardware: &Hardware, to_board: NoisyChannel, to_host: NoisyChannel) -> Result<Self> {
        require_uart(&hardware.model.scene, "board")?;
        let identity = Identity::of(&hardware.model)?;
        let uart = HostUart::new(hardware.board(Simulator::Verilator)?, identity.bit_rate, identity.clock_hz);
        // A scan waits for its period, then comes after two scans at most.
        let scan = hardware.model.scan_timing().map_or(0, |timing| timing.period + 2 * timing.scan);
        Ok(PseudoTerminal::start(uart, QUIET + scan, to_board, to_host)?)
    }

    /// Runs the board behind `uart` in its own thread, until `quiet` cycles have passed without activity on the line, then
    /// again when a byte comes; bytes pass through the given channels.
    ///
    /// # Errors
    /// No pseudo-terminal.
    pub fn start(uart: HostUart, quiet: u64, to_board: NoisyChannel, to_host: NoisyChannel) -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let path = PathBuf::from(ptsname(&master, Vec::new())?.to_string_lossy().into_owned());
        // The slave side stays open here: it keeps the terminal usable between two hosts and in raw mode from the
        // start.
        let slave = File::options().read(true).write(true).open(&path)?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        fcntl_setfl(&master, OFlags::NONBLOCK)?;
        let stop = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let _slave = slave;
            run(uart, quiet, File::from(master), to_board, to_host, &seen)
        });
        Ok(PseudoTerminal { path, stop, thread: Some(thread) })
    }

    /// Path of the port for the host.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Runs until the pseudo-terminal fails.
    ///
    /// # Errors
    /// The I/O error of the pseudo-terminal.
    pub fn wait(mut self) -> io::Result<()> {
        self.thread.take().map_or(Ok(()), |thread| match thread.join() {
            Ok(outcome) => outcome.map(drop),
            Err(panic) => std::panic::resume_unwind(panic),
        })
    }
}

impl Drop for PseudoTerminal {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // Nobody is left to report an error to.
            let _ = thread.join();
        }
    }
}

fn run(
    mut uart: HostUart,
    quiet: u64,
    mut master: File,
    mut to_board: NoisyChannel,
    mut to_host: NoisyChannel,
    stop: &AtomicBool,
) -> io::Result<HostUart> {
    let mut buffer = [0; 4096];
    while !stop.load(Ordering::Relaxed) {
        match master.read(&mut buffer) {
            Ok(count) => {
                buffer[..count].iter().flat_map(|&byte| to_board.transmit(byte)).for_each(|what| uart.send(what))
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => (),
            Err(error) => return Err(error),
        }
        if uart.idle_cycles() > quiet {
            let wait = Timespec { tv_sec: 0, tv_nsec: WAIT_NS };
            poll(&mut [PollFd::new(&master, PollFlags::IN)], Some(&wait))?;
            continue;
        }
        (0..SLICE).for_each(|_| uart.cycle());
        let bytes = uart.received().into_iter().flat_map(|byte| to_host.transmit(byte));
        let bytes: Vec<u8> =
            bytes.filter_map(|what| if let UartSymbol::Byte(byte) = what { Some(byte) } else { None }).collect();
        write(&mut master, &bytes, stop)?;
    }
    Ok(uart)
}

/// Writes all bytes. A host that does not read blocks the simulated board, unlike a real one, and no byte is lost.
fn write(master: &mut File, mut bytes: &[u8], stop: &AtomicBool) -> io::Result<()> {
    while !bytes.is_empty() && !stop.load(Ordering::Relaxed) {
        match master.write(bytes) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                let wait = Timespec { tv_sec: 0, tv_nsec: WAIT_NS };
                poll(&mut [PollFd::new(master, PollFlags::OUT)], Some(&wait))?;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
