//! SPI slave: between the bytes of the link and an SPI controller, whose clock is a domain of its own.

use dermis_golden::link::slip::IDLE;
use rust_hdl::prelude::*;

use crate::wire::{Wire, Word};

/// Mode 0, most significant bit first, bytes in both directions at once. Registers `sclk_…` are in the controller's
/// clock domain:
///
/// ```text
///  mosi -> sclk_mosi -> sclk_shift -> sclk_received --(sclk_toggle, 2 registers)--> data, valid
///  miso <-----------------'   ^------ sclk_kept <--(offer, 2 registers)------------ offered <- send_data
///                                          '-------(sclk_taken, 2 registers)------> send_ready
/// ```
/// Receiving: the eighth rising edge stores the byte and flips a toggle. `clk` sees the toggle at its third edge after
/// that at the latest; the byte stays unchanged for eight periods of `spi_sclk`. An incomplete byte is dropped.
///
/// Sending: the bits change on falling edges. The eighth rising edge of a byte stores the next one if `clk` offers one,
/// and acknowledges it; the falling edge then loads it, or IDLE. The stored byte is released only when the controller
/// has sampled all eight of its bits: if a transaction ends earlier, the next one sends that byte again from its first
/// bit. The first byte of a transaction is IDLE.
///
/// While `spi_cs_n` is high, edges of `spi_sclk` have no effect: they are for another slave.
#[derive(LogicBlock)]
pub struct SpiSlave {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high: no byte to send is accepted.
    pub rst: Signal<In, Bit>,
    /// The controller's clock.
    pub spi_sclk: Signal<In, Bit>,
    /// Chip select, low during a transaction.
    pub spi_cs_n: Signal<In, Bit>,
    /// Data from the controller, sampled on the rising edge of `spi_sclk`.
    pub spi_mosi: Signal<In, Bit>,
    /// Data to the controller, changes on the falling edge of `spi_sclk`.
    pub spi_miso: Signal<Out, Bit>,
    /// The byte received last; valid with `valid`.
    pub data: Wire<Out>,
    /// A byte was received in this cycle.
    pub valid: Signal<Out, Bit>,
    /// Constant 0: every eight bits are a byte.
    pub broken: Signal<Out, Bit>,
    /// A byte to send; valid with `send_valid`.
    pub send_data: Wire<In>,
    /// `send_data` is offered; held until `send_ready`.
    pub send_valid: Signal<In, Bit>,
    /// The byte is accepted in this cycle.
    pub send_ready: Signal<Out, Bit>,
    _level: bool,
    _sclk: Sclk,
    _state: State,
}

/// Registers in the controller's clock domain.
#[derive(Clone, Copy, Debug, Default)]
struct Sclk {
    bit: u32,
    shift: u8,
    carries: bool,
    mosi: bool,
    received: u8,
    toggle: bool,
    kept: u8,
    full: bool,
    taken: bool,
    offered: [bool; 2],
}

/// Registers in the domain of `clk`.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    received: [bool; 3],
    taken: [bool; 2],
    offer: bool,
    offered: u8,
}

/// Index of the last bit of a byte.
const LAST: u32 = 7;

impl Default for SpiSlave {
    fn default() -> Self {
        SpiSlave {
            clk: Default::default(),
            rst: Default::default(),
            spi_sclk: Default::default(),
            spi_cs_n: Default::default(),
            spi_mosi: Default::default(),
            spi_miso: Default::default(),
            data: Wire::new(8),
            valid: Default::default(),
            broken: Default::default(),
            send_data: Wire::new(8),
            send_valid: Default::default(),
            send_ready: Default::default(),
            _level: false,
            _sclk: Sclk::default(),
            _state: State::default(),
        }
    }
}

impl SpiSlave {
    fn rises(&mut self) {
        let (s, mosi) = (self._sclk, self.spi_mosi.val());
        let next = &mut self._sclk;
        next.mosi = mosi;
        next.offered = [self._state.offer, s.offered[0]];
        if s.bit == LAST {
            next.received = s.shift << 1 | u8::from(mosi);
            next.toggle = !s.toggle;
            if s.carries || !s.full {
                next.full = s.offered[1] != s.taken;
                next.taken = s.offered[1];
                next.kept = self._state.offered;
            }
        }
    }

