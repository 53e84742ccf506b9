//! `dermis report`: measures, assembles the sections, writes the files.

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use anyhow::Result;
use clap::{value_parser, Args};
use dermis_golden::data::import::Imported;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::{Condition, Scene};

use super::inputs::scenes_or;
use dermis_flow::jobs::Interrupt;
use dermis_report::document::{Document, Section};
use dermis_report::measure::{
    self, clock, machine, measure, recorded, sweep, ContactCount, DeviceOptions, Measured, Options, SweepPoint,
    DEVICE_FRAMES, MOST_FRAMES,
};
use dermis_report::run_log::RunLog;
use dermis_report::save::save;
use dermis_report::sections::{
    choice, choose, devices, extremes, fields, frames, noise, paper, power, published, ratios, recordings, resources,
    run_logs, search, stability, stages, sweeps, time, Choice, DEVICE_SCENES,
};

/// Number of random frames of a sweep in addition to the shipped ones: quick, full variant.
const SWEEP_FRAMES: [u32; 2] = [0, 24];

/// Arguments of `dermis report`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis report                                      all built-in scenes, minutes
  dermis report --quick                              fewer frames and co-simulations, under two minutes
  dermis report sensor-1 eight-by-eight --quick --out target/small-report
  dermis report --paper                              the paper's figures and tables by their numbers
  dermis report --recording build/recordings/walk    noise, closure, agreement and pictures of a recording

