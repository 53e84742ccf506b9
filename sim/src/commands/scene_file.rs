//! Fields that commands measure and write into the file of a scene; all else in it stays, comments too.

use std::fs;
use std::path::Path;

use anyhow::{ensure, Context, Result};
use dermis_golden::spec::scene::Scene;
use dermis_golden::write::write;
use toml_edit::{DocumentMut, Item, Value};

/// A field of a scene with its new value.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    /// The table, as `search`.
    table: &'static str,
    name: &'static str,
    value: Value,
    /// Stands behind it as a comment.
    remark: String,
}

impl Measured {
    pub(super) fn new(table: &'static str, name: &'static str, value: impl Into<Value>, remark: &str) -> Measured {
        Measured { table, name, value: value.into(), remark: remark.to_owned() }
    }

    /// The line of the field: `name = value  # remark`.
    pub(super) fn line(&self) -> String {
        format!("{} = {}  # {}", self.name, self.value, self.remark)
    }

    fn item(&self) -> Item {
        let mut value = self.value.clone();
        value.decor_mut().set_suffix(format!("  # {}", self.remark));
        Item::Value(value)
    }
}

/// The lines of fields under the headings of their tables, for a scene that has no file; fields of a table follow each other.
pub(super) fn lines(fields: &[Measured]) -> String {
    let tables = fields.chunk_by(|a, b| a.table == b.table);
    let table = |own: &[Measured]| {
        let lines: String = own.iter().map(|field| field.line() + "\n").collect();
        format!("[{}]\n{lines}", own[0].table)
    };
    tables.map(table).collect::<Vec<_>>().join("\n")
}

/// Whether a scene that is named so has a file to write into.
pub(super) fn has_file(named: &str) -> bool {
    !Scene::builtin_names().contains(&named)
}

/// Writes fields into a scene's file, where they replace those of before.
///
/// # Errors
/// A file that cannot be read or written; one that is no scene with them, which then stays as it is.
pub(super) fn state(path: &Path, fields: &[Measured]) -> Result<()> {
    let file = path.display().to_string();
    let text = fs::read_to_string(path).with_context(|| file.clone())?;
    let mut document: DocumentMut = text.parse().with_context(|| file.clone())?;
    for field in fields {
        let table = document[field.table].or_insert(toml_edit::table());
        ensure!(table.is_table_like(), "{file}: {} is no table", field.table);
        table[field.name] = field.item();
    }
    let stated = document.to_string();
    Scene::parse(&stated, &file).with_context(|| format!("with {}", lines(fields).replace('\n', " ").trim()))?;
    Ok(write(path, stated.as_bytes())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: &str =
        "# my pad\n[sensor]\nrows = 2 # two\ncols = 2\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n";

    /// The file with a text behind the sensor's, after the fields were written.
    fn written(text: &str, fields: &[Measured]) -> Result<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad.toml");
        fs::write(&path, format!("{SENSOR}{text}")).unwrap();
        let done = state(&path, fields);
        let now = fs::read_to_string(&path).unwrap().strip_prefix(SENSOR).unwrap().to_owned();
        match done {
            Ok(()) => Ok(now),
            Err(error) => {
                assert_eq!(now, text, "an error leaves the file");
                Err(error)
            }
        }
    }

    #[test]
    fn all_else_in_the_file_stays() {
        let noise = [Measured::new("search", "noise_floor_MPa", 1e-3, "measured")];
        for (search, wanted) in [
            ("", "\n[search]\nnoise_floor_MPa = 0.001  # measured\n"),
            ("[search]\nmu_max = 0.5 # wood\n", "[search]\nmu_max = 0.5 # wood\nnoise_floor_MPa = 0.001  # measured\n"),
            (
                "[search]\nnoise_floor_MPa = 9 # old\nmu_max = 0.5\n",
                "[search]\nnoise_floor_MPa = 0.001  # measured\nmu_max = 0.5\n",
            ),
        ] {
            assert_eq!(written(search, &noise).unwrap(), wanted);
        }
    }

    #[test]
    fn fields_of_several_tables_are_written_once() {
        let dead: toml_edit::Array =
            [[0i64, 1]].into_iter().map(toml_edit::Array::from_iter).map(Value::Array).collect();
        let fields = [
            Measured::new("input", "full_scale_MPa", 0.2, "of the loads"),
            Measured::new("input", "dead", Value::Array(dead), "still"),
            Measured::new("search", "noise_floor_MPa", 2e-4, "of one frame"),
        ];
        let once = written("", &fields).unwrap();
        assert_eq!(once.trim_start(), lines(&fields));
        assert_eq!(written(&once, &fields).unwrap(), once, "twice is as once");
    }

    #[test]
    fn what_would_be_no_scene_is_not_written() {
        let none = [Measured::new("input", "full_scale_MPa", -1.0, "wrong")];
        let error = format!("{:#}", written("", &none).unwrap_err());
        assert!(error.contains("full_scale_MPa") && error.contains("-1"), "{error}");
    }
}
