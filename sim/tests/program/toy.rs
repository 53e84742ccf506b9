//! Tests of the co-simulation bench itself, on a hand-written toy engine: a correct design passes, and every kind of
//! defect is found (wrong vector, wrong expectation, wrong coefficient, broken handshake, missing beat, wrong cycle
//! count).

use std::path::PathBuf;

use dermis_cosim::drive::{record, InputFrame, Stimulus, Times};
use dermis_cosim::toggles::ToggleCounter;
use dermis_cosim::verilator::{Design, Optimisation, Verilated, VerilatorError};
use dermis_cosim::{compare_recording, run, DeviceUnderTest, Findings, Vector, KEPT_PER_FRAME};
use dermis_golden::fixed::{Cycles, Stage, Trace};
use dermis_hdl::device::{Device, Inputs, Outputs, Tap, TapSignal};
use dermis_hdl::state::{StateElement, StorageClass};

const TOY: &str = include_str!("../toy/toy.v");
const GAIN: i64 = 3;
/// One beat per cycle from the cycle after the last code: 6 forces and 1 status.
const CYCLES: Cycles = Cycles { first_output: 1, latency: 7, total: 13, beat_interval: 1 };
const TAPS: [&str; 2] = ["receive", "scale"];
const STALLS: Stimulus = Stimulus::Stalls { seed: 7 };

fn taps() -> Vec<Tap> {
    let tap = |name, valid: &str, word: &str, bits| Tap {
        name,
        valid: vec![valid.into()],
        word: vec![TapSignal { name: word.into(), bits, signed: true }],
        fields: vec!["d"],
        field_bits: bits,
    };
    vec![tap("receive", "take", "s_axis_tdata", 12), tap("scale", "scale_valid", "scaled", 32)]
}

fn cache() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("verilator")
}

fn toy_of(verilog: &str, gain: &str, open_state: bool) -> Result<Verilated, VerilatorError> {
    let files = vec![("toy.v", verilog), ("gain.hex", gain)];
    let optimisation = Optimisation::Off;
    let design = Design { top: "toy", files, taps: &taps(), input_bits: 12, array_bits: 0, open_state, optimisation };
    Verilated::new(&design, &cache())
}

fn toy_with(verilog: &str, gain: &str) -> Result<Verilated, VerilatorError> {
    toy_of(verilog, gain, false)
}

fn toy() -> Verilated {
    toy_with(TOY, "03\n").unwrap()
}

fn vectors() -> Vec<Vector> {
    let frame = |name: &str, codes: [i32; 6]| {
        let word = |c: &i32| vec![i64::from(*c)];
        let scaled: Vec<Vec<i64>> = codes.iter().map(|c| vec![GAIN * i64::from(*c)]).collect();
        Vector {
            frame: name.into(),
            cols: 3,
            taxels: 6,
            array: 0,
            codes: codes.to_vec(),
            expected: Trace {
                beats: codes.iter().map(|&c| [GAIN as i32 * c, c, c]).collect(),
                status: vec![[6, 0, 0]],
                stages: vec![
                    Stage { name: "receive", words: codes.iter().map(word).collect() },
                    Stage { name: "scale", words: scaled },
                ],
                cycles: CYCLES,
                beat_cycles: (1..=7).collect(),
                timing: None,
            },
        }
    };
    vec![frame("ramp", [0, 1, 2, 3, 4, 5]), frame("extremes", [-2048, 2047, -1, 0, 1, -2047])]
}

fn check(device: &mut dyn Device, vectors: &[Vector], stimulus: Stimulus) -> (Findings, Vec<Times>) {
    let dut = DeviceUnderTest { name: "toy", device, taps: &TAPS };
    run(dut, vectors, stimulus)
}

#[test]
fn equal_at_full_speed_with_exact_cycles_and_equal_with_stalls() {
    let (findings, times) = check(&mut toy(), &vectors(), Stimulus::FullSpeed);
    assert_eq!(findings, Findings::default());
    assert!(times.iter().all(|t| t.latency() == Some(7) && t.total() == Some(13)), "{times:?}");
    let (findings, times) = check(&mut toy(), &vectors(), STALLS);
    assert_eq!(findings, Findings::default());
    assert!(times[0].total() > Some(13), "the stalls did not stall: {times:?}");
}

#[test]
fn flipped_bit_in_a_memory_file_is_found_in_its_stage() {
    let (findings, _) = check(&mut toy_with(TOY, "02\n").unwrap(), &vectors(), Stimulus::FullSpeed);
    let first = &findings.kept[0];
    assert_eq!((first.stage.as_str(), first.index, first.taxel), ("scale", 1, None));
    assert_eq!((&first.expected, &first.got), (&Some(vec![3]), &Some(vec![2])));
}

