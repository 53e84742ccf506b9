//! Measurement of error against noise for the report.

use anyhow::Result;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{EstimatorKind, ObjectiveKind, Scene};
use dermis_study::noise::{shape_study, Candidate, ShapeRow, ShapeStudy};

use super::measured::{Measured, Options};
use dermis_flow::progress::Progress;

/// Number of drawn frames: quick, full variant.
const DRAWN: [usize; 2] = [20, 200];
/// Contacts of a frame of scenes that tell contacts apart.
const CONTACTS: usize = 3;

/// Error against noise of one scene.
pub struct NoiseStudy {
    /// Name of the scene.
    pub scene: String,
    /// Whether the scene states the noise.
    pub noise_stated: bool,
    /// A row for each estimator and level.
    pub rows: Vec<ShapeRow>,
}

/// Error against noise on contacts of five shapes: of the first scene, for what it names, the estimator `evidence` and two
/// objectives of the search; of scenes with a network, for their golden model and their hardware, which is one design whatever
/// the noise. The quick variant has the first of either.
///
/// # Errors
/// A scene that the golden model refuses, contacts that do not fit, an interruption.
pub fn noise(measured: &[Measured], options: &Options) -> Result<Vec<NoiseStudy>> {
    let network = |m: &&Measured| m.scene.hardware_estimator() == EstimatorKind::Network;
    let first = measured.iter().find(|m| m.scene.partition.case == Case::WHOLE && !network(m));
    let most = if options.quick { 1 } else { usize::MAX };
    let networks = measured.iter().filter(|m| network(m) && m.bit_true.is_ok()).take(most);
    let candidates = |scene: &Scene, noise_stated: bool| {
        let mut candidates = vec![Candidate::Scene];
        let [sparse, patch] = [ObjectiveKind::Sparse, ObjectiveKind::Patch].map(Candidate::Objective);
        let others = match noise_stated {
            true => vec![Candidate::Estimator(EstimatorKind::Evidence), sparse, patch],
            false => vec![Candidate::Estimator(EstimatorKind::Network), Candidate::Hardware],
        };
        for other in others {
            if candidates.iter().all(|known| known.name(scene) != other.name(scene)) {
                candidates.push(other);
            }
        }
        candidates
    };
    let draws = DRAWN[usize::from(!options.quick)];
    let study = |(m, noise_stated): (&Measured, bool)| {
        let scene = &m.scene;
        let contacts = if scene.partition.case == Case::Contacts { CONTACTS } else { 1 };
        let converter = Converter { unipolar: scene.input.unipolar, ..Default::default() };
        let drawn = DrawOptions { contacts, converter, ..Default::default() };
        let wanted = ShapeStudy {
            draws,
            candidates: candidates(scene, noise_stated),
            noise_stated,
            options: drawn,
            ..Default::default()
        };
        let bar = Progress::steps(&format!("{}: noise", scene.name), 0);
        let rows = shape_study(scene, &wanted, &|done, total| bar.set_of(done as u64, total as u64))?;
        options.interrupt.check()?;
        Ok(NoiseStudy { scene: scene.name.clone(), noise_stated, rows })
    };
    first.map(|m| (m, true)).into_iter().chain(networks.map(|m| (m, false))).map(study).collect()
}
