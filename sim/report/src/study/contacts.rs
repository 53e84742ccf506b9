//! Several contacts, each sheared its own way: case 0, which has one μ, `adaptive`, which has one per rectangle, and
//! `contacts`, which has one per contact, on drawn frames of two to four contacts.

use anyhow::{ensure, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Scene;

use super::super::table::{aligned, percent};
use super::super::tabulate::{contact_shears, shear_over_all};
use crate::drawn_frames::{DrawnFrames, Shapes};
use dermis_flow::progress::Progress;
use dermis_golden::quantile::{median, quantile};

/// The scene: its array holds four contacts.
const SCENE: &str = "sensor-3";
/// Frames of a line.
const FRAMES: u32 = 120;
/// Contacts on the frames, in turn.
const CONTACTS: [u8; 3] = [2, 3, 4];
/// Labels, shapes, and whether the contacts touch.
const LINES: [(&str, Shapes, bool); 4] = [
    ("ellipses", Shapes::Elliptic, false),
    ("ellipses, touching", Shapes::Elliptic, true),
    ("other shapes", Shapes::Other, false),
    ("other shapes, touching", Shapes::Other, true),
];
/// Quantiles of the error.
const SHARES: [f64; 2] = [0.5, 0.9];

/// The table, of the lines that begin with one of `names`, all where there is none.
///
/// # Errors
/// A name that no line begins with; a frame that the golden model refuses.
pub fn run(names: &[String]) -> Result<String> {
    let begins = |label: &str, name: &String| label.starts_with(name.as_str());
    for name in names {
        let known = LINES.map(|(label, ..)| label).join("; ");
        ensure!(LINES.iter().any(|(label, ..)| begins(label, name)), "contacts: no line {name:?}; known: {known}");
    }
    let scene = Scene::builtin(SCENE)?;
    let cases = [Case::WHOLE, Case::Adaptive, Case::Contacts];
    let engine = |case: Case| {
        let mut scene = scene.clone().with_chosen_hardware();
        scene.partition.case = case;
        Golden::reference(&scene)
    };
    let engines = cases.into_iter().map(engine).collect::<Result<Vec<Golden>, _>>()?;
    let mut rows = Vec::new();
    for (label, shapes, touching) in LINES {
        if !names.is_empty() && !names.iter().any(|name| begins(label, name)) {
            continue;
        }
        let _progress = Progress::start(&format!("{}: {label}", scene.name));
        let frames =
            DrawnFrames { frames: FRAMES, contacts: CONTACTS.to_vec(), shapes, touching, seed: 1 }.draw(&scene)?;
        let mut row = vec![label.to_owned()];
        let mut each = Vec::new();
        for engine in &engines {
            let results: Vec<Reconstruction> =
                frames.iter().map(|frame| engine.run(frame)).collect::<Result<_, _>>()?;
            let pairs = || frames.iter().zip(&results);
            let error = |(frame, result): (&Frame, &Reconstruction)| {
                shear_over_all(&frame.contacts, frame.resultant_N, result.resultant_N)
            };
            let errors: Vec<f64> = pairs().filter_map(error).collect();
            row.extend(SHARES.map(|share| percent(quantile(errors.clone(), share))));
            let regions = |(frame, result): (&Frame, &Reconstruction)| {
                result.extra.regions.as_ref().map_or(Vec::new(), |regions| contact_shears(&frame.contacts, regions))
            };
            each.extend(pairs().flat_map(regions));
        }
        row.push(percent(median(each)));
        rows.push(row);
    }
    let head = [
        "contacts",
        "case 0, median",
        "case 0, 90 %",
        "`adaptive`, median",
        "`adaptive`, 90 %",
        "`contacts`, median",
        "`contacts`, 90 %",
        "`contacts`, each contact's own, median",
    ];
    let legend = format!(
        "{SCENE}, {FRAMES} frames of {CONTACTS:?} contacts a line: error of the whole shear over Σ|t|, median and what \
         nine of ten do not exceed; each contact's own: error of its shear over that shear"
    );
    Ok(format!("{}\n{legend}\n", aligned(1, &head, rows)))
}
