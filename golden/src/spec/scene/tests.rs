//! Scenes that are read, filled with defaults or rejected; each message names file, field and value.

use super::*;
use crate::spec::partition::Grid;

const SENSOR: &str = "[sensor]\nrows = 10\ncols = 10\npitch_x_mm = 2.0\npitch_y_mm = 4\nthickness_mm = 3.0\n";

fn with(more: &str) -> Result<Scene, SceneError> {
    Scene::parse(&format!("{SENSOR}{more}"), "my.toml")
}

fn message(more: &str) -> String {
    with(more).unwrap_err().to_string()
}

#[test]
fn everything_but_the_sensor_has_a_default() {
    let scene = with("").unwrap();
    assert_eq!(scene.name, "my");
    let default = Scene::of_sensor(&scene.sensor, "my");
    assert_eq!(scene, default);
    assert_eq!(
        scene.fixed,
        FixedSpec { input_bits: 20, data_bits: 18, coef_bits: 18, inverse_bits: 24, prune_bits: 20, lanes: None }
    );
    assert_eq!((scene.search.mu_max, scene.hardware.board_name()), (0.6, "ulx3s-85f"));
    assert!(scene.require_supported().is_ok());
}

#[test]
fn every_field_is_read() {
    let more = r#"
        [medium]
        kind = "bonded-layer"
        poisson = 0.4
        [partition]
        rows = 2
        cols = 5
        condition = "both-signs"
        [search]
        objective = "patch"
        mu_max = 1
        noise_floor_MPa = 0.001
        form = "orthogonal"
        degree = 5
        [inverse]
        kind = "tikhonov"
        level = 1e-4
        [threshold]
        min_force_N = 0.01
        [fixed]
        input_bits = 16
        data_bits = 16
        coef_bits = 14
        inverse_bits = 18
        [hardware]
        board = "ulx3s-85f"
        link = "spi"
        coefficient_check = "signature"
        code_check = "off"
        [input]
        full_scale_MPa = 0.25
        average = 6
        mean = "sliding"
        template = false
        calibration = "table.csv"
        curve = [[-0.1, -0.2], [0, 0], [0.1, 0.12]]
        tare = "zero.json"
        dead = [[3, 4], [0, 9], [3, 4]]
        unipolar = true
        plausible_MPa = 2.5
        missing_share = 0.05
        zero = "running"
        zero_average = 8
        zero_limit_MPa = 0.005
        [output]
        forces = "resultants""#;
    let scene = with(more).unwrap();
    assert_eq!(scene.medium, Medium::BondedLayer { poisson: 0.4 });
    assert_eq!(scene.partition.case, Case::Grid(Grid { rows: 2, cols: 5 }));
    assert_eq!(scene.partition.condition, Condition::BothSigns);
    assert_eq!(scene.hardware.coefficient_check, CoefficientCheck::Signature);
    assert_eq!([&scene, &with("").unwrap()].map(|own| own.hardware.code_check), [CodeCheck::Off, CodeCheck::On]);
    assert_eq!(scene.hardware.link.name(), "spi");
    assert_eq!(scene.search.objective, ObjectiveKind::Patch);
    assert_eq!((scene.search.mu_max, scene.search.noise_floor_MPa()), (1.0, 0.001));
    assert_eq!((scene.search.form, scene.search.degree), (Form::Orthogonal, Some(5)));
    assert_eq!(scene.inverse, InverseSpec { kind: InverseKind::Tikhonov, level: Some(1e-4) });
    assert_eq!(scene.threshold.min_force_N, 0.01);
    assert_eq!(
        scene.fixed,
        FixedSpec { input_bits: 16, data_bits: 16, coef_bits: 14, inverse_bits: 18, prune_bits: 20, lanes: None }
    );
    let input = InputSpec {
        full_scale_MPa: Some(0.25),
        average: 6,
        mean: MeanKind::Sliding,
        template: false,
        calibration: Some("table.csv".into()),
        curve: vec![[-0.1, -0.2], [0.0, 0.0], [0.1, 0.12]],
        tare: Some("zero.json".into()),
        dead: vec![[0, 9], [3, 4]],
        unipolar: true,
        gain_spread: 0.0,
        plausible_MPa: 2.5,
        missing_share: 0.05,
        zero: Zero::Running(RunningZero { average: 8, limit_MPa: 0.005 }),
    };
    assert_eq!((scene.input, scene.output.forces), (input, ForceOutput::Resultants));
    let beside = Scene::parse(&format!("{SENSOR}[input]\ntare = \"zero.json\""), "rig/my.toml").unwrap();
    assert_eq!(beside.input.tare, Some("rig/zero.json".into()));
}

