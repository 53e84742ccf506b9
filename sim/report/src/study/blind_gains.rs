//! Gains found from presses of unknown load, on drawn arrays whose gains are known.

use anyhow::Result;
use dermis_golden::spec::scene::Scene;
use dermis_study::noise::outcome::Summary;
use dermis_study::noise::{blind_study, BlindRow, BlindStudy};

use super::super::table::{aligned, percent};
use dermis_flow::progress::Progress;

/// Explanation of the cells.
const LEGEND: &str = "rough, smooth: root mean square of the part of the log gains that presses show, and of the one that they do \
                      not, before → with the table; estimated: the rough part and the least that is left of it, from the recording alone; e_t: median / \
                      nine of ten of frames of the same array";

/// The table of a scene, or JSON.
///
/// # Errors
/// A scene that cannot be loaded, and as [`blind_study`].
pub fn run(scene: &str, study: &BlindStudy, json: bool) -> Result<String> {
    let scene = Scene::load(scene)?;
    let bar = Progress::share("gains");
    let share = |done: usize, all: usize| bar.set_share(done as f64 / all as f64);
    let rows = blind_study(&scene, study, &share)?;
    drop(bar);
    if json {
        return Ok(serde_json::to_string(&rows)? + "\n");
    }
    let head = ["spread", "presses", "rough", "smooth", "estimated", "e_t, exact gains", "no table", "table found"];
    let refused = rows
        .iter()
        .filter_map(|row| Some(format!("spread {}: {}\n", percent(Some(row.spread)), row.refused.as_ref()?)));
    let refused: String = refused.collect();
    Ok(format!("{}\n{LEGEND}\n{refused}", aligned(2, &head, rows.iter().map(line).collect())))
}

fn line(row: &BlindRow) -> Vec<String> {
    let share = |value: f64| percent(Some(value));
    let parts =
        |k: usize| format!("{} → {}", share(row.before[k]), row.after.map_or("-".to_owned(), |after| share(after[k])));
    let errors = |summary: &Summary| {
        format!("{} / {}", share(summary.tangential.median.value), share(summary.tangential.ninety.value))
    };
    let estimated =
        row.estimated.map_or("-".to_owned(), |[before, after]| format!("{} → {}", share(before), share(after)));
    let found = row.with.as_ref().map_or("refused".to_owned(), errors);
    vec![
        share(row.spread),
        row.presses.to_string(),
        parts(0),
        parts(1),
        estimated,
        errors(&row.exact),
        errors(&row.without),
        found,
    ]
}
