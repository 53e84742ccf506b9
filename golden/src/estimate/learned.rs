//! Learned: the ratio μ of shear to normal force by a small network, trained on the scene's own physics.
//!
//! Frames with known forces cost nothing: contacts are drawn, their stress is computed, noise is added. A perceptron that
//! has seen some ten million of them knows which μ such stress has on average, and how far that may be off. Where noise
//! hides the exact shape of the pressure it is better than what is computed for one frame; without noise it is not.
//!
//! ```text
//! b, mask ── window ── features ── network ── μ1, μ2 and their σ ── evidence at that μ: forces, misfit, flags
//! training:  frames ── features ── network ── loss ── Adam        file: weights of 12 bits, signature
//! ```
//!
//! | file | step |
//! |---|---|
//! | `window` | the taxels that are read |
//! | `features` | stress over a power of two, two deconvolutions, mask; in parities |
//! | `network` | layers with the mirror symmetry |
//! | `first_layer` | the first one behind the features |
//! | `forward` | all layers behind the features, for one frame |
//! | `signature` | what it is trained for: a sensor, or a range of them |
//! | `options`, `frames`, `inputs`, `training`, `adam` | drawn frames, loss, steps |
//! | `file` | bytes |
//! | `trial` | a network of a few steps, for tests |
//! | `onnx` | the network as a file for other programs |
//! | `composed` | the layers as plain matrices of the stress, for the hardware |
//!
//! A mirrored frame has the mirrored μ because no layer can do otherwise; in parities that costs a quarter of the products.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress of one contact | taxels | MPa |
//! | out: μ with standard deviations | 2 | – |

mod adam;
mod composed;
mod error;
mod features;
mod file;
mod first_layer;
mod forward;
mod frames;
mod inputs;
mod network;
mod onnx;
mod options;
mod signature;
#[cfg(test)]
mod tests;
mod training;
mod trial;

pub use composed::ComposedLayer;
pub use error::LearnedError;
pub use frames::{GAINS, NOISE, RATIO};
pub(crate) use network::LN_SIGMA;
pub use network::OUTPUT_ROWS;
pub use options::Training;
pub use signature::{Cover, SensorRange, Signature};
pub use training::{Stage, MEASURED_NOISE};
pub use trial::with_network;

use crate::read::bytes_up_to;
use crate::spec::quads::Quads;
use crate::spec::scene::{EstimatorKind, Medium, Scene};
use crate::spec::sensor::Sensor;
use faer::Mat;
use features::{power_above, Features, Readings};
use first_layer::FirstLayer;
use forward::Forward;
use network::{Network, Parities};
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::Path;

/// Largest file of a network in bytes.
const LARGEST_FILE: u64 = 64 << 20;

/// Networks that are part of the program: `search.network` without its folder, and bytes.
const SHIPPED: [(&str, &[u8]); 8] = [
    ("dermis:sensor-1", include_bytes!("../../scenes/sensor-1.network")),
    ("dermis:sensor-1-unipolar", include_bytes!("../../scenes/sensor-1-unipolar.network")),
    ("dermis:sensor-1-bonded", include_bytes!("../../scenes/sensor-1-bonded.network")),
    ("dermis:sensor-3-contacts", include_bytes!("../../scenes/sensor-3-contacts.network")),
    ("dermis:eight-by-eight-bonded", include_bytes!("../../scenes/eight-by-eight-bonded.network")),
    ("dermis:eight-by-eight-contacts", include_bytes!("../../scenes/eight-by-eight-contacts.network")),
    ("dermis:bonded", include_bytes!("../../scenes/bonded.network")),
    ("dermis:bonded-unipolar", include_bytes!("../../scenes/bonded-unipolar.network")),
];

/// A trained network, ready for the array of a scene.
pub struct Learned {
    signature: Signature,
    /// Those of the scene it was read for.
    sensor: Sensor,
    medium: Medium,
    features: Features,
    network: Network,
    /// Its first layer behind the features.
    first: FirstLayer,
    /// Both for one frame.
    forward: Forward,
}

/// μ from the network, as a normal density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Mean of μ, [x, y].
    pub mean: [f64; 2],
    /// Standard deviation of μ, [x, y].
    pub sigma: [f64; 2],
}

/// The stress of one contact.
pub struct OneContact<'a> {
    /// Stress on every taxel of the array, that of other contacts taken out.
    pub b: &'a [f64],
    /// Which taxels are not dead.
    pub alive: &'a [bool],
    /// Centre of pressure in mm from the array's centre.
    pub centre_mm: [f64; 2],
}