Writes report.html (one file, opens offline), report.md, report.json, report-tables/*.csv and report-pictures/*.svg;
with --paper and --recording the same files, named paper and recordings.")]
pub struct Arguments {
    /// Built-in names or paths of scenes with shipped frames; default: all built-in ones.
    scenes: Vec<String>,
    /// Folder for the files; default: `report` in the build folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fewer random frames, sweeps and co-simulations; no subarrays of more than 1200 taxels.
    #[arg(long)]
    quick: bool,
    /// Reproduce the paper's figures and tables under its centroid condition, instead of the report.
    #[arg(long)]
    paper: bool,
    /// Folder that dermis import wrote, repeatable: a page about these recordings instead of the report.
    #[arg(long = "recording", value_name = "DIR", conflicts_with_all = ["scenes", "paper", "quick"])]
    recordings: Vec<PathBuf>,
    /// Number of cases prepared in parallel; default: the number of processors. Times are measured sequentially.
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=64))]
    jobs: Option<u16>,
}

/// Runs the command: the path of the HTML page, and whether all hardware equalled its model.
///
/// # Errors
/// A scene that cannot be loaded or measured, no Verilator, files that cannot be written, an interruption.
pub fn run(arguments: &Arguments, build: &Path) -> Result<(String, bool)> {
    if !arguments.recordings.is_empty() {
        return Ok((recordings_page(arguments, build)?, true));
    }
    let names = scenes_or(&arguments.scenes, Scene::builtin_names());
    let scenes = names.iter().map(|name| Scene::load(name)).collect::<Result<Vec<_>, _>>()?;
    let processors = available_parallelism().map_or(1, usize::from);
    let options = Options {
        quick: arguments.quick,
        jobs: arguments.jobs.map_or(processors, usize::from),
        build: build.to_owned(),
        condition: if arguments.paper { Condition::BothSigns } else { Condition::default() },
        simulate: !arguments.paper,
        interrupt: Interrupt::on_signals()?,
    };
    let mut cases: Vec<Case> = (0..4).filter_map(Case::numbered).collect();
    if !arguments.paper {
        cases.push(Case::Contacts);
    }
    let measured = measure(&scenes, &cases, &options)?;
    let document = match arguments.paper {
        true => Document {
            name: "paper",
            title: "Dermis: the paper's figures by number".into(),
            intro: intro(&measured, &options),
            sections: paper(&measured, &options)?,
        },
        false => Document {
            name: "report",
            title: "Dermis: error against run time".into(),
            intro: intro(&measured, &options),
            sections: sections(&measured, &options)?,
        },
    };
    options.interrupt.check()?;
    let out = arguments.out.clone().unwrap_or_else(|| build.join("report"));
    let page = save(&document, &out)?;
    let results = measured.iter().filter_map(|m| m.bit_true.as_ref().ok()?.equal);
    Ok((format!("{}\n", page.display()), results.clone().all(|equal| equal)))
}

/// The page about recordings; returns its path.
fn recordings_page(arguments: &Arguments, build: &Path) -> Result<String> {
    let interrupt = Interrupt::on_signals()?;
    let load = |folder: &PathBuf| recorded(Imported::open(folder)?, &interrupt);
    let all = arguments.recordings.iter().map(load).collect::<Result<Vec<_>>>()?;
    let document = Document {
        name: "recordings",
        title: "Dermis: recordings of real arrays".into(),
        intro: vec![
            machine(),
            format!("Of recordings of more than {MOST_FRAMES} frames, that many at even distances are reconstructed."),
        ],
        sections: vec![recordings(&all)?],
    };
    interrupt.check()?;
    let out = arguments.out.clone().unwrap_or_else(|| build.join("report"));
    Ok(format!("{}\n", save(&document, &out)?.display()))
}

/// The shipped recordings; the quick variant takes the smallest.
fn shipped_recordings(options: &Options) -> Result<Section> {
    let mut shipped = Imported::shipped()?;
    if options.quick {
        shipped.truncate(1);
    }
    let all = shipped.into_iter().map(|imported| recorded(imported, &options.interrupt)).collect::<Result<Vec<_>>>()?;
    recordings(&all)
}

fn sections(measured: &[Measured], options: &Options) -> Result<Vec<Section>> {
    let choices = choose(measured, options)?;
    let first = noise(measured, &measure::noise(measured, options)?)?;
    let others = vec![
        choice(measured, &choices),
        time(measured)?,
        published(measured),
        stages(measured, &choices)?,
        fields(measured, &choices)?,
        search(measured)?,
        ratios(measured)?,
        sweeps(&all_sweeps(measured, &choices, options)?)?,
        stability(&measure::conditions(options)?)?,
        extremes(&measure::extremes(measured, options)?),
        shipped_recordings(options)?,
        resources(measured, &choices, options)?,
        power(measured, &choices, options)?,
        run_logs(&RunLog::load_all(&options.build)?),
    ];
    Ok(first.into_iter().chain(others).chain(where_computed(options)?).collect())
}

/// Time and energy by estimator and device, minutes of measurement that the quick variant leaves out.
fn where_computed(options: &Options) -> Result<Option<Section>> {
    if options.quick {
        return Ok(None);
    }
    let scenes = DEVICE_SCENES.map(Scene::builtin).into_iter().collect::<Result<Vec<_>, _>>()?;
    let frames = DEVICE_FRAMES as usize;
    let device_options = DeviceOptions { frames, python: None, power: true, build: options.build.clone() };
    Ok(Some(devices(&measure::devices(&scenes, &device_options)?)?))
}

/// The sweeps of the scenes with hardware, each in its recommended case, with contact count and number of frames.
fn all_sweeps(
    measured: &[Measured],
    choices: &[Choice],
    options: &Options,
) -> Result<Vec<(Vec<SweepPoint>, ContactCount, usize)>> {
    let kept = if options.quick { 1 } else { choices.len() };
    let chosen = choices.iter().map(|choice| (&measured[choice.index].scene, choice.contact_count)).take(kept);
    chosen
        .map(|(scene, contact_count)| {
            let frames = frames(scene, contact_count, SWEEP_FRAMES[usize::from(!options.quick)])?;
            Ok((sweep(scene, &frames, options)?, contact_count, frames.len()))
        })
        .collect()
}

/// Introduction: origin of the figures.
fn intro(measured: &[Measured], options: &Options) -> Vec<String> {
    let mut intro = vec![machine()];
    if let Some((m, bit_true)) = measured.iter().find_map(|m| Some((m, m.bit_true.as_ref().ok()?))) {
        let (board, clock) = (&bit_true.model.board, clock(&bit_true.model.board, &m.scene));
        intro.push(format!(
            "Hardware times: cycles from the first input beat to the last output beat, divided by {} MHz ({} of {}).",
            clock.MHz, clock.origin, board.description
        ));
    }
    if options.quick {
        intro.push(
            "Quick variant: few random frames; hardware co-simulated for the scenes of `make run` in their own case only, \
             else with the bit-true model's cycle counts; no subarrays above 1200 taxels; literal Eq. 1 up to 200 \
             taxels; one sweep. dermis report without --quick runs everything."
                .into(),
        );
    }
    if !options.simulate {
        intro.push("Cycle counts are the bit-true model's; dermis cosim checks that the hardware's are equal.".into());
    }
    intro.push(
        "Frames are those shipped in golden/data/frames, with known forces. All figures were measured in this run, \
         except the published ones (golden/data/paper) and the counts of long test runs (saved in the build folder)."
            .into(),
    );
    intro
}
