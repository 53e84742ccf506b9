//! C for microcontrollers: every word of forces and status is that of the bit-true model, on the host with the sanitizer of
//! undefined behaviour, and on a Cortex-M7 and an M4 under QEMU; what C does not serve is refused by field.

use std::path::Path;
use std::process::{Command, Output};

use dermis_flow::microcontroller::target::{expected, measure_all, Measured};
use dermis_flow::microcontroller::{generate, generate_for, needs, CSource};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::stages::send::Status;
use dermis_golden::fixed::{Model, Plan};
use dermis_golden::result::flags::{Flag, FlagSet};
use dermis_golden::spec::scene::{largest_code, Scene};
use dermis_tests::{scene, variants};

/// Flags under which the C must be free of warnings; a compiler of a microcontroller has its own.
const FLAGS: [&str; 7] = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Werror"];
/// Random frames of each kind.
const DRAWS: usize = 12;

/// Writes a source's files and compiles its example.
fn compile(source: &CSource, folder: &Path, flags: &[&str]) -> Output {
    for file in &source.files {
        std::fs::write(folder.join(&file.name), &file.text).unwrap();
    }
    let files = ["", "_example"].map(|part| format!("{}{part}.c", source.name));
    let mut compiler = Command::new("gcc");
    compiler.current_dir(folder).args(FLAGS).args(flags).args(["-o", "example"]).args(files);
    compiler.output().expect("gcc is installed (make setup)")
}

/// What the example prints of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
struct Printed {
    /// Forces and status; none of a frame that is refused.
    words: Vec<u32>,
    /// Whether a reading is at the end of its range.
    saturated: bool,
    /// Whether a reading is outside its range.
    outside: bool,
}

/// What the example prints of each frame.
fn run(source: &CSource, flags: &[&str]) -> Vec<Printed> {
    let folder = tempfile::tempdir().unwrap();
    let compiled = compile(source, folder.path(), flags);
    assert!(compiled.status.success(), "{}: {}", source.name, String::from_utf8_lossy(&compiled.stderr));
    let output = Command::new(folder.path().join("example")).output().unwrap();
    assert!(output.status.success(), "{}: {}", source.name, String::from_utf8_lossy(&output.stderr));
    let mut frames = vec![Printed::default(); source.readings.len()];
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let (frame, cells) = line.split_once(',').unwrap();
        let printed = &mut frames[frame.parse::<usize>().unwrap()];
        // Of a taxel row and column come first, of a status its name.
        let words = match cells.split_once(',') {
            None => {
                *(if cells == "saturated" { &mut printed.saturated } else { &mut printed.outside }) = true;
                continue;
            }
            Some(("status", words)) => words,
            Some((_row, cells)) => cells.split_once(',').unwrap().1,
        };
        printed.words.extend(words.split(',').map(|word| word.parse::<i64>().unwrap() as u32));
    }
    frames
}

/// Frames at the ends of the codes, with one taxel, of one sign, and random ones of all sizes.
fn extreme_readings(model: &Model) -> Vec<Vec<i32>> {
    let (taxels, bits) = (model.scene.sensor.taxels(), model.formats().code_bits);
    let (most, mut random) = (largest_code(bits), fastrand::Rng::with_seed(5));
    let mut frames: Vec<Vec<i32>> = [0, most, -most - 1, -1, 1].map(|code| vec![code; taxels]).into();
    frames.push((0..taxels).map(|taxel| if taxel % 2 == 0 { most } else { -most - 1 }).collect());
    for taxel in [0, taxels / 2, taxels - 1] {
        frames.push((0..taxels).map(|own| if own == taxel { most } else { 0 }).collect());
    }
    for draw in 0..DRAWS {
        // From one bit to all of them; every second frame mostly of one sign, as presses are.
        let size = (most >> (2 * draw as u32 % (bits - 1))).max(1);
        let least = if draw % 2 == 0 { -size } else { -size / 8 };
        let code = |_| random.i32(least..=size);
        frames.push((0..taxels).map(code).collect());
    }
    frames
}

