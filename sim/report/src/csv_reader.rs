//! CSV parser for the tests of the CSV writers.

/// Header and records of a CSV text; quoted fields may contain commas, doubled quotes and line ends.
pub fn csv(text: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let (mut records, mut record, mut field, mut quoted) = (Vec::new(), Vec::new(), String::new(), false);
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '"' if quoted && characters.peek() == Some(&'"') => field.extend(characters.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => record.push(std::mem::take(&mut field)),
            '\n' if !quoted => {
                record.push(std::mem::take(&mut field));
                records.push(std::mem::take(&mut record));
            }
            other => field.push(other),
        }
    }
    assert!(field.is_empty() && record.is_empty() && !quoted, "the last record has no end");
    let head = records.remove(0);
    (head, records)
}

/// The field of a record in the column `name`.
pub fn field<'a>(head: &[String], record: &'a [String], name: &str) -> &'a str {
    assert_eq!(head.len(), record.len());
    &record[head.iter().position(|column| column == name).unwrap()]
}
