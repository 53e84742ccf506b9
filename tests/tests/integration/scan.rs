//! Scan by the hardware: codes and beats equal the bit-true model to the bit in Verilator and in kernel simulation, with
//! converters modelled from their data sheet, none of whose times is broken; what faults of the wires do; seeded defects.

use dermis_cosim::scan::{expected, simulate, verify_scan, Array, Fault, Image, VerifiedScan, VerilatedScan};
use dermis_cosim::simulator::Simulator;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::adc::{AdcScan, CONVERTERS};
use dermis_golden::spec::scene::{Scene, TableStorage};
use dermis_hdl::bus::{generate_core, Bus, CoreShape};
use dermis_hdl::language::Change;
use dermis_hdl::link::generate_board;
use dermis_hdl::scan::{generate_scan, generate_scan_changed};
use dermis_tests::{build_dir, scene, variants, verilog_code};

use crate::tables::specimen;

/// Both simulators.
const BOTH: [Simulator; 2] = [Simulator::Verilator, Simulator::Kernel];

/// `eight-by-eight`, scanned by one MAX11125 or two ADS8688.
fn scanned(converters: usize, average: u32) -> (Scene, Vec<Frame>) {
    let (mut scene, frames) = scene("eight-by-eight");
    let peak = frames.iter().map(Frame::peak_MPa).fold(0.0, f64::max);
    scene.input.full_scale_MPa = Some(1.1 * peak);
    scene.hardware.adc_scan = Some(AdcScan {
        converter: CONVERTERS[converters - 1],
        converters,
        channels: 8 / converters,
        sclk_MHz: 12.5,
        row_settling_us: 4.0,
        channel_settling_us: if converters == 1 { 0.5 } else { 2.0 },
        average,
        period_us: 300.0,
    });
    (scene, frames[..2].to_vec())
}

fn verified(scene: &Scene, frames: &[Frame], simulators: &[Simulator], fault: Option<Fault>) -> VerifiedScan {
    let verified = verify_scan(scene, None, frames, simulators, fault, &build_dir()).unwrap();
    assert!(verified.findings.is_equal(), "{:#?}", &verified.findings.kept[..verified.findings.kept.len().min(3)]);
    verified
}

fn has(verified: &VerifiedScan, flag: Flag) -> bool {
    verified.rows.iter().all(|row| row.result.flags.contains(&flag))
}

#[test]
fn codes_and_beats_are_those_of_the_model() {
    for (converters, average) in [(1, 1), (2, 0)] {
        let (scene, frames) = scanned(converters, average);
        // The scan of two converters is shorter.
        let verified = verified(&scene, &frames, variants(&BOTH, converters), None);
        let timing = verified.model.scan_timing().unwrap();
        assert!(!has(&verified, Flag::WrongChannel));
        let [first, second] = [0, 1].map(|row| verified.rows[row].times);
        assert_eq!(second.begins - first.begins, timing.period);
        // From the first frame on the bus to the last code: the scan without its first gap, and the codes' way out.
        let codes = scene.hardware.adc_scan.unwrap().converters as u64;
        assert_eq!(first.last_code - first.begins, timing.scan - timing.gap + 1 + codes + 1, "{converters}");
    }
}

#[test]
fn faults_of_the_wires_are_flagged_where_they_can_be_seen() {
    let (scene, frames) = scanned(1, 1);
    let of = |fault| verified(&scene, &frames[..1], &[Simulator::Verilator], Some(fault));
    let high = of(Fault::Stuck { converter: 0, level: true });
    assert!(has(&high, Flag::WrongChannel) && has(&high, Flag::Saturated));
    let low = of(Fault::Stuck { converter: 0, level: false });
    assert!(has(&low, Flag::WrongChannel) && !has(&low, Flag::Saturated));
    assert!(has(&of(Fault::NextChannel { converter: 0 }), Flag::WrongChannel));
    // Bit 12 is in the tag, bit 3 in the result: only the tag tells.
    assert!(has(&of(Fault::Flip { converter: 0, frame: 21, bit: 12 }), Flag::WrongChannel));
    let seen = of(Fault::Flip { converter: 0, frame: 21, bit: 3 });
    assert!(!has(&seen, Flag::WrongChannel) && !has(&seen, Flag::Saturated));
    let rows = of(Fault::Row { row: 2 });
    assert!(!has(&rows, Flag::WrongChannel) && !has(&rows, Flag::Saturated));
}

#[test]
fn one_sample_at_the_end_of_the_range_is_flagged_although_the_mean_is_not() {
    let (mut scene, frames) = scanned(1, 1);
    let peak = frames[0].peak_MPa();
    // The noise of three LSBs of 4096 brings some samples of the largest taxel to the end.
    scene.input.full_scale_MPa = Some(peak * (1.0 + 1.5 / 4096.0));
    let verified = verified(&scene, &frames[..1], &[Simulator::Verilator], None);
    assert!(has(&verified, Flag::Saturated));
}