/// A press; the same clipped, with a row twice, with a column twice, as its own mirror image in both directions; and all of them
/// as codes that fall with the load.
fn faulty_readings(model: &Model) -> Vec<Vec<i32>> {
    let (rows, cols) = (model.scene.sensor.rows, model.scene.sensor.cols);
    let most = largest_code(model.formats().code_bits);
    let code = |taxel: usize| {
        let [down, right] = [(taxel / cols).abs_diff(1), (taxel % cols).abs_diff(2)].map(|off| off as i32);
        most / 2 - (most / 256 * (7 * down * down + 5 * right * right)).min(most) - (taxel % 3) as i32
    };
    let mut press: Vec<i32> = (0..rows * cols).map(code).collect();
    // The least step.
    press[1] = press[0] + 1;
    let mut sorted = press.clone();
    sorted.sort_unstable();
    let clipped = press.iter().map(|code| *code.min(&sorted[sorted.len() - 5])).collect();
    let taken = |of: &dyn Fn(usize, usize) -> usize| (0..rows * cols).map(|k| press[of(k / cols, k % cols)]).collect();
    let twice = |at: usize| if at == 2 { 1 } else { at };
    let row_twice = taken(&|row, col| cols * twice(row) + col);
    let col_twice = taken(&|row, col| cols * row + twice(col));
    let mirrored = taken(&|row, col| cols * row.min(rows - 1 - row) + col.min(cols - 1 - col));
    let rising: [Vec<i32>; 5] = [press.clone(), clipped, row_twice, col_twice, mirrored];
    let falling = rising.clone().map(|frame| frame.into_iter().map(|code| -1 - code).collect());
    [rising, falling].concat()
}

/// Asserts that the host's compiler gives every word of the model, for shipped frames and extreme readings.
fn check(model: &Model, frames: &[Frame], flags: &[&str]) {
    let mut readings = [extreme_readings(model), faulty_readings(model)].concat();
    readings.extend(frames.iter().map(|frame| model.readings(std::slice::from_ref(frame)).unwrap()));
    let source = generate_for(model, readings).unwrap();
    for (frame, (readings, printed)) in source.readings.iter().zip(run(&source, flags)).enumerate() {
        let expected = expected(model, readings);
        let differs = (0..expected.len()).find(|&word| printed.words.get(word) != Some(&expected[word]));
        assert_eq!((differs, printed.words.len()), (None, expected.len()), "{}: word of frame {frame}", source.name);
    }
}

const SANITIZED: [&str; 3] = ["-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all"];

#[test]
fn built_in_scenes_are_equal_on_the_host() {
    for name in ["sensor-1-noisy", "sensor-1", "sensor-1-unipolar", "sensor-1-bonded", "eight-by-eight-bonded"] {
        let (scene, frames) = scene(name);
        check(&Model::new(&scene).unwrap(), &frames, &SANITIZED);
    }
    // Without mirror symmetry a step of `relax` has a product for each flip.
    let (mut dead, frames) = scene("sensor-1-noisy");
    dead.input.dead = vec![[0, 2], [5, 5]];
    check(&Model::new(&dead).unwrap(), &frames, &SANITIZED);
}

#[test]
fn compilers_without_builtins_give_the_same() {
    let (scene, frames) = scene("eight-by-eight");
    check(&Model::new(&scene).unwrap(), &frames, &["-O3", "-DDERMIS_NO_BUILTINS"]);
}

/// A scene of an array of this pitch along x and y, in mm.
fn parsed(rows: usize, cols: usize, pitch: [f64; 2], text: &str) -> Scene {
    let [x, y] = pitch;
    let sensor = format!("rows = {rows}\ncols = {cols}\npitch_x_mm = {x:?}\npitch_y_mm = {y:?}\nthickness_mm = 3.0\n");
    Scene::parse(&format!("[sensor]\n{sensor}{text}"), "own.toml").unwrap()
}

/// Zero and gain of each taxel, threshold and noise floor, as files and fields of a scene give them.
fn calibrated(plan: &mut Plan) {
    let taxels = plan.scene.sensor.taxels() as i32;
    plan.prepare.zero = Some((0..taxels).map(|taxel| 700 * (taxel % 5) - 900).collect());
    plan.prepare.gain = Some((0..taxels).map(|taxel| 65536 - 991 * (taxel % 7)).collect());
    plan.own_mut().threshold = 5000;
    plan.own_mut().noise_floor = 300;
}

