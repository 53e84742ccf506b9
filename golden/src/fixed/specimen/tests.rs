use super::*;
use crate::data::frame::Frame;
use crate::data::input::calibration::Calibration;
use crate::fixed::words::formats::HALVINGS;
use crate::physics::matrices::Matrices;
use crate::random::Random;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::{CoefficientCheck, Condition};

const HARDWARE: &str = "
name = \"hardware\"
[sensor]
rows = 4
cols = 5
pitch_x_mm = 2.0
pitch_y_mm = 2.0
thickness_mm = 2.0
[input]
full_scale_MPa = 1.0
[hardware]
tables = \"writable\"
[hardware.table_range]
gain = [0.5, 2.0]
";

fn hardware() -> Model {
    Model::new(&Scene::parse(HARDWARE, "hardware").unwrap()).unwrap()
}

/// A specimen with this gain of its third taxel, a noise floor and a threshold; the folder has its table.
fn specimen(gain: f64) -> (tempfile::TempDir, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::parse(HARDWARE, "specimen").unwrap();
    let mut table = Calibration::identity(scene.sensor.taxels());
    (table.gain[2], table.offset[1]) = (gain, -0.125);
    let path = folder.path().join("table.csv");
    std::fs::write(&path, table.to_csv(&scene.sensor)).unwrap();
    scene.input.calibration = Some(path);
    (scene.search.noise_floor_MPa, scene.threshold.min_force_N) = (Some(0.004), 0.01);
    (folder, scene)
}

#[test]
fn hardware_that_takes_an_image_is_the_specimen_s() {
    let mut hardware = hardware();
    let (_folder, scene) = specimen(1.75);
    let own = hardware.with_tables(&scene, 41).unwrap();
    assert!(own.noise_floor() > 0 && own.threshold() > 0);
    let frame =
        Frame::from_stress("f", &scene.sensor, (0..20).map(|taxel| f64::from(taxel) / 40.0 - 0.2).collect()).unwrap();
    let codes = own.readings(std::slice::from_ref(&frame)).unwrap();
    assert_ne!(hardware.run(&codes).beats, own.run(&codes).beats);
    assert_eq!(hardware.load(&own.image()), Outcome::Whole);
    assert_eq!(hardware.run(&codes), own.run(&codes));
    let result = own.decode(&[frame], "fixed", &own.run(&codes).beats, &own.run(&codes).status).unwrap();
    assert_eq!(result.extra.tables_version, Some(41));
    // The tables of the bitstream have version 0.
    assert_eq!(super::super::Model::new(&scene).unwrap().own().version, 0);
}

#[test]
fn a_refused_image_leaves_the_tables_and_a_broken_one_no_force() {
    let mut hardware = hardware();
    let (_folder, scene) = specimen(1.0);
    let image = hardware.with_tables(&scene, 9).unwrap().image();
    let frame = Frame::from_stress("f", &scene.sensor, vec![0.5; 20]).unwrap();
    let codes = hardware.readings(std::slice::from_ref(&frame)).unwrap();
    let before = hardware.run(&codes);
    let flags = |model: &Model| {
        let trace = model.run(&codes);
        model.decode(std::slice::from_ref(&frame), "fixed", &trace.beats, &trace.status).unwrap().flags
    };
    let mut other = image.clone();
    other[0] ^= 1;
    assert_eq!(hardware.load(&other), Outcome::Refused);
    assert_eq!(hardware.run(&codes).beats, before.beats);
    assert!(flags(&hardware).contains(&crate::result::flags::Flag::TablesRefused));
    let mut broken = image.clone();
    broken[30] ^= 1;
    assert_eq!(hardware.load(&broken), Outcome::Broken);
    assert!(hardware.run(&codes).beats.iter().all(|force| *force == [0; 3]));
    // A refused image does not make tables whole.
    assert_eq!((hardware.load(&other), hardware.own().outcome), (Outcome::Refused, Outcome::Broken));
    assert!(flags(&hardware).contains(&crate::result::flags::Flag::TablesIncomplete));
    assert_eq!(hardware.load(&image), Outcome::Whole);
    assert!(!flags(&hardware).contains(&crate::result::flags::Flag::TablesIncomplete));
}