/// An array that shows the first of `frames` for ever.
fn array(model: &Model, frames: &[Frame]) -> Array {
    let full = f64::from(1u32 << (model.formats().code_bits - 1));
    let codes = model.readings(&frames[..1]).unwrap();
    let volts = vec![codes.iter().map(|code| f64::from(*code) / full).collect()];
    Array::new(model.scene.hardware.adc_scan.unwrap(), model.scene.sensor.rows, volts, 3.0, None)
}

#[test]
fn tables_that_come_within_a_scan_break_it_off_and_the_next_has_them() {
    let (mut scene, frames) = scanned(1, 0);
    scene.hardware.tables = TableStorage::Writable;
    scene.hardware.table_range.gain = Some([0.5, 2.0]);
    let (_folder, own) = specimen(&scene);
    let hardware = Model::new(&scene).unwrap();
    let specimen = hardware.with_tables(&own, 1).unwrap();
    let array = array(&hardware, &frames);
    let scans = [expected(&hardware, &array, 0..1), expected(&specimen, &array, 2..3)].concat();
    assert_ne!(scans[0].beats[..4], scans[1].beats[..4]);
    let mut image = Image::within(&specimen, 1).unwrap();
    let findings = |image: &Image| {
        let generated = generate_scan(&hardware).unwrap();
        let mut device = VerilatedScan::new(&generated, &hardware, &build_dir().join("verilator")).unwrap();
        simulate(&mut device, "tables", &hardware, &array, &scans, Some(image), true).0
    };
    let found = findings(&image);
    assert!(found.is_equal(), "{:#?}", found.kept.first());
    // A scan later, the third still has the old tables.
    image.at += hardware.scan_timing().unwrap().period;
    assert!(!findings(&image).is_equal());
    // The program does the same.
    let verified = verify_scan(&scene, Some(&own), &frames[..1], variants(&BOTH, 1), None, &build_dir()).unwrap();
    assert!(verified.findings.is_equal(), "{:#?}", verified.findings.kept.first());
}

#[test]
fn seeded_defects_are_found() {
    let (scene, frames) = scanned(1, 1);
    let model = Model::new(&scene).unwrap();
    let array = array(&model, &frames);
    let expected = expected(&model, &array, 0..1);
    let findings = |changes: &[Change]| {
        let generated = generate_scan_changed(&model, changes).unwrap();
        let mut device = VerilatedScan::new(&generated, &model, &build_dir().join("verilator")).unwrap();
        simulate(&mut device, "changed", &model, &array, &expected, None, false).0
    };
    assert!(findings(&[]).is_equal());
    let defects: [(Change, &str); 4] = [
        // CS rises for two cycles: times of the data sheet.
        (Change::within("sequencer", "rest", |k| [k.constant(8, 15), k.constant(8, 1)]), "stage converter"),
        // The first frame of a row does not wait for the row.
        (Change::within("sequencer", "rest", |k| [k.constant(8, 251), k.constant(8, 20)]), "stage scan"),
        // The sum does not begin anew with a channel.
        (Change::within("capture", "sum_0", |k| [k.named("opens"), k.constant(1, 0)]), "stage scan"),
        // A command that is shifted all the time.
        (Change::value("sequencer", "command", |k| k.named("command").shift_left(1).low(16)), "stage converter"),
    ];
    for (defect, stage) in variants(&defects, 1) {
        let found = findings(std::slice::from_ref(defect));
        assert!(!found.is_equal(), "{defect}");
        assert!(found.kept.iter().any(|one| one.to_string().contains(stage)), "{defect}: {:?}", found.kept.first());
    }
}

#[test]
fn a_stream_has_nothing_of_a_scan() {
    let (scene, _) = scene("eight-by-eight");
    assert!(["capture", "scan_status"].iter().all(|block| !verilog_code(&scene).contains(&format!("__{block} ("))));
    let error = generate_scan(&Model::new(&scene).unwrap()).unwrap_err().to_string();
    assert_eq!(error, "hardware.source = stream: a scan is not available yet");
    let (scene, _) = scanned(1, 0);
    let model = Model::new(&scene).unwrap();
    let error = generate_board(&model).unwrap_err().to_string();
    assert!(
        error.starts_with("hardware.tables = rom: a board that scans its array without writable tables"),
        "{error}"
    );
    let error = generate_core(&model, CoreShape { bus: Bus::AxiLite, words: 1 }).unwrap_err().to_string();
    assert_eq!(error, "hardware.source = adc-scan: a core for a SoC around a scan is not available yet");
    let text = &generate_scan(&model).unwrap().files[0].text;
    assert!(["sequencer", "capture", "scan_status"].iter().all(|block| text.contains(&format!("__{block} ("))));
}
