//! Typed reading of a TOML table, with errors that name file, field, value and what is allowed.

use super::SceneError;
use crate::spec::suggest::{distance, nearest};
use std::ops::RangeInclusive;
use toml::{Table, Value};

/// Letters that the shorter of two names must exceed to count as the beginning of the other.
const LEAST_PREFIX: usize = 3;

/// A scene file being read.
pub(super) struct Reader<'a> {
    file: &'a str,
    root: &'a Table,
}

/// A finite number; integers are accepted as well.
pub(super) fn number_of(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str, root: &'a Table) -> Self {
        Reader { file, root }
    }

    /// Rejects every field that is not in the schema (table name, its fields; "" is the top level).
    pub(super) fn check_names(&self, schema: &[(&str, &[&str])]) -> Result<(), SceneError> {
        let paths = || {
            let path = |table: &&str, field: &&str| join(table, field);
            schema.iter().flat_map(move |(table, fields)| fields.iter().map(move |field| path(table, field)))
        };
        let unknown = |field: String| {
            let hint = hint(&field, schema);
            SceneError::UnknownField { file: self.file.to_string(), field, hint }
        };
        for (name, value) in self.root {
            let Some((_, fields)) = schema.iter().find(|(t, _)| t == name && !t.is_empty()) else {
                if paths().any(|path| path == *name) {
                    continue;
                }
                return Err(unknown(name.clone()));
            };
            let table = value.as_table().ok_or_else(|| self.wrong(name, value, "a table"))?;
            for (key, value) in table.iter().filter(|(key, _)| !fields.contains(&key.as_str())) {
                let path = join(name, key);
                let Some((_, fields)) = schema.iter().find(|(table, _)| *table == path) else {
                    return Err(unknown(path));
                };
                let table = value.as_table().ok_or_else(|| self.wrong(&path, value, "a table"))?;
                if let Some(field) = table.keys().find(|key| !fields.contains(&key.as_str())) {
                    return Err(unknown(join(&path, field)));
                }
            }
        }
        Ok(())
    }

    /// The value at `table.field` or `table.table.field`, if present.
    pub(super) fn value(&self, path: &str) -> Option<&'a Value> {
        let (tables, field) = path.rsplit_once('.').map_or((None, path), |(tables, field)| (Some(tables), field));
        let mut table = self.root;
        for name in tables.into_iter().flat_map(|tables| tables.split('.')) {
            table = table.get(name)?.as_table()?;
        }
        table.get(field)
    }

    /// An integer in a range, or `default`.
    pub(super) fn integer(
        &self,
        path: &str,
        range: RangeInclusive<i64>,
        default: Option<i64>,
    ) -> Result<i64, SceneError> {
        let allowed = format!("a whole number from {} to {}", range.start(), range.end());
        let Some(value) = self.value(path) else {
            return default.ok_or_else(|| self.missing(path, allowed));
        };
        match value.as_integer() {
            Some(number) if range.contains(&number) => Ok(number),
            _ => Err(self.wrong(path, value, allowed)),
        }
    }

    /// A finite number for which `test` holds; `None` if the field is absent. Integers are accepted as well.
    pub(super) fn number(
        &self,
        path: &str,
        test: impl Fn(f64) -> bool,
        allowed: &str,
    ) -> Result<Option<f64>, SceneError> {
        let Some(value) = self.value(path) else {
            return Ok(None);
        };
        match number_of(value).filter(|number| test(*number)) {
            Some(number) => Ok(Some(number)),
            None => Err(self.wrong(path, value, allowed)),
        }
    }

    /// A value of any other type, converted by `read`; `None` if the field is absent.
    pub(super) fn typed<T>(
        &self,
        path: &str,
        read: impl Fn(&Value) -> Option<T>,
        allowed: &str,
    ) -> Result<Option<T>, SceneError> {
        let value = self.value(path);
        value.map(|value| read(value).ok_or_else(|| self.wrong(path, value, allowed))).transpose()
    }

    /// One of the named choices, or the type's default if the field is absent.
    pub(super) fn choice<T: Copy + Default>(&self, path: &str, names: &[(&str, T)]) -> Result<T, SceneError> {
        self.value(path).map_or_else(|| Ok(T::default()), |value| self.one_of(path, value, names))
    }

    /// The named choice that is the value of a field.
    pub(super) fn one_of<T: Copy>(&self, path: &str, value: &Value, names: &[(&str, T)]) -> Result<T, SceneError> {
        let named = names.iter().find(|(name, _)| value.as_str() == Some(name));
        named.map(|(_, choice)| *choice).ok_or_else(|| {
            let quoted: Vec<_> = names.iter().map(|(name, _)| format!("{name:?}")).collect();
            self.wrong(path, value, quoted.join(" or "))
        })
    }

    /// The error for a value that is not allowed.
    pub(super) fn wrong(&self, path: &str, value: &Value, allowed: impl Into<String>) -> SceneError {
        SceneError::WrongValue {
            file: self.file.to_string(),
            field: path.to_string(),
            value: shorten(&value.to_string()),
            allowed: allowed.into(),
        }
    }

    /// The error for a missing field.
    pub(super) fn missing(&self, path: &str, allowed: impl Into<String>) -> SceneError {
        SceneError::Missing { file: self.file.to_string(), field: path.to_string(), allowed: allowed.into() }
    }
}

/// A value's text, shortened to fit a message.
fn shorten(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.to_string();
    }
    text.chars().take(LONGEST).chain("…".chars()).collect()
}

/// `table.field`, or `field` at the top level.
fn join(table: &str, field: &str) -> String {
    if table.is_empty() {
        field.to_string()
    } else {
        format!("{table}.{field}")
    }
}

/// What an unknown `path` resembles, else what its table has. The field's own name counts first, so that a field in the
/// wrong table is found; a name that begins with the typed one, or it
/// with the name, counts as near.
fn hint(path: &str, schema: &[(&str, &[&str])]) -> String {
    let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
    let tables = || schema.iter().map(|(table, _)| *table).filter(|table| !table.is_empty());
    let fields = schema.iter().flat_map(|(table, fields)| fields.iter().map(move |field| (*table, *field)));
    let known = fields.chain(tables().map(|table| ("", table)));
    let key = |(of, known): &(&str, &str)| {
        let begins = name.len().min(known.len()) > LEAST_PREFIX && (known.starts_with(name) || name.starts_with(known));
        Some((if begins { 0 } else { distance(name, known)? }, *of != table))
    };
    match nearest(known, key) {
        Some((of, name)) => format!("the nearest valid field is {}", join(of, name)),
        None => match schema.iter().find(|(of, _)| *of == table && !of.is_empty()) {
            Some((table, fields)) => format!("[{table}] has {}", fields.join(", ")),
            None => format!("a scene has name, [{}]", tables().collect::<Vec<_>>().join("], [")),
        },
    }
}
