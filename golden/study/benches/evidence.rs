//! Time and error of the estimator `evidence` beside the search, on unrelated frames and on those of presses in order.
//!
//! ```text
//! make bench, or: cargo bench --package dermis-golden --bench evidence [-- FRAMES]
//! ```
//!
//! Times are processor time of one core per frame; ratios are of the same run, so that other programs have no part in them.
//!
//! | column | meaning |
//! |---|---|
//! | search | median time of the search |
//! | unrelated | median time of frames that have nothing in common, over that of the search, slowest over median |
//! | in order | the same of the frames of presses: slide, roll, ramp |
//! | spoiled | slowest of the frames of `dermis study sensor-faults`, every fault and size, over the median of the unrelated ones |
//! | e_t | error of the shear of the unrelated frames: median, nine of ten |
//! | σ | share of their force components within one standard deviation |

use dermis_golden::data::frame::Frame;
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::{DrawOptions, Draws};
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::engine::{Engine, State};
use dermis_golden::estimate::float::Golden;
use dermis_golden::result::errors::Errors;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_study::sensor_faults::{spoiled_frames, SensorFaults};
use std::error::Error;

/// Built-in scenes and the number of contacts of a frame.
const ARRAYS: [(&str, usize); 3] = [("eight-by-eight", 1), ("sensor-1", 1), ("sensor-3", 3)];
/// Noise as a share of the peak; it is not stated.
const NOISES: [f64; 4] = [0.0, 5e-4, 2e-3, 1e-2];
/// Motions of the presses.
const MOTIONS: [Motion; 3] = [Motion::Slide, Motion::Roll, Motion::Ramp];
/// Frames of a table's entry.
const FRAMES: usize = 45;

/// Processor time of this thread in ms.
fn processor_ms() -> Result<f64, Box<dyn Error>> {
    // The kernel counts a thread's time when it yields.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(1e-6 * text.split(' ').next().unwrap_or_default().parse::<f64>()?)
}

/// Median, and the largest over it.
fn spread(times: &mut [f64]) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2];
    [median, times[times.len() - 1] / median]
}

/// Results of `frames` and their times in ms; each with the state that the one before left, or after a reset.
fn results(
    golden: &Golden,
    frames: &[Frame],
    in_order: bool,
) -> Result<(Vec<Reconstruction>, Vec<f64>), Box<dyn Error>> {
    let (mut all, mut times, mut state) = (Vec::new(), Vec::new(), State::default());
    for frame in frames {
        let begin = processor_ms()?;
        all.push(golden.reconstruct_after(&mut state, std::slice::from_ref(frame))?);
        times.push(processor_ms()? - begin);
        if !in_order {
            state = State::default();
        }
    }
    Ok((all, times))
}

/// Median and nine of ten of e_t, and the share of force components within one standard deviation.
fn accuracy(frames: &[Frame], results: &[Reconstruction]) -> [f64; 3] {
    let (mut errors, mut within) = (Vec::new(), 0);
    for (frame, result) in frames.iter().zip(results) {
        let (truth, sigma) = (frame.resultant_N.unwrap_or_default(), result.sigma_N().unwrap_or_default());
        errors.push(Errors::new(truth, result.resultant_N).tangential.unwrap_or_default());
        within += (0..3).filter(|&axis| (result.resultant_N[axis] - truth[axis]).abs() <= sigma[axis]).count();
    }
    errors.sort_by(f64::total_cmp);
    [errors[errors.len() / 2], errors[errors.len() * 9 / 10], within as f64 / (3 * frames.len()) as f64]
}

fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(FRAMES);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    println!("scene           noise %  search ms  unrelated ms  /search  worst  spoiled  in order ms  /search  worst    e_t %       σ %");
    for (name, contacts) in ARRAYS {
        let scene = Scene::builtin(name)?;
        let [search, evidence] =
            [EstimatorKind::Search, EstimatorKind::Evidence].map(|kind| Golden::new(&scene.estimated_by(kind)));
        let (search, evidence) = (search?, evidence?);
        let draws = Draws::new(&scene, DrawOptions { contacts, ..DrawOptions::default() })?;
        let spoiled = spoiled_frames(&scene, &SensorFaults { frames: 1, ..SensorFaults::default() })?;
        let spoiled: Vec<Frame> = spoiled.into_iter().map(|(_, _, frame)| frame).collect();
        let (_, times) = results(&evidence, &spoiled, false)?;
        let spoiled_ms = times.into_iter().fold(0.0, f64::max);
        for noise in NOISES {
            let draw =
                |number: u64| draws.frame(number)?.read(&Converter { noise, seed: number, ..Converter::default() });
            let unrelated = (0..count as u64).map(draw).collect::<Result<Vec<Frame>, _>>()?;
            let (_, mut times) = results(&search, &unrelated, false)?;
            let [search_ms, _] = spread(&mut times);
            let (found, mut times) = results(&evidence, &unrelated, false)?;
            let [cold_ms, cold_worst] = spread(&mut times);
            let spoiled_worst = spoiled_ms / cold_ms;
            let mut times = Vec::new();
            for (number, motion) in (0..).zip(MOTIONS) {
                let frames = Press::new(motion).of_frames(count / MOTIONS.len(), noise).frames(&scene, number)?;
                times.extend(results(&evidence, &frames, true)?.1);
            }
            let [warm_ms, warm_worst] = spread(&mut times);
            let [median, most, within] = accuracy(&unrelated, &found);
            println!(
                "{name:<15} {:>7} {search_ms:>10.3} {cold_ms:>13.2} {:>8.1} {cold_worst:>6.1} {spoiled_worst:>8.1} {warm_ms:>12.2} {:>8.1} {warm_worst:>6.1} \
                 {:>5.1} {:>5.1} {:>6.0}",
                100.0 * noise,
                cold_ms / search_ms,
                warm_ms / search_ms,
                100.0 * median,
                100.0 * most,
                100.0 * within
            );
        }
    }
    Ok(())
}
