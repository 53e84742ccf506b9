//! SPI controller of a simulated board.

use dermis_golden::wire::link::slip::IDLE;
use dermis_hdl::link::{BoardDevice, BoardOutputs};

/// Bits of [`BoardDevice`]'s inputs.
const SCLK: u64 = 1;
const CS_N: u64 = 2;
const MOSI: u64 = 4;

/// An SPI controller, mode 0, whose clock runs independently of the board's.
///
/// Time is counted in units of 1/(2·`clock_hz`·`sclk_hz`) s, so that both half periods are integers: `sclk_hz` units
/// for the board's clock, `clock_hz` units for the SPI clock.
pub struct SpiController {
    device: Box<dyn BoardDevice>,
    clock_hz: u64,
    sclk_hz: u64,
    now: u64,
    /// Time of the next edge of the board's clock.
    edge: u64,
    clock: bool,
    inputs: u64,
    pins: BoardOutputs,
}

impl SpiController {
    /// The controller of a board with a clock of `clock_hz`, with an SPI clock of `sclk_hz` that starts `phase` (0 … 1)
    /// board cycles later.
    pub fn new(device: Box<dyn BoardDevice>, clock_hz: u32, sclk_hz: u32, phase: f64) -> Self {
        let (clock_hz, sclk_hz) = (u64::from(clock_hz), u64::from(sclk_hz));
        let pins = BoardOutputs::default();
        let mut controller =
            SpiController { device, clock_hz, sclk_hz, now: 0, edge: sclk_hz, clock: false, inputs: CS_N, pins };
        controller.set_pin(CS_N, true);
        controller.advance((phase * 2.0 * sclk_hz as f64) as u64);
        controller
    }

    /// Waits for `cycles` of the board's clock between transactions.
    pub fn wait(&mut self, cycles: u64) {
        self.advance(2 * cycles * self.sclk_hz);
    }

    /// Transfers `bytes` in one transaction; returns the bytes received.
    pub fn transfer(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.transfer_edges(bytes, 16 * bytes.len())
    }

    /// A transaction that ends after `edges` edges of its clock, 16 per byte; returns the complete bytes received.
    /// After `bytes` the controller sends IDLE.
    pub fn transfer_edges(&mut self, bytes: &[u8], edges: usize) -> Vec<u8> {
        let mut received = Vec::new();
        let mut bits = 0u32;
        self.set_pin(CS_N, false);
        for bit in 0..edges.div_ceil(2) {
            let byte = bytes.get(bit / 8).copied().unwrap_or(IDLE);
            self.set_pin(MOSI, byte >> (7 - bit % 8) & 1 == 1);
            self.half_period();
            bits = bits << 1 | u32::from(self.pins.to_host);
            self.set_pin(SCLK, true);
            if bit % 8 == 7 {
                received.push(bits as u8);
            }
            if 2 * bit + 1 < edges {
                self.half_period();
                self.set_pin(SCLK, false);
            }
        }
        self.half_period();
        self.set_pin(CS_N, true);
        // If the transaction has ended with the clock high, the clock falls while CS is inactive.
        self.set_pin(SCLK, false);
        self.half_period();
        received
    }

    fn half_period(&mut self) {
        self.advance(self.clock_hz);
    }

    /// Advances the simulation by `time` units.
    fn advance(&mut self, time: u64) {
        let until = self.now + time;
        while self.edge <= until {
            self.clock = !self.clock;
            self.pins = self.device.settle(self.inputs, self.clock);
            self.edge += self.sclk_hz;
        }
        self.now = until;
    }

    fn set_pin(&mut self, pin: u64, level: bool) {
        self.inputs = if level { self.inputs | pin } else { self.inputs & !pin };
        self.pins = self.device.settle(self.inputs, self.clock);
    }
}