/// A finished training.
pub struct Trained {
    /// The network, its weights as the file has them.
    pub learned: Learned,
    /// The file.
    pub bytes: Vec<u8>,
    /// Steps done.
    pub steps: usize,
    /// Mean loss of the first and of the last twentieth of the steps.
    pub loss: [f64; 2],
}

impl Learned {
    /// Trains a network for a scene; `progress` sees what is done, and may end it: then the result is the best
    /// network so far.
    ///
    /// # Errors
    /// [`LearnedError::Option`], [`LearnedError::Frames`], [`LearnedError::NotConverged`] or [`LearnedError::Diverged`].
    pub fn train(
        scene: &Scene,
        training: &Training,
        progress: &mut dyn FnMut(&Stage) -> ControlFlow<()>,
    ) -> Result<Trained, LearnedError> {
        let mut signature = Signature::of(scene);
        if let Some(pitch_over_thickness) = training.pitch_over_thickness {
            let poisson = matches!(scene.medium, Medium::BondedLayer { .. }).then_some(SensorRange::POISSON);
            signature.cover =
                Cover::Range(SensorRange { pitch_over_thickness, poisson, least_side: training.least_side });
        }
        let (network, losses) = training::train(scene, &signature, training, progress)?;
        let bytes = file::encode(&network, &signature)?;
        // The scene itself may lie outside the range.
        let own = &signature.cover.scenes(scene, 1)[0];
        let learned = Learned::from_bytes(own, EstimatorKind::Network, &bytes, "the trained network")?;
        Ok(Trained { learned, bytes, steps: losses.steps, loss: [losses.first, losses.last] })
    }

    /// The network that a scene names with `search.network`, for one of its estimators: a file, or `dermis:NAME`, a part of
    /// the program.
    ///
    /// # Errors
    /// [`LearnedError::NoNetwork`], [`LearnedError::Unreadable`], [`LearnedError::Damaged`] or
    /// [`LearnedError::Mismatch`].
    pub fn of_scene(scene: &Scene, estimator: EstimatorKind) -> Result<Learned, LearnedError> {
        let (bytes, file) = bytes_of(scene)?;
        Learned::from_bytes(scene, estimator, &bytes, &file)
    }

    /// What the network was trained for that a scene names.
    ///
    /// # Errors
    /// As [`Learned::misfit_limit`].
    pub fn signature_of(scene: &Scene) -> Result<Signature, LearnedError> {
        let (bytes, file) = bytes_of(scene)?;
        file::signature(&bytes, &file)
    }

