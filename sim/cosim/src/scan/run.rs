//! Runs a scan and compares it with the bit-true model.

use std::ops::Range;
use std::path::Path;

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::stages::scan::{beats, rail, scan as codes_of, Scanned};
use dermis_golden::fixed::stages::send::STATUS_BEATS;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::scan::{generate_scan, scan_simulator, ScanDevice, ScanInputs};
use serde::Serialize;

use super::array::{volts, Array, Fault, NOISE_LSB};
use super::converters::Converters;
use super::device::VerilatedScan;
use crate::findings::{Findings, FrameComparison, Place};
use crate::simulator::Simulator;
use dermis_flow::progress::Progress;

/// Cycles of reset before a run.
const RESET: u64 = 4;
/// Scans beyond the expected ones after which a run is given up.
const SPARE_SCANS: u64 = 3;
/// Seed of the stalls.
const SEED: u64 = 1;

/// What the model expects of a scan.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Number of the scan since the reset.
    pub number: usize,
    /// Codes and flags.
    pub scanned: Scanned,
    /// Beats of the frame: forces, status with its flags, codes.
    pub beats: Vec<[i32; 3]>,
    /// Cycles of the engine.
    pub cycles: Cycles,
}

/// An image of tables that is sent while the hardware scans.
#[derive(Clone, Debug)]
pub struct Image {
    /// Its beats.
    pub beats: Vec<i32>,
    /// Cycles after the reset from which it is offered.
    pub at: u64,
}

/// Cycles from the offer of an image until the engine takes its first byte, at most, and after its last one.
const IMAGE_SLACK: u64 = 200;

impl Image {
    /// The image of the tables of `model`, in the middle of the scan of this number; `None` without a scan.
    pub fn within(model: &Model, scan: usize) -> Option<Image> {
        let timing = model.scan_timing()?;
        Some(Image { beats: model.image_beats(), at: scan as u64 * timing.period + timing.scan / 2 })
    }

    /// The first scan that begins after it.
    fn first_after(&self, period: u64) -> usize {
        ((self.at + self.beats.len() as u64 + IMAGE_SLACK) / period) as usize + 1
    }
}

/// When a scan happened, in cycles after the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ScanTimes {
    /// Its first frame on the bus begins.
    pub begins: u64,
    /// The engine takes its last code.
    pub last_code: u64,
    /// The last beat of its forces and status leaves.
    pub last_beat: u64,
}

/// Codes and beats by plan of the scans of `array` with these numbers.
pub fn expected(model: &Model, array: &Array, scans: Range<usize>) -> Vec<Expected> {
    let Some(scan) = model.scene.hardware.adc_scan else { return Vec::new() };
    let code_bits = model.formats().code_bits;
    let of = |number| {
        let scanned = codes_of(&scan, code_bits, &model.dead, &array.answers(number));
        let trace = model.run(&scanned.codes);
        let mut status = trace.status;
        status.chunks_mut(STATUS_BEATS).for_each(|beats| scanned.flags.put(beats));
        let codes = if model.code_beats() > 0 { beats(&scanned.codes) } else { Vec::new() };
        Expected { number, scanned, beats: [trace.beats, status, codes].concat(), cycles: trace.cycles }
    };
    scans.map(of).collect()
}

/// What a run of a device showed.
#[derive(Default)]
struct Observed {
    /// Codes that the engine took of each whole frame.
    codes: Vec<i32>,
    beats: Vec<[i32; 3]>,
    /// Number of beats up to each last one of a frame.
    ends: Vec<usize>,
    /// Bytes of an image that were not taken.
    left: usize,
    /// Violations of the converters' data sheet, and how many there are.
    violations: Vec<String>,
    violation_count: usize,
    times: Vec<ScanTimes>,
}

/// Runs `device` from a reset until it has answered all `expected` scans of `array`, those that `image` does not break off; the
/// receiver stalls at random if `stalls`. Returns what differs, violations of the data sheet among it, and the times of each
/// scan.
pub fn simulate(
    device: &mut dyn ScanDevice,
    label: &str,
    model: &Model,
    array: &Array,
    expected: &[Expected],
    image: Option<&Image>,
    stalls: bool,
) -> (Findings, Vec<ScanTimes>) {
    match observe(device, model, array, expected, image, stalls) {
        Some(observed) => (compare(label, model, expected, &observed), observed.times),
        None => Default::default(),
    }
}