#[test]
fn builtins_are_complete_and_distinct() {
    for name in Scene::builtin_names() {
        let scene = Scene::load(name).unwrap();
        assert_eq!(scene.name, name);
        assert!(scene.require_supported().is_ok(), "{name}");
    }
}

#[test]
fn an_unknown_scene_names_the_nearest() {
    let text = Scene::load("sensor1").unwrap_err().to_string();
    assert!(text.contains("eight-by-eight") && text.ends_with("did you mean \"sensor-1\"?"), "{text}");
    let text = Scene::load("missing/sensor-3.toml").unwrap_err().to_string();
    assert!(text.ends_with("eight-by-eight-contacts)"), "{text}");
    let text = Scene::load("sensor-3.toml").unwrap_err().to_string();
    assert!(text.ends_with("did you mean \"sensor-3\"?"), "{text}");
    // Better none than a wrong one.
    for name in ["nope.toml", "sensor-9", "pad"] {
        let text = Scene::load(name).unwrap_err().to_string();
        assert!(!text.contains("did you mean"), "{text}");
    }
}

#[test]
fn unknown_fields_name_the_nearest() {
    let cases = [
        ("[search]\nmu_maks = 1", "unknown field search.mu_maks; the nearest valid field is search.mu_max"),
        ("[fixed]\nmu_max = 1", "unknown field fixed.mu_max; the nearest valid field is search.mu_max"),
        ("[serach]\nmu_max = 1", "unknown field serach; the nearest valid field is search"),
        ("[input]\nfull_scale = 1", "unknown field input.full_scale; the nearest valid field is input.full_scale_MPa"),
        // As near to pitch_x_mm as to pitch_y_mm.
        ("[threshold]\npitch_mm = 1", "unknown field threshold.pitch_mm; [threshold] has min_force_N"),
        ("[taxel]\nrows = 1", "unknown field taxel; a scene has name, [sensor], [medium], [partition], [search], [inverse], [threshold], [fixed], [hardware], [hardware.table_range], [hardware.adc_scan], [input], [output]"),
    ];
    for (more, wanted) in cases {
        assert_eq!(message(more), format!("my.toml: {wanted}"));
    }
}

