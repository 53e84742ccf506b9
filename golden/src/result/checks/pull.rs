//! Pull: stress below zero where nothing can pull, as after a tare that was taken under load.
//!
//! ```text
//! S             sums of b over a taxel and those around it, 3 × 3
//! pull share    max −S / (max S + max −S), where max −S is above 6 standard deviations of noise
//! ```
//!
//! A press with shear has tension too, but less of it than compression. What was pressing when the zeros were stored, or a zero
//! that has drifted up, is there as tension alone. The noise is the stated one, or what second differences along the lines show,
//! their median, if that is more; and at least a step of the readings.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: stress, calibrated | taxels | MPa |
//! | out: pull share | scalar | fraction |
//!
//! A tare beside a calibration table shows by itself what pressed: [`tare_load`].

use super::readings::step;
use crate::data::frame::Frame;
use crate::data::input::calibration::Calibration;
use crate::data::input::tare::Tare;
use crate::data::input::InputError;
use crate::spec::scene::Scene;
use serde::Serialize;

/// Standard deviations of noise that a sum is off by chance on no array.
const SIGNIFICANT: f64 = 6.0;
/// Median of the size of a normal variable, over its standard deviation.
const MEDIAN_OF_NORMAL: f64 = 0.6745;
/// Taxels of a sum.
const AROUND: f64 = 9.0;
/// Share of the push of a tare above the table's offsets from which on something pressed: a slope has a half.
const PRESSED: f64 = 0.8;

/// The pull share of a calibrated frame; `None` where no sum is significantly below zero, or lines are too short to tell.
pub fn pull_share(scene: &Scene, frame: &Frame) -> Option<f64> {
    let (rows, cols, b) = (frame.sensor.rows, frame.sensor.cols, &frame.stress_MPa);
    let alive = scene.input.alive(&frame.sensor);
    let read: Vec<f64> = std::iter::zip(b, &alive).map(|(b, alive)| if *alive { *b } else { 0.0 }).collect();
    let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let (mut push, mut pull) = (0.0f64, 0.0f64);
    for (row, col) in (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))) {
        let columns = near(col, cols);
        let lines = near(row, rows).map(|row| &read[row * cols..][columns.clone()]);
        let sum: f64 = lines.flatten().sum();
        (push, pull) = (push.max(sum), pull.max(-sum));
    }
    let stated = scene.search.noise_floor_MPa() * scene.input.noise_share();
    let is_pull = |noise: f64| pull > SIGNIFICANT * AROUND.sqrt() * noise;
    // What the readings show of the noise takes as long as the sums.
    let counts = is_pull(stated) && is_pull(noise_MPa(frame, &alive)?);
    counts.then(|| pull / (push + pull))
}

/// What a tare has that its calibration table has not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TareLoad {
    /// Row of the taxel that has most.
    pub row: usize,
    /// Its column.
    pub col: usize,
    /// Its stress in MPa, above the median of all.
    pub stress_MPa: f64,
}

/// Whether something pressed while the scene's tare was taken: what the tare has above the table's offsets, less the median, is
/// significant, and there is little below. An even drift has none, a slope as much below. `None` without a tare or a table.
///
/// # Errors
/// [`InputError`] if table or tare cannot be read.
pub fn tare_load(scene: &Scene) -> Result<Option<TareLoad>, InputError> {
    let (Some(table), Some(tare)) = (&scene.input.calibration, &scene.input.tare) else { return Ok(None) };
    let (sensor, alive) = (&scene.sensor, scene.input.alive(&scene.sensor));
    let Calibration { offset, gain } = Calibration::load(table, sensor)?;
    let zero = Tare::load(tare, scene)?.zero;
    let stress: Vec<f64> = (0..sensor.taxels()).map(|k| gain[k] * (zero[k] - offset[k])).collect();
    let mut sorted: Vec<f64> = (0..stress.len()).filter(|k| alive[*k]).map(|k| stress[k]).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let turned = stress.iter().map(|b| median - b).collect();
    let share = pull_share(scene, &Frame::from_stress("tare", sensor, turned)?);
    let largest = (0..stress.len()).filter(|k| alive[*k]).max_by(|a, b| stress[*a].total_cmp(&stress[*b]));
    let load = |k: usize| TareLoad { row: k / sensor.cols, col: k % sensor.cols, stress_MPa: stress[k] - median };
    Ok(largest.filter(|_| share > Some(PRESSED)).map(load))
}

