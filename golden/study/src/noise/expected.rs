//! Expected: the errors to expect of a scene, from drawn frames at its stated noise and friction.
//!
//! The noise of the scene is an absolute stress, that of a study a share of max |b|: a peak relates them. Without either,
//! the errors are those of the study's default levels.
//!
//! | | unit | |
//! |---|---|---|
//! | in: scene | – | noise as stated or shown by tare frames, of the mean of its frames; mu_max |
//! | in: peak | MPa | largest stress of a press; `None`: the scene's full scale |
//! | out: rows | – | the baseline, the scene's estimator, and where asked for the hardware |
//! | out: rows of the other medium | – | the same estimators on frames whose cover is held otherwise |
//!
//! The frames are stress already: calibration, tare and averaging are left out, their noise is in the level; so is the
//! threshold, since the loads are scaled. The ratio of
//! shear to load is that of [`DrawOptions`], in proportion to the scene's mu_max.

use super::{other_medium, shape_study, Candidate, SensitivityRow, ShapeRow, ShapeStudy, StudyError};
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::input::Input;
use dermis_golden::estimate::float::GoldenError;
use dermis_golden::spec::scene::{InputSpec, Scene, SearchSpec, ThresholdSpec};

/// What to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// Largest stress of a press in MPa; `None`: the scene's full scale.
    pub peak_MPa: Option<f64>,
    /// Number of frames, 1 to 100 000.
    pub draws: usize,
    /// Seed of contacts and noise.
    pub seed: u64,
    /// Whether the hardware is compared as well, by its bit-true model.
    pub with_hardware: bool,
}

/// Noise of a reconstructed frame and the peak that relates it to a share.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StatedNoise {
    /// Standard deviation in MPa, of the mean of the scene's frames; `None` if neither scene nor tare frames show it.
    pub noise_MPa: Option<f64>,
    /// Largest stress of a press in MPa, if known.
    pub peak_MPa: Option<f64>,
}

impl StatedNoise {
    /// The noise that the scene states or its tare frames show.
    ///
    /// # Errors
    /// [`GoldenError::Input`] if table or tare frames cannot be read.
    pub fn of(scene: &Scene, peak_MPa: Option<f64>) -> Result<StatedNoise, GoldenError> {
        let noise_MPa = Some(Input::new(scene)?.noise_MPa()).filter(|noise| *noise > 0.0);
        Ok(StatedNoise { noise_MPa, peak_MPa: peak_MPa.or(scene.input.full_scale_MPa) })
    }

    /// Noise over peak.
    pub fn share(&self) -> Option<f64> {
        Some(self.noise_MPa? / self.peak_MPa?)
    }
}