/// Runs `device`; `None` of a scene without a scan.
fn observe(
    device: &mut dyn ScanDevice,
    model: &Model,
    array: &Array,
    expected: &[Expected],
    image: Option<&Image>,
    stalls: bool,
) -> Option<Observed> {
    let (scan, timing) = (model.scene.hardware.adc_scan?, model.scan_timing()?);
    let mut converters = Converters::new(scan, array.clone(), model.board.clock_MHz);
    let mut random = fastrand::Rng::with_seed(SEED);
    let mut seen = Observed { times: vec![ScanTimes::default(); expected.len()], ..Observed::default() };
    let (taxels, wanted) = (model.scene.sensor.taxels(), expected.iter().map(|of| of.beats.len()).sum::<usize>());
    let longest = expected.iter().map(|of| of.cycles.total).max().unwrap_or(0);
    let scans = expected.last().map_or(0, |of| of.number) as u64 + SPARE_SCANS;
    // The numbers beyond the codes are bytes of an image.
    let most_code = rail(model.formats().code_bits);
    let (mut frame, mut frames, mut begun) = (Vec::new(), 0, None);
    let mut bytes = image.map_or(&[][..], |image| &image.beats);
    for cycle in 0..RESET + scans * (timing.period + 4 * longest) {
        let m_ready = !stalls || random.u8(..4) > 0;
        let byte = bytes.first().filter(|_| image.is_some_and(|image| cycle >= RESET + image.at));
        let inputs = ScanInputs {
            rst: cycle < RESET,
            enable: true,
            miso: converters.outputs(),
            s_data: byte.copied().unwrap_or_default(),
            s_valid: byte.is_some(),
            s_last: bytes.len() == 1,
            m_ready,
        };
        let outputs = device.cycle(&inputs);
        // Registers are undefined until the second edge of a reset.
        let Some(now) = cycle.checked_sub(RESET) else { continue };
        converters.cycle(&outputs.pins);
        if inputs.s_valid && outputs.s_ready {
            bytes = &bytes[1..];
        }
        let scan_now = array.scan_of(converters.frames());
        if !outputs.pins.cs_n && begun != Some(scan_now) {
            begun = Some(scan_now);
            if let Some(place) = expected.iter().position(|scan| scan.number == scan_now) {
                seen.times[place].begins = now;
            }
        }
        if let Some(beat) = outputs.taken.filter(|beat| beat.data <= most_code) {
            frame.push(beat.data);
            if beat.last && frame.len() == taxels {
                seen.codes.append(&mut frame);
                if let Some(times) = seen.times.get_mut(frames) {
                    times.last_code = now;
                }
                frames += 1;
            } else if beat.last {
                // A scan that an image broke off.
                frame.clear();
            }
        }
        if outputs.m_valid && m_ready {
            seen.beats.push(outputs.m_data);
            if outputs.m_last {
                if let Some(times) = seen.times.get_mut(seen.ends.len()) {
                    times.last_beat = now;
                }
                seen.ends.push(seen.beats.len());
            }
        }
        if seen.beats.len() >= wanted {
            break;
        }
    }
    // What is left of a frame that has not ended is compared too.
    seen.codes.append(&mut frame);
    seen.left = bytes.len();
    let (violations, count) = converters.violations();
    (seen.violations, seen.violation_count) = (violations.to_vec(), count);
    Some(seen)
}

/// What differs from the model.
fn compare(label: &str, model: &Model, expected: &[Expected], observed: &Observed) -> Findings {
    let Observed { codes, beats, ends, left, violations, violation_count, .. } = observed;
    let mut findings = Findings::default();
    let of_scan = |number: usize| FrameComparison::new(label, format!("scan {number}"), number);
    // First in the list: a broken time explains what is wrong after it.
    let mut comparison = of_scan(0);
    let place = Place { stage: "converter", ..Place::default() };
    violations.iter().for_each(|text| comparison.add_violation(place, text.clone()));
    if *left > 0 {
        let place = Place { stage: "load", ..Place::default() };
        comparison.add_violation(place, format!("{left} bytes of the image are not taken"));
    }
    findings.extend(comparison.finish());
    findings.count += violation_count - violations.len();
    let (mut code, mut beat) = (codes.iter(), beats.iter());
    let (cols, mut end) = (model.scene.sensor.cols, 0);
    for (nth, own) in expected.iter().enumerate() {
        let mut comparison = of_scan(own.number);
        for (index, &wanted) in own.scanned.codes.iter().enumerate() {
            let taxel = Some([index / cols, index % cols]);
            let got = code.next().map(|code| vec![i64::from(*code)]);
            comparison.compare(Place { stage: "scan", index, taxel, cycle: None }, Some(vec![wanted.into()]), got);
        }
        for (index, wanted) in own.beats.iter().enumerate() {
            let got = beat.next().map(|beat| beat.map(i64::from).to_vec());
            let place = Place { stage: "beats", index, ..Place::default() };
            comparison.compare(place, Some(wanted.map(i64::from).to_vec()), got);
        }
        end += own.beats.len();
        if ends.get(nth) != Some(&end) {
            let place = Place { stage: "beats", ..Place::default() };
            comparison.add_violation(place, format!("tlast is not on beat {end} of the run"));
        }
        findings.extend(comparison.finish());
    }
    findings
}

