//! Time of a frame's packets on each link of a scene's board.

use anyhow::Result;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;

use super::super::host::link_times;
use dermis_flow::progress::Progress;

/// Scenes of the table: the smallest array, that of the first example, and the largest.
const SCENES: [&str; 3] = ["eight-by-eight", "sensor-1", "sensor-4"];

/// The table, of `names` or else of the table's own scenes.
///
/// # Errors
/// A scene that cannot be loaded or has no hardware.
pub fn run(names: &[String]) -> Result<String> {
    let own = || SCENES.map(str::to_owned).to_vec();
    let names = if names.is_empty() { own() } else { names.to_vec() };
    let mut models = Vec::new();
    for name in names {
        let _progress = Progress::start(&format!("{name}: model"));
        models.push(Model::new(&Scene::load(&name)?)?);
    }
    Ok(link_times(&models))
}
