//! Random valid and ready rates of the two sides of the test bench.

/// Length of a receiver's pause in cycles, enough to fill every buffer.
const PAUSE_CYCLES: u32 = 200;
/// With pauses, one starts once in so many cycles on average.
const PAUSE_EVERY: u32 = 500;

/// Percentage of cycles in which the sender starts to offer a code, and in which the receiver is ready.
pub(crate) struct HandshakeRates {
    random: fastrand::Rng,
    send: u32,
    receive: u32,
    pauses: bool,
    left: u32,
}

impl HandshakeRates {
    /// Both sides in every cycle.
    pub(crate) fn full_speed() -> HandshakeRates {
        HandshakeRates { random: fastrand::Rng::with_seed(0), send: 100, receive: 100, pauses: false, left: 0 }
    }

    /// Random rates from 3 % to 100 % for each side, with or without pauses.
    pub(super) fn random(random: &mut fastrand::Rng) -> HandshakeRates {
        let share = |random: &mut fastrand::Rng| [3, 20, 50, 80, 97, 100, 100][random.usize(..7)];
        let (send, receive, pauses) = (share(random), share(random), random.bool());
        HandshakeRates { random: random.fork(), send, receive, pauses, left: 0 }
    }

    pub(super) fn sends(&mut self) -> bool {
        self.random.u32(..100) < self.send
    }

    pub(super) fn receives(&mut self) -> bool {
        if self.left > 0 {
            self.left -= 1;
            return false;
        }
        if self.pauses && self.random.u32(..PAUSE_EVERY) == 0 {
            self.left = PAUSE_CYCLES;
        }
        self.random.u32(..100) < self.receive
    }
}
