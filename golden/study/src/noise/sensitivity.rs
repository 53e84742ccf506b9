//! Sensitivity: errors if the scene states something wrongly, or the sensor's gains differ.
//!
//! Frames are drawn on the true scene and read by one that is off in one quantity.
//!
//! | quantity | off by |
//! |---|---|
//! | nothing | – |
//! | cover thickness, both pitches | ±2, ±5, ±10 % |
//! | Poisson ratio of a bonded layer (0.45 on a half-space scene) | the same, below 0.5 |
//! | medium: a bonded layer stated as half-space | – |
//! | gain spread, not stated | 0.5, 1, 3, 10 % |
//!
//! [`other_medium`] alone costs a scene's user no more than its own errors: a bonded layer read as a half-space, or the other way.

use super::outcome::Summary;
use super::shapes::{outcomes, readings, stated, ShapeStudy};
use super::StudyError;
use crate::steps::steps;
use dermis_golden::data::generator::draws::DrawnFrame;
use dermis_golden::spec::scene::{Medium, Scene};
use serde::Serialize;

/// Shares by which a quantity is stated wrongly.
const OFF: [f64; 6] = [-0.10, -0.05, -0.02, 0.02, 0.05, 0.10];
/// Spreads of the gains.
const GAINS: [f64; 4] = [0.005, 0.01, 0.03, 0.10];
/// Poisson ratio of the layer for scenes on a half-space: 10 % more is still below 0.5.
const POISSON: f64 = 0.45;
const HALF_SPACE_FOR_LAYER: &str = "half-space for bonded layer";

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensitivityRow {
    /// What is stated wrongly.
    pub what: &'static str,
    /// By which share; for the gains their spread; `None` for nothing and for the medium.
    pub off: Option<f64>,
    /// Medium on which the frames are drawn.
    pub medium: String,
    /// Name of the estimator in scenes, with that of the objective for the search.
    pub estimator: String,
    /// The errors.
    #[serde(flatten)]
    pub summary: Summary,
}

/// What is true, what is stated, and the spread of the gains.
struct Setting {
    what: &'static str,
    off: Option<f64>,
    truth: Scene,
    stated: Scene,
    gain_spread: f64,
}

/// Measures the sensitivities at the first noise level of `study`, for each of its candidates; `progress` is called
/// after every frame with the number of frames done and of all.
///
/// # Errors
/// As [`super::shape_study`].
pub fn sensitivities(
    scene: &Scene,
    study: &ShapeStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SensitivityRow>, StudyError> {
    measured(settings(scene), study, progress)
}

/// The errors where the cover is held otherwise than `scene` states: bonded to a rigid base where it states a half-space, thick or
/// free where it states a layer. As [`sensitivities`].
///
/// ```
/// use dermis_golden::spec::scene::Scene;
/// use dermis_study::noise::{other_medium, Candidate, ShapeStudy};
///
/// let study = ShapeStudy { draws: 6, candidates: vec![Candidate::Scene], ..Default::default() };
/// let rows = other_medium(&Scene::builtin("eight-by-eight-bonded")?, &study, &|_, _| ())?;
/// // A quarter of the shear and more.
/// assert!(rows[0].medium == "half-space" && rows[0].summary.tangential.median.value > 0.25);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`sensitivities`].
pub fn other_medium(
    scene: &Scene,
    study: &ShapeStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SensitivityRow>, StudyError> {
    let (what, medium) = match scene.medium {
        Medium::HalfSpace => (HALF_SPACE_FOR_LAYER, Medium::BondedLayer { poisson: Medium::ELASTOMER }),
        Medium::BondedLayer { .. } => ("bonded layer for half-space", Medium::HalfSpace),
    };
    let truth = Scene { medium, ..scene.clone() };
    measured(vec![Setting { what, off: None, truth, stated: scene.clone(), gain_spread: 0.0 }], study, progress)
}

/// The errors of each setting at the first noise level of `study`, for each of its candidates.
fn measured(
    settings: Vec<Setting>,
    study: &ShapeStudy,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SensitivityRow>, StudyError> {
    study.check()?;
    let total = settings.len() * study.candidates.len() * study.draws;
    let step = steps(progress, total);
    let mut rows = Vec::new();
    let mut known: Vec<(Medium, Vec<DrawnFrame>)> = Vec::new();
    for setting in settings {
        let medium = setting.truth.medium;
        if known.iter().all(|(other, _)| *other != medium) {
            known.push((medium, study.frames(&setting.truth)?));
        }
        let drawn = known.iter().find(|(other, _)| *other == medium).map_or(&[][..], |(_, drawn)| drawn);
        let mut converter = study.converter(0);
        let own = stated(&setting.stated, &converter, study.noise_stated);
        converter.gain_spread = converter.gain_spread.hypot(setting.gain_spread);
        let readings = readings(drawn, &converter, &own)?;
        for &candidate in &study.candidates {
            let outcomes = outcomes(candidate, &candidate.stated(&own), drawn, &readings, &step)?;
            rows.push(SensitivityRow {
                what: setting.what,
                off: setting.off,
                medium: medium.to_string(),
                estimator: candidate.name(&own),
                summary: Summary::of(&outcomes.iter().collect::<Vec<_>>()),
            });
        }
    }
    Ok(rows)
}

fn settings(scene: &Scene) -> Vec<Setting> {
    let poisson = if let Medium::BondedLayer { poisson } = scene.medium { poisson } else { POISSON };
    let bonded = Scene { medium: Medium::BondedLayer { poisson }, ..scene.clone() };
    let setting =
        |what, off, truth: &Scene, stated: Scene| Setting { what, off, truth: truth.clone(), stated, gain_spread: 0.0 };
    let mut settings = vec![setting("nothing", None, scene, scene.clone())];
    for off in OFF {
        let mut thick = scene.clone();
        thick.sensor.thickness_mm *= 1.0 + off;
        settings.push(setting("cover thickness", Some(off), scene, thick));
    }
    for off in OFF {
        let mut wide = scene.clone();
        wide.sensor.pitch_x_mm *= 1.0 + off;
        wide.sensor.pitch_y_mm *= 1.0 + off;
        settings.push(setting("pitch", Some(off), scene, wide));
    }
    for off in OFF {
        let wrong = poisson * (1.0 + off);
        if Medium::allows_poisson(wrong) {
            let stated = Scene { medium: Medium::BondedLayer { poisson: wrong }, ..scene.clone() };
            settings.push(setting("Poisson ratio", Some(off), &bonded, stated));
        }
    }
    let half_space = Scene { medium: Medium::HalfSpace, ..scene.clone() };
    settings.push(setting(HALF_SPACE_FOR_LAYER, None, &bonded, half_space));
    for spread in GAINS {
        let plain = setting("gain spread", Some(spread), scene, scene.clone());
        settings.push(Setting { gain_spread: spread, ..plain });
    }
    settings
}
