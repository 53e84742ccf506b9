//! How willing the two sides of the bench are.

/// Cycles of a pause that fills every buffer behind it.
const PAUSE_CYCLES: u32 = 200;
/// One of so many cycles starts a pause, where there are some.
const PAUSE_EVERY: u32 = 500;

/// Percentages of the cycles in which each side is willing.
pub(crate) struct HandshakeRates {
    random: fastrand::Rng,
    send: u32,
    receive: u32,
    pauses: bool,
    left: u32,
}

impl HandshakeRates {
    /// Both sides always.
    pub(crate) fn full_speed() -> HandshakeRates {
        HandshakeRates { random: fastrand::Rng::with_seed(0), send: 100, receive: 100, pauses: false, left: 0 }
    }

    /// From one side always and the other hardly ever to both now and then.
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