/// Noise of a frame by its second differences, at least a step of its readings; `None` without lines of three live taxels.
fn noise_MPa(frame: &Frame, alive: &[bool]) -> Option<f64> {
    let (rows, cols, b) = (frame.sensor.rows, frame.sensor.cols, &frame.stress_MPa);
    let along = |taxel: usize, by: usize| {
        let line = [taxel - by, taxel, taxel + by];
        line.iter().all(|k| alive[*k]).then(|| (b[line[0]] - 2.0 * b[line[1]] + b[line[2]]).abs())
    };
    let inner = |at: usize, count: usize| at > 0 && at + 1 < count;
    let in_row = (0..rows * cols).filter(|k| inner(k % cols, cols)).filter_map(|k| along(k, 1));
    let in_col = (0..rows * cols).filter(|k| inner(k / cols, rows)).filter_map(|k| along(k, cols));
    let mut all: Vec<f64> = in_row.chain(in_col).collect();
    if all.is_empty() {
        return None;
    }
    let middle = all.len() / 2;
    let (_, median, _) = all.select_nth_unstable_by(middle, f64::total_cmp);
    // A second difference has the variance 1 + 4 + 1.
    let noise = *median / (MEDIAN_OF_NORMAL * 6f64.sqrt());
    Some(noise.max(step(b.iter().copied()).unwrap_or(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Contact;
    use crate::data::generator::converter::Converter;
    use crate::data::generator::draws::{DrawOptions, Draws};
    use crate::data::generator::generate;
    use crate::estimate::float::Golden;
    use crate::fixed::Model;
    use crate::result::checks::PULL;
    use crate::result::flags::Flag;
    use crate::spec::scene::Medium;

    fn builtin(name: &str) -> Scene {
        Scene::builtin(name).unwrap()
    }

    /// Presses with any shear up to mu_max, at 0 to 1 % of noise and 8 to 20 bits; noise alone; the shipped frames. A bonded layer
    /// shows more of the tension behind a shear.
    #[test]
    fn what_presses_pulls_less() {
        let (mut all, mut largest) = (0, [0.0f64; 2]);
        let mut count = |scene: &Scene, share: Option<f64>| {
            all += 1;
            let own = &mut largest[usize::from(scene.medium != Medium::HalfSpace)];
            *own = own.max(share.unwrap_or(0.0));
        };
        for name in ["sensor-1", "eight-by-eight", "sensor-2", "sensor-1-unipolar", "sensor-1-bonded"] {
            let scene = builtin(name);
            for number in 0..24 {
                let options = DrawOptions { contacts: 1 + (number % 2) as usize, seed: 5, ..Default::default() };
                let drawn = Draws::new(&scene, options).unwrap().frame(number).unwrap();
                let full_scale_MPa = Some(1.05 * drawn.peak_MPa());
                for (bits, noise) in [(20, 0.0), (8, 0.0), (12, 1e-3), (16, 1e-2)] {
                    for load in [1.0, 0.05, 0.0] {
                        let mut own = drawn.frame.clone();
                        own.stress_MPa = drawn.exact_MPa.iter().map(|b| load * b).collect();
                        own.stress_MPa[0] += 1e-12;
                        let noise = noise * drawn.peak_MPa() / own.peak_MPa();
                        let converter =
                            Converter { noise, bits: Some(bits), full_scale_MPa, seed: number, ..Default::default() };
                        count(&scene, pull_share(&scene, &converter.convert(&own).unwrap()));
                    }
                }
            }
        }
        for name in Scene::builtin_names() {
            let scene = builtin(name);
            Frame::shipped(&scene).iter().for_each(|frame| count(&scene, pull_share(&scene, frame)));
        }
        println!("{all}, largest {largest:?}");
        assert!(largest[0] < 0.1 * PULL && largest[1] < 0.2 * PULL && all > 1000, "{all}, largest {largest:?}");
    }

    /// A tare under load: with nothing on the array, and with a press elsewhere.
    #[test]
    fn a_tare_under_load_is_found_by_both_models() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = builtin("sensor-1");
        let press = |centre: [f64; 2]| {
            let contact = Contact {
                shape: Some("hertz-circle".to_owned()),
                size_mm: vec![4.0],
                centre_mm: Some(centre),
                normal_N: Some(5.0),
                tangential_N: Some([1.0, 0.5]),
                ..Default::default()
            };
            generate("press", &scene.sensor, scene.medium, &[contact]).unwrap()
        };
        let (at_tare, now) = (press([-8.0, -3.0]), press([9.0, 4.0]));
        let quiet = |frame: &Frame| Converter { noise: 1e-3, seed: 7, ..Default::default() }.convert(frame).unwrap();
        let mut empty = at_tare.clone();
        empty.stress_MPa.iter_mut().for_each(|b| *b *= 1e-9);
        let unloaded = Frame { stress_MPa: empty.stress_MPa.clone(), ..now.clone() };
        let flagged = |scene: &Scene, frame: &Frame| {
            let results = [
                Golden::new(scene).unwrap().run(frame).unwrap(),
                Model::new(scene).unwrap().reconstruct(frame).unwrap(),
            ];
            assert_eq!(results[0].checks.pull_share, results[1].checks.pull_share);
            results.map(|result| result.flags.contains(&Flag::TareSuspect))
        };
        scene.input.full_scale_MPa = Some(3.0 * now.peak_MPa());
        for (tare, found) in [(&empty, false), (&at_tare, true)] {
            let path = folder.path().join(format!("{found}.json"));
            std::fs::write(&path, quiet(tare).to_json()).unwrap();
            scene.input.tare = Some(path);
            assert_eq!(flagged(&scene, &quiet(&now)), [found; 2]);
            assert_eq!(flagged(&scene, &unloaded), [found; 2]);
        }
    }

    /// Beside a table: a press is named by its place, an even drift and a slope are none.
    #[test]
    fn a_tare_shows_what_pressed_beside_its_table() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = builtin("sensor-1");
        let contact = Contact {
            shape: Some("hertz-circle".to_owned()),
            size_mm: vec![4.0],
            centre_mm: Some([-8.0, -3.0]),
            normal_N: Some(2.0),
            ..Default::default()
        };
        let press = generate("press", &scene.sensor, scene.medium, &[contact]).unwrap();
        let peak = press.peak_MPa();
        let mut random = crate::random::Random::new(4);
        let table = Calibration {
            offset: (0..100).map(|_| 600.0 + 50.0 * random.normal()).collect(),
            gain: (0..100).map(|_| 4e-4 * (1.0 + 0.1 * random.normal())).collect(),
        };
        let (path, tare) = (folder.path().join("table.csv"), folder.path().join("zero.json"));
        std::fs::write(&path, table.to_csv(&scene.sensor)).unwrap();
        assert_eq!(tare_load(&scene).unwrap(), None);
        scene.input.calibration = Some(path);
        assert_eq!(tare_load(&scene).unwrap(), None);
        scene.input.tare = Some(tare.clone());
        let mut found = |stress: &dyn Fn(usize) -> f64| {
            let mut reading = |k: usize| table.offset[k] + (stress(k) + 1e-3 * peak * random.normal()) / table.gain[k];
            let readings = (0..100).map(&mut reading).collect();
            std::fs::write(&tare, Frame::from_stress("zero", &scene.sensor, readings).unwrap().to_json()).unwrap();
            tare_load(&scene).unwrap()
        };
        assert_eq!(found(&|_| 0.0), None);
        assert_eq!(found(&|_| 0.3 * peak), None);
        assert_eq!(found(&|k| 0.3 * peak * (k % 10) as f64 / 9.0), None);
        let load = found(&|k| press.stress_MPa[k] + 0.1 * peak * (k % 10) as f64 / 9.0).unwrap();
        let most = (0..100).max_by(|a, b| press.stress_MPa[*a].total_cmp(&press.stress_MPa[*b])).unwrap();
        assert_eq!((load.row, load.col), (most / 10, most % 10));
        assert!((load.stress_MPa / peak - 1.0).abs() < 0.1, "{load:?} of {peak}");
    }
}