#[test]
fn wrong_values_name_what_is_allowed() {
    let cases = [
        ("[search]\nmu_max = nan", "search.mu_max = nan"),
        ("[search]\nmu_max = 2.1", "it must be 0, or a number from 0.001 to 2"),
        ("[search]\nmu_max = 0.0009", "search.mu_max = 0.0009 is not allowed"),
        ("[search]\nmu_max = -0.1", "search.mu_max = -0.1 is not allowed"),
        ("[search]\nnoise_floor_MPa = inf", "search.noise_floor_MPa = inf"),
        ("[search]\nobjective = \"spares\"", "\"sparse\" or \"compressive\""),
        ("[inverse]\nkind = \"svd\"", "it must be \"tsvd\" or \"tikhonov\" or \"exact\""),
        ("[inverse]\nlevel = 1", "inverse.level = 1 is not allowed; it must be a number above 0 and below 1"),
        ("[inverse]\nkind = \"exact\"\nlevel = 0.1", "left out with inverse.kind = \"exact\""),
        ("[threshold]\nmin_force_N = -1", "threshold.min_force_N = -1"),
        ("[fixed]\ndata_bits = 0", "fixed.data_bits = 0 is not allowed; it must be a whole number from 12 to 18"),
        ("[fixed]\ndata_bits = 63", "fixed.data_bits = 63"),
        ("[fixed]\ncoef_bits = 16\ninverse_bits = 15", "from 16 to 32"),
        ("[fixed]\ninput_bits = \"20\"", "fixed.input_bits = \"20\""),
        ("[hardware]\nlink = \"i2c\"", "\"uart\" or \"spi\""),
        ("[hardware]\ncoefficient_check = \"parity\"", "\"none\" or \"signature\""),
        ("[hardware]\ncode_check = true", "\"on\" or \"off\""),
        ("[hardware]\nsearch_width = 3", "hardware.search_width = 3 is not allowed; it must be 4, 2 or 1"),
        (
            "[hardware]\narrays = 2\narray_min_forces_N = [0.1]",
            "hardware.array_min_forces_N = [0.1] is not allowed; it must be a list of 2 numbers, one for each of hardware.arrays",
        ),
        ("[hardware]\narray_noise_floors_MPa = [1e-3]", "left out, or hardware.arrays above 1"),
        (
            "[search]\nnoise_floor_MPa = 1e-3\n[hardware]\narrays = 2\narray_noise_floors_MPa = [1e-3, 1e-4]",
            "search.noise_floor_MPa = 0.001 is not allowed; it must be left out beside hardware.array_noise_floors_MPa",
        ),
        (
            "[input]\nfull_scale_MPa = 1\nzero = \"running\"\nzero_limit_MPa = 0.01\n[hardware]\narrays = 2\n\
             array_noise_floors_MPa = [1e-4, 3e-3]",
            "at least 5 times the noise floor",
        ),
        ("[hardware]\narrays = 12", "hardware.arrays = 12 is not allowed; it must be 1, 2, 4, 8 or 16"),
        ("[hardware]\nboard = \"ulx4m\"", "\"colorlight-i5\" or \"colorlight-i9\" or \"icebreaker\" or \"ulx3s-85f\""),
        ("[input]\nfull_scale_MPa = 0", "above 0"),
        ("[input]\naverage = 13", "from 0 to 12"),
        (
            "[input]\naverage = 2\nmean = \"box\"",
            "input.mean = \"box\" is not allowed; it must be \"block\" or \"sliding\"",
        ),
        (
            "[input]\nmean = \"sliding\"",
            "input.mean = \"sliding\" is not allowed; it must be \"block\", or input.average from",
        ),
        ("[input]\ndead = [[0, 10]]", "a list of [row, col], row 0 to 9, col 0 to 9"),
        ("[input]\ndead = [3]", "a list of [row, col]"),
        ("[input]\nunipolar = 1", "true or false"),
        ("[input]\nzero = \"moving\"", "input.zero = \"moving\" is not allowed; it must be \"fixed\" or \"running\""),
        (
            "[input]\nzero_average = 8",
            "input.zero_average = 8 is not allowed; it must be left out, or input.zero = \"run",
        ),
        (
            "[input]\nzero = \"fixed\"\nzero_limit_MPa = 1",
            "input.zero_limit_MPa = 1 is not allowed; it must be left out",
        ),
        ("[input]\nzero = \"running\"", "input.zero_limit_MPa is missing"),
        ("[input]\nzero = \"running\"\nzero_limit_MPa = 0", "input.zero_limit_MPa = 0 is not allowed"),
        ("[input]\nzero = \"running\"\nzero_limit_MPa = 2\nfull_scale_MPa = 1", "at most input.full_scale_MPa"),
        ("[input]\nzero = \"running\"\nzero_limit_MPa = 1\nzero_average = 17", "from 1 to 16"),
        (
            "[search]\nnoise_floor_MPa = 0.01\n[input]\nzero = \"running\"\nzero_limit_MPa = 0.04",
            "at least 5 times the noise floor",
        ),
        // The default of the limit is below the noise.
        (
            "[search]\nnoise_floor_MPa = 0.01\n[input]\nzero = \"running\"\nfull_scale_MPa = 1",
            "input.zero_limit_MPa is missing",
        ),
        ("[search]\ndegree = 9", "a whole number from 1 to 8"),
        ("[input]\nplausible_MPa = 0", "a number above 0"),
        (
            "[input]\nmissing_share = 0.51",
            "input.missing_share = 0.51 is not allowed; it must be a number from 0 to 0.5",
        ),
        ("[input]\nmissing_share = -0.1", "a number from 0 to 0.5"),
        ("[input]\ntare = 1", "the name of a file"),
        ("[output]\nforces = \"all\"", "\"taxels\" or \"resultants\""),
        ("[partition]\ncase = 4", "0, 1, 2, 3, \"adaptive\" or \"contacts\""),
        ("[partition]\nrows = 3\ncols = 1", "3 subarrays do not divide 10 rows"),
        ("[partition]\nrows = 2", "partition.cols is missing"),
        ("[partition]\ncase = 0\nrows = 2", "left out beside rows and cols"),
        ("[partition]\ncases = [1, 2]", "partition.cases = [1, 2] is not allowed; it must be a list of 0 and others"),
        ("[partition]\ncases = [0]", "partition.cases = [0] is not allowed; it must be a list of 0 and others"),
        ("[partition]\ncases = [0, 1, 1]", "a list of 0 and others of 1, 2 and 3, each once"),
        ("[partition]\ncases = [0, 4]", "a list of 0 and others of 1, 2 and 3, each once"),
        ("[partition]\ncases = 1", "partition.cases = 1 is not allowed; it must be a list of 0 and others"),
        ("[partition]\ncases = [0, 1]\ncase = 1", "left out beside rows, cols and any case but \"adaptive\""),
        ("[partition]\ncases = [0, 1]\nrows = 2", "left out beside rows, cols and any case but \"adaptive\""),
        ("[medium]\npoisson = 0.3", "left out unless"),
        ("[medium]\nkind = \"bonded-layer\"\npoisson = 0.5", "medium.poisson = 0.5"),
    ];
    for (more, wanted) in cases {
        let text = message(more);
        assert!(text.starts_with("my.toml: ") && text.contains(wanted), "{text}");
    }
    let flat = "name = 3\n[sensor]\nrows = 10\ncols = 10\npitch_x_mm = 0\npitch_y_mm = 4\nthickness_mm = 3\n";
    let text = Scene::parse(flat, "flat.toml").unwrap_err().to_string();
    assert!(text.contains("sensor.pitch_x_mm = 0 is not allowed"), "{text}");
    let text = Scene::parse("sensor = 1", "s.toml").unwrap_err().to_string();
    assert!(text.contains("sensor = 1 is not allowed; it must be a table"), "{text}");
    let text = Scene::parse("", "s.toml").unwrap_err().to_string();
    assert!(text.contains("sensor.rows is missing"), "{text}");
}

