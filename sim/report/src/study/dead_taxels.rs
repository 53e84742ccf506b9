//! Dead taxels: errors of both models with taxels left out, and the latency that they cost, on drawn frames of one contact.

use anyhow::{ensure, Result};
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use super::super::table::{aligned, percent};
use super::drawn::{one_contact, tangential};
use dermis_cosim::compare::difference;
use dermis_flow::progress::Progress;
use dermis_golden::quantile::{median, quantile};

/// Built-in scenes and their dead taxels: one and several, in the middle, on the edge and in the corner.
pub const LINES: [(&str, &[[usize; 2]]); 4] = [
    ("eight-by-eight", &[[3, 4]]),
    ("eight-by-eight", &[[0, 0], [2, 5], [5, 5], [6, 1]]),
    ("sensor-1", &[[4, 6]]),
    ("sensor-1", &[[0, 3], [2, 3], [5, 5], [5, 6], [9, 9]]),
];
/// Share of the frames whose difference the last figure does not exceed.
const MOST: f64 = 0.9;

/// A scene with its dead taxels.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadTaxelRow {
    /// Median tangential error of the golden model, a fraction.
    pub golden: Option<f64>,
    /// The bit-true model's.
    pub fixed: Option<f64>,
    /// Largest difference of a force over the largest force, median over the frames.
    pub apart: Option<f64>,
    /// What that difference does not exceed in nine of ten frames.
    pub apart_ninety: Option<f64>,
    /// From the last input beat to the last output beat, in clock cycles.
    pub latency: u64,
}

/// A built-in scene without these taxels, under a name of its own, which generated files carry.
///
/// # Errors
/// A scene that is not built in.
pub fn masked(name: &str, dead: &[[usize; 2]]) -> Result<Scene> {
    let mut scene = Scene::builtin(name)?;
    scene.input.dead = dead.to_vec();
    scene.name = format!("{name}-{}-dead", dead.len());
    Ok(scene)
}

/// The row of one scene.
///
/// # Errors
/// A scene that one of the models refuses.
pub fn measure(scene: &Scene) -> Result<DeadTaxelRow> {
    let (model, golden) = (Model::new(scene)?, Golden::reference(scene)?);
    let frames = one_contact(scene)?;
    let float: Vec<Reconstruction> = frames.iter().map(|frame| golden.run(frame)).collect::<Result<_, _>>()?;
    let fixed: Vec<Reconstruction> = frames.iter().map(|frame| model.reconstruct(frame)).collect::<Result<_, _>>()?;
    let apart = |(a, b): (&Reconstruction, &Reconstruction)| difference(&a.forces_N, &b.forces_N, 1.0).max_share;
    let shares: Vec<f64> = float.iter().zip(&fixed).map(apart).collect();
    Ok(DeadTaxelRow {
        golden: tangential(&float),
        fixed: tangential(&fixed),
        apart: median(shares.clone()),
        apart_ninety: quantile(shares, MOST),
        latency: Cycles::longest(&model).latency,
    })
}

/// The table, of the scenes called by one of `names`, all where there is none.
///
/// # Errors
/// A name that the table does not have; as [`measure`].
pub fn run(names: &[String]) -> Result<String> {
    for name in names {
        let known = LINES.map(|(name, _)| name);
        ensure!(known.contains(&name.as_str()), "dead-taxels: no scene {name:?}; known: {}, {}", known[0], known[2]);
    }
    let mut rows = Vec::new();
    for (name, dead) in LINES.into_iter().filter(|(name, _)| names.is_empty() || names.iter().any(|n| n == name)) {
        let scene = masked(name, dead)?;
        let _progress = Progress::start(&format!("{}: errors", scene.name));
        let row = measure(&scene)?;
        let errors = [row.golden, row.fixed, row.apart, row.apart_ninety].map(percent);
        let labels = vec![name.to_owned(), dead.len().to_string()];
        rows.push([labels, errors.to_vec(), vec![row.latency.to_string()]].concat());
    }
    let head =
        ["scene", "dead", "e_t golden", "e_t fixed", "fixed − golden, median", "in nine of ten", "latency, cycles"];
    let legend = "fixed − golden: largest difference of a force over the frame's largest force";
    Ok(format!("{}\n{legend}\n", aligned(2, &head, rows)))
}
