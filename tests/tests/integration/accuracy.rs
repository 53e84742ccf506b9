//! Accuracy: the golden model against known forces, and the bit-true model (which the hardware equals) against the
//! golden model on the same quantised input, with 20 bits and with the 16 of a common converter, on random frames of
//! one contact each.
//!
//! `dermis study input-bits` prints the table. Median tangential errors are compared with `baselines/accuracy.csv`:
//! exactly with the compiler and on the processor of its last renewal, else within 0.2 points.

use dermis_golden::estimate::float::Golden;
use dermis_report::study::{input_bits, tangential};
use dermis_tests::{baseline, scene};

/// Bound of the golden model's median tangential error on sensor 1: twice the 1.4 % of a study in double precision.
const GOLDEN_TANGENTIAL: f64 = 0.03;
/// Bound of the golden model's normal error on sensor 1, for each frame.
const GOLDEN_NORMAL: f64 = 0.015;
/// Allowed change of an error with another compiler or processor than those of the committed table, in points.
const POINTS: f64 = 0.2;

#[test]
fn errors_are_those_of_the_committed_table() {
    let mut measured = Vec::new();
    for (name, scene) in input_bits::scenes(&[]).unwrap() {
        for row in input_bits::measure(&name, &scene).unwrap() {
            let figures = [("float", row.float), ("float on the same codes", row.codes), ("fixed", row.fixed)];
            let line = |(what, error): (&str, Option<f64>)| {
                (format!("{name} at {} bits: {what} (%)", row.bits), 100.0 * error.unwrap())
            };
            measured.extend(figures.map(line));
        }
    }
    baseline::check("accuracy", &measured, is_met);
}

/// Whether a measured error is the committed one.
fn is_met(was: f64, is: f64, same_machine: bool) -> bool {
    match same_machine {
        true => was == is,
        false => (was - is).abs() <= POINTS,
    }
}

#[test]
fn a_changed_error_and_a_line_that_is_not_committed_are_found() {
    let line = |what: &str, value: f64| (format!("sensor-1 at 20 bits: {what} (%)"), value);
    let measured = [line("float", 1.5), line("fixed", -1.0), line("no", 1.0)];
    let missed = baseline::missed("accuracy", &measured, is_met);
    assert_eq!(missed.len(), 3, "{missed:?}");
    assert!(missed[2].ends_with(": none -> 1"), "{missed:?}");
    assert!(!is_met(1.0, 1.0001, true) && is_met(1.0, 1.1999, false) && !is_met(1.0, 0.7999, false));
}

#[test]
fn sensor_1_meets_its_targets() {
    let (scene, frames) = scene("sensor-1");
    let golden = Golden::reference(&scene).unwrap();
    let golden: Vec<_> = frames.iter().map(|f| golden.run(f).unwrap()).collect();
    for result in &golden {
        let normal = result.error.as_ref().unwrap().normal.unwrap();
        assert!(normal <= GOLDEN_NORMAL, "{}: e_n {normal}", result.frame);
    }
    let float = tangential(&golden).unwrap();
    assert!(float <= GOLDEN_TANGENTIAL, "golden e_t {float}");
}
