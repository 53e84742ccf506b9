//! The paper's figures and tables, reproduced: Figs. 1 and 3 to 7, Table 2, the operation counts of its section 4, and
//! a check of its conclusions.

use std::time::Instant;

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::words::schedule::vectors;
use dermis_golden::physics::matrices::cache;
use dermis_golden::spec::partition::Case;
use dermis_study::paper::conclusions;

use super::super::document::{
    count, empty_cell, percent, seconds, text_cell, two_digits, Cell, Item, Picture, Section, Table,
};
use super::super::measure::{Implementation, Measured, Options};
use super::super::pictures::{bars, force_field, stress_map, Bars, Outline};
use super::super::style::SERIES;
use super::fields::field_pictures;
use super::lookup::{case_text, find, scenes};
use super::published::{table_two, times};
use super::ratios;
use dermis_flow::progress::Progress;
use dermis_golden::quantile::median;

/// Figures of forces: number, sensor, case, and the shipped frame that corresponds to the paper's.
const FIELDS: [(&str, &str, i64, &str); 8] = [
    ("Fig. 4a", "sensor-1", 2, "S1-hs-hertz"),
    ("Fig. 4b", "sensor-2", 3, "S2-hs-ring"),
    ("Fig. 5a", "sensor-3", 0, "S3-hs-three"),
    ("Fig. 5b", "sensor-3", 1, "S3-hs-three"),
    ("Fig. 6a", "sensor-4", 0, PLANTAR),
    ("Fig. 6b", "sensor-4", 1, PLANTAR),
    ("Fig. 6c", "sensor-4", 2, PLANTAR),
    ("Fig. 6d", "sensor-4", 3, PLANTAR),
];
const PLANTAR: &str = "s4-plantar-two-feet";
/// Repeats of each case, as in Fig. 7.
const REPEATS: usize = 3;

/// All sections.
///
/// # Errors
/// A picture that cannot be written, a frame that cannot be reconstructed, an interruption.
pub fn paper(measured: &[Measured], options: &Options) -> Result<Vec<Section>> {
    let mut sections = vec![figure_1(measured)?, figure_3(measured)?];
    for (id, title, from) in
        [("fig-4", "Fig. 4", "Fig. 4"), ("fig-5", "Fig. 5", "Fig. 5"), ("fig-6", "Fig. 6", "Fig. 6")]
    {
        sections.push(figure_of_fields(measured, id, title, from)?);
    }
    sections.push(figure_7(measured, options)?);
    let one = |id, title: &str, table| Section { id, title: title.into(), items: vec![Item::Table(table)] };
    sections.push(one("table-2-section", "Table 2", table_two(measured)));
    sections.push(one("published", "Run times of section 4", times(measured)));
    sections.push(Section {
        id: "operations",
        title: "Operation counts of section 4".into(),
        items: vec![
            Item::Text(
                "The paper counts (3 n)² operations for a subarray of n taxels. Eq. 1 as printed takes 3 n² \
                 multiplications for C†b and (3 n)² for I − C†C, in every subarray and for every candidate μ. With \
                 the series in μ the matrix products are computed once per frame, with n² / 4 multiplications each \
                 after folding by the two mirror symmetries; a candidate needs no matrix product."
                    .into(),
            ),
            Item::Table(operations(measured)),
        ],
    });
    sections.push(one("conclusions", "Check of the paper's conclusions", conclusions_table(measured)));
    Ok(sections)
}

fn figure_1(measured: &[Measured]) -> Result<Section> {
    let mut items = vec![Item::Text(
        "The function S of Eq. 2 as stress on 10×10 taxels. With the first taxel as origin and a pitch of 4 mm in x \
         and 2 mm in y it ranges from −16 145 to 36 000 N/m²; the paper prints −36 000 to 20 912, which no origin or \
         sign tried here reproduces. Eq. 2 does not describe a contact, so that there is no true force."
            .into(),
    )];
    if let Some(m) = find(measured, "sensor-1", Case::WHOLE) {
        let frame = Frame::eq2(&m.scene.sensor);
        let result = m.engine.run(&frame)?;
        let outline = Outline { subarrays: &result.subarrays, centroids: true, contacts: &[] };
        let forces = &result.forces_N;
        let peaks = [
            forces.fz.iter().fold(0.0, |peak: f64, f| peak.max(f.abs())),
            forces.fx.iter().zip(&forces.fy).fold(0.0, |peak: f64, (x, y)| peak.max(x.hypot(*y))),
        ];
        let picture =
            |name: &str, svg| Picture { id: format!("fig-1-{name}"), caption: format!("Fig. 1: {name}"), svg };
        items.push(Item::Pictures(vec![
            picture("stress", stress_map(&m.scene.sensor, &frame.stress_MPa, outline)?),
            picture("forces", force_field(&m.scene.sensor, forces, peaks, Outline { centroids: false, ..outline })?),
        ]));
    }
    Ok(Section { id: "fig-1", title: "Fig. 1: Eq. 2 on sensor 1".into(), items })
}

