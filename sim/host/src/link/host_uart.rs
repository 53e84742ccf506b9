//! Host end of a simulated board's UART.

use std::collections::VecDeque;

use anyhow::{ensure, Result};
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::link::{BoardDevice, BoardOutputs};

/// Bits per byte on the line, with start and stop bit.
const BITS: u64 = 10;

/// Refuses a scene whose link is not a UART, for `dermis <command>`, which supports serial ports only.
///
/// # Errors
/// The scene's link is not a UART.
pub fn require_uart(scene: &Scene, command: &str) -> Result<()> {
    let (name, link) = (&scene.name, scene.hardware.link);
    ensure!(
        link == LinkKind::Uart,
        "dermis {command}: scene {name}: hardware.link = {:?} is not a serial port; it must be {:?} here",
        link.name(),
        LinkKind::Uart.name(),
    );
    Ok(())
}

/// What the host sends on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UartSymbol {
    /// A byte.
    Byte(u8),
    /// A byte whose stop bit is missing.
    NoStop(u8),
    /// The line stays idle for the time of so many bytes.
    Pause(u32),
}

/// A UART with exact bit times, simulated in step with the board's clock.
pub struct HostUart {
    device: Box<dyn BoardDevice>,
    /// Bits per clock cycle are the fraction `baud` / `clock_hz`.
    baud: u64,
    clock_hz: u64,
    cycle: u64,
    queue: VecDeque<UartSymbol>,
    /// What is being sent, and its first cycle.
    sending: Option<(UartSymbol, u64)>,
    /// Byte being received: cycle of its start edge, number of bits sampled, their values from bit 0.
    receiving: Option<(u64, u64, u32)>,
    received: Vec<u8>,
    pins: BoardOutputs,
    /// The last cycle with activity on the line, in either direction.
    last_active: u64,
}

impl HostUart {
    /// The host of a board with a clock of `clock_hz`, at `baud` bit/s.
    pub fn new(device: Box<dyn BoardDevice>, baud: u32, clock_hz: u32) -> Self {
        HostUart {
            device,
            baud: baud.into(),
            clock_hz: clock_hz.into(),
            cycle: 0,
            queue: VecDeque::new(),
            sending: None,
            receiving: None,
            received: Vec::new(),
            pins: BoardOutputs { to_host: true, ..BoardOutputs::default() },
            last_active: 0,
        }
    }

    /// Changes the host's bit rate to `baud` bit/s; the board keeps its own.
    pub fn set_baud(&mut self, baud: u32) {
        self.baud = baud.into();
    }

    /// Appends to the queue of symbols to send.
    pub fn send(&mut self, what: UartSymbol) {
        self.queue.push_back(what);
        self.last_active = self.cycle;
    }

    /// Takes the bytes received since the last call.
    pub fn received(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.received)
    }

    /// Clock cycles since the last activity on the line.
    pub fn idle_cycles(&self) -> u64 {
        self.cycle - self.last_active
    }

    /// Clock cycles simulated so far.
    pub fn cycles(&self) -> u64 {
        self.cycle
    }

    /// The board's pins in the last cycle.
    pub fn pins(&self) -> BoardOutputs {
        self.pins
    }

    /// Simulates one clock cycle.
    pub fn cycle(&mut self) {
        let level = self.level();
        self.pins = self.device.cycle(level.into());
        self.listen();
        if !self.queue.is_empty() || self.sending.is_some() || self.receiving.is_some() {
            self.last_active = self.cycle;
        }
        self.cycle += 1;
    }

    /// Whole bit times since cycle `from`.
    fn bits_since(&self, from: u64) -> u64 {
        (self.cycle - from) * self.baud / self.clock_hz
    }

    /// The level that the host drives.
    fn level(&mut self) -> bool {
        if let Some((what, from)) = self.sending {
            let bytes = if let UartSymbol::Pause(bytes) = what { u64::from(bytes) } else { 1 };
            if self.bits_since(from) >= BITS * bytes {
                self.sending = None;
            }
        }
        if self.sending.is_none() {
            self.sending = self.queue.pop_front().map(|what| (what, self.cycle));
        }
        let Some((what, from)) = self.sending else { return true };
        let (data, stop) = match what {
            UartSymbol::Byte(data) => (data, true),
            UartSymbol::NoStop(data) => (data, false),
            UartSymbol::Pause(_) => return true,
        };
        match self.bits_since(from) {
            0 => false,
            bit @ 1..=8 => data >> (bit - 1) & 1 == 1,
            _ => stop,
        }
    }

    /// Samples the board's line in the middle of each bit.
    fn listen(&mut self) {
        let level = self.pins.to_host;
        match self.receiving {
            None if !level => self.receiving = Some((self.cycle, 0, 0)),
            None => (),
            Some((from, done, data)) => {
                let halves = 2 * (self.cycle - from) * self.baud / self.clock_hz;
                if halves < 2 * done + 1 {
                    return;
                }
                let data = data | u32::from(level) << done;
                self.receiving = (done + 1 < BITS).then_some((from, done + 1, data));
                if done + 1 == BITS && level {
                    self.received.push((data >> 1) as u8);
                }
            }
        }
    }
}
