//! Inputs: what a network in training sees of drawn frames, of one sensor or of those of a range.
//!
//! Of a range [`SENSORS`] sensors are drawn once, each with contacts of its own; the frames of a step are of some of them, [`GROUP`] of each.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: scene, training | – | – |
//! | out: features, and the place of the sensor in a range | channels × frames | – |
//! | out: μ | 2 × frames | of mu_max |

use super::error::LearnedError;
use super::features::Features;
use super::frames::Frames;
use super::network::Parities;
use super::options::Training;
use super::signature::{Cover, SensorRange, Signature};
use crate::physics::symmetry::folded::EVEN;
use crate::random::Random;
use crate::spec::scene::Scene;
use faer::Mat;
use rayon::prelude::*;

/// Sensors of a range.
const SENSORS: usize = 96;
/// Frames of a step that are of one sensor of a range.
const GROUP: usize = 16;

/// Frames of every sensor of a training, as inputs of the network.
pub(super) struct Inputs {
    sensors: Vec<OfSensor>,
    /// Inputs of the network.
    channels: usize,
    /// Contacts drawn of each sensor.
    drawn: usize,
}

/// Frames of one sensor.
struct OfSensor {
    features: Features,
    frames: Frames,
    /// The inputs that state where it lies in the range.
    range_inputs: Option<[f32; SensorRange::INPUTS]>,
}

impl Inputs {
    /// No frames yet, of a scene and a training; `seed` is that of the contacts.
    ///
    /// # Errors
    /// [`LearnedError::Frames`] or [`LearnedError::NotConverged`].
    pub fn new(scene: &Scene, signature: &Signature, training: &Training, seed: u64) -> Result<Inputs, LearnedError> {
        let window = signature.window;
        let of = |scene: &Scene| {
            Ok(OfSensor {
                features: Features::new(&window, &scene.sensor, scene.medium)?,
                frames: Frames::new(scene, window, training, seed)?,
                range_inputs: match &signature.cover {
                    Cover::One { .. } => None,
                    Cover::Range(range) => Some(range.inputs_of(&scene.sensor, scene.medium)),
                },
            })
        };
        let sensors = signature.cover.scenes(scene, SENSORS).iter().map(of).collect::<Result<_, LearnedError>>()?;
        let channels = Features::channels(&window) + signature.cover.inputs();
        Ok(Inputs { sensors, channels, drawn: 0 })
    }

    /// Number of inputs.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Draws until at least `count` contacts of all sensors together have been drawn, at least one of each.
    ///
    /// # Errors
    /// As [`Frames::draw`].
    pub fn draw(&mut self, count: usize) -> Result<(), LearnedError> {
        let of_each = count.div_ceil(self.sensors.len());
        if of_each > self.drawn {
            self.drawn = of_each;
            // Of each there may be too few for two threads.
            self.sensors.par_iter_mut().try_for_each(|sensor| sensor.frames.draw(of_each))?;
        }
        Ok(())
    }

    /// Mixes `frames` frames of the contacts drawn so far: the inputs of the network, and μ in units of mu_max. `noise` is the range of
    /// the noise in units of the peak.
    pub fn mix(&self, frames: usize, noise: [f64; 2], random: &mut Random) -> (Parities, Mat<f32>) {
        if let [sensor] = &self.sensors[..] {
            return sensor.mix(frames, noise, random);
        }
        let mut inputs: Parities = std::array::from_fn(|_| Mat::zeros(self.channels, frames));
        let mut truth = Mat::zeros(2, frames);
        for first in (0..frames).step_by(GROUP) {
            let count = GROUP.min(frames - first);
            let sensor = random.between(0.0, self.sensors.len() as f64) as usize;
            let (own, of_own) = self.sensors[sensor.min(self.sensors.len() - 1)].mix(count, noise, random);
            for (inputs, own) in inputs.iter_mut().zip(&own) {
                inputs.subcols_mut(first, count).copy_from(own);
            }
            truth.subcols_mut(first, count).copy_from(&of_own);
        }
        (inputs, truth)
    }
}

impl OfSensor {
    /// As [`Inputs::mix`].
    fn mix(&self, frames: usize, noise: [f64; 2], random: &mut Random) -> (Parities, Mat<f32>) {
        let (readings, truth) = self.frames.mix(frames, noise, random);
        let mut inputs = self.features.of(&readings);
        if let Some(values) = self.range_inputs {
            for (parity, inputs) in inputs.iter_mut().enumerate() {
                let channels = inputs.nrows();
                inputs.resize_with(channels + values.len(), frames, |row, _| match parity {
                    EVEN => values[row - channels],
                    _ => 0.0,
                });
            }
        }
        (inputs, truth)
    }
}
