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
    let mut list = List { plan, scene: &scene, all: Vec::new() };
    list.codes();
    list.tables();
    list.means();
    list.arrays();
    list.estimate();
    list.forces();
    list.all
}

/// The features that have been listed.
struct List<'p> {
    plan: &'p Plan,
    scene: &'p Scene,
    all: Vec<Feature>,
}

/// One of two settings: the scene's `own` if it `has` the feature, else that with which it is added.
fn set(has: bool, own: String, added: &str) -> String {
    if has {
        own
    } else {
        added.to_string()
    }
}

impl List<'_> {
    /// Adds a feature; where the scene does not have it, its plan.
    fn add_plan(
        &mut self,
        name: &'static str,
        has: bool,
        setting: String,
        plan: impl FnOnce() -> Result<Plan, FixedError>,
    ) {
        let with_feature = (!has).then(plan);
        self.all.push(Feature { name, setting, with_feature, without_feature: None });
    }

    /// Adds a feature that a scene without it has after a change.
    fn add(&mut self, name: &'static str, has: bool, setting: String, change: impl FnOnce(&mut Scene)) {
        let scene = self.scene;
        self.add_plan(name, has, setting, || planned(&scene.changed(change)));
    }

    /// Adds a feature of the scene that is not added to others.
    fn add_own(&mut self, name: &'static str, setting: String) {
        self.add(name, true, setting, |_| ());
    }

    /// The plan after a change without the feature added last, where the scene has it.
    fn without(&mut self, change: impl FnOnce(&mut Scene)) {
        if let Some(feature) = self.all.last_mut().filter(|feature| feature.with_feature.is_none()) {
            feature.without_feature = planned(&self.scene.changed(change)).ok();
        }
    }

    /// The scene's full scale, or one for scenes without.
    fn full_scale_MPa(&self) -> f64 {
        self.scene.input.full_scale_MPa.unwrap_or(1.0)
    }

    /// What gives the codes and checks them.
    fn codes(&mut self) {
        // The plan does not count the scan, which stands before the engine: a scene that has it lists it, without its cost.
        if let Some(scan) = self.scene.hardware.adc_scan {
            self.add_own("scan", format!("{} {} on one bus", scan.converters, scan.converter.name));
        }
        let check = |s: &mut Scene| s.hardware.code_check = CodeCheck::On;
        if self.scene.changed(check).checks_codes() && self.plan.board.engine == EngineKind::Parallel {
            let checks = self.scene.checks_codes();
            self.add("code check", checks, "plateaus, repeated rows and columns".into(), check);
            self.without(|s| s.hardware.code_check = CodeCheck::Off);
        }
    }

    /// Zeros and gains of the taxels, and what can be written.
    fn tables(&mut self) {
        let (scene, input, full_scale) = (self.scene, &self.scene.input, self.full_scale_MPa());
        let scaled = |scene: &Scene, gains| {
            planned_with(scene, Scale::of_tare(scene.hardware.arrays * scene.sensor.taxels(), gains), None)
        };
        let written = self.plan.has_writable_tables();
        let table = input.calibration.is_some() || written;
        self.add_plan("tare frame", table || input.tare.is_some(), "a zero per taxel".into(), || {
            let tared = |s: &mut Scene| (s.input.tare, s.input.full_scale_MPa) = (Some("".into()), Some(full_scale));
            scaled(&scene.changed(tared), false)
        });
        let setting = format!("a zero and a gain of {MULTIPLIER_BITS} bits per taxel");
        self.add_plan("calibration table", table, setting, || {
            let tabled =
                |s: &mut Scene| (s.input.calibration, s.input.full_scale_MPa) = (Some("".into()), Some(full_scale));
            scaled(&scene.changed(tabled), true)
        });
        let writes = |s: &mut Scene| {
            (s.hardware.tables, s.input.full_scale_MPa) = (TableStorage::Writable, Some(full_scale));
        };
        self.add("writable tables", written, "zero, gain, noise floor and threshold".into(), writes);
        self.without(|s| (s.hardware.tables, s.hardware.table_range) = Default::default());
        let running = input.running_zero();
        let average = running.map_or(RunningZero::AVERAGE, |running| running.average);
        self.add("running zero", running.is_some(), format!("a gain of 2^−{average}"), |s| {
            let limit_MPa = full_scale * RunningZero::LIMIT_SHARE;
            s.input.zero = Zero::Running(RunningZero { average: RunningZero::AVERAGE, limit_MPa });
            s.input.full_scale_MPa = Some(full_scale);
        });
        self.without(|s| s.input.zero = Zero::Fixed);
        let range = &scene.hardware.table_range;
        let covers = range.thickness_mm.unwrap_or(OTHER_COVERS.map(|of_own| of_own * scene.sensor.thickness_mm));
        let own = [
            range.thickness_mm.map(|[least, most]| format!("covers of {least} to {most} mm")),
            (range.dead_taxels > 0).then(|| format!("up to {} dead taxels", range.dead_taxels)),
        ];
        let own = own.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let cover = format!("covers of {:.3} to {:.3} mm", covers[0], covers[1]);
        let coefficients = scene.hardware.has_writable_coefficients();
        self.add("writable coefficients", coefficients, set(coefficients, own, &cover), |s| {
            writes(s);
            s.hardware.table_range.thickness_mm = Some(covers);
        });
        self.without(|s| {
            s.hardware.table_range = TableRange { gain: s.hardware.table_range.gain, ..TableRange::default() }
        });
    }

    /// Means over frames.
    fn means(&mut self) {
        let input = &self.scene.input;
        let adaptive = |s: &mut Scene| {
            let average = if s.input.mean == MeanKind::Adaptive { s.input.average } else { 0 };
            (s.input.average, s.input.mean, s.input.template) = (average, MeanKind::Adaptive, false);
        };
        let (mean, power) = (input.mean, input.longest_average().max(1));
        let slide = |s: &mut Scene| (s.input.average, s.input.mean) = (power, MeanKind::Sliding);
        let (slides, adapts) = (mean == MeanKind::Sliding, mean == MeanKind::Adaptive);
        let frames = if input.slides() { most_frames(power) } else { 1 << power };
        self.add("averaging", input.longest_average() > 0, format!("{frames} frames"), |s| s.input.average = power);
        self.add("sliding mean", slides, format!("gains from 1 to 2^−{power}"), slide);
        self.without(|s| s.input.mean = MeanKind::Block);
        let longest = self.scene.changed(adaptive).input.longest_average();
        self.add("adaptive mean", adapts, format!("the longest of {} frames", most_frames(longest)), adaptive);
        self.without(slide);
    }

    /// Several arrays, and the subarrays of each.
    fn arrays(&mut self) {
        let (plan, scene) = (self.plan, self.scene);
        let several = scene.hardware.arrays > 1;
        let arrays = if several { scene.hardware.arrays } else { OTHER_ARRAYS };
        self.add("several arrays", several, format!("{arrays} arrays"), |s| s.hardware.arrays = arrays);
        self.without(|s| *s = s.of_array(0));
        let parts = plan.parts().len();
        let quarters = Case::numbered(1).filter(|case| subarrays(*case, &scene.sensor).is_ok());
        if plan.chooses() {
            // The cases built stay the same, whatever else would fit.
            let cases: Vec<String> = plan.cases().iter().map(|case| case.case.to_string()).collect();
            self.add_own("choice of the case", format!("cases {} per frame", cases.join(", ")));
        } else if parts > 1 {
            self.add_own("partition", format!("{parts} subarrays"));
        } else if let Some(case) = quarters {
            self.add("partition", false, "2×2 subarrays".into(), |s| s.partition.case = case);
        }
    }

    /// What gives μ.
    fn estimate(&mut self) {
        let (plan, scene) = (self.plan, self.scene);
        let degree = plan.formats().degree;
        let mu_max = SearchSpec::default().mu_max;
        let own = format!("mu_max = {}", scene.search.mu_max);
        let back = if degree > 0 { scene.search.mu_max } else { mu_max };
        self.add("search", plan.searches(), set(degree > 0, own, &format!("mu_max = {mu_max}")), |s| {
            (s.search.mu_max, s.hardware.estimator) = (back, Some(EstimatorKind::Search));
        });
        if plan.has_network() {
            let layers: Vec<String> = plan.formats().layers.iter().map(usize::to_string).collect();
            self.add_own("network", format!("layers of {} rows", layers.join(", ")));
        }
        if plan.contacts() > 0 {
            self.add_own("contacts", format!("a μ for each of {} at most", plan.contacts()));
        }
        if degree > 0 {
            self.add_plan("polynomial of degree 3", degree == MAX_DEGREE, "degree 3".into(), || {
                planned_with(scene, Scale::new(scene)?, Some(MAX_DEGREE))
            });
        }
        // The serial engine searches one taxel at a time; where the case is chosen per frame, it is four.
        if plan.searches() && !plan.chooses() && plan.board.engine == EngineKind::Parallel {
            let widest = plan.formats().search_width == Quads::LANES;
            self.add("search width", widest, format!("{} taxels per cycle", Quads::LANES), |s| {
                s.hardware.search_width = Some(Quads::LANES);
            });
            self.without(|s| s.hardware.search_width = Some(1));
        }
    }

    /// What becomes of the forces, and their checks.
    fn forces(&mut self) {
        let (plan, scene, full_scale) = (self.plan, self.scene, self.full_scale_MPa());
        // A threshold that is written is there whatever the scene's.
        let threshold = plan.built_in_threshold() != Some(0);
        let own = match plan.built_in_threshold() {
            None if !plan.has_writable_tables() => "of each array".to_owned(),
            _ => format!("{} N", scene.threshold.min_force_N),
        };
        self.add("threshold", threshold, set(threshold, own, "1 mN"), |s| {
            (s.threshold.min_force_N, s.input.full_scale_MPa) = (1e-3, Some(full_scale));
        });
        let dead = scene.input.dead.len();
        let flips = &plan.formats().flips;
        let own = format!(
            "{dead} {}; parity flips: {} of Cz⁺, {} of Ax, {} of Ay",
            if dead == 1 { "taxel" } else { "taxels" },
            flips.inverse.len(),
            flips.ax.len(),
            flips.ay.len()
        );
        // A dead taxel in a corner breaks every symmetry.
        let corner = |s: &mut Scene| s.input.dead = vec![[0, 0]];
        self.add("dead taxels", dead > 0, set(dead > 0, own, "dead = [[0, 0]]"), corner);
        self.without(|s| s.input.dead.clear());
        self.add("coefficient check", plan.has_coefficient_check(), "a signature of the words read".into(), |s| {
            s.hardware.coefficient_check = CoefficientCheck::Signature;
        });
        let setting = "a force and its moments per subarray".into();
        self.add("resultants", plan.sends_resultants(), setting, |s| s.output.forces = ForceOutput::Resultants);
        if let Some(push) = plan.push_limit {
            self.all.push(Feature {
                name: "negative pressure",
                setting: format!("flagged above 1/{} of all", 1 + push),
                with_feature: None,
                without_feature: Some(Plan { push_limit: None, ..plan.clone() }),
            });
        }
    }
}