/// Odd sizes, dead taxels without symmetry, a shared matrix, narrow and wide words, no shear, calibration.
#[test]
fn other_scenes_are_equal_on_the_host() {
    let degree = |degree| format!("[search]\ndegree = {degree}\n");
    let scenes = [
        parsed(5, 7, [2.0, 3.0], "[partition]\ncondition = \"both-signs\"\n[input]\ndead = [[0, 1], [2, 3], [4, 6]]\n"),
        parsed(6, 6, [4.0, 4.0], &degree(1)),
        parsed(3, 4, [4.0, 4.0], &(degree(2) + "[fixed]\ninput_bits = 12\ninverse_bits = 18\n")),
        parsed(4, 6, [4.0, 4.0], "[fixed]\ninput_bits = 24\ninverse_bits = 28\ndata_bits = 14\n"),
        parsed(4, 5, [2.0, 3.0], "[search]\nmu_max = 0.0\n"),
    ];
    let shares = scenes.each_ref().map(|scene| Model::new(scene).unwrap().formats().shared_a);
    assert_eq!(shares, [false, true, false, false, false]);
    for scene in &scenes {
        let model = Model::new(scene).unwrap();
        check(&model, &[], &SANITIZED);
        check(&model.with_changed_plan(calibrated).unwrap(), &[], &SANITIZED);
    }
}

/// A reading that needs more bits, or one at the end of a stated full scale; taxel 3 is dead.
#[test]
fn readings_beyond_their_range_are_told() {
    let outcomes = |input: &str| {
        let model = Model::new(&parsed(4, 4, [4.0, 4.0], &format!("[input]\ndead = [[0, 3]]\n{input}"))).unwrap();
        let most = largest_code(model.formats().code_bits);
        let with = |(at, code): (usize, i32)| (0..16).map(|taxel| if taxel == at { code } else { 100 }).collect();
        let codes = [(15, most - 1), (15, most), (15, -most - 1), (3, most), (15, most + 1), (3, -most - 2)];
        let source = generate_for(&model, codes.map(with).into()).unwrap();
        run(&source, &SANITIZED).iter().map(|printed| (printed.outside, printed.saturated)).collect::<Vec<_>>()
    };
    let (none, outside, saturated) = ((false, false), (true, false), (false, true));
    assert_eq!(outcomes("full_scale_MPa = 1.0"), [none, saturated, saturated, none, outside, outside]);
    // Where every frame has a scale of its own its largest reading is the largest code.
    assert_eq!(outcomes(""), [none, none, none, none, outside, outside]);
}

/// The checks of codes: each kind of faulty frame has its flags, in C as in the model, and none where the scene has no check.
#[test]
fn faults_of_codes_are_in_the_status() {
    let flags_of = |falls: bool, more: &str| {
        let of_check = |plan: &mut Plan| {
            plan.prepare.gain = Some(vec![if falls { -65536 } else { 65536 }; 24]);
            plan.prepare.zero = Some(vec![0; 24]);
            plan.push_limit = Some(5);
            plan.prepare.check.iter_mut().for_each(|check| check.falls = falls);
        };
        let model = Model::new(&parsed(4, 6, [4.0, 4.0], more)).unwrap().with_changed_plan(of_check).unwrap();
        check(&model, &[], &SANITIZED);
        let readings = faulty_readings(&model);
        let raised = |readings: &Vec<i32>| Status::all(&model.run(readings).status).next().unwrap().raised;
        let both = |raised: FlagSet| [Flag::Clipped, Flag::LineFault].map(|flag| raised.contains(flag));
        readings.iter().map(|readings| both(raised(readings))).collect::<Vec<_>>()
    };
    let (clean, clipped, line) = ([false, false], [true, false], [false, true]);
    let seen = [clean, clipped, line, line, clean];
    assert_eq!(flags_of(false, "")[..5], seen);
    assert_eq!(flags_of(true, "")[5..], seen);
    assert_eq!(flags_of(false, "[hardware]\ncode_check = \"off\"\n"), [clean; 10]);
}