    /// The network of the program, by the name for `search.network`, that serves the hardware of a scene; `None` without one.
    ///
    /// ```
    /// use dermis_golden::estimate::learned::Learned;
    /// use dermis_golden::spec::scene::Scene;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let sensor = "rows = 8\ncols = 10\npitch_x_mm = 3.0\npitch_y_mm = 2.5\nthickness_mm = 2.0\n";
    /// let scene = Scene::parse(&format!("[sensor]\n{sensor}[medium]\nkind = \"bonded-layer\"\npoisson = 0.47\n"), "pad.toml")?;
    /// assert_eq!(Learned::serving(&scene), Some("dermis:bonded"));
    /// # Ok(())
    /// # }
    /// ```
    pub fn serving(scene: &Scene) -> Option<&'static str> {
        let serves = |(name, bytes): &&(&str, &[u8])| {
            file::signature(bytes, name).is_ok_and(|own| own.check(scene, EstimatorKind::Network, name).is_ok())
        };
        SHIPPED.iter().find(serves).map(|(name, _)| *name)
    }

    /// The limit of [`crate::estimate::misfit`] of the network that a scene names; `None` for a file without one.
    ///
    /// # Errors
    /// [`LearnedError::NoNetwork`], [`LearnedError::Unreadable`] or [`LearnedError::Damaged`].
    pub fn misfit_limit(scene: &Scene) -> Result<Option<f64>, LearnedError> {
        let (bytes, file) = bytes_of(scene)?;
        file::limit(&bytes, &file)
    }

    /// The bytes of the network that a scene names, with this limit of [`crate::estimate::misfit`]; its weights stay as they are.
    ///
    /// # Errors
    /// As [`Learned::misfit_limit`].
    pub fn with_misfit_limit(scene: &Scene, limit: f64) -> Result<Vec<u8>, LearnedError> {
        let (bytes, file) = bytes_of(scene)?;
        file::with_limit(&bytes, limit, &file)
    }

    /// The network in the bytes of a file, for an estimator of a scene; `file` names it in errors.
    ///
    /// # Errors
    /// [`LearnedError::Damaged`] or [`LearnedError::Mismatch`].
    pub fn from_bytes(
        scene: &Scene,
        estimator: EstimatorKind,
        bytes: &[u8],
        file: &str,
    ) -> Result<Learned, LearnedError> {
        let (mut network, signature) = file::decode(bytes, file)?;
        signature.check(scene, estimator, file)?;
        if let Cover::Range(range) = &signature.cover {
            network = network.with_stated(&range.inputs_of(&scene.sensor, scene.medium));
        }
        let features = Features::new(&signature.window, &scene.sensor, scene.medium)?;
        let first = FirstLayer::new(&features, &network.layers[0]);
        let forward = Forward::new(&first, &network.layers[1..]);
        Ok(Learned { signature, sensor: scene.sensor.clone(), medium: scene.medium, features, network, first, forward })
    }

    /// What the network was trained for.
    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Number of weights.
    pub fn weights(&self) -> usize {
        self.network.widths().windows(2).map(|pair| Quads::LANES * pair[0] * pair[1]).sum()
    }

    /// What a window has of one contact.
    fn readings(&self, contact: &OneContact) -> Readings {
        let window = self.signature.window;
        let n = window.taxels();
        let origin = window.origin(&self.sensor, contact.centre_mm);
        let taxels = window.taxels_of(&self.sensor, origin);
        let (mut b, mut masked) = (Mat::zeros(n, 1), Mat::zeros(n, 1));
        for (own, taxel) in taxels.iter().enumerate() {
            match taxel.filter(|taxel| contact.alive[*taxel]).map(|taxel| contact.b[taxel] as f32) {
                // A unipolar array reads no tension, also where that of another contact was taken out.
                Some(stress) => b[(own, 0)] = if self.signature.unipolar { stress.max(0.0) } else { stress },
                None => masked[(own, 0)] = 1.0,
            }
        }
        Readings { b, masked }
    }

    /// μ of one contact.
    pub fn shear(&self, contact: &OneContact) -> Gaussian {
        let Readings { b, masked } = self.readings(contact);
        let scale = power_above(b.norm_max()).recip();
        let stress = self.features.in_parities(&b, &|_| scale);
        let mask = (masked.norm_max() > 0.0).then(|| self.features.in_parities(&masked, &|_| 1.0));
        self.in_scene(self.forward.shear(first_frame(&stress), mask.as_ref().map(first_frame)))
    }

    /// Mean and standard deviation in units of mu_max as those of a μ of at most mu_max.
    fn in_scene(&self, (mean, sigma): ([f64; 2], [f64; 2])) -> Gaussian {
        let of_scene = |values: [f64; 2]| values.map(|value| value * self.signature.mu_max);
        let mut found = Gaussian { mean: of_scene(mean), sigma: of_scene(sigma) };
        let size = found.mean[0].hypot(found.mean[1]);
        if size > self.signature.mu_max {
            found.mean = found.mean.map(|mu| mu * self.signature.mu_max / size);
        }
        found
    }
}

/// The values of the first frame.
fn first_frame(of: &Parities) -> [&[f32]; 4] {
    of.each_ref().map(|own| own.col_as_slice(0))
}

/// The bytes of the network that a scene names, and the name for errors.
fn bytes_of(scene: &Scene) -> Result<(Cow<'static, [u8]>, String), LearnedError> {
    let Some(path) = &scene.search.network else {
        return Err(LearnedError::NoNetwork { scene: scene.name.clone() });
    };
    let file = path.display().to_string();
    match SHIPPED.iter().find(|(name, _)| path.file_name().is_some_and(|file| file == *name)) {
        Some((name, bytes)) => Ok((Cow::Borrowed(bytes), (*name).to_owned())),
        None => Ok((Cow::Owned(read(path, &file)?), file)),
    }
}

/// The bytes of a file.
fn read(path: &Path, file: &str) -> Result<Vec<u8>, LearnedError> {
    let unreadable = |source| LearnedError::Unreadable { file: file.to_owned(), source };
    let too_large = || LearnedError::Damaged { file: file.to_owned(), reason: "it is too large".to_owned() };
    bytes_up_to(LARGEST_FILE, path).map_err(unreadable)?.ok_or_else(too_large)
}
