//! `dermis calibrate`: the calibration table of a sensor, from recordings under known uniform stresses, or from ordinary presses.

mod blind;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{anyhow, Result};
use clap::Args;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::calibration::Calibration;
use dermis_golden::data::input::known_loads::{Curvature, KnownLoad, LoadFit, Residual};
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use serde::Serialize;
use toml_edit::{Array, Value};

use super::layout::LayoutArguments;
use super::scene_file::{has_file, lines, state, Measured};
use dermis_report as report;

/// Arguments of `dermis calibrate`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis calibrate mat.toml --load 0=zero.csv --load 0.05=half.csv --load 0.1=full.csv --out table.csv
  dermis calibrate mat.toml --load 0=zero.csv --load 0.1=full.csv --json
  dermis calibrate mat.toml --blind presses.mcap --out table.csv

A recording is a text with one frame per line or one row per line, as a stream has them, an MCAP file, a JSON frame, or a folder of such files,
in the unit of the readings. Each must be taken under the same stress on every taxel, as air pressure on a foil applies it. With three loads
or more each is left out once, and the table of the others is compared with it. The table is what `input.calibration`
reads. Where the readings are no straight lines, and four loads or more, one of them 0, show it, `input.curve` has their characteristic,
which the hardware does not take. These fields and those of full scale, dead taxels and noise are written into the file of the scene, where all else
stays.

With --blind a recording of 200 ordinary presses or more, 300 are better, takes the place of known loads: press all over the array, with anything, and
lift in between. It tells how the gains of neighbours differ; the common scale and what changes slowly over the array stay as they are.
Recordings of other programs become MCAP files by dermis import.")]
pub struct Arguments {
    /// Built-in name or path of the scene that defines the sensor.
    scene: String,
    /// Stress in MPa and the recording under it, a file or a folder; repeatable, at least two.
    #[arg(long = "load", value_name = "MPA=FILE", required_unless_present = "blind", conflicts_with = "blind")]
    loads: Vec<LoadFile>,
    /// Recording of presses whose loads are not known, a file or a folder: gains of the taxels from what no press explains.
    #[arg(long, value_name = "FILE")]
    blind: Option<PathBuf>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// File for the table.
    #[arg(long, value_name = "FILE", required_unless_present = "json")]
    out: Option<PathBuf>,
    /// Print what is known of the calibration as JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// A known stress and the recording under it.
#[derive(Clone, Debug)]
struct LoadFile {
    stress_MPa: f64,
    path: PathBuf,
}

impl FromStr for LoadFile {
    type Err = String;

    fn from_str(text: &str) -> Result<LoadFile, String> {
        let wanted = || "a finite stress in MPa and a file, as in 0.05=half.csv".to_owned();
        let (stress, path) = text.split_once('=').ok_or_else(wanted)?;
        let stress_MPa = stress.trim().parse().ok().filter(|stress: &f64| stress.is_finite()).ok_or_else(wanted)?;
        Ok(LoadFile { stress_MPa, path: path.into() })
    }
}

/// The JSON of the command.
#[derive(Serialize)]
struct CalibrationJson<'a> {
    scene: &'a str,
    table: Option<String>,
    loads: usize,
    noise_MPa: Option<f64>,
    least_full_scale_MPa: f64,
    saturated_MPa: &'a [f64],
    curved_share: Option<f64>,
    curvature: &'a Option<Curvature>,
    dead: &'a [[usize; 2]],
    offset: &'a [f64],
    gain: &'a [f64],
    residuals: &'a [Residual],
}

/// Runs the command.
///
/// # Errors
/// A scene or recording that cannot be read, loads that give no table, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let scene = Scene::load(&arguments.scene)?;
    if let Some(presses) = &arguments.blind {
        return arguments.gains_of_presses(&scene, presses);
    }
    let load = |LoadFile { stress_MPa, path }: &LoadFile| -> Result<KnownLoad> {
        Ok(KnownLoad {
            stress_MPa: *stress_MPa,
            frames: Frame::load_all_as(path, Some(&scene), &arguments.layout.stated())?,
        })
    };
    let loads = arguments.loads.iter().map(load).collect::<Result<Vec<_>>>()?;
    let fit = LoadFit::new(&scene, &loads).map_err(|error| anyhow!("--load: {error}"))?;
    let table = arguments.out.as_ref().map(|out| out.display().to_string());
    let fields = fields(&fit, &scene, arguments)?;
    let stand = save(arguments, &scene, &fit.table, &fields)?;
    if !arguments.json {
        return Ok(report::calibration(&fit, &stand, &lines(&fields)));
    }
    let answer = CalibrationJson {
        scene: &scene.name,
        table,
        loads: loads.len(),
        noise_MPa: fit.noise_MPa,
        least_full_scale_MPa: fit.full_scale_MPa,
        saturated_MPa: &fit.saturated_MPa,
        curved_share: fit.curved_share(),
        curvature: &fit.curvature,
        dead: &fit.dead,
        offset: &fit.table.offset,
        gain: &fit.table.gain,
        residuals: &fit.residuals,
    };
    Ok(serde_json::to_string(&answer)? + "\n")
}