#[test]
fn flipped_bit_in_a_vector_is_found_at_the_input() {
    let mut vectors = vectors();
    vectors[1].codes[4] ^= 1 << 3;
    let (findings, _) = check(&mut toy(), &vectors, STALLS);
    let first = &findings.kept[0];
    assert_eq!((first.frame.as_str(), first.stage.as_str(), first.taxel), ("extremes", "receive", Some([1, 1])));
}

#[test]
fn flipped_bit_in_the_expected_output_is_found_with_its_cycle() {
    let mut vectors = vectors();
    vectors[0].expected.beats[5][2] ^= 1;
    let (findings, times) = check(&mut toy(), &vectors, Stimulus::FullSpeed);
    assert_eq!(findings.count, 1);
    let (last_out, text) = (times[0].last_out.unwrap(), findings.kept[0].to_string());
    let wanted = format!(
        "toy, full speed: frame ramp, stage beats, word 5 (taxel 1,2), cycle {}: expected [15, 5, 4], got [15, 5, 5]",
        last_out - 1
    );
    assert_eq!(text, wanted);
}

#[test]
fn a_wrong_cycle_count_is_found() {
    let mut vectors = vectors();
    vectors[0].expected.cycles.latency += 1;
    let (findings, _) = check(&mut toy(), &vectors[..1], Stimulus::FullSpeed);
    assert_eq!(findings.kept[0].rule.as_deref(), Some("latency: expected 8 cycles, got 7"));
}

#[test]
fn every_output_beat_has_its_cycle() {
    let vectors = vectors();
    let inputs: Vec<InputFrame> =
        vectors.iter().map(|v| InputFrame { codes: &v.codes, taxels: v.taxels, beats: 7, array: 0 }).collect();
    let mut recording = record(&mut toy(), TAPS.len(), &inputs, Stimulus::FullSpeed, 10_000);
    // Delays the third beat of the second frame by a cycle; the last beat keeps its cycle.
    recording.beats[9].cycle += 1;
    let findings = compare_recording("toy", &TAPS, &vectors, &recording, true);
    let (due, late) = (recording.beats[9].cycle - 1, recording.beats[9].cycle);
    assert_eq!(findings.count, 1);
    let wanted =
        format!("toy: frame extremes, stage cycles, word 2, cycle {late}: output beat 2 was due in cycle {due}");
    assert_eq!(findings.kept[0].to_string(), wanted);
    assert!(compare_recording("toy", &TAPS, &vectors, &recording, false).is_equal());
}

#[test]
fn frames_of_one_name_are_told_apart() {
    let mut vectors = vectors();
    vectors[1].frame = vectors[0].frame.clone();
    vectors[1].expected.beats[0][0] ^= 1;
    let (findings, _) = check(&mut toy(), &vectors, Stimulus::FullSpeed);
    assert_eq!(findings.unequal.into_iter().collect::<Vec<_>>(), [1]);
}

#[test]
fn a_stage_without_a_tap_and_a_tap_without_a_stage_are_found() {
    let mut vectors = vectors();
    vectors[0].expected.stages[1].name = "other";
    let (findings, _) = check(&mut toy(), &vectors[..1], Stimulus::FullSpeed);
    let stages: Vec<&str> = findings.kept.iter().filter(|m| m.rule.is_some()).map(|m| m.stage.as_str()).collect();
    assert_eq!(stages, ["scale", "other"]);
}

#[test]
fn a_broken_design_is_an_error_with_the_tools_message() {
    let Err(error) = toy_with(&TOY.replace("wire take =", "wire taken ="), "03\n") else {
        panic!("the broken design was built")
    };
    assert!(error.to_string().contains("toy.v:"), "{error}");
}

/// The toy engine with altered outputs.
struct Altered<F: FnMut(&mut Outputs)>(Verilated, F);

impl<F: FnMut(&mut Outputs)> Device for Altered<F> {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let mut outputs = self.0.cycle(inputs);
        (self.1)(&mut outputs);
        outputs
    }
}

#[test]
fn a_beat_that_changes_while_it_waits_is_found() {
    let mut flicker = false;
    let mut device = Altered(toy(), |outputs| {
        flicker = !flicker;
        outputs.m_valid &= flicker;
    });
    let (findings, _) = check(&mut device, &vectors(), STALLS);
    assert!(findings
        .kept
        .iter()
        .any(|m| m.rule.as_deref() == Some("a valid beat must stay unchanged until it is accepted")));
}

