//! The errors of a scene under noise, as `dermis noise` measures them.

use dermis_golden::noise::{study, Study};
use dermis_golden::scene::ObjectiveKind;
use pyo3::prelude::*;

use crate::exceptions::{input, not_allowed};
use crate::reconstruction::plain;
use crate::scene::{count, Scene};

fn objective(name: &str) -> PyResult<ObjectiveKind> {
    let named = ObjectiveKind::NAMES.iter().find(|(known, _)| *known == name);
    let known = || ObjectiveKind::NAMES.map(|(name, _)| name).join(", ");
    named
        .map(|(_, kind)| *kind)
        .ok_or_else(|| not_allowed("objectives", format!("{name:?}"), &format!("of {}", known())))
}

#[pymethods]
impl Scene {
    /// Measure the error of the shear under noise on random elliptic contacts, beside the Cramér-Rao bound.
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
    ///     Objectives of the search; default: all.
    /// frames : int, default 64
    ///     Frames that are averaged in the second half of the rows; 1 leaves that half out.
    ///
    /// Returns
    /// -------
    /// list of dict
    ///     A row per level, number of frames and objective, as `dermis noise --json` prints them; errors are fractions.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A parameter out of range, a scene that the model refuses.
    #[pyo3(signature = (*, levels = None, draws = 200, seed = 1, objectives = None, frames = 64))]
    fn noise<'py>(
        &self,
        py: Python<'py>,
        levels: Option<Vec<f64>>,
        draws: i64,
        seed: i64,
        objectives: Option<Vec<String>>,
        frames: i64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut wanted = Study {
            draws: count("draws", draws)?,
            seed: count("seed", seed)?,
            frames: count("frames", frames)?,
            ..Study::default()
        };
        wanted.levels = levels.unwrap_or(wanted.levels);
        if let Some(names) = objectives {
            wanted.objectives = names.iter().map(|name| objective(name)).collect::<PyResult<_>>()?;
        }
        let rows = py.detach(|| study(self.spec(), &wanted, &mut |_, _| ())).map_err(input)?;
        plain(py, &rows)
    }
}
