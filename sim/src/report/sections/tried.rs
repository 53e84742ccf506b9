//! What long runs in this build folder have tried and found.

use super::super::document::{count, seconds, words, Cell, Item, Section, Table};
use crate::tried::{Line, Tried};

/// The section.
pub fn tried(all: &[Tried]) -> Section {
    let item = match all {
        [] => Item::Text(
            "No long run has left its counts in the build folder yet; `make fuzz`, `dermis stress` and
                          `dermis faults` do."
                .into(),
        ),
        all => {
            let head = ["command", "what", "unit", "tried", "time", "outcomes"];
            let rows = all.iter().flat_map(|run| run.lines.iter().map(move |line| row(run, line)));
            let caption = "Counts that the last run of each command in the build folder left behind";
            Item::Table(Table::new("tried", caption, &head, rows.collect()))
        }
    };
    Section { id: "tried", title: "Inputs tried".into(), items: vec![item] }
}

fn row(run: &Tried, line: &Line) -> Vec<Cell> {
    vec![
        words(run.command.clone()),
        words(line.what.clone()),
        words(line.unit.clone()),
        count(line.tried),
        seconds(Some(line.seconds)),
        words(line.outcome()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_tried_is_a_table_once_there_is_any() {
        assert!(matches!(tried(&[]).items[..], [Item::Text(_)]));
        let mut run = Tried::new("make fuzz");
        run.lines.push(Line {
            what: "scene".into(),
            unit: "inputs".into(),
            tried: 12,
            outcomes: [("refused".to_owned(), 12)].into(),
            seconds: 0.5,
        });
        let Item::Table(table) = &tried(&[run]).items[0] else { panic!("no table") };
        assert_eq!((table.rows[0][3].number, table.rows[0][5].shown.as_str()), (Some(12.0), "12 refused"));
    }
}
