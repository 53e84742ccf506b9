//! Values of fields that stand for themselves: a board's name, dead taxels, the knots of a curve, a number for each array.

use super::field::{number_of, Kind, Number};
use crate::spec::board::Board;
use crate::spec::sensor::MAX_SIDE;
use serde_json::{json, Value as Json};
use std::path::Path;
use toml::Value;

/// A built-in board's name, or the path of a file, which the scene gives relative to its own folder.
pub(super) struct BoardName;

impl Kind for BoardName {
    type Value = String;

    fn read(&self, value: &Value, file: &str) -> Option<String> {
        match value.as_str()? {
            name if Board::names().contains(&name) => Some(name.to_owned()),
            path if Board::is_file(path) => Some(Path::new(file).with_file_name(path).display().to_string()),
            _ => None,
        }
    }

    fn allowed(&self) -> String {
        let names: Vec<_> = Board::names().into_iter().map(|name| format!("{name:?}")).collect();
        format!("{}, or the path of a board's file, which ends with .toml", names.join(" or "))
    }

    fn schema(&self) -> Json {
        json!({ "type": "string", "anyOf": [{ "enum": Board::names() }, { "pattern": "\\.toml$" }] })
    }

    fn show(&self, value: &String) -> Option<Value> {
        Some(Value::String(value.clone()))
    }
}

/// Taxels, [row, col] each; sorted, without duplicates.
pub(super) struct DeadTaxels;

impl Kind for DeadTaxels {
    type Value = Vec<[usize; 2]>;

    fn read(&self, value: &Value, _: &str) -> Option<Vec<[usize; 2]>> {
        let index = |value: &Value| usize::try_from(value.as_integer()?).ok().filter(|index| *index < MAX_SIDE);
        let taxel = |value: &Value| match value.as_array()?.as_slice() {
            [row, col] => Some([index(row)?, index(col)?]),
            _ => None,
        };
        let mut taxels = value.as_array()?.iter().map(taxel).collect::<Option<Vec<_>>>()?;
        taxels.sort_unstable();
        taxels.dedup();
        Some(taxels)
    }

    fn allowed(&self) -> String {
        "a list of [row, col], from 0".to_owned()
    }

    fn schema(&self) -> Json {
        let index = json!({ "type": "integer", "minimum": 0, "maximum": MAX_SIDE - 1 });
        json!({ "type": "array", "items": { "type": "array", "items": index, "minItems": 2, "maxItems": 2 } })
    }

    fn show(&self, value: &Vec<[usize; 2]>) -> Option<Value> {
        value.is_empty().then(|| Value::Array(Vec::new()))
    }
}

/// A number for each array, or none.
pub(super) struct OfEachArray(pub(super) Number);

impl Kind for OfEachArray {
    type Value = Vec<f64>;

    fn read(&self, value: &Value, file: &str) -> Option<Vec<f64>> {
        value.as_array()?.iter().map(|value| self.0.read(value, file)).collect()
    }

    fn allowed(&self) -> String {
        format!("a list with {} for each of hardware.arrays", self.0.allowed())
    }

    fn schema(&self) -> Json {
        json!({ "type": "array", "items": self.0.schema() })
    }

    fn show(&self, value: &Vec<f64>) -> Option<Value> {
        value.is_empty().then(|| Value::Array(Vec::new()))
    }
}

/// Most knots of a curve.
const MOST_KNOTS: usize = 64;

/// Whether both values of the knots of a curve rise from one to the next.
pub(crate) fn rise(knots: &[[f64; 2]]) -> bool {
    knots.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1])
}

/// Knots of a curve, [u, b] each, both rising, with [0, 0]; or none.
pub(super) struct Knots;

impl Kind for Knots {
    type Value = Vec<[f64; 2]>;

    fn read(&self, value: &Value, _: &str) -> Option<Vec<[f64; 2]>> {
        let knot = |value: &Value| match value.as_array()?.as_slice() {
            [u, b] => Some([number_of(u)?, number_of(b)?]),
            _ => None,
        };
        let knots = value.as_array()?.iter().map(knot).collect::<Option<Vec<_>>>()?;
        let fits = (2..=MOST_KNOTS).contains(&knots.len()) && rise(&knots) && knots.contains(&[0.0, 0.0]);
        (knots.is_empty() || fits).then_some(knots)
    }

    fn allowed(&self) -> String {
        format!("a list of 2 to {MOST_KNOTS} [MPa by the table, MPa], both rising, with [0, 0]; or []")
    }

    fn schema(&self) -> Json {
        let knot = json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 });
        json!({ "type": "array", "items": knot, "maxItems": MOST_KNOTS })
    }

    fn show(&self, value: &Vec<[f64; 2]>) -> Option<Value> {
        value.is_empty().then(|| Value::Array(Vec::new()))
    }
}