/// Index of the frame that corresponds to the paper's on a sensor.
fn frame_of(m: &Measured) -> usize {
    FIELDS.iter().find(|field| field.1 == m.scene.name).map_or(0, |field| m.frame(field.3))
}

fn figure_3(measured: &[Measured]) -> Result<Section> {
    let mut pictures = Vec::new();
    for scene in scenes(measured).into_iter().filter(|name| FIELDS.iter().any(|field| field.1 == *name)) {
        let own: Vec<&Measured> = measured.iter().filter(|m| m.scene.name == scene).collect();
        pictures.push(ratios::picture(scene, &own, frame_of, "fig-3")?);
    }
    let text = "Both bars are zero where the centroid condition is not met, as in the paper.";
    let items = vec![Item::Text(text.into()), Item::Pictures(pictures)];
    Ok(Section { id: "fig-3", title: "Fig. 3: μ per subarray and case".into(), items })
}

fn figure_of_fields(measured: &[Measured], id: &'static str, title: &str, from: &str) -> Result<Section> {
    let mut items = Vec::new();
    for (number, scene, case, frame) in FIELDS.iter().filter(|field| field.0.starts_with(from)) {
        let Some(m) = Case::numbered(*case).and_then(|case| find(measured, scene, case)) else {
            items.push(Item::Text(format!("{number}: {scene}, case {case} was not measured in this run.")));
            continue;
        };
        let mut pictures = field_pictures(m, m.frame(frame), &number.to_lowercase().replace(". ", "-"))?;
        pictures.iter_mut().for_each(|picture| picture.caption = format!("{number}: {}", picture.caption));
        items.push(Item::Pictures(pictures));
    }
    Ok(Section { id, title: format!("{title}: reconstructed forces"), items })
}

/// Fig. 7: three repeats of computing the matrices and one frame in each case, as in the paper.
fn figure_7(measured: &[Measured], options: &Options) -> Result<Section> {
    let cases: Vec<&Measured> = measured.iter().filter(|m| m.scene.name == "sensor-4").collect();
    let bar = Progress::steps("Fig. 7", (REPEATS * cases.len()) as u64);
    // Without the matrix cache, so that computing the matrices is measured.
    cache::set_folder(None);
    let mut all: Vec<[f64; REPEATS]> = Vec::new();
    for m in &cases {
        let mut repeats = [0.0; REPEATS];
        for (k, repeat) in repeats.iter_mut().enumerate() {
            options.interrupt.check()?;
            let start = Instant::now();
            Golden::new(&m.scene)?.run(&m.frames[m.frame(PLANTAR)])?;
            *repeat = start.elapsed().as_secs_f64();
            bar.set((REPEATS * all.len() + k + 1) as u64);
        }
        all.push(repeats);
    }
    let published = dermis_study::paper::run_times();
    let printed = |m: &Measured| {
        let same =
            |p: &&dermis_study::paper::RunTime| p.sensor.contains("48x48") && p.case == Some(m.scene.partition.case);
        published.iter().find(same).map(|p| p.seconds)
    };
    let group = |(m, repeats): (&&Measured, &[f64; REPEATS])| {
        let values = [printed(m)].into_iter().chain(repeats.iter().map(|s| Some(*s))).collect();
        (format!("case {}", m.scene.partition.case), values)
    };
    let names = ["the paper", "first repeat", "second", "third"];
    let plot = Bars {
        axis: "s, matrices and one frame".into(),
        groups: cases.iter().zip(&all).map(group).collect(),
        series: names.iter().zip(&SERIES).map(|(name, colour)| ((*name).to_owned(), *colour)).collect(),
        text: super::super::document::seconds_text,
        limit: None,
        names_above: false,
        log: true,
    };
    let picture = Picture {
        id: "fig-7".into(),
        caption: "Fig. 7: time of a 48×48 frame with its matrices, golden model".into(),
        svg: bars(&plot)?,
    };
    let middle = |repeats: &[f64; REPEATS]| median(repeats.to_vec());
    let whole = cases.iter().zip(&all).find(|(m, _)| m.scene.partition.case == Case::WHOLE);
    let faster = |whole: Option<f64>, seconds: Option<f64>| match (whole, seconds) {
        (Some(whole), Some(seconds)) => {
            Cell { shown: format!("{} ×", two_digits(whole / seconds)), number: Some(whole / seconds) }
        }
        _ => empty_cell(),
    };
    let rows = cases.iter().zip(&all).map(|(m, repeats)| {
        let mut row = vec![text_cell(case_text(m.scene.partition.case)), seconds(printed(m))];
        row.extend(repeats.map(|s| seconds(Some(s))));
        row.push(faster(whole.and_then(|(m, _)| printed(m)), printed(m)));
        row.push(faster(whole.and_then(|(_, repeats)| middle(repeats)), middle(repeats)));
        let frame = |engine| m.point(engine).map(|point| point.seconds);
        row.extend([seconds(frame(Implementation::Golden)), seconds(frame(Implementation::Hardware))]);
        row
    });
    let head = [
        "case",
        "the paper",
        "golden, repeat 1",
        "repeat 2",
        "repeat 3",
        "the paper: faster than case 0",
        "golden: faster than case 0",
        "golden, a frame alone",
        "hardware, a frame",
    ];
    let table = Table::new("fig-7-table", "Time of a 48×48 frame", &head, rows.collect());
    let text =
        "The columns \"faster than case 0\" show the paper's conclusion that subarrays shorten the response, with its \
                times and with those measured here.";
    let items = vec![Item::Pictures(vec![picture]), Item::Text(text.into()), Item::Table(table)];
    Ok(Section { id: "fig-7-section", title: "Fig. 7: response time, three repeats".into(), items })
}

