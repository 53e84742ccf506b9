//! A bad wire: bytes that get lost, flipped, late or broken on their way.

use super::UartSymbol;

/// How often what goes wrong: one byte of so many; 0 is never.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelFaults {
    /// Is lost.
    pub lost: u32,
    /// Has one bit flipped.
    pub flipped: u32,
    /// Comes up to thirty bytes later than the one before; towards the board only.
    pub late: u32,
    /// Has no stop bit; towards the board only.
    pub no_stop: u32,
    /// Of the random draws.
    pub seed: u64,
}

/// One direction of a wire.
#[derive(Clone, Debug)]
pub struct NoisyChannel {
    faults: ChannelFaults,
    random: fastrand::Rng,
}

impl NoisyChannel {
    /// A wire with these faults.
    pub fn new(faults: ChannelFaults) -> Self {
        NoisyChannel { faults, random: fastrand::Rng::with_seed(faults.seed) }
    }

    fn happens(&mut self, once_in: u32) -> bool {
        once_in > 0 && self.random.u32(..once_in) == 0
    }

    /// What becomes of a byte.
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
