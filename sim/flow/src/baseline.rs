//! Results of place and route by board and scene: `baselines.json` beside the boards' files, for the built-in boards the
//! committed `constraints/baselines.json`.
//!
//! `dermis bitstream --update-baselines` writes the file if the clock is met. Without that option `dermis bitstream`
//! fails if its result is slower or larger than the baseline, beyond the tolerances below.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::tools::ToolError;
use dermis_golden::plain_words::JsonError;
use dermis_golden::spec::board::Board;
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;

/// Name of the file, beside the board's.
const FILE: &str = "baselines.json";
/// Content of the file when this program was built.
const COMMITTED: &str = include_str!("../../../constraints/baselines.json");
/// Allowed relative loss of the best seed's clock; about the scatter of place and route.
const SLOWER: f64 = 0.10;
/// Allowed relative increase of look-up tables and flip-flops; tool versions differ by less.
const LARGER: f64 = 0.05;

/// Path of the baselines of a board; of a built-in one relative to the repository's root.
pub fn path(board: &Board) -> PathBuf {
    board.folder().join(FILE)
}

/// Result of a scene on a board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// Look-up tables.
    pub luts: u64,
    /// Flip-flops.
    pub flip_flops: u64,
    /// Multipliers.
    pub multipliers: u64,
    /// Block RAMs.
    pub block_rams: u64,
    /// Highest clock of the best seed, of which the bitstream is made, MHz.
    pub best_MHz: f64,
    /// Highest clock of the median seed, MHz.
    pub median_MHz: f64,
    /// Highest clock of the slowest seed, MHz.
    pub worst_MHz: f64,
    /// Number of seeds placed and routed.
    pub seeds: u32,
}

impl Baseline {
    /// The figures in which `now` is worse beyond tolerance, each with both values.
    pub fn regressions(&self, now: &Baseline) -> Vec<String> {
        let mut regressions = Vec::new();
        if now.best_MHz < self.best_MHz * (1.0 - SLOWER) {
            regressions.push(format!("{:.1} MHz, was {:.1} MHz", now.best_MHz, self.best_MHz));
        }
        let cells = [
            ("LUTs", now.luts, self.luts, LARGER),
            ("flip-flops", now.flip_flops, self.flip_flops, LARGER),
            ("multipliers", now.multipliers, self.multipliers, 0.0),
            ("block RAMs", now.block_rams, self.block_rams, 0.0),
        ];
        for (what, now, was, tolerance) in cells {
            if now as f64 > was as f64 * (1.0 + tolerance) {
                regressions.push(format!("{now} {what}, was {was}"));
            }
        }
        regressions
    }
}

/// Baselines by board and scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Baselines(pub BTreeMap<String, BTreeMap<String, Baseline>>);

impl Baselines {
    /// The baselines built into this program; empty if they cannot be parsed ([`Baselines::read`] reports why).
    pub fn committed() -> Baselines {
        serde_json::from_str(COMMITTED).unwrap_or_default()
    }

    /// Reads the file at `path`; empty if there is no file.
    ///
    /// # Errors
    /// [`ToolError::File`]; [`ToolError::Output`] with line and field if the file cannot be parsed.
    pub fn read(path: &Path) -> Result<Baselines, ToolError> {
        if !path.exists() {
            return Ok(Baselines::default());
        }
        let text = std::fs::read_to_string(path).map_err(ToolError::io(path))?;
        let wrong = |e| ToolError::Output { path: path.to_owned(), reason: JsonError::new(&e).to_string() };
        serde_json::from_str(&text).map_err(wrong)
    }

    /// Writes the file at `path`, completely or not at all.
    ///
    /// # Errors
    /// [`ToolError::File`].
    pub fn write(&self, path: &Path) -> Result<(), ToolError> {
        let wrong = |e: serde_json::Error| ToolError::Output { path: path.to_owned(), reason: e.to_string() };
        let text = serde_json::to_string_pretty(self).map_err(wrong)? + "\n";
        Ok(write(path, text.as_bytes())?)
    }