/// Pitches and thickness that are in range each by itself, but whose ratio asks for a panic, all memory or half a minute.
#[test]
fn lengths_far_apart_are_refused_by_field() {
    let far = [("1e-300", "4.0", "3.0", "pitch_y_mm"), ("1000.0", "1e-12", "1000.0", "pitch_y_mm")];
    let thick = [("1.0", "1.0", "1001.0", "thickness_mm"), ("1.0", "2.0", "0.0005", "thickness_mm")];
    for (x, y, h, field) in far.into_iter().chain(thick) {
        let text = format!("[sensor]\nrows = 8\ncols = 8\npitch_x_mm = {x}\npitch_y_mm = {y}\nthickness_mm = {h}\n");
        let error = Scene::parse(&text, "far.toml").unwrap_err().to_string();
        assert!(
            error.contains(&format!("sensor.{field} = ")) && error.contains("is not allowed; it must be from 1/"),
            "{error}"
        );
    }
}

#[test]
fn the_least_mu_max_still_has_formats() {
    for mu_max in ["0", "0.001"] {
        let scene = with(&format!("[search]\nmu_max = {mu_max}")).unwrap();
        assert!(crate::fixed::Model::new(&scene).is_ok(), "{mu_max}");
    }
}

#[test]
fn names_can_stand_in_paths_and_comments() {
    let named = |name: &str| Scene::parse(&format!("name = {name:?}\n{SENSOR}"), "my.toml");
    for name in ["a", "Sensor 1", "probe-2_b.v3", "größe", &"x".repeat(64)] {
        assert_eq!(named(name).unwrap().name, name);
    }
    let long = "x".repeat(65);
    for name in ["", ".", "..", ".hidden", " a", "a ", "a/b", "a\\b", "a\nb", "a\"b", "*", long.as_str()] {
        let text = named(name).unwrap_err().to_string();
        assert!(text.starts_with("my.toml: name = ") && text.contains("1 to 64 letters"), "{text}");
    }
    // A scene without a name takes that of its file.
    let text = Scene::parse(SENSOR, "folder/my (2).toml").unwrap_err().to_string();
    assert!(text.starts_with("folder/my (2).toml: name = \"my (2)\" is not allowed"), "{text}");
}

