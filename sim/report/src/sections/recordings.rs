//! Recordings of real arrays: noise, codes, closure of the normal force, agreement of both models, flags, pictures over
//! time. Shear only where the user stated a cover.

use std::collections::BTreeMap;

use anyhow::Result;
use dermis_golden::data::import::{Summary, Unit};
use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::Reconstruction;

use super::super::document::{
    count, decimal, empty_cell, median_percent, percent, seconds, text_cell, Cell, Item, Picture, Section, Table,
};
use super::super::measure::Recorded;
use super::super::pictures::{scatter, stress_map, Outline, Scatter, Series};
use super::super::style::SERIES;

/// Number of stress maps of a recording.
const MAPS: usize = 4;

/// The section of some recordings.
///
/// # Errors
/// A picture that cannot be written.
pub fn recordings(all: &[Recorded]) -> Result<Section> {
    let mut items = vec![
        Item::Text(
            "Recordings of real pressure arrays, imported by dermis import. Their contacts are not known: there is no \
             error to measure, and shear is reported only where the user stated the thickness of a cover. What can be \
             measured is the array's noise and codes, how well the normal force agrees with the device's own figure, and \
             how well the bit-true model agrees with the golden model on real readings."
                .into(),
        ),
        Item::Table(measured(all)),
        Item::Table(forces(all)),
        Item::Table(flags(all)),
    ];
    for recorded in all {
        items.push(Item::Text(origin(&recorded.imported.summary)));
        items.push(Item::Pictures(pictures(recorded)?));
    }
    Ok(Section { id: "recordings", title: "Recordings of real arrays".into(), items })
}

/// Device, unit and what is known of the shear.
fn origin(summary: &Summary) -> String {
    let device = summary.device.as_deref().unwrap_or("a device that the file does not name");
    let unit = match summary.unit {
        unit if unit != Unit::Raw => format!("readings in {}", unit.name()),
        _ => format!(
            "raw counts, whose stress and force rest on the full scale of {} MPa that the user stated",
            summary.full_scale_MPa
        ),
    };
    let shear = match summary.covered {
        true => "The user stated a cover; its shear is as reliable as the flags say.",
        false => "No cover of known thickness: no shear is searched, and none is claimed.",
    };
    format!("{}: {} from {device}, {unit}. {shear}", summary.name, summary.file)
}

/// Array, codes and noise.
fn measured(all: &[Recorded]) -> Table {
    let head = [
        "recording",
        "array",
        "taken",
        "missing",
        "frames",
        "levels",
        "step, kPa",
        "bits",
        "at full scale",
        "noise, kPa",
        "of peak",
        "spread of peak",
        "held frames",
        "without contact, kPa",
    ];
    let row = |recorded: &Recorded| {
        let Summary { array: [rows, cols], window, codes, noise, .. } = &recorded.imported.summary;
        let kPa = |MPa: Option<f64>| decimal(MPa.map(|MPa| 1e3 * MPa), 3);
        vec![
            text_cell(recorded.imported.summary.name.clone()),
            text_cell(format!("{rows}×{cols}")),
            text_cell(format!("{}×{}", window.rows, window.cols)),
            count(recorded.imported.summary.missing as u64),
            count(recorded.imported.frames.len() as u64),
            count(codes.levels as u64),
            kPa(codes.step_MPa),
            codes.bits.map_or_else(empty_cell, |bits| count(u64::from(bits))),
            count(codes.at_full_scale as u64),
            kPa(noise.loaded_MPa),
            percent(noise.loaded_share),
            percent(noise.spread_share),
            count(noise.held_frames as u64),
            kPa(noise.empty_MPa),
        ]
    };
    let caption =
        "Array, codes and noise. Noise: standard deviation of a loaded taxel from frame to frame, from second differences \
         while the load is held (the force changes by at most 2 %), median over the frames; spread: standard deviation \
         within a run of at least six such frames, with drift, tremor and motion of the load; without contact: of unloaded \
         taxels, which a threshold in the device hides";
    Table::new("recordings", caption, &head, all.iter().map(row).collect())
}

