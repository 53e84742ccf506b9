//! Comparison with published figures: Table 2 and run times, from the files in `golden/data/paper`.

use dermis_golden::result::errors::{Errors, SMALLEST_SHARE};
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::Condition;
use dermis_golden::spec::sensor::Sensor;
use dermis_study::paper::{run_times, table_2, RunTime};

use super::super::document::{
    count, empty_cell, median_percent, percent, percent_text, seconds, text_cell, two_digits, Cell, Item, Section,
    Table,
};
use super::super::measure::{ContactCount, Implementation, Measured};
use super::lookup::{case_text, find};

/// The section with Table 2 and the published run times.
pub fn published(measured: &[Measured]) -> Section {
    Section {
        id: "published",
        title: "Comparison with published figures".into(),
        items: vec![Item::Table(table_two(measured)), Item::Table(times(measured))],
    }
}

/// The paper's Table 2 next to the errors measured here, against truth and against case 0.
pub(super) fn table_two(measured: &[Measured]) -> Table {
    let head = [
        "sensor",
        "case",
        "contacts",
        "paper X1",
        "paper X2",
        "paper X3",
        "|X1| to truth",
        "|X2| to truth",
        "|X3| to truth",
        "|X1| to case 0",
        "|X2| to case 0",
        "|X3| to case 0",
        "bit-true |X1|",
        "bit-true |X2|",
        "bit-true |X3|",
        "frames",
    ];
    let parts = measured.iter().flat_map(|m| ContactCount::all_of(&m.frames).into_iter().map(move |of| (m, of)));
    let rows = parts.filter_map(|(m, contacts)| {
        let number = m.scene.name.strip_prefix("sensor-")?.parse().ok()?;
        let paper = table_2(number, m.scene.partition.case)?;
        let all = 0..m.frames.len();
        let frames: Vec<usize> = all.filter(|&frame| ContactCount::of(&m.frames[frame]) == contacts).collect();
        let whole = find(measured, &m.scene.name, Case::WHOLE);
        let to_whole: Vec<Option<Errors>> = match whole {
            None => Vec::new(),
            Some(whole) => {
                let pairs = whole.golden.iter().zip(&m.golden);
                pairs.map(|(whole, own)| Some(Errors::new(whole.resultant_N, own.resultant_N))).collect()
            }
        };
        let mut row = vec![text_cell(m.scene.name.clone()), text_cell(case_text(m.scene.partition.case))];
        row.push(text_cell(contacts.name()));
        row.extend(paper.map(|x| percent(Some(x))));
        for errors in [m.errors(Implementation::Golden), to_whole, m.errors(Implementation::Fixed)] {
            let error = |frame: usize, k: usize| errors.get(frame)?.as_ref()?.axes()[k].map(f64::abs);
            row.extend((0..3).map(|k| median_percent(frames.iter().map(|&frame| error(frame, k)))));
        }
        row.push(count(frames.len() as u64));
        Some(row)
    });
    let condition = match measured.first().map(|m| m.scene.partition.condition).unwrap_or_default() {
        Condition::BothSigns => "compression and tension both exceed the noise floor, the paper's centroid condition",
        Condition::Loaded => {
            "some stress exceeds the noise floor, not under the paper's centroid condition (dermis report --paper has it)"
        }
    };
    let caption = format!(
        "The paper's Table 2 (one frame; sensors 1, 2: against finite elements; 3, 4: against case 0) next to the \
         golden and the bit-true model (median of |X| over the frames with one contact and with several). Condition \
         here: a subarray is searched where {condition}. Left out of the relative errors: a component below {} of the \
         reference force",
        percent_text(SMALLEST_SHARE)
    );
    Table::new("table-2", caption, &head, rows.collect())
}

/// The published run times next to those measured here.
pub(super) fn times(measured: &[Measured]) -> Table {
    let head = [
        "published for",
        "case",
        "published by",
        "published",
        "literal Eq. 1, CPU",
        "golden search, CPU",
        "golden evidence, CPU",
        "bit-true search, CPU",
        "hardware",
        "published / golden search",
        "published / hardware",
        "source",
    ];
    let rows = run_times().into_iter().map(|published| {
        let own = measured.iter().find(|m| fits(m, &published));
        let time = |engine: Implementation| own.and_then(|m| m.point(engine)).map(|point| point.seconds);
        let ratio = |engine: Implementation| match time(engine) {
            None => empty_cell(),
            Some(own) => {
                let ratio = published.seconds / own;
                Cell { shown: format!("{} ×", two_digits(ratio)), number: Some(ratio) }
            }
        };
        let case = published.case.map_or_else(empty_cell, |case| text_cell(case_text(case)));
        let mut row = vec![text_cell(published.sensor.clone()), case, text_cell(published.system.clone())];
        row.push(seconds(Some(published.seconds)));
        row.extend(Implementation::ALL.map(|engine| seconds(time(engine))));
        row.extend([
            ratio(Implementation::Golden),
            ratio(Implementation::Hardware),
            text_cell(published.source.clone()),
        ]);
        row
    });
    let caption =
        "Published run times next to those of this run, which are per frame, with the matrices computed beforehand \
                   (dermis report --paper, Fig. 7, includes the matrices)";
    Table::new("run-times", caption, &head, rows.collect())
}

/// Whether a published time is for an array of this shape in this case.
fn fits(m: &Measured, published: &RunTime) -> bool {
    let Sensor { rows, cols, .. } = m.scene.sensor;
    published.sensor.contains(&format!("{rows}x{cols}")) && published.case == Some(m.scene.partition.case)
}