#[test]
fn cases_are_listed_or_all_that_divide() {
    let choices = |more: &str| {
        let scene = with(more).unwrap();
        assert_eq!(scene.partition.case, Case::Adaptive);
        assert!(scene.require_supported().is_ok() && scene.require_golden().is_ok());
        scene.partition.choices(&scene.sensor).iter().map(Case::to_string).collect::<String>()
    };
    assert_eq!(choices("[partition]\ncase = \"adaptive\""), "0123");
    assert_eq!(choices("[partition]\ncases = [3, 0]"), "03");
    assert_eq!(choices("[partition]\ncase = \"adaptive\"\ncases = [0, 1, 2]"), "012");
    let odd = SENSOR.replace("rows = 10", "rows = 9");
    let error = Scene::parse(&format!("{odd}[partition]\ncases = [0, 1]"), "my.toml").unwrap_err().to_string();
    assert!(
        error.contains("partition.cases = [0, 1]") && error.contains("2 subarrays do not divide 9 rows"),
        "{error}"
    );
    let neither = odd.replace("cols = 10", "cols = 9");
    let scene = Scene::parse(&format!("{neither}[partition]\ncase = \"adaptive\""), "my.toml").unwrap();
    let error = scene.require_supported().unwrap_err().to_string();
    assert!(error.contains("no other of the paper's cases divides the array"), "{error}");
}

#[test]
fn choices_not_built_yet_say_so() {
    let cases = [
        ("[partition]\ncase = \"contacts\"", "partition.case = contacts; available: 0, 1, 2, 3, adaptive, rows and"),
        (
            "[partition]\ncase = \"contacts\"\ncondition = \"both-signs\"\n[hardware]\nestimator = \"network\"",
            "partition.condition = both-signs; available: loaded, with contacts",
        ),
        ("[partition]\ncase = \"adaptive\"\n[search]\nmu_max = 0", "search.mu_max = 0; available: above 0, with"),
        (
            "[partition]\ncases = [0, 1]\n[output]\nforces = \"resultants\"",
            "output.forces = resultants; available: taxels",
        ),
        (
            "[input]\ndead = [[0, 1]]\n[partition]\ncase = 1",
            "input.dead = [[0, 1]]; available: none, or partition.case = 0 or contacts",
        ),
        ("[input]\ndead = [[0, 1]]\n[partition]\ncases = [0, 1]", "input.dead = [[0, 1]]; available: none, or"),
        (
            "[partition]\ncase = \"adaptive\"\n[hardware]\nsearch_width = 2",
            "hardware.search_width = 2; available: 4, with adaptive",
        ),
        (
            "[hardware]\narrays = 2\ntables = \"writable\"\n[hardware.table_range]\nthickness_mm = [1, 4]",
            "hardware.arrays = 2; available: 1, with hardware.table_range.thickness_mm",
        ),
        (
            "[hardware]\narrays = 2\n[input]\naverage = 1",
            "input.average = 1; available: 0, with hardware.arrays above 1; or",
        ),
        ("[input]\nunipolar = true", "input.unipolar"),
        ("[search]\ndegree = 4", "search.degree"),
        ("[search]\nobjective = \"auto\"", "search.objective = auto; available: sparse"),
        ("[search]\nform = \"orthogonal\"", "search.form = orthogonal; available: oblique"),
    ];
    for (more, wanted) in cases {
        let text = with(more).unwrap().require_supported().unwrap_err().to_string();
        assert!(text.contains("not available yet") && text.contains(wanted), "{text}");
    }
}

