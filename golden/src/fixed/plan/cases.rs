//! The partition cases of a plan: that of the scene, or several on shared hardware of which each frame takes one.
//!
//! A case beyond the first adds counter limits, addresses, its coefficients in the shared memory and a frame buffer.
//! The result of a frame is to the bit that of the chosen case alone; [`choose`](crate::fixed::stages::choose) chooses
//! it.
//!
//! Where the scene lists no cases, the largest set of cases that fits the board is built, and of equally large sets the
//! one with the finest cases. A case left out is kept in [`Dropped`] with the resources of a design that includes it.

use super::contents::{CasePlan, ContactPlan, Dropped, OwnTables, Plan};
use super::cycles::SHORTEST_SWEEP;
use super::fit::{fit, Design};
use super::specimens::specimens;
use super::widths::{widths, CaseMatrices};
use crate::estimate::deviations::Deviations;
use crate::estimate::misfit::Misfit;
use crate::estimate::segment::{self, Segmenter};
use crate::fixed::error::FixedError;
use crate::fixed::stages::load::Outcome;
use crate::fixed::stages::prepare::{Prepare, Scale};
use crate::fixed::words::formats::{Formats, LOG_FRACTION};
use crate::fixed::words::quantised::Quantised;
use crate::physics::matrices::Matrices;
use crate::spec::adc::timing::Timing;
use crate::spec::board::{Board, EngineKind};
use crate::spec::partition::{subarrays, Case, PartitionError, Subarray};
use crate::spec::quads::Quads;
use crate::spec::scene::MAX_DEGREE;
use crate::spec::scene::{CodeCheck, HardwareSpec, Scene};
use crate::spec::sensor::Sensor;
use crate::spec::window::Window;

/// By how much norms of other sets of dead taxels may exceed those of the sets that are looked at; without it one specimen in
/// four would be refused.
const DEAD_MARGIN: f64 = 1.25;

/// The plan of a scene, whether it fits its board or not.
///
/// # Errors
/// As [`Model::new`](crate::fixed::Model::new), except [`FixedError::DoesNotFit`].
pub fn planned(scene: &Scene) -> Result<Plan, FixedError> {
    planned_with(scene, Scale::new(scene)?, None)
}

/// The plan with the given scale of the readings and, if given, degree of the polynomial.
///
/// # Errors
/// As [`planned`].
pub fn planned_with(scene: &Scene, scale: Scale, degree: Option<usize>) -> Result<Plan, FixedError> {
    scene.require_supported()?;
    let scene = &scene.clone().with_chosen_hardware();
    let board = Board::load(scene.hardware.board_name())?;
    if board.engine == EngineKind::Serial {
        scene.require_serial()?;
    }
    if let Some(scan) = scene.hardware.adc_scan {
        let timing = Timing::new(&scan, scene.sensor.rows, board.clock_MHz);
        timing.map_err(|error| FixedError::Scan { scene: scene.name.clone(), error })?;
    }
    match scene.partition.case {
        Case::Adaptive => several(scene, &scale, degree, &board),
        case => {
            let specimens = specimen_matrices(scene, case, degree)?;
            plan_of(scene, &scale, &board, vec![(case, case_matrices(scene, case, degree)?)], &specimens)
        }
    }
}

/// The plan of the cases that the scene lists, else of as many cases as fit the board, else of case 0 alone.
fn several(scene: &Scene, scale: &Scale, degree: Option<usize>, board: &Board) -> Result<Plan, FixedError> {
    let listed = scene.partition.listed.is_some();
    let mut choices = scene.partition.choices(&scene.sensor);
    // A case with too few quads is an error only where the scene lists it or no other is left.
    let large: Vec<Case> = choices.iter().copied().filter(|&case| is_large(scene, case)).collect();
    if !listed && large.len() > 1 {
        choices = large;
    }
    let short = |plan: &Plan| plan.resources.shortages(&plan.board);
    // If case 0 alone exceeds the board, so does every set of cases, since all contain it.
    let whole = case_matrices(scene, Case::WHOLE, degree)?;
    if !listed {
        let alone = plan_of(scene, scale, board, vec![(Case::WHOLE, whole.clone())], &[])?;
        if !short(&alone).is_empty() {
            return Ok(alone);
        }
    }
    let mut matrices = vec![whole];
    for &case in &choices[1..] {
        matrices.push(case_matrices(scene, case, degree)?);
    }
    let all: Vec<usize> = (0..choices.len()).collect();
    let of = |subset: &[usize]| -> Result<Plan, FixedError> {
        let pick = |&at: &usize| (choices[at], matrices[at].clone());
        plan_of(scene, scale, board, subset.iter().map(pick).collect(), &[])
    };
    if listed {
        return of(&all);
    }
    let mut plan = None;
    for subset in subsets(choices.len()) {
        let built = of(&subset)?;
        let fits = short(&built).is_empty();
        plan = Some((built, subset));
        if fits {
            break;
        }
    }
    let (mut plan, subset) = plan.ok_or(FixedError::Internal("no set of two cases to build"))?;
    // If no two cases fit, the last set tried is returned; whoever needs a design that fits asks what the board lacks.
    if short(&plan).is_empty() {
        for &at in all.iter().filter(|at| !subset.contains(at)) {
            let with: Vec<usize> = all.iter().copied().filter(|k| subset.contains(k) || *k == at).collect();
            plan.dropped.push(Dropped { case: choices[at], design: of(&with)? });
        }
    }
    Ok(plan)
}