#[test]
fn a_missing_tlast_is_found() {
    let mut device = Altered(toy(), |outputs| outputs.m_last = false);
    let (findings, _) = check(&mut device, &vectors(), Stimulus::FullSpeed);
    assert_eq!(findings.count, 2);
    assert_eq!((findings.kept[0].stage.as_str(), findings.kept[0].index), ("handshake", 6));
}

#[test]
fn a_surplus_beat_is_found() {
    let mut beats = 0;
    let mut device = Altered(toy(), |outputs| {
        beats += usize::from(outputs.m_valid);
        outputs.m_valid |= beats == 14;
    });
    let (findings, _) = check(&mut device, &vectors(), Stimulus::FullSpeed);
    assert_eq!(findings.kept[0].rule.as_deref(), Some("no beat may follow the last frame"));
}

#[test]
fn a_hung_device_ends_the_run_and_the_awaited_transfer_is_named() {
    let awaited = |alter: fn(&mut Outputs), vectors: &[Vector]| {
        let (findings, _) = check(&mut Altered(toy(), alter), vectors, Stimulus::FullSpeed);
        assert!(findings.count > KEPT_PER_FRAME);
        findings.kept[0].rule.clone().unwrap()
    };
    let no_valid = awaited(|outputs| outputs.m_valid = false, &vectors());
    assert_eq!(no_valid, "no transfer for 10000 cycles while waiting for output beat 0 of 7");
    let no_ready = awaited(|outputs| outputs.s_ready = false, &vectors()[..1]);
    assert_eq!(no_ready, "no transfer for 10000 cycles while waiting for s_axis_tready for taxel 0 of 6");
}

#[test]
fn a_device_that_sends_without_end_does_not_hang_the_bench() {
    let mut device = Altered(toy(), |outputs| {
        outputs.m_valid = true;
        outputs.s_ready = false;
    });
    let (findings, _) = check(&mut device, &vectors(), Stimulus::FullSpeed);
    let gave_up = findings.kept.iter().find(|m| m.stage == "watchdog").map(ToString::to_string);
    assert!(gave_up.as_ref().is_some_and(|text| text.contains("waiting for s_axis_tready")), "{gave_up:?}");
}

/// The toy engine without its reset.
struct WithoutReset(Verilated);

impl Device for WithoutReset {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        self.0.cycle(&Inputs { rst: false, ..*inputs })
    }
}

#[test]
fn a_missing_reset_is_found() {
    let mut device = toy();
    // A first reset for a defined start; later ones have no effect.
    device.cycle(&Inputs { rst: true, ..Inputs::default() });
    let (findings, _) = check(&mut WithoutReset(device), &vectors(), STALLS);
    assert!(!findings.is_equal());
}

#[test]
fn changes_of_registers_are_counted_to_the_bit() {
    let register = |signal: &str, words, bits| StateElement {
        class: StorageClass::Register,
        stage: "toy",
        scope: String::new(),
        signal: signal.into(),
        words,
        bits,
    };
    let registers = [register("head", 1, 3), register("sending", 1, 1), register("memory", 8, 12)];
    let mut device = toy_of(TOY, "03\n", true).unwrap();
    let ramp = &vectors()[..1];
    // What the words are before the first frame is random.
    check(&mut device, ramp, Stimulus::FullSpeed);
    let mut counter = ToggleCounter::new(&mut device, registers.iter()).unwrap();
    let (findings, _) = check(&mut counter, ramp, Stimulus::FullSpeed);
    assert_eq!(findings, Findings::default());
    // head: 0 to 5 and back to 0 (8 + 2 bits), 0 to 6 and back (10 + 2); sending: on and off; the memory has the frame.
    assert_eq!(counter.toggles().collect::<Vec<_>>(), [8 + 2 + 10 + 2, 2, 0]);
    // Each of the six words changes from the ramp's to the extremes': 0, 1, 2, 3, 4, 5 to -2048, 2047, -1, 0, 1, -2047.
    check(&mut counter, &vectors()[1..], Stimulus::FullSpeed);
    assert_eq!(counter.toggles().last(), Some(1 + 10 + 11 + 2 + 2 + 2));
    assert!(ToggleCounter::new(&mut device, [register("absent", 1, 1)].iter()).is_err());
    assert!(ToggleCounter::new(&mut toy(), registers.iter()).is_err(), "closed state");
}
