//! Timing of the two streams: full speed, or random gaps.

/// The receiver starts a long pause, which fills every buffer, once in so many cycles on average.
const LONG_PAUSE_EVERY: u32 = 64;
/// Length of a long pause in cycles.
const LONG_PAUSE_CYCLES: u32 = 40;

/// Timing of the two streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stimulus {
    /// One code per cycle, output always ready: cycle counts are exact.
    FullSpeed,
    /// One code per cycle, output always ready, frames without a gap.
    BackToBack,
    /// Random gaps on both streams.
    Stalls {
        /// Seed of the gaps.
        seed: u64,
    },
}

impl std::fmt::Display for Stimulus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stimulus::FullSpeed => write!(f, "full speed"),
            Stimulus::BackToBack => write!(f, "back to back"),
            Stimulus::Stalls { seed } => write!(f, "stalls (seed {seed})"),
        }
    }
}

/// Decides in which cycles the sender starts to offer a code and the receiver is ready.
pub(super) struct StallGenerator {
    random: Option<fastrand::Rng>,
    pause: u32,
}

impl StallGenerator {
    pub(super) fn new(stimulus: Stimulus) -> Self {
        let random = match stimulus {
            Stimulus::FullSpeed | Stimulus::BackToBack => None,
            Stimulus::Stalls { seed } => Some(fastrand::Rng::with_seed(seed)),
        };
        StallGenerator { random, pause: 0 }
    }

    pub(super) fn sends(&mut self) -> bool {
        self.random.as_mut().is_none_or(|r| r.bool())
    }

    pub(super) fn receives(&mut self) -> bool {
        let Some(random) = &mut self.random else {
            return true;
        };
        if self.pause > 0 {
            self.pause -= 1;
            return false;
        }
        if random.u32(..LONG_PAUSE_EVERY) == 0 {
            self.pause = LONG_PAUSE_CYCLES;
        }
        random.bool()
    }
}
