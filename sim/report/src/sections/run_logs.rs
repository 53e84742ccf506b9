//! Counts of the long test runs saved in the build folder.

use super::super::document::{count, seconds, text_cell, Cell, Item, Section, Table};
use crate::run_log::{RunLog, TargetCounts};

/// The section with the counts of long test runs.
pub fn run_logs(all: &[RunLog]) -> Section {
    let item = match all {
        [] => Item::Text(
            "The build folder contains no counts of long test runs yet; `make fuzz`, `dermis stress` and `dermis \
             faults` save them."
                .into(),
        ),
        all => {
            let head = ["command", "what", "unit", "tried", "time", "outcomes"];
            let rows = all.iter().flat_map(|run| run.targets.iter().map(move |target| row(run, target)));
            let caption = "Counts of the last run of each command with this build folder";
            Item::Table(Table::new("tried", caption, &head, rows.collect()))
        }
    };
    Section { id: "tried", title: "Inputs tried".into(), items: vec![item] }
}

fn row(run: &RunLog, target: &TargetCounts) -> Vec<Cell> {
    vec![
        text_cell(run.command.clone()),
        text_cell(target.target.clone()),
        text_cell(target.unit.clone()),
        count(target.count),
        seconds(Some(target.seconds)),
        text_cell(target.outcomes_text()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_logs_become_a_table() {
        assert!(matches!(run_logs(&[]).items[..], [Item::Text(_)]));
        let mut run = RunLog::new("make fuzz");
        run.targets.push(TargetCounts {
            target: "scene".into(),
            unit: "inputs".into(),
            count: 12,
            outcomes: [("refused".to_owned(), 12)].into(),
            seconds: 0.5,
        });
        let Item::Table(table) = &run_logs(&[run]).items[0] else { panic!("no table") };
        assert_eq!((table.rows[0][3].number, table.rows[0][5].shown.as_str()), (Some(12.0), "12 refused"));
    }
}
