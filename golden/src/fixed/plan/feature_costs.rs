//! Cost of each optional feature: the scene's design with the feature added, or without it.
//!
//! The number of lanes stays that of the scene, so that only the feature makes the difference.

use super::cases::{planned, planned_with};
use super::contents::{CasePlan, Plan};
use crate::fixed::error::FixedError;
use crate::fixed::stages::prepare::Scale;
use crate::fixed::words::formats::MULTIPLIER_BITS;
use crate::spec::board::EngineKind;
use crate::spec::partition::{subarrays, Case};
use crate::spec::quads::Quads;
use crate::spec::scene::MAX_DEGREE;
use crate::spec::scene::{
    CodeCheck, CoefficientCheck, EstimatorKind, ForceOutput, MeanKind, RunningZero, Scene, SearchSpec, TableRange,
    TableStorage, Zero,
};
use crate::spec::sliding::most_frames;

/// Covers for which writable coefficients are counted where the scene has none, over its own thickness.
const OTHER_COVERS: [f64; 2] = [0.8, 1.25];

/// Arrays for which the engine is counted where the scene has one.
const OTHER_ARRAYS: usize = 16;

/// An optional feature of the hardware.
#[derive(Debug)]
pub struct Feature {
    /// Name of the feature.
    pub name: &'static str,
    /// The scene's setting, or the setting with which the feature was added.
    pub setting: String,
    /// The plan with the feature added, or why there is none; `None` if the scene has the feature.
    pub with_feature: Option<Result<Plan, FixedError>>,
    /// The plan without the feature, if the scene has it and its cost depends on the setting.
    pub without_feature: Option<Plan>,
}