#[test]
fn what_no_table_holds_is_refused_by_field() {
    let hardware = hardware();
    let error = |scene: &Scene, version| hardware.with_tables(scene, version).unwrap_err().to_string();
    let (_folder, scene) = specimen(2.5);
    assert_eq!(
        error(&scene, 1),
        "input.calibration: the gain of taxel [0, 2] is 2.5; hardware.table_range.gain allows 0.5 to 2"
    );
    let (_folder, mut scene) = specimen(2.0);
    assert_eq!(error(&scene, 0), "version: 0 is not possible; expected 1 to 32767");
    scene.sensor.thickness_mm = 3.0;
    assert!(error(&scene, 1).starts_with("sensor.thickness_mm: differs from that of the hardware's scene"));
    type Change = (&'static str, fn(&mut Scene));
    let changes: [Change; 6] = [
        ("hardware.table_range.gain", |scene| scene.hardware.table_range.gain = None),
        ("hardware.coefficient_check", |scene| scene.hardware.coefficient_check = CoefficientCheck::Signature),
        ("hardware.board", |scene| scene.hardware.board = Some("icebreaker".into())),
        ("search.mu_max", |scene| scene.search.mu_max = 0.25),
        ("fixed.coef_bits", |scene| scene.fixed.coef_bits -= 1),
        ("partition.condition", |scene| scene.partition.condition = Condition::BothSigns),
    ];
    for (field, change) in changes {
        let (_folder, mut scene) = specimen(2.0);
        change(&mut scene);
        let error = error(&scene, 1);
        assert!(error.starts_with(&format!("{field}: differs from that of the hardware's scene")), "{field}: {error}");
    }
    // A board that is named is the one that a scene without a name has.
    let (_folder, mut scene) = specimen(2.0);
    scene.hardware.board = Some(scene.hardware.board_name().to_owned());
    assert!(hardware.with_tables(&scene, 1).is_ok());
    let mut rom = hardware.scene.clone();
    rom.hardware = Default::default();
    let rom = Model::new(&rom).unwrap();
    let (_folder, scene) = specimen(1.0);
    assert!(rom.with_tables(&scene, 1).unwrap_err().to_string().starts_with("hardware.tables: rom is not possible"));
    assert_eq!((rom.image(), rom.clone().load(&[])), (Vec::new(), Outcome::Refused));
}

#[test]
fn an_image_ends_as_the_stream_says() {
    let mut hardware = hardware();
    let (_folder, scene) = specimen(1.0);
    let image = hardware.with_tables(&scene, 3).unwrap().image();
    let mut intake = Intake::default();
    let mut send = |model: &mut Model, bytes: &[u8], in_frame| {
        let count = bytes.len();
        let each = bytes.iter().enumerate().map(|(at, &byte)| intake.byte(model, byte, at + 1 == count, in_frame));
        let all: Vec<Outcome> = each.flatten().collect();
        assert!(!intake.is_busy());
        all
    };
    assert_eq!(send(&mut hardware, &image, true), [Outcome::Refused]);
    assert_eq!(send(&mut hardware, &image, false), [Outcome::Whole]);
    assert_eq!((hardware.own().version, hardware.own().outcome), (3, Outcome::Whole));
    assert_eq!(send(&mut hardware, &[&image[..], &[0, 0]].concat(), false), [Outcome::Broken]);
    assert_eq!(send(&mut hardware, &image[..40], false), [Outcome::Broken]);
    let mut wrong = image.clone();
    wrong[5] ^= 1;
    assert_eq!(send(&mut hardware, &wrong, false), [Outcome::Refused]);
    assert_eq!(hardware.own().outcome, Outcome::Broken);
    // Broken off by a code, and by a reset.
    for (bytes, outcome) in [(3, Outcome::Refused), (7, Outcome::Broken)] {
        image[..bytes].iter().for_each(|&byte| assert_eq!(intake.byte(&mut hardware, byte, false, false), None));
        assert_eq!(intake.code(&mut hardware), Some(outcome));
        image[..bytes].iter().for_each(|&byte| assert_eq!(intake.byte(&mut hardware, byte, false, false), None));
        assert_eq!(intake.reset(&mut hardware, 0), (outcome == Outcome::Broken).then_some(outcome));
        assert_eq!(intake.code(&mut hardware), None);
    }
}

#[test]
fn features_are_counted_of_writable_hardware_too() {
    use crate::fixed::plan::feature_costs::features;
    let (_folder, scene) = specimen(1.0);
    let model = Model::new(&scene).unwrap();
    let all = features(&model);
    let written = all.iter().find(|feature| feature.name == "writable tables").unwrap();
    let without = written.without_feature.as_ref().unwrap().resources.multipliers();
    assert!(written.with_feature.is_none() && without <= model.resources.multipliers());
}

/// The hardware of covers and dead taxels.
fn of_range(rows: usize, range: &str) -> Scene {
    let text = HARDWARE.replace("rows = 4", &format!("rows = {rows}")).replace("gain = [0.5, 2.0]", range);
    Scene::parse(&text, "range").unwrap()
}

fn with(scene: &Scene, thickness_mm: f64, dead: &[[usize; 2]]) -> Scene {
    let mut specimen = scene.clone();
    (specimen.sensor.thickness_mm, specimen.input.dead) = (thickness_mm, dead.to_vec());
    specimen
}

/// Even and odd arrays; the coefficients are those of the specimen, to the bit, and its forces near those of hardware for it alone.
#[test]
fn coefficients_of_another_cover_are_loaded() {
    let ranges = ["thickness_mm = [1.0, 3.0]", "thickness_mm = [1.5, 2.5]\ndead_taxels = 2", "dead_taxels = 3"];
    let sizes = [(4, 0.6), (5, 0.6), (5, 0.0)];
    for ((rows, mu_max), range) in sizes.into_iter().flat_map(|size| ranges.map(|range| (size, range))) {
        let mut scene = of_range(rows, range);
        scene.search.mu_max = mu_max;
        let hardware = Model::new(&scene).unwrap();
        assert!(!hardware.storage().is_pruned(hardware.formats().quads) && hardware.dead.is_empty());
        let covers = if scene.hardware.table_range.thickness_mm.is_some() { [1.7, 2.5] } else { [2.0, 2.0] };
        let dead: &[[usize; 2]] = if scene.hardware.table_range.dead_taxels > 0 { &[[0, 1], [2, 3]] } else { &[] };
        for thickness_mm in covers {
            let specimen = with(&scene, thickness_mm, dead);
            let own = hardware.with_tables(&specimen, 3).unwrap();
            let mut loaded = hardware.clone();
            assert_eq!(loaded.load(&own.image()), Outcome::Whole, "{range}");
            assert_eq!(loaded.cases()[0].memory(), own.cases()[0].memory());
            // A force over one taxel, with shear.
            let matrices = Matrices::of(&specimen, &specimen.sensor, 3).unwrap();
            let stress = |taxel| {
                let [z, x, y] = [&matrices.cz, &matrices.cx, &matrices.cy].map(|c| c[(taxel, 8)]);
                5.0 * (z + 0.3 * x - 0.2 * y)
            };
            let stress = (0..scene.sensor.taxels()).map(stress).collect();
            let frame = Frame::from_stress("f", &specimen.sensor, stress).unwrap();
            let codes = own.readings(std::slice::from_ref(&frame)).unwrap();
            assert_eq!(loaded.run(&codes), own.run(&codes));
            assert_ne!(hardware.run(&codes).beats, own.run(&codes).beats);
            // Hardware of this specimen alone has other words, whose last bits differ. With a search they may move μ by a step
            // or two; by more where the objective is flat, as next to a dead taxel.
            let mut alone = own.scene.clone();
            (alone.hardware.tables, alone.hardware.table_range) = Default::default();
            let alone = Model::new(&alone).unwrap().reconstruct(&frame).unwrap();
            let own = own.reconstruct(&frame).unwrap();
            let step = scene.search.mu_max / f64::from(3 << HALVINGS);
            if scene.search.mu_max == 0.0 || dead.is_empty() {
                for (own, alone) in own.subarrays[0].mu.iter().zip(alone.subarrays[0].mu) {
                    assert!((own - alone).abs() <= 2.5 * step, "{rows} {range} {thickness_mm}: {own} {alone}");
                }
                let forces =
                    |of: &Reconstruction| [&of.forces_N.fx, &of.forces_N.fy, &of.forces_N.fz].map(Vec::clone).concat();
                let (own, alone) = (forces(&own), forces(&alone));
                let largest = alone.iter().fold(0.0f64, |most, f| most.max(f.abs()));
                for (own, alone) in own.iter().zip(&alone) {
                    let most = (5.0 * step).max(1e-4) * largest;
                    assert!((own - alone).abs() < most, "{rows} {range} {thickness_mm}: {own} {alone}");
                }
            }
        }
    }
}

#[test]
fn a_specimen_outside_the_range_is_refused_by_field() {
    let scene = of_range(4, "thickness_mm = [1.5, 2.5]\ndead_taxels = 2");
    let hardware = Model::new(&scene).unwrap();
    let error = |scene: &Scene| hardware.with_tables(scene, 1).unwrap_err().to_string();
    assert_eq!(
        error(&with(&scene, 2.6, &[])),
        "sensor.thickness_mm: 2.6 is not possible with these tables: hardware.table_range.thickness_mm allows 1.5 to 2.5"
    );
    assert_eq!(
        error(&with(&scene, 2.0, &[[0, 0], [0, 1], [0, 2]])),
        "input.dead: 3 taxels is not possible with these tables: hardware.table_range.dead_taxels allows 2"
    );
    let mut other = with(&scene, 2.0, &[]);
    other.sensor.pitch_x_mm = 2.5;
    assert!(error(&other).starts_with("sensor.pitch_x_mm: differs"));
    // Without a range the cover is that of the bitstream.
    let mut fixed = super::super::Model::new(&of_range(4, "gain = [0.5, 2.0]")).unwrap();
    let thick = with(&fixed.scene, 2.5, &[]);
    assert!(fixed.with_tables(&thick, 1).unwrap_err().to_string().starts_with("sensor.thickness_mm: differs"));
    // An image of the same array without coefficients, or of another cover, is for other hardware.
    assert_eq!(fixed.load(&super::super::Model::new(&thick).unwrap().image()), Outcome::Refused);
    assert_eq!(fixed.load(&hardware.image()), Outcome::Refused);
}

/// Whatever is within the range needs no wider words than the specimens at its bounds.
#[test]
fn specimens_within_the_range_are_accepted() {
    let mut random = Random::new(24);
    for range in ["thickness_mm = [1.0, 3.0]", "thickness_mm = [1.6, 2.4]\ndead_taxels = 4"] {
        let scene = of_range(6, range);
        let hardware = Model::new(&scene).unwrap();
        let own = &scene.hardware.table_range;
        let taxels: Vec<[usize; 2]> = (0..scene.sensor.taxels()).map(|taxel| [taxel / 5, taxel % 5]).collect();
        for _ in 0..60 {
            let [least, most] = own.thickness_mm.unwrap();
            let drawn = (0..own.dead_taxels).filter_map(|_| random.pick(&taxels).copied());
            let dead: std::collections::BTreeSet<[usize; 2]> = drawn.collect();
            let dead: Vec<[usize; 2]> = dead.into_iter().collect();
            let specimen = with(&scene, random.between(least, most), &dead);
            assert!(hardware.with_tables(&specimen, 1).is_ok(), "{range}: {specimen:?}");
        }
    }
}