/// Closure, agreement and speed.
fn forces(all: &[Recorded]) -> Table {
    let head = [
        "recording",
        "largest force, N",
        "stress × area off the device's figure, median",
        "at most",
        "reconstructed off stress × area, median",
        "on dead taxels, median",
        "fixed off golden, largest",
        "RMS",
        "golden estimator",
        "golden, CPU",
        "hardware estimator",
        "bit-true, CPU",
        "hardware",
        "cycles",
        "why no hardware",
    ];
    let caption =
        "Normal force and time of a frame. Device's figure: the force that an LST file prints, the raw sum of a Tekscan \
         CSV, over the whole array; reconstructed: the golden model's force on the taxels that exist; on dead taxels: \
         its force on the others over all of it; fixed off golden: largest difference of a force on a taxel over the \
         frame's largest, worst frame; hardware: cycles of the bit-true model over its clock";
    Table::new("recording-forces", caption, &head, all.iter().map(force_row).collect())
}

fn force_row(recorded: &Recorded) -> Vec<Cell> {
    let summary = &recorded.imported.summary;
    let closure = summary.closure();
    let largest = summary.frames.iter().map(|frame| frame.normal_N + frame.outside_N).fold(0.0, f64::max);
    let alive: Vec<[f64; 2]> = recorded.golden.iter().map(|result| alive_and_dead(recorded, result)).collect();
    let normal = |k: usize| summary.frames[recorded.chosen[k]].normal_N;
    // Frames of little load are all rounding.
    let loaded = |k: &usize| normal(*k) > 0.1 * largest;
    let indices = || (0..alive.len()).filter(loaded);
    let fixed = recorded.fixed.as_ref();
    let worst = |share: fn(&dermis_cosim::compare::Difference) -> f64| {
        fixed.ok().map(|fixed| fixed.differences.iter().map(share).fold(0.0, f64::max))
    };
    vec![
        text_cell(summary.name.clone()),
        decimal(Some(largest), 2),
        percent(closure.map(|[_, median]| median)),
        percent(closure.map(|[most, _]| most)),
        median_percent(indices().map(|k| Some((alive[k][0] / normal(k) - 1.0).abs()))),
        match recorded.imported.scene.input.dead.len() {
            0 => empty_cell(),
            _ => median_percent(indices().map(|k| Some(alive[k][1] / (alive[k][0] + alive[k][1])))),
        },
        percent(worst(|difference| difference.max_share)),
        percent(worst(|difference| difference.rms_share)),
        text_cell(recorded.estimator),
        seconds(Some(recorded.seconds)),
        text_cell(fixed.ok().map_or("", |fixed| fixed.estimator)),
        seconds(fixed.ok().map(|fixed| fixed.seconds)),
        seconds(fixed.ok().map(|fixed| fixed.hardware_seconds)),
        fixed.map_or_else(|_| empty_cell(), |fixed| count(fixed.cycles)),
        text_cell(fixed.err().cloned().unwrap_or_default()),
    ]
}

/// Normal force in N on the taxels that exist, and on the dead ones.
fn alive_and_dead(recorded: &Recorded, result: &Reconstruction) -> [f64; 2] {
    let (scene, fz) = (&recorded.imported.scene, &result.forces_N.fz);
    let dead: f64 = scene.input.dead.iter().map(|[row, col]| fz[row * scene.sensor.cols + col]).sum();
    [fz.iter().sum::<f64>() - dead, dead]
}

