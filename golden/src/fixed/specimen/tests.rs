use super::*;
use crate::frame::Frame;
use crate::input::calibration::Calibration;

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
    (scene.search.noise_floor_MPa, scene.threshold.min_force_N) = (0.004, 0.01);
    (folder, scene)
}

#[test]
fn hardware_that_takes_an_image_is_the_specimen_s() {
    let mut hardware = hardware();
    let (_folder, scene) = specimen(1.75);
    let own = hardware.with_tables(&scene, 41).unwrap();
    assert!(own.noise_floor > 0 && own.threshold > 0);
    let frame =
        Frame::from_stress("f", &scene.sensor, (0..20).map(|taxel| f64::from(taxel) / 40.0 - 0.2).collect()).unwrap();
    let codes = own.readings(std::slice::from_ref(&frame)).unwrap();
    assert_ne!(hardware.run(&codes).beats, own.run(&codes).beats);
    assert_eq!(hardware.load(&own.image()), Outcome::Whole);
    assert_eq!(hardware.run(&codes), own.run(&codes));
    let result = own.decode(&[frame], "fixed", &own.run(&codes).beats, &own.run(&codes).status).unwrap();
    assert_eq!(result.extra.tables_version, Some(41));
    // The tables of the bitstream have version 0.
    assert_eq!(super::super::Model::new(&scene).unwrap().tables_version, 0);
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
    assert!(flags(&hardware).contains(&crate::flags::Flag::TablesRefused));
    let mut broken = image.clone();
    broken[30] ^= 1;
    assert_eq!(hardware.load(&broken), Outcome::Broken);
    assert!(hardware.run(&codes).beats.iter().all(|force| *force == [0; 3]));
    // A refused image does not make tables whole.
    assert_eq!((hardware.load(&other), hardware.tables_outcome), (Outcome::Refused, Outcome::Broken));
    assert!(flags(&hardware).contains(&crate::flags::Flag::TablesIncomplete));
    assert_eq!(hardware.load(&image), Outcome::Whole);
    assert!(!flags(&hardware).contains(&crate::flags::Flag::TablesIncomplete));
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
    assert!(error(&scene, 1).starts_with("sensor: differs from that of the hardware's scene"));
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
    let mut send = |plan: &mut Plan, bytes: &[u8], in_frame| {
        let count = bytes.len();
        let each = bytes.iter().enumerate().map(|(at, &byte)| intake.byte(plan, byte, at + 1 == count, in_frame));
        let all: Vec<Outcome> = each.flatten().collect();
        assert!(!intake.is_busy());
        all
    };
    assert_eq!(send(&mut hardware, &image, true), [Outcome::Refused]);
    assert_eq!(send(&mut hardware, &image, false), [Outcome::Whole]);
    assert_eq!((hardware.tables_version, hardware.tables_outcome), (3, Outcome::Whole));
    assert_eq!(send(&mut hardware, &[&image[..], &[0, 0]].concat(), false), [Outcome::Broken]);
    assert_eq!(send(&mut hardware, &image[..40], false), [Outcome::Broken]);
    let mut wrong = image.clone();
    wrong[5] ^= 1;
    assert_eq!(send(&mut hardware, &wrong, false), [Outcome::Refused]);
    assert_eq!(hardware.tables_outcome, Outcome::Broken);
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
fn errors_are_expected_and_features_counted_of_writable_hardware_too() {
    use crate::fixed::plan::feature_costs::features;
    use crate::noise::expected::{expected, Expectation, StatedNoise};
    let (_folder, scene) = specimen(1.0);
    let asked = Expectation { peak_MPa: None, draws: 2, seed: 1, with_hardware: true };
    let noise = StatedNoise::of(&scene, None).unwrap();
    assert!(expected(&scene, &asked, &noise, &|_, _| ()).is_ok());
    let model = Model::new(&scene).unwrap();
    let all = features(&model);
    let written = all.iter().find(|feature| feature.name == "writable tables").unwrap();
    let without = written.without_feature.as_ref().unwrap().resources.multipliers();
    assert!(written.with_feature.is_none() && without <= model.resources.multipliers());
}