/// A scanned frame.
#[derive(Clone, Debug)]
pub struct ScannedFrame {
    /// Name of the frame whose stress the array had.
    pub frame: String,
    /// The result from the scanned codes; the hardware's as well where `equal` is set.
    pub result: Reconstruction,
    /// Whether every run equalled the model on this frame.
    pub equal: bool,
    /// When it happened in the first run.
    pub times: ScanTimes,
}

/// The co-simulation of a scan.
#[derive(Clone, Debug)]
pub struct VerifiedScan {
    /// The model.
    pub model: Model,
    /// Results, one per frame.
    pub rows: Vec<ScannedFrame>,
    /// Mismatches and broken times of all runs.
    pub findings: Findings,
    /// Labels of the runs.
    pub runs: Vec<String>,
}

/// Co-simulates the scan of `scene` over an array that shows `frames` (at least one), one per scan, on the given simulators,
/// with a fault of the wires if there is one. With a `specimen`, its tables come in the middle of the first scan, which they
/// break off, and the frames are the specimen's.
///
/// # Errors
/// A scene that cannot be built, tables that it does not take, a frame of another sensor, a fault of what the array does not
/// have, no Verilator, a netlist, which a scan does not have.
pub fn verify_scan(
    scene: &Scene,
    specimen: Option<&Scene>,
    frames: &[Frame],
    simulators: &[Simulator],
    fault: Option<Fault>,
    build: &Path,
) -> Result<VerifiedScan> {
    let hardware = Model::new(scene)?;
    let (Some(scan), Some(timing)) = (hardware.scene.hardware.adc_scan, hardware.scan_timing()) else {
        bail!("hardware.source = stream: there is no scan");
    };
    let (model, image) = match specimen {
        None => (hardware.clone(), None),
        Some(specimen) => {
            let model = hardware.with_tables(specimen, 1)?;
            let image = Image::within(&model, 0);
            (model, image)
        }
    };
    let first = image.as_ref().map_or(0, |image| image.first_after(timing.period));
    let volts = frames.iter().map(|frame| volts(&model, frame)).collect::<Result<Vec<_>>>()?;
    let before = volts.iter().take(1).cycle().take(first).cloned().collect::<Vec<_>>();
    let array = Array::new(scan, scene.sensor.rows, [before, volts].concat(), NOISE_LSB, fault);
    let scans = first..first + frames.len();
    if let Some(fault) = fault {
        fault.check(&array, scans.end)?;
    }
    let expected = expected(&model, &array, scans);
    let mut verified =
        VerifiedScan { model: model.clone(), rows: Vec::new(), findings: Findings::default(), runs: Vec::new() };
    let mut first_times = Vec::new();
    for &simulator in simulators {
        let stimuli: &[bool] = if simulator == Simulator::Verilator { &[false, true] } else { &[false] };
        for &stalls in stimuli {
            let label = format!("{}, {}", simulator.name(), if stalls { "with stalls" } else { "full speed" });
            let _progress = Progress::start(&format!("{}: {label}", scene.name));
            let mut device: Box<dyn ScanDevice> = match simulator {
                Simulator::Verilator => {
                    Box::new(VerilatedScan::new(&generate_scan(&hardware)?, &hardware, &build.join("verilator"))?)
                }
                Simulator::Kernel => scan_simulator(&hardware)?,
                Simulator::Netlist => bail!("a scan is not simulated as netlist: take verilator or kernel"),
            };
            let (findings, times) = simulate(&mut *device, &label, &model, &array, &expected, image.as_ref(), stalls);
            verified.findings.extend(findings);
            verified.runs.push(label);
            if first_times.is_empty() {
                first_times = times;
            }
        }
    }
    for (index, ((frame, own), times)) in frames.iter().zip(&expected).zip(first_times).enumerate() {
        let (beats, others) = own.beats.split_at(model.force_beats());
        let status = &others[..model.status_beats()];
        let result = model.decode(std::slice::from_ref(frame), "scan", beats, status)?;
        let equal = !verified.findings.unequal.contains(&(first + index));
        verified.rows.push(ScannedFrame { frame: frame.id.clone(), result, equal, times });
    }
    Ok(verified)
}
