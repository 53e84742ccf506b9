//! A noisy channel: bytes are lost, altered or delayed at random.

use super::host_uart::UartSymbol;

/// Error rates: each value n means that one byte in n on average is affected; 0 means none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelFaults {
    /// Bytes lost.
    pub lost: u32,
    /// Bytes with one bit flipped.
    pub flipped: u32,
    /// Bytes delayed by up to thirty byte times; towards the board only.
    pub late: u32,
    /// Bytes without stop bit; towards the board only.
    pub no_stop: u32,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// One direction of a link.
#[derive(Clone, Debug)]
pub struct NoisyChannel {
    faults: ChannelFaults,
    random: fastrand::Rng,
}

impl NoisyChannel {
    /// A channel with the given error rates.
    pub fn new(faults: ChannelFaults) -> Self {
        NoisyChannel { faults, random: fastrand::Rng::with_seed(faults.seed) }
    }

    fn happens(&mut self, once_in: u32) -> bool {
        once_in > 0 && self.random.u32(..once_in) == 0
    }

    /// What arrives for one byte sent.
    pub fn transmit(&mut self, byte: u8) -> Vec<UartSymbol> {
        let faults = self.faults;
        let mut out = Vec::new();
        if self.happens(faults.late) {
            out.push(UartSymbol::Pause(self.random.u32(1..=30)));
        }
        let (lost, flipped, no_stop) =
            (self.happens(faults.lost), self.happens(faults.flipped), self.happens(faults.no_stop));
        let byte = if flipped { byte ^ 1 << self.random.u32(..8) } else { byte };
        match (lost, no_stop) {
            (true, _) => (),
            (false, true) => out.push(UartSymbol::NoStop(byte)),
            (false, false) => out.push(UartSymbol::Byte(byte)),
        }
        out
    }
}