    /// The built-in scenes that have a baseline, each on its board and with its search width; the tests' own are left out.
    pub fn built_in(&self) -> Vec<(Scene, &Baseline)> {
        let all =
            self.0.iter().flat_map(|(on, scenes)| scenes.iter().map(move |(name, baseline)| (on, name, baseline)));
        let on_board = |(on, name, baseline): (&String, &String, _)| {
            let mut scene = built_in(name)?;
            scene.hardware.board = Some(on.clone());
            Some((scene, baseline))
        };
        all.filter_map(on_board).collect()
    }

    /// The baseline of a scene on a board.
    pub fn get(&self, board: &str, scene: &str) -> Option<&Baseline> {
        self.0.get(board)?.get(scene)
    }
}

/// Between the name of a scene and its search width, in the name of a variant.
const WIDTH: &str = "-width-";

/// The scene with `width` taxels per cycle in its search: a variant with a name, a folder and baselines of its own.
pub fn with_search_width(mut scene: Scene, width: usize) -> Scene {
    scene.name.push_str(&format!("{WIDTH}{width}"));
    scene.hardware.search_width = Some(width);
    scene
}

/// The built-in scene, or variant of one, of this name.
fn built_in(name: &str) -> Option<Scene> {
    let (base, width) = match name.rsplit_once(WIDTH) {
        Some((base, width)) => (base, Some(width.parse().ok()?)),
        None => (name, None),
    };
    if !Scene::builtin_names().contains(&base) {
        return None;
    }
    let scene = Scene::builtin(base).ok()?;
    Some(match width {
        Some(width) => with_search_width(scene, width),
        None => scene,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline() -> Baseline {
        Baseline {
            luts: 40_000,
            flip_flops: 30_000,
            multipliers: 70,
            block_rams: 60,
            best_MHz: 110.0,
            median_MHz: 105.0,
            worst_MHz: 99.5,
            seeds: 3,
        }
    }

    #[test]
    fn the_committed_file_is_whole() {
        assert_eq!(serde_json::from_str::<Baselines>(COMMITTED).unwrap(), Baselines::committed());
    }

    #[test]
    fn a_variant_is_found_by_its_name_and_a_scene_of_the_tests_is_not() {
        let variant = with_search_width(Scene::builtin("sensor-1").unwrap(), 2);
        assert_eq!(variant.name, "sensor-1-width-2");
        let mut all = Baselines::default();
        let on = all.0.entry("ulx3s-85f".into()).or_default();
        for name in ["sensor-1", &variant.name, "tiny", "sensor-1-width-x"] {
            on.insert(name.into(), baseline());
        }
        let scenes: Vec<Scene> = all.built_in().into_iter().map(|(scene, _)| scene).collect();
        let on_board = |mut scene: Scene| {
            scene.hardware.board = Some("ulx3s-85f".into());
            scene
        };
        assert_eq!(scenes, [Scene::builtin("sensor-1").unwrap(), variant].map(on_board));
    }

    #[test]
    fn slower_and_larger_is_a_loss() {
        let was = baseline();
        let now = Baseline { best_MHz: 100.0, luts: 41_900, ..was.clone() };
        assert_eq!(was.regressions(&now), Vec::<String>::new());
        let now = Baseline { best_MHz: 98.0, luts: 42_100, block_rams: 61, ..was.clone() };
        assert_eq!(
            was.regressions(&now),
            ["98.0 MHz, was 110.0 MHz", "42100 LUTs, was 40000", "61 block RAMs, was 60"]
        );
    }

    #[test]
    fn the_file_reads_back_and_a_wrong_field_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("baselines.json");
        assert_eq!(Baselines::read(&path).unwrap(), Baselines::default());
        let mut all = Baselines::default();
        all.0.entry("ulx3s-85f".into()).or_default().insert("sensor-1".into(), baseline());
        all.write(&path).unwrap();
        assert_eq!(Baselines::read(&path).unwrap(), all);
        let text = std::fs::read_to_string(&path).unwrap().replace("best_MHz", "fast_MHz");
        std::fs::write(&path, text).unwrap();
        assert!(Baselines::read(&path).unwrap_err().to_string().contains("fast_MHz"));
    }
}
