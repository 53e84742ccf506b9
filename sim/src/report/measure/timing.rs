//! Times of a frame on the CPU: three repeats over the frames, one engine at a time.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::{Engine, Measured};
use crate::compare::median;

/// Repeats of every engine on every frame.
pub const REPEATS: usize = 3;
/// An engine gets no further frame in a repeat that has lasted so long; each repeat has one at least.
const PATIENCE: Duration = Duration::from_secs(2);

/// Times of a frame, in s.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Median over the frames, of each repeat.
    pub repeats: Vec<f64>,
}

impl Timing {
    /// The middle repeat.
    pub fn seconds(&self) -> f64 {
        median(self.repeats.clone()).unwrap_or(f64::NAN)
    }

    /// Times `run` on each frame by its index.
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

/// Times every engine that the case has.
pub(super) fn time(measured: &Measured) -> Result<BTreeMap<Engine, Timing>> {
    let frames = &measured.frames;
    let mut times = BTreeMap::new();
    times.insert(
        Engine::Golden,
        Timing::of(frames.len(), |k| {
            measured.engine.run(&frames[k])?;
            Ok(())
        })?,
    );
    if let Ok(bit_true) = &measured.bit_true {
        times.insert(
            Engine::Fixed,
            Timing::of(frames.len(), |k| {
                bit_true.model.reconstruct(&frames[k])?;
                Ok(())
            })?,
        );
    }
    if let Some(literal) = &measured.literal {
        times.insert(
            Engine::Baseline,
            Timing::of(frames.len(), |k| {
                literal.run(&frames[k])?;
                Ok(())
            })?,
        );
    }
    Ok(times)
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