#[test]
fn the_golden_model_rejects_unsupported_combinations() {
    let orthogonal = "[search]\nform = \"orthogonal\"\n";
    let patch = "[search]\nobjective = \"patch\"\n";
    let cases = [
        (format!("[partition]\ncase = \"adaptive\"\n{patch}"), "search.objective = patch; available: sparse, with"),
        (format!("{orthogonal}[input]\ndead = [[0, 1]]"), "input.dead = [[0, 1]]; available: none, with"),
        (format!("{orthogonal}[input]\ndead = [[0, 1], [2, 3]]"), "input.dead = [[0, 1], …]; available: none, with"),
        (format!("{orthogonal}[input]\nunipolar = true"), "input.unipolar = true; available: false, with"),
        // Of several rejected values the first in the order of the schema is reported.
        (format!("{orthogonal}[input]\nunipolar = true\ndead = [[0, 1]]"), "input.dead"),
    ];
    for (more, wanted) in cases {
        let text = with(&more).unwrap().require_golden().unwrap_err().to_string();
        assert!(text.contains("not available yet") && text.contains(wanted), "{text}");
    }
    for more in [patch, orthogonal, "[medium]\nkind = \"bonded-layer\"", "[input]\nunipolar = true\ndead = [[0, 1]]"] {
        assert!(with(more).unwrap().require_golden().is_ok(), "{more}");
    }
}

/// `#` and a number name an array of a scene, alone.
#[test]
fn an_array_of_a_scene_is_named_behind_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hand.toml").display().to_string();
    let limits = "array_noise_floors_MPa = [1e-4, 4e-4, 2e-4, 3e-4]\narray_min_forces_N = [0, 1, 2, 3]\n";
    std::fs::write(
        &path,
        format!("{SENSOR}[hardware]\narrays = 4\n{limits}[input]\ncalibration = \"{{array}}.csv\"\n"),
    )
    .unwrap();
    let third = Scene::load(&format!("{path}#3")).unwrap();
    assert_eq!((third.hardware.arrays, third.input.calibration), (1, Some(folder.path().join("3.csv"))));
    assert_eq!((third.search.noise_floor_MPa, third.threshold.min_force_N), (Some(3e-4), 3.0));
    assert!(!third.hardware.states_limits_of_each_array());
    let error = Scene::load(&format!("{path}#4")).unwrap_err().to_string();
    assert!(error.ends_with("hand.toml#4: the scene has 4 (hardware.arrays), numbered from 0"), "{error}");
    assert!(Scene::load("sensor-1#0").is_ok());
    // A file of that name is a scene of its own.
    std::fs::write(format!("{path}#4"), SENSOR).unwrap();
    assert_eq!(Scene::load(&format!("{path}#4")).unwrap().hardware.arrays, 1);
    assert!(Scene::load("sensor-1#").unwrap_err().to_string().contains("no scene"));
}

#[test]
fn syntax_errors_name_the_line() {
    let text = message("[search]\nmu_max = = 1");
    assert!(text.starts_with("my.toml, line 8: "), "{text}");
}

#[test]
fn files_are_read_and_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.toml");
    let name = path.to_str().unwrap();
    std::fs::write(&path, SENSOR).unwrap();
    assert_eq!(Scene::load(name).unwrap().name, "own");
    std::fs::write(&path, vec![b'#'; (1 << 20) + 1]).unwrap();
    assert!(matches!(Scene::load(name), Err(SceneError::TooLarge { .. })));
    std::fs::write(&path, [0xff, 0xfe]).unwrap();
    assert!(matches!(Scene::load(name), Err(SceneError::Unreadable { .. })));
    let folder = folder.path().to_str().unwrap();
    assert!(matches!(Scene::load(folder), Err(SceneError::Unreadable { .. })));
}