/// The source with the number of largest magnitude of a table negated: a weight of an output that is never active changes nothing.
fn with_wrong_word(source: &CSource, table: &str) -> CSource {
    let mut wrong = source.clone();
    let file = wrong.files.iter_mut().find(|file| file.name == format!("{}.c", source.name)).unwrap();
    let begin = file.text.find(&format!("static const int32_t {table}[")).unwrap();
    let begin = begin + file.text[begin..].find('{').unwrap() + 1;
    let end = begin + file.text[begin..].find('}').unwrap();
    let mut words: Vec<i64> = file.text[begin..end].split(',').filter_map(|word| word.trim().parse().ok()).collect();
    let largest = words.iter_mut().max_by_key(|word| word.abs()).unwrap();
    *largest = -*largest;
    let words: Vec<String> = words.iter().map(i64::to_string).collect();
    file.text.replace_range(begin..end, &words.join(","));
    wrong
}

#[test]
fn a_wrong_word_of_a_table_is_found() {
    let (scene, frames) = scene("sensor-1-noisy");
    let model = Model::new(&scene).unwrap();
    let source = generate(&model, &frames).unwrap();
    let right: Vec<Vec<u32>> = source.readings.iter().map(|readings| expected(&model, readings)).collect();
    let words = |source: &CSource| run(source, &["-O0"]).into_iter().map(|printed| printed.words).collect::<Vec<_>>();
    assert_eq!(words(&source), right);
    let tables = ["WEIGHTS_1", "INVERSE_LOW_0", "BIASES_2", "AX_1", "AY_2", "INVERSE_HIGH_0", "WEIGHTS_3"];
    for table in variants(&tables, 3) {
        assert_ne!(words(&with_wrong_word(&source, table)), right, "{table}");
    }
    // The comparison on a core finds it as well.
    let error = measure_all(&model, &with_wrong_word(&source, "WEIGHTS_1")).unwrap_err().to_string();
    assert!(error.contains("a word differs from the bit-true model's on a Cortex-M7"), "{error}");
}

/// Shipped frames on both cores; an instruction in each cycle of 480 MHz leaves room in a millisecond.
#[test]
fn shipped_frames_are_equal_on_cortex_m() {
    for name in ["sensor-1-noisy", "sensor-1"] {
        let (scene, frames) = scene(name);
        let model = Model::new(&scene).unwrap();
        let source = generate(&model, &frames).unwrap();
        let Measured::Runs(runs) = measure_all(&model, &source).unwrap() else {
            panic!("arm-none-eabi-gcc and qemu-system-arm are installed (make setup)")
        };
        assert_eq!(runs.len(), 2);
        for run in runs {
            let instructions = if scene.hardware_estimator().name() == "network" { 400_000 } else { 900_000 };
            assert!(run.instructions < instructions, "{name}: {run:?}");
            let code = run.flash_bytes.checked_sub(source.needs.coefficient_bytes).unwrap();
            assert!(code < 10_000 && run.stack_bytes < 1000, "{name}: {run:?}");
            assert_eq!(run.results.len(), frames.len());
        }
    }
}

#[test]
fn what_c_does_not_serve_is_refused_by_field() {
    let scaled = "[input]\nfull_scale_MPa = 1.0\n";
    let cases = [
        ("partition.case = 1", "[partition]\ncase = 1\n".to_owned()),
        ("input.average = 2", "[input]\nfull_scale_MPa = 1.0\naverage = 2\n".to_owned()),
        ("input.zero = running", format!("{scaled}zero = \"running\"\n")),
        ("hardware.tables = writable", format!("{scaled}[hardware]\ntables = \"writable\"\n")),
        ("output.forces = resultants", "[output]\nforces = \"resultants\"\n".to_owned()),
    ];
    for (field, text) in cases {
        let scene = parsed(8, 8, [4.0, 4.0], &text);
        let model = Model::new(&scene).unwrap();
        let error = needs(&model).unwrap_err().to_string();
        assert!(error.contains(field), "{error}");
        assert_eq!(generate_for(&model, Vec::new()).unwrap_err().to_string(), error);
    }
    let contacts = Model::new(&Scene::builtin("eight-by-eight-contacts").unwrap()).unwrap();
    assert!(needs(&contacts).unwrap_err().to_string().contains("partition.case = contacts"));
}
