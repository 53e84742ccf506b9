//! The generator against the shipped frames, which come from other programs, and its errors.

use super::*;
use crate::data::generator::slip::Slip;
use crate::spec::scene::Scene;

/// The frames have 9 digits, and their own quadrature is accurate to 8e-9 of the peak.
const PRINTED: f64 = 1e-8;
/// Rounding of the force on a cell in the file, relative to the largest.
const PRINTED_CELLS: f64 = 1e-8;
/// Finite elements against the exact layer, according to the frames' notes: at most 1.1e-3.
const FINITE_ELEMENTS: f64 = 1.15e-3;
/// Error of midpoint sums on a 0.1 mm grid, which resolve an outline to 0.05 mm, relative to the peak.
const MIDPOINTS: f64 = 3e-3;

/// Every shipped frame of a built-in sensor, in its own medium.
fn shipped(name: &str) -> Vec<Frame> {
    let media = [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.40 }, Medium::BondedLayer { poisson: 0.48 }];
    let through = |medium| Frame::shipped(&Scene { medium, ..Scene::builtin(name).unwrap() });
    media.into_iter().flat_map(through).collect()
}

/// Largest difference relative to the reference's largest value; absolute if that is zero.
fn off(values: &[f64], reference: &[f64]) -> f64 {
    let largest = reference.iter().fold(0.0f64, |most, b| b.abs().max(most));
    let difference = values.iter().zip(reference).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    difference / if largest > 0.0 { largest } else { 1.0 }
}

fn again(frame: &Frame) -> Frame {
    generate(&frame.id, &frame.sensor, frame.medium.unwrap(), &frame.contacts).unwrap()
}

#[test]
fn shipped_frames_come_out_of_their_contacts() {
    let mut exact = 0;
    // Those that the generator made itself say nothing of it.
    let other = |frame: &Frame| frame.source.as_deref() != Some("bonded-layer-quadrature");
    for frame in ["sensor-1", "sensor-2", "sensor-3", "eight-by-eight"].into_iter().flat_map(shipped).filter(other) {
        let made = again(&frame);
        let midpoints = frame.id.contains("random") || frame.id.contains("multi");
        let tolerance = match frame.source.as_deref() {
            Some("fem") => FINITE_ELEMENTS,
            _ if midpoints => MIDPOINTS,
            _ => PRINTED,
        };
        let stress = off(&made.stress_MPa, &frame.stress_MPa);
        assert!(stress <= tolerance, "{}: {stress:e}", frame.id);
        if !midpoints {
            exact += 1;
            let (cells, wanted) = (made.cell_forces_N.unwrap(), frame.cell_forces_N.unwrap());
            assert!(off(&cells.fz, &wanted.fz) <= PRINTED_CELLS, "{}", frame.id);
            let shear = off(&[cells.fx, cells.fy].concat(), &[wanted.fx, wanted.fy].concat());
            assert!(shear <= PRINTED_CELLS, "{}: {shear:e}", frame.id);
            let resultant = off(&made.resultant_N.unwrap(), &frame.resultant_N.unwrap());
            assert!(resultant <= PRINTED, "{}: {resultant:e}", frame.id);
        }
    }
    assert_eq!(exact, 20);
}

#[test]
fn large_thin_arrays_come_out_too() {
    let frame = shipped("sensor-4").into_iter().find(|frame| frame.id == "S4-hs-three").unwrap();
    assert!(off(&again(&frame).stress_MPa, &frame.stress_MPa) <= PRINTED);
}

#[test]
fn a_foot_leaves_its_whole_load_on_the_cells() {
    let sensor = Sensor { rows: 16, cols: 8, pitch_x_mm: 18.0, pitch_y_mm: 18.0, thickness_mm: 4.0 };
    let foot = Contact {
        shape: Some("plantar-left".to_string()),
        normal_N: Some(350.0),
        tangential_N: Some([10.0, -35.0]),
        rotation_rad: Some(0.1),
        ..Default::default()
    };
    let frame = generate("foot", &sensor, Medium::HalfSpace, &[foot]).unwrap();
    let sum = frame.cell_forces_N.as_ref().unwrap().resultant();
    assert!((0..3).all(|k| (sum[k] - [10.0, -35.0, 350.0][k]).abs() < 1e-9), "{sum:?}");
    assert!(frame.stress_MPa.iter().all(|b| b.is_finite()) && frame.peak_MPa() > 0.01);
}

