//! The tables of `dermis flags`: the flags of a result, and the fields of a status.

use dermis_golden::fixed::stages::send::status_fields;
use dermis_golden::result::flags::{Flag, StatusField};

use super::table::aligned;

/// Words of a beat.
const WORDS: [&str; 3] = ["fx", "fy", "fz"];

/// A row per flag; a second table with a row per field of a status.
pub fn flags() -> String {
    let of_flag = |flag: Flag| {
        let name = format!("`{}`", flag.name());
        vec![name, flag.raised_when().to_owned(), flag.remedy().to_owned(), flag.raised_by().to_owned()]
    };
    let flags = aligned(4, &["flag", "raised when", "what to do", "raised by"], Flag::ALL.map(of_flag).to_vec());
    let head = ["beat", "word", "bits", "name", "meaning", "only with", "in `output.flags`", "flag"];
    format!("{flags}\n{}", aligned(8, &head, status_fields().iter().map(of_field).collect()))
}

fn of_field(field: &StatusField) -> Vec<String> {
    let bits = match field.bits {
        1 => field.low.to_string(),
        bits => format!("{}:{}", field.low + bits - 1, field.low),
    };
    let code = |text: &str| format!("`{text}`");
    let entry = field.manifest_entry().map_or(String::new(), |(name, _)| code(&name));
    let flag = Flag::ALL.into_iter().find(|flag| flag.status_bit().as_ref() == Some(field));
    vec![
        field.beat.to_string(),
        WORDS[field.word].to_owned(),
        bits,
        code(field.name),
        field.meaning.to_owned(),
        field.feature.setting().to_owned(),
        entry,
        flag.map_or(String::new(), |flag| code(flag.name())),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_flag_and_each_field_has_a_row() {
        let text = flags();
        let (flags, fields) = text.split_once("\n\n").unwrap();
        for flag in Flag::ALL {
            let row = flags.lines().find(|line| line.starts_with(&format!("| `{}` ", flag.name()))).unwrap();
            assert!(row.contains(flag.raised_when()) && row.contains(flag.remedy()), "{row}");
        }
        for (row, field) in fields.lines().skip(2).zip(status_fields()) {
            let of_flag = Flag::ALL.into_iter().find(|flag| flag.status_bit() == Some(field));
            let cells = [field.name, field.meaning, field.feature.setting(), of_flag.map_or("", Flag::name)];
            assert!(cells.iter().all(|cell| row.contains(cell)), "{row}: {cells:?}");
        }
        assert_eq!(fields.lines().count(), 2 + status_fields().len());
    }
}
