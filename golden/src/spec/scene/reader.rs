//! Typed reading of a TOML table, with errors that name file, field, value and what is allowed.

use super::declared::Declared;
use super::SceneError;
use crate::spec::suggest::{distance, nearest};
use toml::{Table, Value};

/// Letters that the shorter of two names must exceed to count as the beginning of the other.
const LEAST_PREFIX: usize = 3;

/// A scene file being read.
pub(super) struct Reader<'a> {
    /// Its file.
    pub(super) file: &'a str,
    root: &'a Table,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str, root: &'a Table) -> Self {
        Reader { file, root }
    }

    /// Rejects every field that is not declared.
    pub(super) fn check_names(&self, fields: &[Declared]) -> Result<(), SceneError> {
        self.check_table("", self.root, fields)
    }

    fn check_table(&self, path: &str, table: &Table, fields: &[Declared]) -> Result<(), SceneError> {
        for (key, value) in table {
            let path = join(path, key);
            if fields.iter().any(|field| field.path == path) {
                continue;
            }
            if !fields.iter().any(|field| is_in(&field.path, &path)) {
                let hint = hint(&path, fields);
                return Err(SceneError::UnknownField { file: self.file.to_string(), field: path, hint });
            }
            let table = value.as_table().ok_or_else(|| self.wrong(&path, value, "a table"))?;
            self.check_table(&path, table, fields)?;
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

    /// The error for a value that is not allowed.
    pub(super) fn wrong(&self, path: &str, value: &Value, allowed: impl Into<String>) -> SceneError {
        SceneError::WrongValue {
            file: self.file.to_string(),
            field: path.to_string(),
            value: shorten(&value.to_string()),
            allowed: allowed.into(),
        }
    }

    /// The error for the value of a field that is not allowed; for a missing field if it has none.
    pub(super) fn wrong_field(&self, path: &str, allowed: impl Into<String>) -> SceneError {
        match self.value(path) {
            Some(value) => self.wrong(path, value, allowed),
            None => self.missing(path, allowed),
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

/// Whether a field is in a table or in one within it.
fn is_in(field: &str, table: &str) -> bool {
    field.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'))
}

/// What an unknown `path` resembles, else what its table has. The field's own name counts first, so that a field in the
/// wrong table is found; a name that begins with the typed one, or it
/// with the name, counts as near.
fn hint(path: &str, fields: &[Declared]) -> String {
    let split = |path| str::rsplit_once(path, '.').unwrap_or(("", path));
    let (table, name) = split(path);
    let mut tables: Vec<&str> = Vec::new();
    for (of, _) in fields.iter().map(|field| split(&field.path)) {
        if !of.is_empty() && !tables.contains(&of) {
            tables.push(of);
        }
    }
    let known = fields.iter().map(|field| split(&field.path)).chain(tables.iter().map(|table| ("", *table)));
    let key = |(of, known): &(&str, &str)| {
        let begins = name.len().min(known.len()) > LEAST_PREFIX && (known.starts_with(name) || name.starts_with(known));
        Some((if begins { 0 } else { distance(name, known)? }, *of != table))
    };
    if let Some((of, name)) = nearest(known, key) {
        return format!("the nearest valid field is {}", join(of, name));
    }
    match tables.contains(&table) {
        true => {
            let names = fields.iter().map(|field| split(&field.path)).filter(|(of, _)| *of == table);
            format!("[{table}] has {}", names.map(|(_, name)| name).collect::<Vec<_>>().join(", "))
        }
        false => format!("a scene has name, [{}]", tables.join("], [")),
    }
}