#[test]
fn partial_slip_holds_its_load() {
    let sensor = Scene::builtin("sensor-2").unwrap().sensor;
    let contact = Contact {
        shape: Some("hertz-ellipse".to_string()),
        size_mm: vec![5.0, 7.0, 30.0],
        normal_N: Some(10.0),
        tangential_N: Some([3.0, -1.0]),
        kind_of_slip: Some("partial-slip".to_string()),
        friction: Some(0.4),
        ..Default::default()
    };
    let sticking = |friction| Contact { friction: Some(friction), ..contact.clone() };
    let make = |contact| generate("p", &sensor, Medium::HalfSpace, &[contact]).unwrap();
    let sum = make(contact.clone()).cell_forces_N.unwrap().resultant();
    assert!((0..3).all(|k| (sum[k] - [3.0, -1.0, 10.0][k]).abs() < 1e-12), "{sum:?}");
    // At the friction limit there is no stick area: full sliding.
    let sliding = make(Contact { kind_of_slip: None, ..contact.clone() });
    let limit = make(sticking(10f64.sqrt() / 10.0 * (1.0 + 1e-12)));
    assert!(off(&limit.stress_MPa, &sliding.stress_MPa) < 1e-9);
}

/// In partial slip and with an even shear, every shape has the pressure of full slip, its whole shear, and none against it or
/// beside the contact.
#[test]
fn the_spread_of_the_shear_keeps_forces() {
    let sensor = Sensor { rows: 80, cols: 80, pitch_x_mm: 0.2, pitch_y_mm: 0.2, thickness_mm: 3.0 };
    let shapes = [
        ("hertz-ellipse", vec![3.0, 5.0, 30.0]),
        ("tilted", vec![4.0, 5.0, 20.0, 0.5, -0.4]),
        ("lobed", vec![4.0, 5.0, 20.0]),
        ("flat-punch", vec![4.0, 3.0, 50.0]),
        ("ring", vec![5.0, 2.0]),
        ("rectangle", vec![5.0, 7.0, 30.0]),
    ];
    for (shape, size_mm) in shapes {
        let forces = |kind: &str, friction: Option<f64>| {
            let contact = Contact {
                shape: Some(shape.to_string()),
                size_mm: size_mm.clone(),
                normal_N: Some(10.0),
                tangential_N: Some([1.5, -2.0]),
                kind_of_slip: Some(kind.to_string()),
                friction,
                ..Default::default()
            };
            cells::forces(&sensor, &traction::pieces(0, &contact).unwrap())
        };
        let full = forces("full-sliding", None);
        for (kind, friction) in [("partial-slip", Some(0.6)), ("partial-slip", Some(0.26)), ("even-shear", None)] {
            let own = forces(kind, friction);
            let sum = own.resultant();
            assert!((0..3).all(|k| (sum[k] - [1.5, -2.0, 10.0][k]).abs() < 1e-9), "{shape} {kind}: {sum:?}");
            for (cell, force) in own.fx.iter().enumerate() {
                assert!((own.fz[cell] - full.fz[cell]).abs() < 1e-9, "{shape} {kind} {cell}");
                assert!(*force > -1e-9 && (full.fz[cell].abs() > 1e-9 || force.abs() < 1e-4), "{shape} {kind} {cell}");
            }
            // Nearer to sliding, nearer to the pressure.
            let away = own.fx.iter().zip(&full.fx).map(|(a, b)| (a - b).abs()).sum::<f64>() / 1.5;
            let uniform = matches!(shape, "flat-punch" | "ring" | "rectangle");
            match (kind, friction) {
                ("even-shear", _) => assert!(if uniform { away < 1e-9 } else { away > 0.1 }, "{shape}: {away}"),
                (_, Some(0.6)) => assert!(away > 0.3, "{shape}: {away}"),
                _ => assert!(away < 0.2, "{shape}: {away}"),
            }
        }
    }
}