/// The plan of `cases`; where there are several, case 0 is the first. Its formats serve `specimens` as well.
fn plan_of(
    scene: &Scene,
    scale: &Scale,
    board: &Board,
    cases: Vec<(Case, CaseMatrices)>,
    specimens: &[CaseMatrices],
) -> Result<Plan, FixedError> {
    let (cases, matrices): (Vec<Case>, Vec<CaseMatrices>) = cases.into_iter().unzip();
    let (designs, resources) = fit(scene, &matrices, board, widths(scene, &matrices, specimens, board)?);
    let force_exponent = designs[0].formats.force_exponent;
    let mut scene = scene.clone();
    let mut planned = Vec::with_capacity(cases.len());
    for (&case, design) in cases.iter().zip(designs) {
        let Design { formats, quantised, storage } = design;
        if cases.len() > 1 && !is_large(&scene, case) {
            return Err(FixedError::SmallCase { case, quads: formats.quads, least: SHORTEST_SWEEP });
        }
        planned.push(CasePlan { case, parts: parts(case, &scene.sensor)?, formats, quantised, storage });
    }
    let (score_limit, push_limit) = clean_limits(&scene)?;
    if let [only] = cases[..] {
        scene.partition.case = only;
    }
    if board.engine == EngineKind::Serial {
        scene.hardware.code_check = CodeCheck::Off;
    }
    if scene.hardware.table_range.has_coefficients() {
        // That of the specimen that needs most; all have it.
        scene.search.degree = Some(planned[0].formats.degree).filter(|degree| *degree > 0);
    }
    let Limits { prepare, own } = limits(&scene, scale.clone(), force_exponent)?;
    Ok(Plan {
        own,
        prepare,
        score_limit,
        push_limit,
        // Scenes with dead taxels have a single subarray.
        dead: match scene.hardware.has_writable_dead_taxels() {
            true => Vec::new(),
            false => planned[0].parts[0].local_indices(&scene.input.dead),
        },
        resources,
        by_contact: (scene.partition.case == Case::Contacts).then(|| ContactPlan {
            segmenter: Segmenter::new(&scene.sensor, segment::WIDTH),
            window: Window::around_contact(&scene.sensor),
        }),
        misfit: Misfit::of_scene(&scene, scene.hardware_estimator())?,
        board: board.clone(),
        scene,
        cases: planned,
        dropped: Vec::new(),
    })
}

/// The word of the least score and the least push of clean frames, see [`Plan::score_limit`] and [`Plan::push_limit`].
fn clean_limits(scene: &Scene) -> Result<(Option<i32>, Option<u32>), FixedError> {
    if scene.partition.case != Case::WHOLE {
        return Ok((None, None));
    }
    let Some(table) = Deviations::of_scene(scene, scene.hardware_estimator())? else { return Ok((None, None)) };
    let score = table.least_score.map(|bits| -(bits * f64::from(1u32 << LOG_FRACTION)) as i32);
    Ok((score, table.least_push))
}

/// What depends on the specimen of the array and on what its user wants to see.
pub struct Limits {
    /// Zero and gain of each taxel, and averaging.
    pub prepare: Prepare,
    /// Noise floor and threshold of each array; a force LSB is 2^`force_exponent` code LSBs in MPa · 1 N/MPa.
    pub own: Vec<OwnTables>,
}