    fn falls(&mut self) {
        let s = self._sclk;
        let next = &mut self._sclk;
        next.bit = (s.bit + 1) % (LAST + 1);
        next.shift = match s.bit {
            LAST if s.full => s.kept,
            LAST => IDLE,
            _ => s.shift << 1 | u8::from(s.mosi),
        };
        if s.bit == LAST {
            next.carries = s.full;
        }
    }

    fn clocked(&mut self) {
        let s = self._state;
        let next = &mut self._state;
        next.received = [self._sclk.toggle, s.received[0], s.received[1]];
        next.taken = [self._sclk.taken, s.taken[0]];
        if self.send_valid.val() && s.taken[1] == s.offer && !self.rst.val() {
            next.offer = !s.offer;
            next.offered = self.send_data.val().number() as u8;
        }
    }
}

impl Logic for SpiSlave {
    fn update(&mut self) {
        // The two clocks never change in the same update round: callers settle in between.
        if self.clk.pos_edge() {
            self.clocked();
        }
        match (self._level, self.spi_sclk.val()) {
            (false, true) => self.rises(),
            (true, false) => self.falls(),
            _ => (),
        }
        self._level = self.spi_sclk.val();
        if self.spi_cs_n.val() {
            (self._sclk.bit, self._sclk.shift, self._sclk.carries) = (0, IDLE, false);
        }
        let s = &self._state;
        self.spi_miso.next = self._sclk.shift >> 7 == 1;
        self.data.next = Word::from(u64::from(self._sclk.received));
        self.valid.next = s.received[1] != s.received[2];
        self.broken.next = false;
        self.send_ready.next = s.taken[1] == s.offer;
    }

    fn connect(&mut self) {
        self.spi_miso.connect();
        self.data.connect();
        self.valid.connect();
        self.broken.connect();
        self.send_ready.connect();
    }

