//! A board's file as a table of values with their lines, and its errors: file, line, field, value and what is allowed.

use std::collections::BTreeMap;

use toml::{Spanned, Table, Value};

use super::error::BoardError;
use crate::plain_words::{line_of, of_toml};
use crate::spec::suggest::{distance, nearest};

/// Fields of a board's file, and their allowed values in words.
pub(super) const FIELDS: [(&str, &str); 29] = [
    ("description", "a text"),
    ("engine", "\"parallel\" or \"serial\""),
    ("device", "a device that `dermis boards` lists; or left out, with family and the device's counts in this file"),
    ("family", "\"ecp5\", \"ice40\" or \"artix7\", that of the device"),
    ("size", "the size as place and route names it, for example \"85k\""),
    ("package", "the package as place and route names it, for example \"CABGA381\""),
    ("speed_grade", "the speed grade as place and route names it, a whole number"),
    ("verilog", "a list of Verilog files beside this one, at least one with pins, of letters, digits and . _ - /"),
    ("pins", "the pin file beside this one, a .lpf for ecp5 or a .pcf for ice40; left out for an engine alone"),
    ("input_clock_MHz", "a number above 0"),
    ("clock_MHz", "a number above 0, the clock of the engine in MHz"),
    ("uart_baud", "a whole number above 0, in bit/s"),
    ("spi_MHz", "a number above 0"),
    ("converters", "a list of converters of one type that `dermis converters` lists, in the order of adc_miso"),
    ("multipliers", "a whole number of at least 0, and no more than the device has"),
    ("multiplier_bits", "the widths of a multiplier's signed operands, the wider first, each of at least 2"),
    ("multiplier_part_bits", "a whole number from 1 to the narrower of multiplier_bits"),
    ("multiplier_blocks", "columns and rows of blocks of four, with no fewer multipliers than the field multipliers"),
    ("block_rams", "a whole number of at least 0, and no more than the device has"),
    ("block_ram_shapes", "a list of [words, bits], each above 0, at least one"),
    ("search_width", "4, 2 or 1"),
    ("distributed_words", "two whole numbers: words always in distributed RAM, and where block RAM is short"),
    ("large_rams", "a whole number of at least 0, and no more than the device has"),
    ("large_ram_shape", "[words, bits], each above 0 where there are large_rams"),
    ("luts", "a whole number above 0, and no more than the device has"),
    ("flip_flops", "a whole number above 0, and no more than the device has"),
    ("seeds", "a whole number above 0"),
    ("placers", "the placers of place and route in the order in which they are tried, at least one with pins"),
    ("place_minutes", "a whole number above 0, in minutes"),
];
/// Longest value in characters that a message repeats.
const LONGEST: usize = 60;

/// The allowed values of a field, in words.
fn allowed(field: &str) -> &'static str {
    FIELDS.iter().find(|(name, _)| *name == field).map_or("", |(_, allowed)| allowed)
}

/// A board's file that was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Reader {
    /// Path as given.
    pub file: String,
    /// All fields.
    pub table: Table,
    /// Line of each field, from 1.
    lines: BTreeMap<String, usize>,
}

impl Reader {
    /// Reads the fields of `text`, which is that of `file`.
    pub fn new(file: &str, text: &str) -> Result<Reader, BoardError> {
        let invalid = |line, reason| BoardError::Invalid { file: file.to_owned(), line, reason };
        let fields: BTreeMap<Spanned<String>, Value> = toml::from_str(text).map_err(|error| {
            let (line, reason) = of_toml(text, &error);
            invalid(line, reason)
        })?;
        let line = |key: &Spanned<String>| line_of(text.as_bytes(), key.span().start);
        let lines = fields.keys().map(|key| (key.get_ref().clone(), line(key))).collect();
        let table = fields.into_iter().map(|(key, value)| (key.into_inner(), value)).collect();
        let reader = Reader { file: file.to_owned(), table, lines };
        match reader.table.keys().find(|key| allowed(key).is_empty()) {
            Some(unknown) => Err(invalid(reader.line(unknown), format!("unknown field {unknown}; {}", hint(unknown)))),
            None => Ok(reader),
        }
    }

    /// Line of a field, 1 if the file does not have it.
    pub fn line(&self, field: &str) -> usize {
        self.lines.get(field).copied().unwrap_or(1)
    }

    /// The error for a field with a value that is not allowed.
    pub fn wrong(&self, field: &str, value: &Value) -> BoardError {
        self.wrong_for(field, value, allowed(field))
    }

    /// The same with other words for what is allowed.
    pub fn wrong_for(&self, field: &str, value: &Value, allowed: &str) -> BoardError {
        let value = value.to_string();
        let short: String = match value.chars().count() > LONGEST {
            true => value.chars().take(LONGEST).chain("…".chars()).collect(),
            false => value,
        };
        let reason = format!("{field} = {short} is not allowed; it must be {allowed}");
        BoardError::Invalid { file: self.file.clone(), line: self.line(field), reason }
    }

    /// The error for a field that is missing.
    pub fn missing(&self, field: &'static str) -> BoardError {
        BoardError::Missing { file: self.file.clone(), field, allowed: allowed(field).to_owned() }
    }
}

/// The field that `unknown` resembles, else all fields.
fn hint(unknown: &str) -> String {
    let names = || FIELDS.iter().map(|(name, _)| *name);
    match nearest(names(), |name| distance(unknown, name)) {
        Some(name) => format!("did you mean {name}?"),
        None => format!("there are: {}", names().collect::<Vec<_>>().join(", ")),
    }
}