/// Number of frames with each flag.
fn flags(all: &[Recorded]) -> Table {
    let tally = |results: &[Reconstruction]| {
        let mut tally: BTreeMap<Flag, u64> = BTreeMap::new();
        results.iter().flat_map(|result| &result.flags).for_each(|flag| *tally.entry(*flag).or_default() += 1);
        tally
    };
    let mut rows = Vec::new();
    for recorded in all {
        let golden = tally(&recorded.golden);
        let fixed = recorded.fixed.as_ref().ok().map(|fixed| tally(&fixed.results));
        let mut names: Vec<Flag> = golden.keys().chain(fixed.iter().flat_map(BTreeMap::keys)).copied().collect();
        names.sort();
        names.dedup();
        let own = |tally: &BTreeMap<Flag, u64>, flag: Flag| count(tally.get(&flag).copied().unwrap_or(0));
        let frames = recorded.golden.len() as u64;
        let name = || text_cell(recorded.imported.summary.name.clone());
        for flag in &names {
            let fixed = fixed.as_ref().map_or_else(empty_cell, |fixed| own(fixed, *flag));
            rows.push(vec![name(), text_cell(flag.name()), own(&golden, *flag), fixed, count(frames)]);
        }
        if names.is_empty() {
            let none = || if fixed.is_some() { count(0) } else { empty_cell() };
            rows.push(vec![name(), text_cell("none"), count(0), none(), count(frames)]);
        }
    }
    let head = ["recording", "flag", "golden, frames", "bit-true, frames", "of frames"];
    Table::new("recording-flags", "Frames with a flag", &head, rows)
}

/// Force over time, and stress at some moments.
fn pictures(recorded: &Recorded) -> Result<Vec<Picture>> {
    let Recorded { imported, chosen, golden, .. } = recorded;
    let (summary, sensor) = (&imported.summary, &imported.scene.sensor);
    let timed = summary.frames.iter().all(|frame| frame.time_s.is_some());
    let x = |k: usize| match summary.frames[k].time_s {
        Some(seconds) if timed => seconds,
        _ => (k + 1) as f64,
    };
    let series = |name: &str, colour: usize, points: Vec<(f64, f64)>| Series {
        name: name.into(),
        colour: SERIES[colour],
        shape: colour % 4,
        hollow: false,
        points: points.into_iter().map(|(x, y)| (x, y, String::new())).collect(),
        joined: true,
    };
    let all = || summary.frames.iter().enumerate();
    let device = all().filter_map(|(k, frame)| Some((x(k), frame.device_N?))).collect::<Vec<_>>();
    let mut lines = vec![
        series("stress × area", 0, all().map(|(k, frame)| (x(k), frame.normal_N)).collect()),
        series("golden", 1, chosen.iter().zip(golden).map(|(k, result)| (x(*k), result.resultant_N[2])).collect()),
    ];
    if !device.is_empty() {
        lines.push(series("device, whole array", 2, device));
    }
    let plot = Scatter {
        x: if timed { "time, s".into() } else { "frame".into() },
        y: "normal force, N".into(),
        log: [false; 2],
        ticks: [short; 2],
        series: lines,
        guides: Vec::new(),
    };
    let mut pictures = vec![Picture {
        id: format!("recording-{}-force", summary.name),
        caption: format!("{}: normal force over time", summary.name),
        svg: scatter(&plot)?,
    }];
    for k in moments(summary) {
        let frame = &imported.frames[k];
        let when = if timed { format!("{} s", short(x(k))) } else { format!("frame {}", k + 1) };
        pictures.push(Picture {
            id: format!("recording-{}-{}", summary.name, k + 1),
            caption: format!("{}: stress at {when}, {:.2} N", summary.name, summary.frames[k].normal_N),
            svg: stress_map(sensor, &frame.stress_MPa, Outline::default())?,
        });
    }
    Ok(pictures)
}

/// Frames at even distances between the first and the last that carry a tenth of the largest force.
fn moments(summary: &Summary) -> Vec<usize> {
    let largest = summary.frames.iter().map(|frame| frame.normal_N).fold(0.0, f64::max);
    let loaded: Vec<usize> =
        (0..summary.frames.len()).filter(|k| summary.frames[*k].normal_N > 0.1 * largest).collect();
    let mut moments: Vec<usize> = match loaded.len() {
        0 => Vec::new(),
        count => (0..MAPS).map(|k| loaded[k * (count - 1) / (MAPS - 1)]).collect(),
    };
    moments.dedup();
    moments
}

/// A number with up to three decimals.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
