//! Input frames of the experiments with the model's results: a scene's shipped frames and synthetic ones.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::stages::prepare::Prepared;
use dermis_golden::fixed::{Cycles, Model};

/// Largest number of shipped frames used.
const SHIPPED: usize = 4;

/// The codes of one reconstruction and the bit-true model's results; where these depend on frames before, those after a
/// reset.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// Codes of all frames in order, each row-major.
    pub codes: Vec<i32>,
    /// Taxels per frame; `tlast` marks the last one.
    pub taxels: usize,
    /// Expected output: force beats, then status beats.
    pub beats: Vec<[i32; 3]>,
    /// Number of force beats.
    pub forces: usize,
    /// Cycle counts at full speed.
    pub cycles: Cycles,
    /// Cycles from the last input beat to each output beat, at full speed.
    pub beat_cycles: Vec<u64>,
}

/// A beat that is offered.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Code {
    /// A code, or a byte of an image.
    pub(super) data: i32,
    /// `tlast`.
    pub(super) last: bool,
    /// `tid`.
    pub(super) array: usize,
}

impl Sample {
    pub(super) fn new(model: &Model, codes: Vec<i32>) -> Sample {
        Sample::after(model, codes, &mut model.prepare.empty())
    }

    /// With the results of `codes` after the frames of which `prepared` is; it is then of these too.
    fn after(model: &Model, codes: Vec<i32>, prepared: &mut Prepared) -> Sample {
        model.add(prepared, &codes);
        Sample::of(model, codes, prepared)
    }

    /// With the results of `prepared`, which is of these codes and of those before.
    pub(super) fn of(model: &Model, codes: Vec<i32>, prepared: &Prepared) -> Sample {
        let trace = model.run_prepared(prepared);
        let forces = trace.beats.len();
        let beats = [trace.beats, trace.status].concat();
        Sample {
            codes,
            taxels: model.scene.sensor.taxels(),
            beats,
            forces,
            cycles: trace.cycles,
            beat_cycles: trace.beat_cycles,
        }
    }

    /// The same codes as the second reconstruction after a reset, behind `first`.
    pub(crate) fn behind(&self, model: &Model, first: &Sample) -> Sample {
        match model.scene.input.has_memory() {
            false => self.clone(),
            true => Sample::after(model, self.codes.clone(), &mut model.prepare.run(&first.codes)),
        }
    }

    /// Whether any force is not zero.
    pub(crate) fn has_force(&self) -> bool {
        self.beats[..self.forces].iter().any(|beat| *beat != [0; 3])
    }
}

/// Samples of the first shipped frames.
///
/// # Errors
/// A frame of another sensor.
pub(crate) fn shipped_samples(model: &Model, frames: &[Frame]) -> Result<Vec<Sample>> {
    let whole = frames.chunks_exact(model.scene.input.frames_per_result()).take(SHIPPED);
    whole.map(|frames| Ok(Sample::new(model, model.readings(frames)?))).collect()
}

/// Synthetic samples: zeros, all codes at either end of their range, noise of two amplitudes, a single loaded taxel.
pub(crate) fn synthetic_samples(model: &Model, random: &mut fastrand::Rng) -> Vec<Sample> {
    let taxels = model.scene.sensor.taxels();
    let count = taxels * model.scene.input.frames_per_result();
    let most = (1i32 << (model.formats().code_bits - 1)) - 1;
    let mut noise = |most: i32| (0..count).map(|_| random.i32(-most - 1..=most)).collect::<Vec<_>>();
    let alone = (0..count).map(|index| if index % taxels == taxels / 2 { most / 3 } else { 0 }).collect();
    let all = [vec![0; count], vec![most; count], vec![-most - 1; count], noise(most), noise(7), alone];
    all.into_iter().map(|codes| Sample::new(model, codes)).collect()
}