#[test]
fn auto_takes_the_network_in_hardware_where_noise_can_be() {
    let chosen = |change: fn(&mut Scene)| {
        let mut scene = Scene::builtin("sensor-1-noisy").unwrap();
        scene.search.estimator = None;
        scene.hardware.estimator = None;
        (scene.search.noise_floor_MPa, scene.input.full_scale_MPa) = (Some(1e-4), Some(0.1));
        change(&mut scene);
        assert_eq!(scene.hardware_estimator(), scene.choose_for_hardware().0);
        scene.choose_for_hardware()
    };
    assert_eq!(chosen(|_| {}), (EstimatorKind::Network, "the scene states noise and names a network".to_owned()));
    // Without a full scale nothing says that the noise is small.
    assert_eq!(
        chosen(|s| (s.search.noise_floor_MPa, s.input.full_scale_MPa) = (Some(1e-8), None)).0,
        EstimatorKind::Network
    );
    type Change = fn(&mut Scene);
    let searched: [(Change, &str); 6] = [
        (|s| s.search.network = None, "names no network"),
        (|s| s.search.noise_floor_MPa = Some(0.0), "states no noise"),
        (|s| s.search.noise_floor_MPa = Some(9e-7), "below 1e-5 of full scale"),
        (|s| s.partition.case = Case::numbered(1).unwrap(), "partition.case = 1"),
        (|s| s.search.mu_max = 0.0, "mu_max"),
        (|s| s.hardware.search_width = Some(2), "search_width"),
    ];
    for (change, why) in searched {
        let (taken, reason) = chosen(change);
        assert!(taken == EstimatorKind::Search && reason.contains(why), "{why}: {reason}");
    }
    // Of a mean of 64 frames more noise is allowed in each.
    assert_eq!(chosen(|s| (s.search.noise_floor_MPa, s.input.average) = (Some(7e-6), 6)).0, EstimatorKind::Search);
    assert_eq!(chosen(|s| s.search.noise_floor_MPa = Some(1.1e-6)).0, EstimatorKind::Network);
}

/// A name is an algorithm; a name of an earlier version is refused with the names that take its place.
#[test]
fn estimators_are_named_for_the_model_and_for_the_hardware() {
    let text = |more: &str| {
        format!("[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 2.0\npitch_y_mm = 2.0\nthickness_mm = 2.0\n{more}")
    };
    let parsed = |more: &str| Scene::parse(&text(more), "own.toml");
    let both = |more: &str| {
        let scene = parsed(more).unwrap();
        (scene.model_estimator(), scene.hardware_estimator())
    };
    let stated = |name: &str| both(&format!("[search]\nestimator = \"{name}\"\n"));
    use EstimatorKind::{Combined, Evidence, EvidenceNetwork, Network, Search};
    assert_eq!(both(""), (Evidence, Search));
    assert_eq!(both("[search]\nnetwork = \"own.network\"\n"), (Combined, Search));
    assert_eq!(
        EstimatorKind::NAMES.map(|(name, _)| stated(name)),
        [(Search, Search), (Evidence, Search), (Network, Network), (EvidenceNetwork, Network), (Combined, Network),]
    );
    let split = "[search]\nestimator = \"evidence+network\"\n[hardware]\nestimator = \"search\"\n";
    assert_eq!(both(split), (EvidenceNetwork, Search));
    // A search by subarrays has no evidence.
    assert_eq!(both("[partition]\ncase = 1\n"), (Search, Search));
    let refused = |more: &str| parsed(more).unwrap_err().to_string();
    for table in ["search", "hardware"] {
        let error = refused(&format!("[{table}]\nestimator = \"learned\"\n"));
        for named in [
            "own.toml",
            &format!("{table}.estimator = \"learned\""),
            "\"evidence+network\"",
            "hardware.estimator = \"network\"",
        ] {
            assert!(error.contains(named), "{named}: {error}");
        }
    }
    assert!(refused("[search]\nestimator = \"auto\"\n").contains("left out"));
    assert!(refused("[hardware]\nestimator = \"evidence\"\n").contains("\"search\" or \"network\""));
    let mut scene = parsed("").unwrap();
    scene.hardware.estimator = Some(Evidence);
    let error = scene.require_supported().unwrap_err().to_string();
    assert!(error.contains("hardware.estimator = evidence") && error.contains("search, network"), "{error}");
}
