//! The errors of a scene under noise, as `dermis noise` measures them.

use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind};
use dermis_study::noise::{by_name, shape_study, shapes_named, study, Candidate, ShapeStudy, Study, AVERAGED};
use pyo3::prelude::*;

use crate::exceptions::{input, not_allowed};
use crate::reconstruction::plain;
use crate::scene::{count, Scene};

/// The values of `names` that are wanted, called `field` in errors.
fn named<T: Copy>(field: &str, wanted: Option<Vec<String>>, names: &[(&str, T)]) -> PyResult<Vec<T>> {
    let refused = |name: &str, known: &str| not_allowed(field, format!("{name:?}"), &format!("of {known}"));
    let one = |name: &String| by_name(name, names).map_err(|known| refused(name, &known));
    wanted.unwrap_or_default().iter().map(one).collect()
}

/// What only a study over shapes has, as the caller gave it.
struct OverShapes {
    estimators: Option<Vec<String>>,
    contacts: Option<i64>,
    slip: Option<String>,
    gain_spread: Option<f64>,
    drift: Option<f64>,
    tare_frames: Option<i64>,
    unipolar: Option<bool>,
    stated: Option<bool>,
    hardware: Option<bool>,
}

impl OverShapes {
    /// The first parameter that was given.
    fn given(&self) -> Option<&'static str> {
        let all = [
            ("estimators", self.estimators.is_some()),
            ("contacts", self.contacts.is_some()),
            ("slip", self.slip.is_some()),
            ("gain_spread", self.gain_spread.is_some()),
            ("drift", self.drift.is_some()),
            ("tare_frames", self.tare_frames.is_some()),
            ("unipolar", self.unipolar.is_some()),
            ("stated", self.stated.is_some()),
            ("hardware", self.hardware.is_some()),
        ];
        all.iter().find(|(_, given)| *given).map(|(name, _)| *name)
    }

    /// The study that the command makes with the same options; `basic` has what both studies have.
    fn study(self, scene: &Scene, shapes: &str, basic: Study, frames: usize) -> PyResult<ShapeStudy> {
        let converter = Converter {
            gain_spread: self.gain_spread.unwrap_or(0.0),
            drift: self.drift.unwrap_or(0.0),
            tare_frames: count("tare_frames", self.tare_frames.unwrap_or(0))?,
            frames,
            unipolar: self.unipolar.unwrap_or(false) || scene.spec().input.unipolar,
            ..Converter::default()
        };
        let options = DrawOptions {
            shapes: shapes_named(shapes).map_err(|error| input(format!("shapes = {error}")))?,
            contacts: count("contacts", self.contacts.unwrap_or(1))?,
            slip: self
                .slip
                .map_or(Ok(Slip::Full), |name| name.parse())
                .map_err(|error| input(format!("slip = {error}")))?,
            seed: basic.seed,
            converter,
            ..DrawOptions::default()
        };
        let estimators = named("estimators", self.estimators, &EstimatorKind::NAMES)?;
        let mut candidates: Vec<Candidate> = estimators.into_iter().map(Candidate::Estimator).collect();
        candidates.extend(basic.objectives.into_iter().map(Candidate::Objective));
        if candidates.is_empty() {
            candidates.push(Candidate::Scene);
        }
        candidates.extend(self.hardware.unwrap_or(false).then_some(Candidate::Hardware));
        let (draws, levels, noise_stated) = (basic.draws, basic.levels, self.stated.unwrap_or(true));
        Ok(ShapeStudy { draws, levels, options, noise_stated, candidates, ..ShapeStudy::default() })
    }
}