fn operations(measured: &[Measured]) -> Table {
    let head = [
        "case",
        "subarrays",
        "n per subarray",
        "the paper's (3 n)²",
        "Eq. 1 per candidate, all subarrays",
        "degree of p(μ)",
        "ours per frame, folded, all subarrays",
        "Eq. 1 per candidate / ours per frame",
    ];
    let of_sensor_4 = measured.iter().filter(|m| m.scene.name == "sensor-4");
    let rows = of_sensor_4.filter_map(|m| Some((m, m.engine.matrices()?))).map(|(m, matrices)| {
        let n = matrices.sensor.taxels() as u64;
        let parts = m.scene.sensor.taxels() as u64 / n;
        let literal = parts * (3 * n * n + 9 * n * n);
        // One product for Cz⁺; for each further v_ij one if i or j is 0, else two.
        let products = |degree: usize| 1 + 2 * (vectors(degree) as u64 - 1) - 2 * degree as u64;
        let ours = parts * products(matrices.degree) * n * n / 4;
        vec![
            text_cell(case_text(m.scene.partition.case)),
            count(parts),
            count(n),
            Cell { shown: format!("{}² = {}", 3 * n, 9 * n * n), number: Some((9 * n * n) as f64) },
            count(literal),
            count(matrices.degree as u64),
            count(ours),
            Cell {
                shown: format!("{} ×", two_digits(literal as f64 / ours as f64)),
                number: Some(literal as f64 / ours as f64),
            },
        ]
    });
    Table::new("operations-table", "Multiplications for 48×48 taxels", &head, rows.collect())
}

/// The paper's best case per sensor next to the best one measured here.
fn conclusions_table(measured: &[Measured]) -> Table {
    let head = [
        "sensor",
        "the paper's best",
        "shear error there",
        "best here",
        "shear error there",
        "best of the cut cases here",
        "shear error there",
        "holds",
        "the paper's words",
    ];
    let rows = conclusions().into_iter().map(|conclusion| {
        let name = format!("sensor-{}", conclusion.sensor);
        let own = measured.iter().filter(|m| m.scene.name == name);
        let errors: Vec<(Case, f64)> =
            own.filter_map(|m| Some((m.scene.partition.case, m.point(Implementation::Golden)?.tangential?))).collect();
        let least = |cut: bool| {
            let all = errors.iter().filter(|(case, _)| !cut || *case != Case::WHOLE);
            all.min_by(|a, b| a.1.total_cmp(&b.1)).copied()
        };
        let cells = |found: Option<(Case, f64)>| match found {
            Some((case, error)) => [text_cell(case_text(case)), percent(Some(error))],
            None => [empty_cell(), empty_cell()],
        };
        let theirs = errors.iter().find(|(case, _)| *case == conclusion.best).copied();
        // Where the paper calls a case with subarrays best, it is compared with such cases only: case 0 is its
        // reference.
        let cut = conclusion.best != Case::WHOLE;
        let holds = least(cut).is_some_and(|(case, _)| case == conclusion.best);
        let mut row = vec![text_cell(name)];
        row.extend([text_cell(case_text(conclusion.best)), percent(theirs.map(|(_, error)| error))]);
        row.extend(cells(least(false)));
        row.extend(cells(least(true)));
        row.extend([text_cell(if holds { "yes" } else { "no" }), text_cell(conclusion.text)]);
        row
    });
    let caption =
        "The best case according to the paper, and the case with the smallest median shear error here (golden model \
                   under the paper's condition, against the true force)";
    Table::new("judged", caption, &head, rows.collect())
}