/// Writes table and fields where they belong; where they stand, in words.
///
/// # Errors
/// A file that cannot be written.
fn save(arguments: &Arguments, scene: &Scene, table: &Calibration, fields: &[Measured]) -> Result<String> {
    let Some(out) = &arguments.out else { return Ok(String::new()) };
    write(out, table.to_csv(&scene.sensor).as_bytes())?;
    let whither = match has_file(&arguments.scene) {
        true => {
            state(Path::new(&arguments.scene), fields)?;
            format!("written into {}", arguments.scene)
        }
        false => "for the scene".to_owned(),
    };
    Ok(format!("{}: offset and gain of {} taxels; {whither}", out.display(), table.gain.len()))
}

/// Step of the full scale in MPa.
const STEP: f64 = 1e-3;
/// Share of a full scale that the arithmetic may add.
const ROUNDING: f64 = 1e-12;

/// The fields of the scene that follow from a calibration.
fn fields(fit: &LoadFit, scene: &Scene, arguments: &Arguments) -> Result<Vec<Measured>> {
    let mut fields = Vec::new();
    fields.extend(table_field(arguments, "from readings under known loads")?);
    if let Some(curve) = curve(fit, scene)? {
        fields.push(Measured::new("input", "curve", curve, "the characteristic behind the table, [MPa by it, MPa]"));
    }
    fields.push(full_scale_field(fit.full_scale_MPa, scene, "at least; covers the readings of these loads")?);
    let mut dead = [&scene.input.dead[..], &fit.dead].concat();
    dead.sort_unstable();
    dead.dedup();
    if !fit.dead.is_empty() {
        // Rows and columns are small.
        let place = |place: &[usize; 2]| Value::Array(place.iter().map(|k| *k as i64).collect());
        let dead = Value::Array(dead.iter().map(place).collect());
        fields.push(Measured::new("input", "dead", dead, "readings do not follow the load"));
    }
    if let Some(noise_MPa) = fit.noise_MPa.filter(|noise_MPa| *noise_MPa > 0.0) {
        let noise_MPa = rounded(&format!("{noise_MPa:.2e}"))?;
        fields.push(Measured::new("search", "noise_floor_MPa", noise_MPa, "of one frame, as these loads show it"));
    }
    Ok(fields)
}

/// The field that names the table; none without a file for it.
fn table_field(arguments: &Arguments, remark: &str) -> Result<Option<Measured>> {
    let Some(out) = &arguments.out else { return Ok(None) };
    let table = beside_scene(out, Path::new(&arguments.scene))?;
    Ok(Some(Measured::new("input", "calibration", table, remark)))
}

/// The full scale that covers `least_MPa` and what the scene states.
fn full_scale_field(least_MPa: f64, scene: &Scene, remark: &str) -> Result<Measured> {
    // Rounded up, so that no reading is beyond it, but for the last bits of the arithmetic.
    let least = (least_MPa * (1.0 - ROUNDING) / STEP).ceil() * STEP;
    let full_scale_MPa = rounded(&format!("{:.3}", least.max(scene.input.full_scale_MPa.unwrap_or(0.0))))?;
    Ok(Measured::new("input", "full_scale_MPa", full_scale_MPa, remark))
}

/// The knots of a curved characteristic; none in place of an older curve.
fn curve(fit: &LoadFit, scene: &Scene) -> Result<Option<Value>> {
    let Some(Curvature { knots, .. }) = &fit.curvature else {
        return Ok((!scene.input.curve.is_empty()).then(|| Value::Array(Array::new())));
    };
    let knot = |knot: &[f64; 2]| -> Result<Value> {
        let figures = knot.iter().map(|figure| rounded(&format!("{figure:.5e}"))).collect::<Result<Array>>()?;
        Ok(Value::Array(figures))
    };
    Ok(Some(Value::Array(knots.iter().map(knot).collect::<Result<Array>>()?)))
}