#[test]
fn drawn_contacts_lie_inside_and_repeat() {
    let sensor = Scene::builtin("sensor-3").unwrap().sensor;
    for (seed, shapes) in (0..20).map(|seed| (seed, if seed < 10 { Shapes::Elliptic } else { Shapes::Other })) {
        let draw = Draw { count: 3, shapes, slip: Slip::Full, touching: false, seed };
        let contacts = random_contacts(&sensor, draw);
        assert_eq!(contacts, random_contacts(&sensor, draw));
        generate("drawn", &sensor, Medium::HalfSpace, &contacts).unwrap();
        for contact in contacts {
            let ([x, y], a) = (contact.centre_mm.unwrap(), contact.size_mm[0]);
            assert!(x.abs() + a <= 20.0 && y.abs() + a <= 40.0);
        }
    }
}

#[test]
fn drawn_contacts_touch_where_they_are_to() {
    let sensor = Scene::builtin("sensor-3").unwrap().sensor;
    for seed in 0..10 {
        let gap = |touching: bool| {
            let draw = Draw { count: 2, shapes: Shapes::Elliptic, slip: Slip::Full, touching, seed };
            let [a, b] = random_contacts(&sensor, draw).try_into().unwrap();
            let reach = |contact: &Contact| contact.size_mm[0].max(contact.size_mm[1]);
            let ([x, y], [u, v]) = (a.centre_mm.unwrap(), b.centre_mm.unwrap());
            (x - u).hypot(y - v) - reach(&a) - reach(&b)
        };
        assert!(gap(true).abs() < 1e-9 && gap(false) > 1.0, "{} {}", gap(true), gap(false));
    }
}

#[test]
fn refusals_name_contact_field_and_value() {
    let good = Contact {
        shape: Some("hertz-circle".to_string()),
        size_mm: vec![3.0],
        normal_N: Some(5.0),
        ..Default::default()
    };
    let text = |text: &str| Some(text.to_string());
    let cases = [
        (Contact { shape: text("star"), ..good.clone() }, "contact 1: shape = \"star\""),
        (Contact { size_mm: vec![], ..good.clone() }, "size_mm = [] is not allowed; it must be [a]"),
        (Contact { size_mm: vec![f64::NAN], ..good.clone() }, "size_mm = [NaN]"),
        (Contact { shape: text("ring"), size_mm: vec![2.0, 3.0], ..good.clone() }, "below outer"),
        (Contact { normal_N: Some(-1.0), ..good.clone() }, "normal_N = -1 is"),
        (Contact { centre_mm: Some([f64::INFINITY, 0.0]), ..good.clone() }, "centre_mm"),
        (Contact { centre_mm: Some([500.0, 0.0]), ..good.clone() }, "centre_mm"),
        (Contact { kind_of_slip: text("stick"), ..good.clone() }, "kind_of_slip = \"stick\""),
        (
            Contact { kind_of_slip: text("none"), tangential_N: Some([1.0, 0.0]), ..good.clone() },
            "tangential_N = [1.0, 0.0]",
        ),
        (Contact { kind_of_slip: text("partial-slip"), ..good.clone() }, "friction = none is"),
        (
            Contact {
                shape: text("plantar-left"),
                size_mm: vec![],
                friction: Some(1.0),
                kind_of_slip: text("partial-slip"),
                ..good.clone()
            },
            "none or full-sliding for feet",
        ),
    ];
    let sensor = Scene::builtin("sensor-1").unwrap().sensor;
    for (contact, wanted) in cases {
        let error = generate("x", &sensor, Medium::HalfSpace, &[good.clone(), contact]).unwrap_err();
        assert!(error.to_string().contains(wanted), "{error}");
    }
    assert_eq!(generate("x", &sensor, Medium::HalfSpace, &[]), Err(GeneratorError::NoContact));
    let flat = Sensor { rows: 1, ..sensor };
    assert!(matches!(generate("x", &flat, Medium::HalfSpace, &[good]), Err(GeneratorError::Sensor(_))));
}

#[test]
fn written_frames_come_back() {
    let sensor = Scene::builtin("sensor-1").unwrap().sensor;
    let draw = Draw { count: 1, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed: 7 };
    let frame = generate("mine", &sensor, Medium::HalfSpace, &random_contacts(&sensor, draw)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.json");
    std::fs::write(&path, frame.to_json()).unwrap();
    assert_eq!(Frame::load(&path, None).unwrap(), frame);
}