/// The limits of a scene in the words of its hardware.
///
/// # Errors
/// [`FixedError::NoFullScale`].
pub fn limits(scene: &Scene, scale: Scale, force_exponent: i32) -> Result<Limits, FixedError> {
    let full_scale = scene.input.full_scale_MPa;
    if let (Some(field), None) = (scene.scaled_input(), full_scale) {
        return Err(FixedError::NoFullScale { field, value: scene.field_value(field) });
    }
    let scaled = |field, value: f64, unit: &dyn Fn(f64) -> f64| match full_scale {
        _ if value == 0.0 => Ok(0.0),
        Some(full_scale) => Ok(value / unit(full_scale)),
        None => Err(FixedError::NoFullScale { field, value: value.to_string() }),
    };
    let prepare = Prepare::new(scene, scale, full_scale.unwrap_or(1.0));
    let code_lsb = |full_scale: f64| full_scale / prepare.largest();
    let force_lsb = |full_scale: f64| code_lsb(full_scale) * 2f64.powi(force_exponent);
    let stated = |list: &[f64], of_each, common| if list.is_empty() { common } else { of_each };
    let HardwareSpec { array_noise_floors_MPa, array_min_forces_N, .. } = &scene.hardware;
    let floor = stated(array_noise_floors_MPa, "hardware.array_noise_floors_MPa", "search.noise_floor_MPa");
    let least = stated(array_min_forces_N, "hardware.array_min_forces_N", "threshold.min_force_N");
    let own = |array: usize| {
        let Scene { search, threshold, .. } = &scene.of_array(array);
        let noise_floor = scaled(floor, search.noise_floor_MPa(), &code_lsb)?;
        let threshold = scaled(least, threshold.min_force_N, &force_lsb)?;
        Ok(OwnTables {
            noise_floor: noise_floor.floor().min(f64::from(i32::MAX)) as i32,
            threshold: threshold.ceil().min(f64::from(u32::MAX)) as i64,
            version: 0,
            outcome: Outcome::Whole,
        })
    };
    let own: Result<Vec<OwnTables>, FixedError> = (0..scene.hardware.arrays).map(own).collect();
    Ok(Limits { own: own?, prepare })
}

/// The subarrays of a case; contacts are found on the whole array.
fn parts(case: Case, sensor: &Sensor) -> Result<Vec<Subarray>, PartitionError> {
    subarrays(if case == Case::Contacts { Case::WHOLE } else { case }, sensor)
}

/// The matrices of the specimens at the bounds of `hardware.table_range`.
fn specimen_matrices(scene: &Scene, case: Case, degree: Option<usize>) -> Result<Vec<CaseMatrices>, FixedError> {
    let of = |specimen: &Scene| {
        let matrices = case_matrices(specimen, case, degree)?;
        let margin = scene.hardware.table_range.dead_taxels > 0 && !specimen.input.dead.is_empty();
        Ok(if margin { matrices.scaled(DEAD_MARGIN) } else { matrices })
    };
    specimens(scene).iter().map(of).collect()
}

/// The matrices of a specimen in the words of the hardware of `plan`, which has one case; `None` if they need others.
///
/// # Errors
/// Those of the matrices.
pub fn requantised(plan: &Plan, specimen: &Scene) -> Result<Option<Quantised>, FixedError> {
    let (own, case) = (plan.first(), plan.first().case);
    let mut specimens = specimen_matrices(&plan.scene, case, None)?;
    specimens.push(case_matrices(&plan.scene, case, None)?);
    let widths = widths(&plan.scene, &[case_matrices(specimen, case, None)?], &specimens, &plan.board)?;
    let Formats { lanes_per_parity, groups, .. } = own.formats;
    let same = Formats { lanes_per_parity, groups, ..widths.formats } == own.formats;
    Ok(widths.quantised.into_iter().next().filter(|_| same))
}

/// The subarrays of a case and their matrices; the polynomial has `degree` if given, else the degree that the series
/// needs.
fn case_matrices(scene: &Scene, case: Case, degree: Option<usize>) -> Result<CaseMatrices, FixedError> {
    let parts = parts(case, &scene.sensor)?;
    // Scenes with dead taxels have a single subarray.
    let dead = parts[0].local_indices(&scene.input.dead);
    let mut matrices = Matrices::of(scene, &parts[0].sensor(&scene.sensor), MAX_DEGREE)?.without(&dead)?;
    matrices.degree = degree.unwrap_or(matrices.degree);
    Ok(CaseMatrices { matrices, parts: parts.len() })
}

/// Whether every subarray has the [`SHORTEST_SWEEP`] quads that a search shared by several cases needs.
fn is_large(scene: &Scene, case: Case) -> bool {
    let quads = |part: &Subarray| Quads { rows: part.rows, cols: part.cols }.len() as u64;
    subarrays(case, &scene.sensor).is_ok_and(|parts| parts.iter().all(|part| quads(part) >= SHORTEST_SWEEP))
}

/// All subsets of `count` cases with case 0 and at least one other, as indices: the largest first, then those with the
/// finest cases.
fn subsets(count: usize) -> Vec<Vec<usize>> {
    let of = |bits: usize| std::iter::once(0).chain((1..count).filter(move |k| bits >> k & 1 == 1));
    let mut all: Vec<Vec<usize>> = (2..1usize << count).step_by(2).map(|bits| of(bits).collect()).collect();
    all.sort_by(|a, b| b.len().cmp(&a.len()).then(a.cmp(b)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_subsets_come_first() {
        assert_eq!(subsets(2), [vec![0, 1]]);
        let four = subsets(4);
        assert_eq!(four.len(), 7);
        assert_eq!(four[..3], [vec![0, 1, 2, 3], vec![0, 1, 2], vec![0, 1, 3]]);
        assert_eq!(four[6], [0, 3]);
    }
}
