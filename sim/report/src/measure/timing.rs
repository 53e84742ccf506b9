//! Times per frame on the CPU: three repeats over the frames, one engine at a time.

use std::time::{Duration, Instant};

use anyhow::Result;

use dermis_golden::quantile::median;

/// Number of repeats of every engine.
pub const REPEATS: usize = 3;
/// Time after which a repeat runs no further frame; each repeat runs at least one.
const PATIENCE: Duration = Duration::from_secs(2);

/// Times per frame, in s.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Median over the frames, for each repeat.
    pub repeats: Vec<f64>,
}

impl Timing {
    /// Median of the repeats.
    pub fn seconds(&self) -> f64 {
        median(self.repeats.clone()).unwrap_or(f64::NAN)
    }

    /// Measures `run` on each frame, given by its index.
    pub(super) fn of(frames: usize, mut run: impl FnMut(usize) -> Result<()>) -> Result<Timing> {
        let mut repeats = Vec::with_capacity(REPEATS);
        for _ in 0..REPEATS {
            let (begin, mut times) = (Instant::now(), Vec::with_capacity(frames));
            for frame in 0..frames {
                let start = Instant::now();
                run(frame)?;
                times.push(start.elapsed().as_secs_f64());
                if begin.elapsed() > PATIENCE {
                    break;
                }
            }
            repeats.extend(median(times));
        }
        Ok(Timing { repeats })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_in_every_repeat() {
        let mut seen = Vec::new();
        let timing = Timing::of(2, |frame| {
            seen.push(frame);
            std::thread::sleep(Duration::from_millis(1));
            Ok(())
        });
        assert_eq!(seen, [0, 1, 0, 1, 0, 1]);
        assert!(timing.unwrap().seconds() >= 1e-3);
    }
}