/// The number that is shown so.
fn rounded(shown: &str) -> Result<f64> {
    shown.parse().map_err(|error| anyhow!("{shown}: {error}"))
}

/// The table as the scene's file names it: relative where it lies in the same folder, else absolute.
fn beside_scene(table: &Path, scene: &Path) -> Result<String> {
    let folder = |path: &Path| std::path::absolute(path).map(|path| path.parent().map(Path::to_owned));
    let same = folder(table).and_then(|own| Ok(own == folder(scene)?));
    let found = match same? {
        true => table.file_name().map(PathBuf::from).unwrap_or_else(|| table.to_owned()),
        false => std::path::absolute(table)?,
    };
    Ok(found.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const SENSOR: &str =
        "# my pad\n[sensor]\nrows = 2\ncols = 3\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3 # of foam\n";

    /// Counts under a stress, 8 frames in one form or the other: a taxel has 120 and more without load, 2000 and more per MPa;
    /// the last one does not follow.
    fn counts(stress_MPa: f64, a_line_per_frame: bool) -> String {
        let reading = |t: usize, k: usize| {
            120 + k + t % 2 + if k < 5 { (stress_MPa * (2000 + 100 * k) as f64) as usize } else { 0 }
        };
        let frame = |t: usize| {
            let cells: Vec<String> = (0..6).map(|k| reading(t, k).to_string()).collect();
            let rows = if a_line_per_frame {
                vec![cells.join(",")]
            } else {
                cells.chunks(3).map(|row| row.join(",")).collect()
            };
            rows.join("\n") + "\n"
        };
        (0..8).map(frame).collect()
    }

    /// The scene's text and what was printed after a calibration in a folder with these frames.
    fn calibrated(scene: &str, a_line_per_frame: bool, out: &str) -> (String, String) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).display().to_string();
        fs::write(at("pad.toml"), scene).unwrap();
        let load = |stress_MPa: f64| {
            let path = PathBuf::from(at(&format!("{stress_MPa}.csv")));
            fs::write(&path, counts(stress_MPa, a_line_per_frame)).unwrap();
            LoadFile { stress_MPa, path }
        };
        fs::create_dir(at("more")).unwrap();
        let loads = [0.0, 0.05, 0.1].map(load).to_vec();
        let arguments = Arguments {
            scene: at("pad.toml"),
            loads,
            blind: None,
            out: Some(at(out).into()),
            layout: LayoutArguments::default(),
            json: false,
        };
        let printed = run(&arguments).unwrap();
        let text = fs::read_to_string(at("pad.toml")).unwrap();
        // What is written is a scene that finds its table.
        let scene = Scene::load(&at("pad.toml")).unwrap();
        let table = Calibration::load(scene.input.calibration.as_ref().unwrap(), &scene.sensor).unwrap();
        assert!((table.gain[0] - 1.0 / 2000.0).abs() < 1e-6, "{table:?}");
        let place = folder.path().canonicalize().unwrap().display().to_string();
        (text.replace(&place, "FOLDER").replace(&folder.path().display().to_string(), "FOLDER"), printed)
    }

    #[test]
    fn fields_are_written_into_the_scene_whatever_form_the_frames_have() {
        let (text, printed) = calibrated(SENSOR, true, "table.csv");
        let written = text.strip_prefix(SENSOR).unwrap();
        for line in
            ["calibration = \"table.csv\"", "dead = [[1, 2]]", "noise_floor_MPa = 0.0002", "full_scale_MPa = 0.1"]
        {
            assert!(written.contains(line) && printed.contains(line), "{line}: {text}{printed}");
        }
        assert_eq!(calibrated(SENSOR, false, "table.csv").0, text);
        // Once more: nothing twice, and a comment stays.
        assert_eq!(calibrated(&text, true, "table.csv").0, text);
        let beside = calibrated(&text, true, "more/table.csv").0;
        assert!(beside.contains("calibration = \"FOLDER/more/table.csv\""), "{beside}");
    }

    #[test]
    fn what_the_scene_states_beyond_the_loads_stays() {
        let stated = format!("{SENSOR}\n[input]\nfull_scale_MPa = 0.7\ndead = [[0, 1]]\n\n[search]\nmu_max = 0.4\n");
        let (text, _) = calibrated(&stated, true, "table.csv");
        for line in ["full_scale_MPa = 0.7 ", "dead = [[0, 1], [1, 2]]", "mu_max = 0.4\nnoise_floor_MPa"] {
            assert!(text.contains(line), "{line}: {text}");
        }
    }
}
