//! `dermis stability`: errors of double, single and fixed point against the condition number of Cz, and extreme frames.
//!
//! | arguments | prints |
//! |---|---|
//! | no scenes | the table of [`dermis_study::stability::settings`] |
//! | scenes | one row for each |
//! | `--extreme` | results on extreme frames of each scene, by default sensor-1 |
//! | `--plot FILE` | additionally writes error against condition number as SVG |

use std::path::PathBuf;

use anyhow::{ensure, Result};
use clap::Args;
use dermis_golden::spec::scene::Scene;
use dermis_study::stability::extreme::{frames, outcome};
use dermis_study::stability::{measure, settings, Setting};

use dermis_flow::progress::Progress;
use dermis_golden::write::write;
use dermis_report::{self as report, Format};

/// Arguments of `dermis stability`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in names or paths of scenes; default: a series from well to ill conditioned.
    scenes: Vec<String>,
    /// Only scenes of this group of the table: thickness, poisson, size, pitches.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["scenes", "extreme"])]
    group: Option<String>,
    /// Only scenes with this kind of inverse: tsvd, tikhonov, exact.
    #[arg(long, value_name = "KIND", conflicts_with = "extreme")]
    inverse: Option<String>,
    /// Measure on extreme frames instead; default scene: sensor-1.
    #[arg(long, conflicts_with = "plot")]
    extreme: bool,
    /// Also plot error against condition number into an SVG file.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Output format.
    #[arg(long, value_enum, default_value = "markdown")]
    format: Format,
}

const EXAMPLES: &str = "Examples:
  dermis stability                                   thickness/pitch 0.1 to 10, Poisson ratios, sizes, pitches
  dermis stability --group thickness --inverse tsvd
  dermis stability my-scene.toml --format json
  dermis stability --group thickness --plot out.svg
  dermis stability --extreme eight-by-eight          zero, saturated, 1e-9 to 1e9 of full scale, …";

/// Runs the command: the table as text; writes the plot if asked for.
///
/// # Errors
/// An unknown scene, a scene that the golden model refuses (with `--extreme`), a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    if arguments.extreme {
        return extreme(arguments);
    }
    let mut wanted = match arguments.scenes.as_slice() {
        [] => settings(),
        names => names.iter().map(|name| Ok(Setting::new(name, Scene::load(name)?))).collect::<Result<Vec<_>>>()?,
    };
    let Arguments { group, inverse, .. } = arguments;
    wanted.retain(|setting| group.as_ref().is_none_or(|group| setting.group == *group));
    wanted.retain(|setting| inverse.as_ref().is_none_or(|kind| setting.scene.inverse.kind.name() == kind));
    ensure!(!wanted.is_empty(), "stability: no scene of --group {group:?} with --inverse {inverse:?}");
    let bar = Progress::steps("stability", wanted.len() as u64);
    let mut rows = Vec::with_capacity(wanted.len());
    for setting in &wanted {
        rows.push(measure(setting)?);
        bar.set(rows.len() as u64);
    }
    drop(bar);
    if let Some(path) = &arguments.plot {
        write(path, report::stability_picture(&rows)?.as_bytes())?;
    }
    report::stability(&rows, arguments.format)
}

fn extreme(arguments: &Arguments) -> Result<String> {
    let default = ["sensor-1".to_owned()];
    let names = if arguments.scenes.is_empty() { &default[..] } else { &arguments.scenes };
    let mut all = Vec::new();
    for name in names {
        let scene = Scene::load(name)?;
        let _progress = Progress::start(&format!("{name}: extreme frames"));
        let rows = frames(&scene)?.iter().map(outcome).collect::<Result<Vec<_>, _>>()?;
        all.push((scene.name, rows));
    }
    report::extremes(&all, arguments.format)
}
