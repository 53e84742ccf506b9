//! Frames that a sensor's faults spoil, by engine: flagged, silently wrong, right. Faults that one frame cannot tell, and
//! clean frames, have tables of their own; the last table has the sums.

use anyhow::Result;
use dermis_golden::spec::scene::Scene;
use dermis_study::sensor_faults::{sensor_faults, Counts, FaultRow, Kind, SensorFaults, ENGINES};
use serde::Serialize;

use super::super::table::{aligned, percent};
use dermis_flow::progress::Progress;

/// Scenes of the table.
const SCENES: [&str; 2] = ["sensor-1", "eight-by-eight"];
/// Explanation of the cells.
const LEGEND: &str =
    "flagged / silently wrong / right; wrong: e_t > 20 %, e_n > 10 %, or a force where nothing presses; worst z: \
                      largest error over its standard deviation without a flag";

/// The sums of one engine over the faults that frames show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sum {
    /// Name of the engine, and whether the frame is alone or in a stream.
    pub engine: &'static str,
    /// Over faults that a frame shows.
    pub shown: Counts,
    /// Over faults that another force explains.
    pub hidden: Counts,
    /// Over clean frames.
    pub clean: Counts,
}

/// The sums of all engines.
pub fn sums(rows: &[FaultRow]) -> Vec<Sum> {
    let of = |path: usize, kinds: &[Kind]| {
        let own = rows.iter().filter(|row| kinds.contains(&row.kind)).map(|row| row.engines[path]);
        own.fold(Counts::default(), Counts::plus)
    };
    let sum = |(path, engine): (usize, &dermis_study::sensor_faults::Path)| Sum {
        engine: engine.name(),
        shown: of(path, &[Kind::Shown, Kind::NoContact]),
        hidden: of(path, &[Kind::Hidden]),
        clean: of(path, &[Kind::Clean]),
    };
    ENGINES.iter().enumerate().map(sum).collect()
}

/// Measures the scenes, those of the guide where there are none: tables, or JSON.
///
/// # Errors
/// A scene that cannot be loaded, and as [`sensor_faults`].
pub fn run(scenes: &[String], study: &SensorFaults, json: bool) -> Result<String> {
    let names: Vec<&str> = match scenes {
        [] => SCENES.to_vec(),
        names => names.iter().map(String::as_str).collect(),
    };
    let scenes = names.into_iter().map(Scene::load).collect::<Result<Vec<_>, _>>()?;
    let bar = Progress::steps("sensor faults", 0);
    let rows = sensor_faults(&scenes, study, &|done, total| bar.set_of(done as u64, total as u64))?;
    drop(bar);
    match json {
        true => Ok(serde_json::to_string(&serde_json::json!({ "rows": rows, "sums": sums(&rows) }))? + "\n"),
        false => Ok(text(&rows)),
    }
}

fn text(rows: &[FaultRow]) -> String {
    let engines: Vec<&str> = ENGINES.iter().map(|engine| engine.name()).collect();
    let head = [&["fault", "size", "frames"], &engines[..]].concat();
    let line = |row: &FaultRow| {
        let cells = row.engines.iter().map(|of| format!("{}/{}/{}", of.flagged, of.silent, of.right));
        let frames = row.engines[0].frames.to_string();
        [row.fault.to_owned(), row.size.clone(), frames].into_iter().chain(cells).collect()
    };
    let table = |kinds: &[Kind]| {
        let own = rows.iter().filter(|row| kinds.contains(&row.kind)).map(line).collect();
        aligned(2, &head, own)
    };
    let shown = table(&[Kind::Shown, Kind::NoContact]);
    let hidden = format!("Not told from another force by one frame:\n\n{}", table(&[Kind::Hidden]));
    let clean = format!("Clean frames, where a flag is a false alarm:\n\n{}", table(&[Kind::Clean]));
    let z = |counts: &Counts| counts.worst_z.map_or("-".to_owned(), |z| format!("{z:.1}"));
    let sum = |Sum { engine, shown, hidden, clean }: Sum| {
        let share = |share: f64| percent(Some(share));
        let (engine, given_as) = engine.rsplit_once(", ").unwrap_or((engine, ""));
        vec![
            engine.to_owned(),
            given_as.to_owned(),
            shown.frames.to_string(),
            shown.flagged.to_string(),
            shown.silent.to_string(),
            shown.right.to_string(),
            share(shown.silent_share()),
            z(&shown),
            share(hidden.silent_share()),
            share(clean.flagged_share()),
        ]
    };
    let head = [
        "engine",
        "given as",
        "frames",
        "flagged",
        "silently wrong",
        "right",
        "silently wrong, share",
        "worst z",
        "not told, silently wrong",
        "clean, flagged",
    ];
    let all = aligned(2, &head, sums(rows).into_iter().map(sum).collect());
    format!("{shown}\n{hidden}\n{clean}\nSums:\n\n{all}\n{LEGEND}\n")
}