#[pymethods]
impl Scene {
    /// Measure the errors under noise beside the Cramér-Rao bound: of the shear on random elliptic contacts, or with
    /// `shapes` of the forces on contacts of any shape.
    ///
    /// Parameters
    /// ----------
    /// levels : list of float, optional
    ///     Standard deviations of the noise over max |b|, 0 to 1; default: 0, 0.0001, 0.0005, 0.002, 0.01.
    /// draws : int, default 200
    ///     Number of random frames.
    /// seed : int, default 1
    ///     Seed of contacts and noise.
    /// objectives : list of str, optional
    ///     Objectives of the search; default: all, with `shapes` what the scene names.
    /// frames : int, optional
    ///     Frames that are averaged: in the second half of the rows, 1 leaves that half out, default 64; with `shapes` in
    ///     every reading, default 1.
    /// shapes : str, optional
    ///     Shapes that are drawn in turn: "mixed", "table", or names separated by commas, as `dermis noise --shapes`
    ///     takes them. The parameters below need it.
    /// estimators : list of str, optional
    ///     Estimators; default: what the scene names.
    /// contacts : int, default 1
    ///     Contacts of a frame.
    /// slip : str, default "full"
    ///     How the shear is spread over the contacts: "full", "even", "mixed", or its share of the friction limit, such as "0.4".
    /// gain_spread : float, default 0
    ///     Standard deviation of the taxels' gains, a fraction.
    /// drift : float, default 0
    ///     Standard deviation of the taxels' zeros since the tare over max |b|.
    /// tare_frames : int, default 0
    ///     Frames without contact whose noisy mean is subtracted; 0: none.
    /// unipolar : bool, optional
    ///     Whether tension reads as zero; default: what the scene says.
    /// stated : bool, default True
    ///     Whether the scene states noise and gain spread.
    /// hardware : bool, default False
    ///     Also the scene's hardware, by its bit-true model.
    ///
    /// Returns
    /// -------
    /// list of dict
    ///     A row per level, number of frames and objective or estimator, as `dermis noise --json` prints them; errors are fractions.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A parameter out of range, a scene that the model refuses.
    #[pyo3(signature = (*, levels = None, draws = 200, seed = 1, objectives = None, frames = None, shapes = None,
        estimators = None, contacts = None, slip = None, gain_spread = None, drift = None, tare_frames = None,
        unipolar = None, stated = None, hardware = None))]
    // One argument per option of the command.
    #[allow(clippy::too_many_arguments)]
    fn noise<'py>(
        &self,
        py: Python<'py>,
        levels: Option<Vec<f64>>,
        draws: i64,
        seed: i64,
        objectives: Option<Vec<String>>,
        frames: Option<i64>,
        shapes: Option<&str>,
        estimators: Option<Vec<String>>,
        contacts: Option<i64>,
        slip: Option<String>,
        gain_spread: Option<f64>,
        drift: Option<f64>,
        tare_frames: Option<i64>,
        unipolar: Option<bool>,
        stated: Option<bool>,
        hardware: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let frames: Option<usize> = frames.map(|frames| count("frames", frames)).transpose()?;
        let mut basic = Study {
            draws: count("draws", draws)?,
            seed: count("seed", seed)?,
            frames: frames.unwrap_or(AVERAGED),
            ..Study::default()
        };
        basic.levels = levels.unwrap_or(basic.levels);
        let objectives = named("objectives", objectives, &ObjectiveKind::NAMES)?;
        let own =
            OverShapes { estimators, contacts, slip, gain_spread, drift, tare_frames, unipolar, stated, hardware };
        if let Some(shapes) = shapes {
            let wanted = own.study(self, shapes, Study { objectives, ..basic }, frames.unwrap_or(1))?;
            let rows = py.detach(|| shape_study(self.spec(), &wanted, &|_, _| ())).map_err(input)?;
            return plain(py, &rows);
        }
        if let Some(name) = own.given() {
            return Err(input(format!("{name} needs shapes")));
        }
        if !objectives.is_empty() {
            basic.objectives = objectives;
        }
        let rows = py.detach(|| study(self.spec(), &basic, &mut |_, _| ())).map_err(input)?;
        plain(py, &rows)
    }
}
