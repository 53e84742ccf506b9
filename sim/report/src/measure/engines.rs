//! Runs all engines on the frames of scenes and cases.

use std::collections::BTreeMap;

use anyhow::{anyhow, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::{Golden, GoldenError};
use dermis_golden::fixed::{FixedError, Model, Trace};
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::{subarrays, Case};
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_hdl::generate;
use dermis_study::baseline::Baseline;

use super::measured::{BitTrue, ContactCount, Implementation, Measured, Options};
use super::timing::Timing;
use dermis_cosim::simulator::Simulator;
use dermis_cosim::verify::verify;
use dermis_cosim::QUICK_SCENES;
use dermis_flow::jobs::parallel;
use dermis_flow::progress::Progress;

/// Largest subarray, in taxels, of the cases measured by the quick variant.
const QUICK_TAXELS: usize = 1200;
/// Largest subarray, in taxels, for which the quick variant runs the literal baseline, which takes seconds per frame
/// beyond.
const QUICK_LITERAL: usize = 200;

/// Measures scenes in cases on their shipped frames, in the order given; cases that do not divide an array, or that a network
/// does not take, are skipped.
///
/// # Errors
/// A scene that the golden model refuses or that has no shipped frames, no Verilator, an interruption.
pub fn measure(scenes: &[Scene], cases: &[Case], options: &Options) -> Result<Vec<Measured>> {
    let mut tasks = Vec::new();
    for scene in scenes {
        let frames = Frame::shipped(scene);
        if frames.is_empty() {
            return Err(anyhow!("scene {}: no frame is shipped for {}", scene.name, scene.sensor));
        }
        let network = scene.hardware_estimator() == EstimatorKind::Network;
        for case in scene.cases_of(cases) {
            let mut scene = scene.clone();
            (scene.partition.case, scene.partition.condition) = (case, options.condition);
            let largest = match case {
                // One μ per contact over the whole array; equal to case 0 for a single contact.
                Case::Contacts
                    if !network && !frames.iter().any(|frame| ContactCount::of(frame) == ContactCount::Several) =>
                {
                    None
                }
                Case::Contacts | Case::Adaptive => Some(scene.sensor.taxels()),
                Case::Grid(_) => subarrays(case, &scene.sensor).ok().map(|parts| parts[0].rows * parts[0].cols),
            };
            if largest.is_some_and(|taxels| !(options.quick && taxels > QUICK_TAXELS)) {
                tasks.push((scene, frames.clone()));
            }
        }
    }
    let mut all =
        parallel("engines and co-simulations", tasks, options.jobs, &options.interrupt, |(scene, frames)| {
            prepare(scene, frames, options)
        })?;
    let bar = Progress::steps("timing", all.len() as u64);
    for (done, measured) in all.iter_mut().enumerate() {
        options.interrupt.check()?;
        measured.times = time(measured)?;
        bar.set(done as u64 + 1);
    }
    Ok(all)
}

fn prepare(scene: Scene, frames: Vec<Frame>, options: &Options) -> Result<Measured> {
    let engine = Golden::reference(&scene)?;
    let golden = frames.iter().map(|frame| engine.run(frame)).collect::<Result<Vec<_>, _>>()?;
    let bit_true = match Model::for_frames(&scene, &frames) {
        Ok(model) => Ok(bit_true(model, &frames, options)?),
        Err(error @ (FixedError::DoesNotFit(_) | FixedError::Scene(_) | FixedError::Format { .. })) => {
            Err(in_one_line(&error.to_string()))
        }
        Err(error) => return Err(error.into()),
    };
    let too_slow = options.quick && engine.matrices().is_some_and(|own| own.sensor.taxels() > QUICK_LITERAL);
    let literal = match too_slow {
        true => Err("left out of the quick variant".to_owned()),
        false => Baseline::new(&scene).map_err(|error| error.to_string()),
    };
    let (literal, baseline) = match literal {
        Err(reason) => (None, Err(reason)),
        Ok(literal) => {
            let forces = frames.iter().map(|frame| literal.run(frame)).collect::<Result<Vec<_>, _>>()?;
            (Some(literal), Ok(forces))
        }
    };
    let (evidence, times) = (evidence_of(&scene, &frames, options), BTreeMap::new());
    Ok(Measured { scene, frames, engine, golden, evidence, bit_true, baseline, times, literal })
}

/// `evidence` on every frame, or why not.
fn evidence_of(scene: &Scene, frames: &[Frame], options: &Options) -> Result<(Golden, Vec<Reconstruction>), String> {
    if !Implementation::Evidence.is_of(scene.partition.case) {
        return Err("as in case 0".to_owned());
    }
    if options.quick && scene.sensor.taxels() > QUICK_LITERAL {
        return Err("left out of the quick variant".to_owned());
    }
    let run = || -> Result<(Golden, Vec<Reconstruction>), GoldenError> {
        let engine = Golden::with(scene, EstimatorKind::Evidence)?;
        let results = frames.iter().map(|frame| engine.run(frame)).collect::<Result<Vec<_>, _>>()?;
        Ok((engine, results))
    };
    run().map_err(|error| in_one_line(&error.to_string()))
}

/// A message of several lines for a cell of a table: the first line, then the others separated by semicolons.
fn in_one_line(message: &str) -> String {
    let mut lines = message.lines().map(str::trim);
    let first = lines.next().unwrap_or_default();
    let others = lines.collect::<Vec<_>>().join("; ");
    format!("{first} {others}").trim_end().to_owned()
}

fn bit_true(model: Model, frames: &[Frame], options: &Options) -> Result<BitTrue> {
    let traces = frames.iter().map(|frame| Ok(model.run(&model.readings(std::slice::from_ref(frame))?)));
    let traces: Vec<Trace> = traces.collect::<Result<_, FixedError>>()?;
    let decoded = frames
        .iter()
        .zip(&traces)
        .map(|(frame, t)| model.decode(std::slice::from_ref(frame), "fixed", &t.beats, &t.status));
    let results = decoded.collect::<Result<Vec<_>, _>>()?;
    let usage = generate(&model)?.usage;
    let slowest = traces.iter().map(|trace| trace.cycles.total).max().unwrap_or(0);
    let mut bit_true = BitTrue { results, traces, equal: None, cycles: slowest, usage, model };
    if is_simulated(&bit_true.model.scene, options) {
        let verified = verify(&bit_true.model.scene, frames, &[Simulator::Verilator], &options.build)?;
        bit_true.equal = Some(verified.findings.is_equal());
        bit_true.cycles = verified.rows.iter().filter_map(|row| row.times.total()).max().unwrap_or(slowest);
    }
    Ok(bit_true)
}

fn is_simulated(scene: &Scene, options: &Options) -> bool {
    let first = QUICK_SCENES.contains(&scene.name.as_str());
    let own = Scene::builtin(&scene.name).is_ok_and(|own| own.partition.case == scene.partition.case);
    options.simulate && (!options.quick || first && own)
}

/// Measures every CPU engine that supports the case.
fn time(measured: &Measured) -> Result<BTreeMap<Implementation, Timing>> {
    let frames = &measured.frames;
    type Run<'m> = Box<dyn Fn(&Frame) -> Result<()> + 'm>;
    let mut runs: Vec<(Implementation, Run)> =
        vec![(Implementation::Golden, Box::new(|frame| Ok(measured.engine.run(frame).map(drop)?)))];
    if let Ok((engine, _)) = &measured.evidence {
        runs.push((Implementation::Evidence, Box::new(|frame| Ok(engine.run(frame).map(drop)?))));
    }
    if let Ok(bit_true) = &measured.bit_true {
        runs.push((Implementation::Fixed, Box::new(|frame| Ok(bit_true.model.reconstruct(frame).map(drop)?))));
    }
    if let Some(literal) = &measured.literal {
        runs.push((Implementation::Baseline, Box::new(|frame| Ok(literal.run(frame).map(drop)?))));
    }
    let timed = |(engine, run): (Implementation, Run)| Ok((engine, Timing::of(frames.len(), |k| run(&frames[k]))?));
    runs.into_iter().map(timed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_told_in_full() {
        // 16×16 taxels in one subarray do not fit a small device; what makes them fit is told too.
        let mut scene = Scene::builtin("sensor-3").unwrap();
        (scene.sensor.rows, scene.sensor.cols) = (16, 16);
        scene.hardware.board = Some("colorlight-i5".into());
        let error = Model::new(&scene).unwrap_err().to_string();
        let one_line = in_one_line(&error);
        assert!(error.lines().count() > 1 && !one_line.contains('\n'), "{error}");
        assert!(error.lines().all(|line| one_line.contains(line.trim())), "{one_line}");
        assert_eq!(in_one_line("one"), "one");
    }
}
