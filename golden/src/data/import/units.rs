//! Units of stress and length that recordings state.
//!
//! | name | units per MPa |
//! |---|---|
//! | `Pa`, `kPa`, `MPa` | 10⁶, 10³, 1 |
//! | `bar`, `mbar` | 10, 10⁴ |
//! | `N/cm2` | 10² |
//! | `psi` | 145.037738 |
//! | `mmHg` | 7500.6168 |
//! | `kg/cm2`, `g/cm2` | 10.1971621, 10197.1621 |
//! | `N` | the area of a taxel in mm²: a force on each |
//! | `raw` | the largest count over the full scale, which the user states |
//!
//! Stress is the reading divided by this number: readings in kPa come out as the decimal fractions they are.

use crate::data::text::point;
use serde::{Deserialize, Serialize};

/// Unit of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Pascal.
    Pa,
    /// Kilopascal.
    #[serde(rename = "kPa")]
    KiloPa,
    /// Megapascal, N/mm².
    #[serde(rename = "MPa")]
    MegaPa,
    /// Bar.
    #[serde(rename = "bar")]
    Bar,
    /// Millibar, hPa.
    #[serde(rename = "mbar")]
    MilliBar,
    /// Newton per square centimetre.
    #[serde(rename = "N/cm2")]
    NewtonPerCm2,
    /// Pound-force per square inch.
    #[serde(rename = "psi")]
    Psi,
    /// Millimetre of mercury.
    #[serde(rename = "mmHg")]
    MmHg,
    /// Kilogram-force per square centimetre.
    #[serde(rename = "kg/cm2")]
    KgPerCm2,
    /// Gram-force per square centimetre.
    #[serde(rename = "g/cm2")]
    GramPerCm2,
    /// Newton on each taxel.
    #[serde(rename = "N")]
    Newton,
    /// Counts of a converter.
    #[serde(rename = "raw")]
    Raw,
}

impl Unit {
    /// Every unit with its name and its number per MPa; `None` for forces, of which it is the area of a taxel, and counts.
    pub const ALL: [(&'static str, Unit, Option<f64>); 12] = [
        ("Pa", Unit::Pa, Some(1e6)),
        ("kPa", Unit::KiloPa, Some(1e3)),
        ("MPa", Unit::MegaPa, Some(1.0)),
        ("bar", Unit::Bar, Some(10.0)),
        ("mbar", Unit::MilliBar, Some(1e4)),
        ("N/cm2", Unit::NewtonPerCm2, Some(1e2)),
        ("psi", Unit::Psi, Some(145.037_738)),
        ("mmHg", Unit::MmHg, Some(7_500.616_8)),
        ("kg/cm2", Unit::KgPerCm2, Some(10.197_162_1)),
        ("g/cm2", Unit::GramPerCm2, Some(10_197.162_1)),
        ("N", Unit::Newton, None),
        ("raw", Unit::Raw, None),
    ];

    /// Other names of the same units, as devices and spreadsheets write them.
    const SYNONYMS: [(&'static str, Unit); 10] = [
        ("N/mm2", Unit::MegaPa),
        ("hPa", Unit::MilliBar),
        ("lb/in2", Unit::Psi),
        ("lbf/in2", Unit::Psi),
        ("torr", Unit::MmHg),
        ("kgf/cm2", Unit::KgPerCm2),
        ("at", Unit::KgPerCm2),
        ("gf/cm2", Unit::GramPerCm2),
        ("counts", Unit::Raw),
        ("adc", Unit::Raw),
    ];

    /// The unit of a name or a synonym; upper and lower case are the same, `²` and `^2` are `2`, blanks count for nothing.
    ///
    /// ```
    /// use dermis_golden::data::import::Unit;
    ///
    /// assert_eq!(Unit::named("KPa"), Some(Unit::KiloPa));
    /// assert_eq!(Unit::named("N/cm²").and_then(Unit::per_MPa), Some(100.0));
    /// assert_eq!((Unit::named("kgf / cm^2"), Unit::named("lb/in2")), (Some(Unit::KgPerCm2), Some(Unit::Psi)));
    /// assert_eq!((Unit::named("raw").and_then(Unit::per_MPa), Unit::named("furlong")), (None, None));
    /// ```
    pub fn named(name: &str) -> Option<Unit> {
        let name = name.replace('²', "2").replace([' ', '^'], "");
        let mut all = Unit::ALL.into_iter().map(|(own, unit, _)| (own, unit)).chain(Unit::SYNONYMS);
        all.find(|(own, _)| own.eq_ignore_ascii_case(&name)).map(|(_, unit)| unit)
    }

    /// Name in options and summaries.
    pub fn name(self) -> &'static str {
        Unit::ALL.iter().find(|(_, unit, _)| *unit == self).map_or("", |(name, ..)| name)
    }

    /// Its number per MPa; `None` for forces and counts.
    pub fn per_MPa(self) -> Option<f64> {
        Unit::ALL.iter().find(|(_, unit, _)| *unit == self).and_then(|(.., per_MPa)| *per_MPa)
    }

    /// The names of all units, for messages.
    pub fn names() -> String {
        Unit::ALL.map(|(name, ..)| name).join(", ")
    }
}

/// The units of length of [`millimetres`], for messages.
pub(super) const LENGTHS: &str = "a length above 0 in mm, cm, m or inches";

/// A length such as `5.08 mm`, `5,08 mm`, `0.127 centimeters` or `0.2 in`, in mm.
pub(super) fn millimetres(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, unit) = text.split_at(text.find(|c: char| c.is_alphabetic())?);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "mm" | "millimeters" | "millimetres" => 1.0,
        "cm" | "centimeters" | "centimetres" => 10.0,
        "m" | "meters" | "metres" => 1000.0,
        "in" | "inch" | "inches" => 25.4,
        _ => return None,
    };
    let length: f64 = point(number).parse::<f64>().ok()? * factor;
    // Decimal fractions of a centimetre come out as decimal fractions of a millimetre.
    let length = (length * 1e9).round() / 1e9;
    (length.is_finite() && length > 0.0).then_some(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_by_hand() {
        assert_eq!(millimetres("5.08 mm"), Some(5.08));
        assert_eq!(millimetres("0.127 centimeters"), Some(1.27));
        assert_eq!((millimetres("0.5in"), millimetres("5,08 mm")), (Some(12.7), Some(5.08)));
        for text in ["", "5", "mm", "-1 mm", "nan mm", "5 parsec", "1e400 mm", "0 mm"] {
            assert_eq!(millimetres(text), None, "{text}");
        }
    }

    #[test]
    fn names_are_those_of_the_json() {
        for (name, unit, _) in Unit::ALL {
            assert_eq!(serde_json::to_value(unit).unwrap(), name);
            assert_eq!((Unit::named(name), unit.name()), (Some(unit), name));
        }
    }
}