/// The errors to expect; `progress` is called after every frame with the number of frames done and of all.
///
/// ```
/// use dermis_golden::spec::scene::Scene;
/// use dermis_study::noise::expected::{expected, Expectation, StatedNoise};
///
/// let mut scene = Scene::builtin("eight-by-eight")?;
/// scene.search.noise_floor_MPa = Some(1e-4);
/// let expectation = Expectation { peak_MPa: Some(0.2), draws: 4, seed: 1, with_hardware: true };
/// let noise = StatedNoise::of(&scene, expectation.peak_MPa)?;
/// assert_eq!(noise.share(), Some(5e-4));
/// let rows = expected(&scene, &expectation, &noise, &|_, _| ())?;
/// assert_eq!(rows.len(), 3);
/// assert!(rows.iter().all(|row| row.noise == 5e-4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`shape_study`].
pub fn expected(
    scene: &Scene,
    expectation: &Expectation,
    noise: &StatedNoise,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<ShapeRow>, StudyError> {
    let (bare, study) = drawn(scene, expectation, noise);
    shape_study(&bare, &study, progress)
}

/// The errors where the cover is held otherwise than the scene states, at its noise or without any, by [`other_medium`].
///
/// # Errors
/// As [`other_medium`].
pub fn of_other_medium(
    scene: &Scene,
    expectation: &Expectation,
    noise: &StatedNoise,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<SensitivityRow>, StudyError> {
    let (bare, mut study) = drawn(scene, expectation, noise);
    study.levels.truncate(1);
    other_medium(&bare, &study, progress)
}

/// The scene as far as it matters to frames of stress, and what is drawn for it.
fn drawn(scene: &Scene, expectation: &Expectation, noise: &StatedNoise) -> (Scene, ShapeStudy) {
    let mut bare = scene.clone().with_chosen_hardware();
    let InputSpec { dead, unipolar, gain_spread, plausible_MPa, .. } = scene.input.clone();
    bare.hardware.take_stress();
    bare.input = InputSpec { dead, unipolar, gain_spread, plausible_MPa, ..InputSpec::default() };
    bare.search.noise_floor_MPa = Some(0.0);
    bare.threshold = ThresholdSpec::default();
    let converter = Converter { gain_spread, unipolar, ..Converter::default() };
    let mut options = DrawOptions { seed: expectation.seed, converter, ..DrawOptions::default() };
    let SearchSpec { mu_max, .. } = scene.search;
    if mu_max > 0.0 {
        options.ratio = options.ratio.map(|ratio| ratio * mu_max / SearchSpec::default().mu_max);
    }
    let mut candidates = vec![Candidate::Scene];
    candidates.extend(expectation.with_hardware.then_some(Candidate::Hardware));
    let share = noise.share();
    let levels = share.map_or_else(|| ShapeStudy::default().levels, |share| vec![share]);
    // Where the scene states no noise, the golden model finds it in the frame.
    let noise_stated = share.is_some();
    let study =
        ShapeStudy { levels, draws: expectation.draws, options, noise_stated, candidates, ..ShapeStudy::default() };
    (bare, study)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expectation(peak_MPa: Option<f64>) -> Expectation {
        Expectation { peak_MPa, draws: 6, seed: 3, with_hardware: true }
    }

    fn rows(scene: &Scene, peak_MPa: Option<f64>) -> Vec<ShapeRow> {
        let noise = StatedNoise::of(scene, peak_MPa).unwrap();
        expected(scene, &expectation(peak_MPa), &noise, &|_, _| ()).unwrap()
    }

    #[test]
    fn averaging_halves_the_noise_and_the_peak_relates_it() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        scene.search.noise_floor_MPa = Some(4e-4);
        assert_eq!(StatedNoise::of(&scene, None).unwrap().share(), None);
        scene.input.full_scale_MPa = Some(0.4);
        assert_eq!(StatedNoise::of(&scene, None).unwrap().share(), Some(1e-3));
        scene.input.average = 2;
        assert_eq!(StatedNoise::of(&scene, None).unwrap().share(), Some(5e-4));
        assert_eq!(StatedNoise::of(&scene, Some(0.1)).unwrap().share(), Some(2e-3));
    }

    #[test]
    fn less_noise_has_smaller_errors_and_the_hardware_has_larger_ones() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let mut median = |noise: f64, estimator: usize| {
            scene.search.noise_floor_MPa = Some(noise);
            rows(&scene, Some(0.1))[estimator].summary.tangential.median.value
        };
        let (quiet, noisy, hardware) = (median(1e-6, 1), median(1e-3, 1), median(1e-4, 2));
        assert!(quiet < noisy && quiet < hardware, "{quiet} {noisy} {hardware}");
    }

    /// Each medium read as the other costs most of the shear or more, in both models, at the stated noise.
    #[test]
    fn the_other_medium_costs_the_shear() {
        for (name, other) in [("eight-by-eight", "bonded-layer, poisson 0.48"), ("eight-by-eight-bonded", "half-space")]
        {
            let mut scene = Scene::builtin(name).unwrap();
            scene.search.noise_floor_MPa = Some(1e-6);
            let noise = StatedNoise::of(&scene, Some(0.1)).unwrap();
            let wrong = of_other_medium(&scene, &expectation(Some(0.1)), &noise, &|_, _| ()).unwrap();
            let right = rows(&scene, Some(0.1));
            assert_eq!((wrong.len(), right.len()), (2, 3));
            for (wrong, right) in wrong.iter().zip(&right[1..]) {
                assert_eq!((wrong.medium.as_str(), &wrong.estimator), (other, &right.estimator));
                let [wrong, right] = [&wrong.summary, &right.summary].map(|summary| summary.tangential.median.value);
                assert!(wrong > 0.25 && wrong > 3.0 * right, "{name}: {wrong} {right}");
            }
        }
    }

    #[test]
    fn without_a_stated_noise_the_errors_are_those_of_several_levels() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        scene.threshold.min_force_N = 0.01;
        let rows = rows(&scene, None);
        assert_eq!(rows.len(), 3 * ShapeStudy::default().levels.len());
        assert!(rows.iter().all(|row| !row.noise_stated));
    }
}
