//! What a scene may hold, for others than the program's own reader.

use super::declared::Declared;
use super::Scene;
use serde_json::{json, Value as Json};
use std::sync::LazyLock;

impl Scene {
    /// All fields of a scene file, table by table.
    pub fn fields() -> &'static [Declared] {
        static FIELDS: LazyLock<Vec<Declared>> = LazyLock::new(|| {
            let mut fields = Vec::new();
            Scene::declare(&mut fields);
            fields
        });
        &FIELDS
    }

    /// JSON schema (draft 2020-12) of a scene file: names, types, ranges, defaults, meanings. What several fields decide together
    /// is not in it.
    pub fn json_schema() -> Json {
        let mut schema = object();
        schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
        schema["title"] = json!("Scene of Dermis");
        for field in Scene::fields() {
            add(&mut schema, &field.path, field);
        }
        // A table that has a field which must not be missing must not be missing.
        let tables = schema["properties"].as_object().into_iter().flatten();
        let has_required = |table: &Json| table["required"].as_array().is_some_and(|fields| !fields.is_empty());
        schema["required"] = tables.filter(|(_, table)| has_required(table)).map(|(name, _)| name.as_str()).collect();
        schema
    }
}

/// Adds a field whose path within the table that `schema` describes is `path`.
fn add(schema: &mut Json, path: &str, field: &Declared) {
    match path.split_once('.') {
        None => {
            schema["properties"][path] = field.schema.clone();
            if let (None, Some(required)) = (&field.without, schema["required"].as_array_mut()) {
                required.push(json!(path));
            }
        }
        Some((table, path)) => {
            let table = &mut schema["properties"][table];
            if table.is_null() {
                *table = object();
            }
            add(table, path, field);
        }
    }
}

/// The schema of a table without fields.
fn object() -> Json {
    json!({ "type": "object", "properties": {}, "required": [], "additionalProperties": false })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSOR: &str = "[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 2\npitch_y_mm = 2\nthickness_mm = 2\n";

    /// The text of a scene with one field more.
    fn with(path: &str, value: &str) -> String {
        match path.rsplit_once('.') {
            None => format!("{path} = {value}\n{SENSOR}"),
            Some((table, field)) => format!("{SENSOR}[{table}]\n{field} = {value}\n"),
        }
    }

    #[test]
    fn a_default_that_is_stated_changes_nothing() {
        let bare = Scene::parse(SENSOR, "pad.toml").unwrap();
        // Of a table that stands only beside another field nothing can be stated alone.
        let alone =
            |field: &&Declared| !field.path.starts_with("hardware.adc_scan") && !field.path.contains("table_range");
        let stated: Vec<_> =
            Scene::fields().iter().filter(alone).filter(|field| !field.schema["default"].is_null()).collect();
        assert!(stated.len() > 20, "{}", stated.len());
        for field in stated {
            let text = with(&field.path, &field.schema["default"].to_string());
            assert_eq!(Scene::parse(&text, "pad.toml").unwrap(), bare, "{text}");
        }
    }

    #[test]
    fn every_field_is_known_once_with_its_meaning() {
        let fields = Scene::fields();
        for field in fields {
            assert_eq!(fields.iter().filter(|other| other.path == field.path).count(), 1, "{}", field.path);
            assert!(field.meaning.ends_with('.') && !field.allowed.is_empty(), "{}", field.path);
            let names: Vec<&str> = field.path.split('.').collect();
            let pointer = names.iter().map(|name| format!("/properties/{name}")).collect::<String>();
            assert_eq!(Scene::json_schema().pointer(&pointer), Some(&field.schema), "{}", field.path);
        }
        assert_eq!(Scene::json_schema()["required"], json!(["sensor"]));
        assert_eq!(Scene::json_schema()["properties"]["sensor"]["required"].as_array().map(Vec::len), Some(5));
    }
}
