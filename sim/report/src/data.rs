//! A document as Markdown and JSON, and its tables as CSV.

use serde_json::{json, Value};

use super::csv::quoted;
use super::document::{Cell, Document, Item, Picture, Section, Table};

/// The document as Markdown; pictures are references to files.
pub fn text(document: &Document) -> String {
    let mut text = format!("# {}\n\n", document.title);
    document.intro.iter().for_each(|paragraph| text.push_str(&format!("{paragraph}\n\n")));
    for section in &document.sections {
        text.push_str(&format!("## {}\n\n", section.title));
        for item in &section.items {
            match item {
                Item::Text(paragraph) => text.push_str(&format!("{paragraph}\n\n")),
                Item::Table(table) => text.push_str(&format!("{}:\n\n{}\n", table.caption, markdown(table))),
                Item::Pictures(all) => {
                    for picture in all {
                        let path = path_of_picture(document, &picture.id);
                        text.push_str(&format!("![{}]({path})\n\n", picture.caption));
                    }
                }
            }
        }
    }
    text
}

/// Path of a picture, relative to the document's folder.
pub fn path_of_picture(document: &Document, id: &str) -> String {
    format!("{}-pictures/{id}.svg", document.name)
}

/// Path of a table, relative to the document's folder.
pub fn path_of_table(document: &Document, id: &str) -> String {
    format!("{}-tables/{id}.csv", document.name)
}

/// A table as Markdown, with numbers right-aligned.
pub fn markdown(table: &Table) -> String {
    let texts = (0..table.head.len()).take_while(|column| !table.is_number(*column)).count();
    let rows = table.rows.iter().map(|row| row.iter().map(|cell| cell.shown.clone()).collect());
    super::table::aligned(texts, &table.head, rows.collect())
}

/// A table as CSV: numbers with full precision, fractions instead of percent, empty fields for missing values.
pub fn csv(table: &Table) -> String {
    let line = |fields: &mut dyn Iterator<Item = String>| fields.collect::<Vec<_>>().join(",") + "\n";
    let mut text = line(&mut table.head.iter().map(|head| quoted(head)));
    for row in &table.rows {
        text.push_str(&line(&mut row.iter().map(|cell| match cell.number {
            Some(number) => number.to_string(),
            None if *cell == super::document::empty_cell() => String::new(),
            None => quoted(&cell.shown),
        })));
    }
    text
}

/// The document as JSON.
pub fn document(document: &Document) -> Value {
    let cell = |cell: &Cell| match cell.number {
        Some(number) => json!(number),
        None if *cell == super::document::empty_cell() => Value::Null,
        None => json!(cell.shown),
    };
    let table = |table: &Table| {
        let rows: Vec<Vec<Value>> = table.rows.iter().map(|row| row.iter().map(cell).collect()).collect();
        json!({ "table": table.id, "caption": table.caption, "head": table.head, "rows": rows })
    };
    let item = |item: &Item| match item {
        Item::Text(text) => vec![json!({ "text": text })],
        Item::Table(one) => vec![table(one)],
        Item::Pictures(all) => {
            let one = |p: &Picture| {
                let file = path_of_picture(document, &p.id);
                json!({ "picture": p.id, "caption": p.caption, "file": file })
            };
            all.iter().map(one).collect()
        }
    };
    let section = |section: &Section| {
        let items: Vec<Value> = section.items.iter().flat_map(item).collect();
        json!({ "id": section.id, "title": section.title, "items": items })
    };
    let sections: Vec<Value> = document.sections.iter().map(section).collect();
    json!({ "title": document.title, "intro": document.intro, "sections": sections })
}

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::super::document::{empty_cell, percent, text_cell};
    use super::*;

    fn one() -> Table {
        Table::new(
            "t",
            "errors",
            &["scene", "e_t"],
            vec![vec![text_cell("a, \"b\""), percent(Some(0.1 + 0.2))], vec![text_cell("c"), empty_cell()]],
        )
    }

    #[test]
    fn csv_and_json_hold_numbers_with_full_precision() {
        let (head, rows) = csv_reader::csv(&csv(&one()));
        assert_eq!(
            (csv_reader::field(&head, &rows[0], "e_t"), csv_reader::field(&head, &rows[1], "e_t")),
            ("0.30000000000000004", "")
        );
        assert!(csv(&one()).contains("\"a, \"\"b\"\"\""));
        let section = Section { id: "s", title: "S".into(), items: vec![Item::Table(one())] };
        let whole = Document { name: "report", title: "T".into(), intro: vec![], sections: vec![section] };
        let value = document(&whole);
        assert_eq!(value.pointer("/sections/0/items/0/rows/0/1"), Some(&json!(0.1 + 0.2)));
        assert_eq!(value.pointer("/sections/0/items/0/rows/1/1"), Some(&Value::Null));
        assert!(text(&whole).contains("| a, \"b\" | 30.0 % |"));
    }
}
