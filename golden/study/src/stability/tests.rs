//! The values of the table against its targets, and rejected scenes in its rows.

use super::extreme::{frames, outcome, ExtremeRow, Outcome};
use super::*;
use dermis_golden::estimate::float::pass::solve_direct;
use dermis_golden::result::flags::Flag;
use dermis_golden::spec::scene::InverseKind;

fn scene(h: f64, kind: InverseKind) -> Scene {
    let sensor = Sensor { rows: 8, cols: 8, pitch_x_mm: 1.0, pitch_y_mm: 1.0, thickness_mm: h };
    let mut scene = Scene::of_sensor(&sensor, "stiff");
    (scene.search.mu_max, scene.inverse.kind) = (MU_MAX, kind);
    scene
}

fn row(h: f64, kind: InverseKind) -> StabilityRow {
    measure(&Setting::new("thickness", scene(h, kind))).unwrap()
}

/// Largest normal error without noise: 1 % up to a condition of 10⁷, 5 % at 10¹³.
#[test]
fn targets_hold_for_every_condition() {
    for (h, condition, most) in [(1.0, 1e1, 0.01), (3.0, 1e4, 0.01), (5.0, 1e7, 0.01), (10.0, 1e13, 0.05)] {
        for kind in [InverseKind::Tsvd, InverseKind::Tikhonov] {
            let row = row(h, kind);
            let spectrum = row.spectrum.unwrap();
            assert!((0.1..10.0).contains(&(spectrum.condition / condition)), "h {h}: {:e}", spectrum.condition);
            for figures in [row.double, row.single, row.fixed] {
                let normal = figures.unwrap().normal.unwrap();
                assert!(normal <= most, "h {h}, {kind:?}: e_n {normal}");
            }
        }
    }
}

#[test]
fn the_level_bounds_rank_and_gain() {
    let (exact, cut) = (row(10.0, InverseKind::Exact), row(10.0, InverseKind::Tsvd));
    let (exact_spectrum, spectrum) = (exact.spectrum.unwrap(), cut.spectrum.unwrap());
    // The largest singular value of Cz: gain = condition / σ_max.
    let largest = exact_spectrum.condition / exact_spectrum.gain;
    assert!(spectrum.gain * largest <= 1.0 / cut.level);
    assert!(spectrum.rank.round() < 32.0 && exact_spectrum.rank.round() >= 63.0);
    // Codes of 20 bits carry no information for the exact inverse; the level keeps the fixed model accurate.
    assert!(exact.fixed.unwrap().forward > 100.0 * cut.fixed.unwrap().forward);
}

#[test]
fn where_nothing_is_below_the_level_nothing_changes() {
    for h in [0.1, 1.0, 3.0] {
        let [cut, exact] = [InverseKind::Tsvd, InverseKind::Exact].map(|kind| row(h, kind));
        assert_eq!((cut.spectrum, cut.double, cut.fixed), (exact.spectrum, exact.double, exact.fixed), "h {h}");
    }
}

#[test]
fn stiffer_scenes_need_more_bits() {
    let bits = [0.1, 1.0, 2.0, 3.0].map(|h| row(h, InverseKind::Tsvd).bits.unwrap());
    assert!(bits.windows(2).all(|pair| pair[0] <= pair[1]) && bits[0] < bits[3], "{bits:?}");
}

#[test]
fn errors_name_a_value_that_works() {
    let mut wide = scene(5.0, InverseKind::Tsvd);
    wide.search.mu_max = 2.0;
    let refused = measure(&Setting::new("wide", wide.clone())).unwrap().refused.unwrap();
    assert!(refused.contains("needs a series of more than degree 8; use search.mu_max = "), "{refused}");
    // The suggested value works.
    let suggested = refused.split("search.mu_max = ").nth(1).unwrap().split(' ').next().unwrap();
    wide.search.mu_max = suggested.parse().unwrap();
    assert!(Golden::new(&wide).is_ok(), "{suggested}");
    let mut layer = scene(1.0, InverseKind::Tsvd);
    layer.medium = Medium::BondedLayer { poisson: 0.4999 };
    let row = measure(&Setting::new("layer", layer)).unwrap();
    assert!([row.double, row.fixed].iter().all(|figures| figures.unwrap().normal.unwrap() < 0.01), "{row:?}");
}

#[test]
fn the_table_covers_what_it_says() {
    let all = settings();
    let of = |group: &str| all.iter().filter(|setting| setting.group == group).count();
    assert_eq!([of("thickness"), of("poisson"), of("size"), of("pitches"), of("50 digits")], [17, 10, 7, 6, 4]);
}

/// Stress computed independently with 50 digits: the same targets, and where the inverse truncates nothing the only
/// error is rounding times condition.
#[test]
fn frames_of_50_digits_meet_the_targets() {
    let own = settings().into_iter().filter(|setting| setting.frame.is_some());
    let limits = [(1e-13, 0.01), (1e-9, 0.01), (0.2, 0.01), (0.3, 0.05)];
    for (setting, (forward, normal)) in own.zip(limits) {
        let row = measure(&setting).unwrap();
        let (double, h) = (row.double.unwrap(), row.sensor.thickness_mm);
        assert!(double.forward <= forward, "h {h}: {:e}", double.forward);
        for figures in [row.double, row.single, row.fixed] {
            assert!(figures.unwrap().normal.unwrap() <= normal, "h {h}: {:?}", figures);
        }
    }
}