/// All optional features in pipeline order. A scene that would exceed its board with a feature added is counted all the
/// same.
pub fn features(plan: &Plan) -> Vec<Feature> {
    let mut scene = plan.scene.clone();
    scene.fixed.lanes = Some(4 * plan.formats().lanes_per_parity as u32);
    if plan.chooses() {
        let built: Vec<u32> = plan.cases().iter().map(CasePlan::number).collect();
        scene.partition.listed = Some([0, 1, 2, 3].map(|number| built.contains(&number)));
    }
    let scene = &scene;
    let input = &scene.input;
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut changed = scene.clone();
        change(&mut changed);
        changed
    };
    let plain = planned;
    let of_zeros = |scene: &Scene, gains| Scale::of_tare(scene.hardware.arrays * scene.sensor.taxels(), gains);
    let scaled = |scene: &Scene, gains| planned_with(scene, of_zeros(scene, gains), None);
    let full_scale = input.full_scale_MPa.unwrap_or(1.0);

    let mut all = Vec::new();
    let mut add = |name, has: bool, setting: String, back: &dyn Fn() -> Result<Plan, FixedError>| {
        all.push(Feature { name, setting, with_feature: (!has).then(back), without_feature: None });
    };
    let set = |has: bool, own: String, back: &str| if has { own } else { back.to_string() };

    // The plan does not count the scan, which stands before the engine: a scene that has it lists it, without its cost.
    if let Some(scan) = scene.hardware.adc_scan {
        let setting = format!("{} {} on one bus", scan.converters, scan.converter.name);
        add("scan", true, setting, &|| plain(scene));
    }
    let checking = with(&|s| s.hardware.code_check = CodeCheck::On);
    if checking.checks_codes() && plan.board.engine == EngineKind::Parallel {
        add("code check", scene.checks_codes(), "plateaus, repeated rows and columns".into(), &|| plain(&checking));
    }
    let written = plan.has_writable_tables();
    let table = input.calibration.is_some() || written;
    let running = input.running_zero();
    let tare = table || input.tare.is_some();
    add("tare frame", tare, "a zero per taxel".into(), &|| {
        scaled(&with(&|s| (s.input.tare, s.input.full_scale_MPa) = (Some("".into()), Some(full_scale))), false)
    });
    add("calibration table", table, format!("a zero and a gain of {MULTIPLIER_BITS} bits per taxel"), &|| {
        scaled(&with(&|s| (s.input.calibration, s.input.full_scale_MPa) = (Some("".into()), Some(full_scale))), true)
    });
    add("writable tables", written, "zero, gain, noise floor and threshold".into(), &|| {
        let writable = (TableStorage::Writable, Some(full_scale));
        plain(&with(&|s| (s.hardware.tables, s.input.full_scale_MPa) = writable))
    });
    let runs = |s: &mut Scene| {
        let limit_MPa = full_scale * RunningZero::LIMIT_SHARE;
        s.input.zero = Zero::Running(RunningZero { average: RunningZero::AVERAGE, limit_MPa });
        s.input.full_scale_MPa = Some(full_scale);
    };
    let average = running.map_or(RunningZero::AVERAGE, |running| running.average);
    add("running zero", running.is_some(), format!("a gain of 2^−{average}"), &|| plain(&with(&runs)));
    let range = &scene.hardware.table_range;
    let covers = range.thickness_mm.unwrap_or(OTHER_COVERS.map(|of_own| of_own * scene.sensor.thickness_mm));
    let own = [
        range.thickness_mm.map(|[least, most]| format!("covers of {least} to {most} mm")),
        (range.dead_taxels > 0).then(|| format!("up to {} dead taxels", range.dead_taxels)),
    ];
    let own = own.into_iter().flatten().collect::<Vec<_>>().join(", ");
    let cover = format!("covers of {:.3} to {:.3} mm", covers[0], covers[1]);
    let coefficients = scene.hardware.has_writable_coefficients();
    add("writable coefficients", coefficients, set(coefficients, own, &cover), &|| {
        let writable = |s: &mut Scene| {
            (s.hardware.tables, s.input.full_scale_MPa) = (TableStorage::Writable, Some(full_scale));
            s.hardware.table_range.thickness_mm = Some(covers);
        };
        plain(&with(&writable))
    });
    let adaptive = |s: &mut Scene| {
        let average = if s.input.mean == MeanKind::Adaptive { s.input.average } else { 0 };
        (s.input.average, s.input.mean, s.input.template) = (average, MeanKind::Adaptive, false);
    };
    let (mean, power) = (input.mean, input.longest_average().max(1));
    let (slides, adapts) = (mean == MeanKind::Sliding, mean == MeanKind::Adaptive);
    let frames = if input.slides() { most_frames(power) } else { 1 << power };
    add("averaging", input.longest_average() > 0, format!("{frames} frames"), &|| {
        plain(&with(&|s| s.input.average = power))
    });
    add("sliding mean", slides, format!("gains from 1 to 2^−{power}"), &|| {
        plain(&with(&|s| (s.input.average, s.input.mean) = (power, MeanKind::Sliding)))
    });
    let longest = with(&adaptive).input.longest_average();
    add("adaptive mean", adapts, format!("the longest of {} frames", most_frames(longest)), &|| {
        plain(&with(&adaptive))
    });
    let several = scene.hardware.arrays > 1;
    let arrays = if several { scene.hardware.arrays } else { OTHER_ARRAYS };
    add("several arrays", several, format!("{arrays} arrays"), &|| plain(&with(&|s| s.hardware.arrays = arrays)));
    let parts = plan.parts().len();
    let quarters = Case::numbered(1).filter(|case| subarrays(*case, &scene.sensor).is_ok());
    if plan.chooses() {
        // The cases built stay the same, whatever else would fit.
        let cases: Vec<String> = plan.cases().iter().map(|case| case.case.to_string()).collect();
        add("choice of the case", true, format!("cases {} per frame", cases.join(", ")), &|| plain(scene));
    } else if parts > 1 {
        add("partition", true, format!("{parts} subarrays"), &|| plain(scene));
    } else if let Some(case) = quarters {
        add("partition", false, "2×2 subarrays".into(), &|| plain(&with(&|s| s.partition.case = case)));
    }
    let degree = plan.formats().degree;
    let mu_max = SearchSpec::default().mu_max;
    let own = format!("mu_max = {}", scene.search.mu_max);
    let back = if degree > 0 { scene.search.mu_max } else { mu_max };
    add("search", plan.searches(), set(degree > 0, own, &format!("mu_max = {mu_max}")), &|| {
        plain(&with(&|s| (s.search.mu_max, s.hardware.estimator) = (back, Some(EstimatorKind::Search))))
    });
    if plan.has_network() {
        let layers: Vec<String> = plan.formats().layers.iter().map(usize::to_string).collect();
        add("network", true, format!("layers of {} rows", layers.join(", ")), &|| plain(scene));
    }
    if plan.contacts() > 0 {
        add("contacts", true, format!("a μ for each of {} at most", plan.contacts()), &|| plain(scene));
    }
    if degree > 0 {
        let cubic = degree == MAX_DEGREE;
        add("polynomial of degree 3", cubic, "degree 3".into(), &|| {
            planned_with(scene, Scale::new(scene)?, Some(MAX_DEGREE))
        });
    }
    let width = plan.formats().search_width;
    // The serial engine searches one taxel at a time; where the case is chosen per frame, it is four.
    let chosen = plan.searches() && !plan.chooses() && plan.board.engine == EngineKind::Parallel;
    if chosen {
        add("search width", width == Quads::LANES, format!("{} taxels per cycle", Quads::LANES), &|| {
            plain(&with(&|s| s.hardware.search_width = Some(Quads::LANES)))
        });
    }
    // A threshold that is written is there whatever the scene's.
    let threshold = plan.built_in_threshold() != Some(0);
    let own = match plan.built_in_threshold() {
        None if !written => "of each array".to_owned(),
        _ => format!("{} N", scene.threshold.min_force_N),
    };
    add("threshold", threshold, set(threshold, own, "1 mN"), &|| {
        let thresholded = with(&|s| (s.threshold.min_force_N, s.input.full_scale_MPa) = (1e-3, Some(full_scale)));
        plain(&thresholded)
    });
    let dead = input.dead.len();
    let flips = &plan.formats().flips;
    let own = format!(
        "{dead} {}; parity flips: {} of Cz⁺, {} of Ax, {} of Ay",
        if dead == 1 { "taxel" } else { "taxels" },
        flips.inverse.len(),
        flips.ax.len(),
        flips.ay.len()
    );
    // A dead taxel in a corner breaks every symmetry.
    add("dead taxels", dead > 0, set(dead > 0, own, "dead = [[0, 0]]"), &|| {
        plain(&with(&|s| s.input.dead = vec![[0, 0]]))
    });
    add("coefficient check", plan.has_coefficient_check(), "a signature of the words read".into(), &|| {
        plain(&with(&|s| s.hardware.coefficient_check = CoefficientCheck::Signature))
    });
    let resultants = plan.sends_resultants();
    add("resultants", resultants, "a force and its moments per subarray".into(), &|| {
        plain(&with(&|s| s.output.forces = ForceOutput::Resultants))
    });
    let mut without = |name: &str, change: &dyn Fn(&mut Scene)| {
        let plan = plain(&with(change)).ok();
        all.iter_mut().filter(|feature| feature.name == name).for_each(|f| f.without_feature = plan.clone());
    };
    if scene.checks_codes() {
        without("code check", &|s| s.hardware.code_check = CodeCheck::Off);
    }
    if running.is_some() {
        without("running zero", &|s| s.input.zero = Zero::Fixed);
    }
    if slides {
        without("sliding mean", &|s| s.input.mean = MeanKind::Block);
    }
    if adapts {
        without("adaptive mean", &|s| (s.input.average, s.input.mean) = (power, MeanKind::Sliding));
    }
    if written {
        without("writable tables", &|s| (s.hardware.tables, s.hardware.table_range) = Default::default());
    }
    if several {
        without("several arrays", &|s| *s = s.of_array(0));
    }
    if coefficients {
        without("writable coefficients", &|s| {
            s.hardware.table_range = TableRange { gain: s.hardware.table_range.gain, ..TableRange::default() }
        });
    }
    if dead > 0 {
        without("dead taxels", &|s| s.input.dead.clear());
    }
    if chosen && width == Quads::LANES {
        without("search width", &|s| s.hardware.search_width = Some(1));
    }
    if let Some(push) = plan.push_limit {
        all.push(Feature {
            name: "negative pressure",
            setting: format!("flagged above 1/{} of all", 1 + push),
            with_feature: None,
            without_feature: Some(Plan { push_limit: None, ..plan.clone() }),
        });
    }
    all
}