    fn hdl(&self) -> Verilog {
        Verilog::Custom(format!(
            "\
// Controller's clock domain, falling edges; reset between transactions.
reg [2:0] sclk_bit;
reg [7:0] sclk_shift;
reg sclk_carries;
// Controller's clock domain, rising edges; not reset, so that the handshake with clk holds across transactions.
reg sclk_mosi;
reg [7:0] sclk_received, sclk_kept;
reg [1:0] sclk_offered = 2'd0;
reg sclk_toggle = 1'b0;
reg sclk_full = 1'b0;
reg sclk_taken = 1'b0;
// Domain of clk.
reg [2:0] received = 3'd0;
reg [1:0] taken = 2'd0;
reg offer = 1'b0;
reg [7:0] offered;
wire sclk_last = sclk_bit == 3'd{LAST};
always @(*) begin
  spi_miso = sclk_shift[7];
  data = sclk_received;
  valid = received[1] != received[2];
  broken = 1'b0;
  send_ready = taken[1] == offer;
end
always @(posedge spi_sclk) begin
  sclk_mosi <= spi_mosi;
  sclk_offered <= {{sclk_offered[0], offer}};
  if (sclk_last) begin
    sclk_received <= {{sclk_shift[6:0], spi_mosi}};
    sclk_toggle <= !sclk_toggle;
    if (sclk_carries || !sclk_full) begin
      sclk_full <= sclk_offered[1] != sclk_taken;
      sclk_taken <= sclk_offered[1];
      sclk_kept <= offered;
    end
  end
end
always @(negedge spi_sclk or posedge spi_cs_n) begin
  if (spi_cs_n) begin
    sclk_bit <= 3'd0;
    sclk_shift <= 8'd{IDLE};
    sclk_carries <= 1'b0;
  end else begin
    sclk_bit <= sclk_bit + 3'd1;
    sclk_shift <= !sclk_last ? {{sclk_shift[6:0], sclk_mosi}} : sclk_full ? sclk_kept : 8'd{IDLE};
    if (sclk_last) sclk_carries <= sclk_full;
  end
end
always @(posedge clk) begin
  received <= {{received[1:0], sclk_toggle}};
  taken <= {{taken[0], sclk_taken}};
  if (send_valid && send_ready && !rst) begin
    offer <= !offer;
    offered <= send_data;
  end
end"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::settles;

    /// The block, the bytes that the `clk` side has received, and the bytes it still has to send.
    struct Bench {
        block: SpiSlave,
        received: Vec<u8>,
        sending: Vec<u8>,
        clock: bool,
    }

    impl Bench {
        fn new(sending: &[u8]) -> Bench {
            let mut block = SpiSlave::default();
            block.connect_all();
            block.spi_cs_n.next = true;
            let mut bench = Bench { block, received: Vec::new(), sending: sending.to_vec(), clock: false };
            bench.settle();
            bench
        }

        fn settle(&mut self) {
            assert!(settles(&mut self.block));
        }

        /// Half a cycle of `clk`; the `clk` side reads and writes before a rising edge.
        fn half(&mut self) {
            let block = &mut self.block;
            if !self.clock {
                if block.valid.val() {
                    self.received.push(block.data.val().number() as u8);
                }
                block.send_valid.next = !self.sending.is_empty();
                block.send_data.next = Word::from(u64::from(self.sending.first().copied().unwrap_or(0)));
                self.settle();
                if !self.sending.is_empty() && self.block.send_ready.val() {
                    self.sending.remove(0);
                }
            }
            self.clock = !self.clock;
            self.block.clk.next = self.clock.into();
            self.settle();
        }

        /// A transaction of `edges` edges of the controller's clock, `halves` half cycles of `clk` apart; returns the
        /// complete bytes that the controller has received.
        fn transaction(&mut self, bytes: &[u8], edges: usize, halves: usize) -> Vec<u8> {
            self.block.spi_cs_n.next = false;
            let (mut seen, mut whole) = (0u32, Vec::new());
            for edge in 0..edges {
                let bit = edge / 2;
                if edge % 2 == 0 {
                    self.block.spi_mosi.next = bytes[bit / 8] >> (7 - bit % 8) & 1 == 1;
                    self.settle();
                    seen = seen << 1 | u32::from(self.block.spi_miso.val());
                    whole.extend((bit % 8 == 7).then_some(seen as u8));
                }
                self.block.spi_sclk.next = edge % 2 == 0;
                self.settle();
                (0..halves).for_each(|_| self.half());
            }
            self.block.spi_cs_n.next = true;
            self.settle();
            self.block.spi_sclk.next = false;
            self.settle();
            (0..halves).for_each(|_| self.half());
            whole
        }
    }

    #[test]
    fn bytes_pass_both_ways_at_once_and_none_is_lost_where_a_transaction_ends() {
        let (there, back): (Vec<u8>, Vec<u8>) = ((0..200).collect(), (100..200).collect());
        for halves in [2, 3, 8] {
            for edges in 1..=64 {
                let mut bench = Bench::new(&back);
                let (mut sent, mut seen) = (0, Vec::new());
                while seen.len() < back.len() && sent + 8 < there.len() {
                    // Alternately seven whole bytes, and a transaction of `edges` edges.
                    for edges in [7 * 16, edges] {
                        let bytes = &there[sent..];
                        let whole = bench.transaction(bytes, edges, halves);
                        assert!(whole.first().is_none_or(|first| *first == IDLE), "{edges} edges");
                        // A byte is received at its eighth rising edge.
                        sent += (edges + 1) / 16;
                        seen.extend(whole.into_iter().filter(|byte| *byte != IDLE));
                    }
                }
                (0..6).for_each(|_| bench.half());
                assert_eq!(bench.received, there[..sent], "{edges} edges");
                let wanted: Vec<u8> = back.iter().copied().take(seen.len()).collect();
                assert!(seen == wanted && seen.len() > 80, "{edges} edges: {seen:?}");
            }
        }
    }
}