/// Every line of the table in [`extreme`], for both models.
#[test]
fn extreme_frames_have_the_documented_outcomes() {
    for name in ["sensor-1", "eight-by-eight"] {
        let scene = Scene::builtin(name).unwrap();
        let rows: Vec<ExtremeRow> = frames(&scene).unwrap().iter().map(|frame| outcome(frame).unwrap()).collect();
        let of = |frame: &str| rows.iter().find(|row| row.frame == frame).unwrap_or_else(|| panic!("{frame}"));
        let both = |frame: &str| {
            let row = of(frame);
            [row.golden.clone(), row.fixed.clone().unwrap()]
        };
        for outcome in both("zero") {
            assert_eq!(outcome.resultant_N, [0.0; 3]);
            assert_eq!(outcome.flags, [Flag::NoContact, Flag::ConditionUnmet]);
        }
        let flagged = [
            ("one taxel saturated", Flag::Saturated),
            ("all saturated", Flag::Saturated),
            ("load 1e1 of full scale", Flag::Saturated),
            ("load 1e9 of full scale", Flag::Saturated),
            ("all tension", Flag::NoCompression),
            ("over the edge", Flag::LoadOutside),
            ("in the corner", Flag::LoadOutside),
            ("larger than the array", Flag::LoadOutside),
            ("load 1e-9 of full scale", Flag::ConditionUnmet),
            ("load 1e-4 of full scale", Flag::ShearUnreliable),
        ];
        for (frame, flag) in flagged {
            for outcome in both(frame) {
                assert!(outcome.flags.contains(&flag), "{name}, {frame}: {:?}", outcome.flags);
            }
        }
        // Tensile forces without shear.
        for Outcome { resultant_N: [x, y, normal], .. } in both("all tension") {
            assert!(x == 0.0 && y == 0.0 && normal < 0.0);
        }
        let unipolar = of("all clipped, unipolar");
        assert_eq!(unipolar.golden.resultant_N, [0.0; 3]);
        assert!(unipolar.fixed.is_none() && unipolar.refused.as_ref().unwrap().contains("input.unipolar"));
        // Stress below half an LSB is zero in integers.
        let [golden, fixed] = both("load 1e-9 of full scale");
        assert!(golden.resultant_N[2] > 0.0 && fixed.resultant_N == [0.0; 3] && fixed.flags.contains(&Flag::NoContact));
        // Forces are proportional to the load: up to rounding for powers of ten, exactly for powers of two.
        let unit = &of("load 1e0 of full scale").golden;
        for k in [-6, -4, -2, -1, 1, 3, 9] {
            let scaled = &of(&format!("load 1e{k} of full scale")).golden;
            let ratio = scaled.resultant_N[2] / unit.resultant_N[2] / 10f64.powi(k);
            assert!((ratio - 1.0).abs() < 1e-12, "{k}: {ratio}");
        }
        let factor = 2f64.powi(60);
        for (small, large) in both("load 2^-30, own full scale").iter().zip(both("load 2^30, own full scale")) {
            assert_eq!(small.resultant_N.map(|f| f * factor), large.resultant_N, "{name}");
        }
        // Two decades below full scale the normal force is still accurate, six decades below it is not.
        let normal = |frame: &str| of(frame).fixed.as_ref().unwrap().errors[1].unwrap();
        assert!(normal("load 1e-2 of full scale") < 0.02 && normal("load 1e-6 of full scale") > 0.1);
        for row in &rows {
            for Outcome { resultant_N: [x, y, normal], .. } in
                [Some(&row.golden), row.fixed.as_ref()].into_iter().flatten()
            {
                assert!([x, y, normal].iter().all(|f| f.is_finite()));
                // Shear is within mu_max where the whole array has one μ, up to the rounding of force words.
                let whole = row.frame != "on a subarray boundary" && *normal > 0.0;
                assert!(!whole || x.hypot(*y) <= scene.search.mu_max * normal * 1.001, "{name}, {}", row.frame);
            }
        }
    }
}

/// Frames generated by the cell model itself: the error is rounding times condition.
#[test]
fn stiff_frames_come_back() {
    // Thickness 1, 3, 5 mm; at 10 mm a plain solve recovers nothing.
    for (frame, bound) in references().into_iter().zip([1e-13, 1e-9, 1e-7]) {
        let [t1, t2, n] = frame.resultant_N.unwrap();
        // The series of the stiffest would not converge; the solve does not need it.
        let matrices = Matrices::new(&frame.sensor, 0.0).unwrap();
        let p = solve_direct(&matrices, &frame.stress_MPa, [t1 / n, t2 / n]);
        let truth = frame.cell_forces_N.unwrap().fz;
        let off = p.iter().zip(&truth).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
        assert!(off < bound, "{}: {off:e}, condition {:e}", frame.id, matrices.condition);
    }
}
