//! Changes that make a scene fit its board; each changed scene is planned, none is estimated.
//!
//! | change | tried |
//! |---|---|
//! | `fixed.lanes` left out | where the scene sets it: then as many as fit are used |
//! | `partition.cases` | one fewer, where the scene lists three or four |
//! | `partition` | finer grids that divide the array, the coarsest first, the paper's cases before others |
//! | `search.mu_max` | the largest value with three decimals for a polynomial of lower degree, then 0 |
//! | `fixed.prune_bits` | one bit fewer at a time |

use super::cases::planned;
use super::contents::Plan;
use super::cycles::Cycles;
use crate::estimate::degree::{CUBIC_FROM, SERIES_TOLERANCE};
use crate::fixed::error::{FitSuggestion, FixedError, Shortage};
use crate::physics::matrices::Matrices;
use crate::spec::partition::{Case, Grid};
use crate::spec::scene::Scene;
use crate::spec::scene::MAX_DEGREE;
use crate::spec::sensor::MIN_SIDE;

/// The plan, if its board has the resources.
///
/// # Errors
/// [`FixedError::DoesNotFit`] with the resources the board lacks and the changes that make the scene fit.
pub fn fitting(plan: Plan) -> Result<Plan, FixedError> {
    let lacking = plan.resources.shortages(&plan.board);
    if lacking.is_empty() {
        return Ok(plan);
    }
    let (board, scene) = (plan.board.name.clone(), plan.scene.name.clone());
    Err(FixedError::DoesNotFit(Box::new(Shortage { scene, board, lacking, suggestions: fit_suggestions(&plan) })))
}

/// Of each kind of change, the first that alone makes the scene fit.
fn fit_suggestions(plan: &Plan) -> Vec<FitSuggestion> {
    let scene = &plan.scene;
    let kinds = [
        lanes(scene).into_iter().find_map(suggestion),
        fewer_cases(scene).into_iter().find_map(suggestion),
        partitions(scene).into_iter().find_map(suggestion),
        degrees(plan).into_iter().find_map(suggestion),
        pruned(scene).find_map(suggestion),
    ];
    kinds.into_iter().flatten().collect()
}

/// The change as text and the changed scene.
type Change = (String, Scene);

fn suggestion((change, scene): Change) -> Option<FitSuggestion> {
    let plan = planned(&scene).ok()?;
    plan.resources.shortages(&plan.board).is_empty().then(|| FitSuggestion {
        change,
        degree: plan.formats().degree,
        lanes: 4 * plan.formats().lanes_per_parity,
        block_rams: plan.resources.block_rams(),
        multipliers: plan.resources.multipliers(),
        cycles: Cycles::longest(&plan).latency,
    })
}

fn lanes(scene: &Scene) -> Option<Change> {
    scene.fixed.lanes.map(|_| ("fixed.lanes left out".to_string(), scene.changed(|s| s.fixed.lanes = None)))
}

/// The list of cases without one of them, the coarser ones removed first.
fn fewer_cases(scene: &Scene) -> Vec<Change> {
    let Some(listed) = scene.partition.listed.filter(|listed| listed.iter().filter(|case| **case).count() > 2) else {
        return Vec::new();
    };
    let without = |number: usize| {
        let mut listed = listed;
        listed[number] = false;
        let left: Vec<String> = (0..4).filter(|&number| listed[number]).map(|number| number.to_string()).collect();
        let text = format!("partition.cases = [{}]", left.join(", "));
        (text, scene.changed(|s| s.partition.listed = Some(listed)))
    };
    (1..4).rev().filter(|&number| listed[number]).map(without).collect()
}

fn partitions(scene: &Scene) -> Vec<Change> {
    let sensor = &scene.sensor;
    // A single case takes less than several, even the coarsest one.
    let now = scene.partition.case.grid().map_or(0, |grid| grid.rows * grid.cols);
    let divides = |lines: usize, parts: &usize| lines.is_multiple_of(*parts) && lines / parts >= MIN_SIDE;
    let mut grids: Vec<Grid> = (1..=sensor.rows)
        .filter(|rows| divides(sensor.rows, rows))
        .flat_map(|rows| (1..=sensor.cols).map(move |cols| Grid { rows, cols }))
        .filter(|grid| divides(sensor.cols, &grid.cols) && grid.rows * grid.cols > now)
        .collect();
    let numbered = |grid: Grid| (0..=3).find(|&number| Case::numbered(number) == Some(Case::Grid(grid)));
    // Among grids of equally many subarrays the squarest first.
    grids.sort_by_key(|&g| (numbered(g).is_none(), g.rows * g.cols, g.rows.abs_diff(g.cols)));
    let change = |grid: Grid| {
        let case = Case::Grid(grid);
        let text = match numbered(grid) {
            Some(number) => format!("partition.case = {number}"),
            None => format!("partition.rows = {}, partition.cols = {}", grid.rows, grid.cols),
        };
        (text, scene.changed(|s| s.partition.case = case))
    };
    grids.into_iter().map(change).collect()
}

fn degrees(plan: &Plan) -> Vec<Change> {
    let scene = &plan.scene;
    let Ok(matrices) = Matrices::of(scene, &plan.parts()[0].sensor(&scene.sensor), MAX_DEGREE) else {
        return Vec::new();
    };
    let radii = [CUBIC_FROM.min(SERIES_TOLERANCE.cbrt()), SERIES_TOLERANCE.sqrt()];
    // r grows in proportion to mu_max.
    let largest = |radius: f64| (scene.search.mu_max * radius / matrices.spectral_radius * 1e3).floor() / 1e3;
    let lower = radii.map(largest).into_iter().chain([0.0]);
    lower
        .filter(|&mu_max| mu_max < scene.search.mu_max)
        .map(|mu_max| (format!("search.mu_max = {mu_max}"), scene.changed(|s| s.search.mu_max = mu_max)))
        .collect()
}

/// Smallest `fixed.prune_bits` of the scene's schema.
const MIN_PRUNE_BITS: u32 = 8;

fn pruned(scene: &Scene) -> impl Iterator<Item = Change> + '_ {
    (MIN_PRUNE_BITS..scene.fixed.prune_bits)
        .rev()
        .map(|bits| (format!("fixed.prune_bits = {bits}"), scene.changed(|s| s.fixed.prune_bits = bits)))
}
