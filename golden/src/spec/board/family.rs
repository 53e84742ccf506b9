//! Device families and their devices: `constraints/families/<family>.toml`.
//!
//! | field | meaning |
//! |---|---|
//! | `description`, `source` | the family, and where its figures come from |
//! | `multiplier`, `block_ram` | names of the cells that are counted |
//! | `figures` | fields of a board that all devices have |
//! | `devices.NAME` | fields of a board that this device has |
//! | `power` | energies for an estimate of the power, [`Power`]; absent where none are known |

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::error::BoardError;
use super::files::Folder;
use super::power::Power;

/// A device family, whose members share their tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// Lattice ECP5.
    Ecp5,
    /// Lattice iCE40 UltraPlus.
    Ice40,
    /// Xilinx Artix-7; no open tools for place and route are run here.
    Artix7,
}

impl Family {
    /// Every family with its name in a board's file.
    pub const NAMES: [(&'static str, Family); 3] =
        [("ecp5", Family::Ecp5), ("ice40", Family::Ice40), ("artix7", Family::Artix7)];

    /// Name in a board's file.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, family)| *family == self).map_or("", |(name, _)| name)
    }

    /// File name extension of the pin constraints; `None` where place and route is not run.
    pub fn pin_file_extension(self) -> Option<&'static str> {
        match self {
            Family::Ecp5 => Some("lpf"),
            Family::Ice40 => Some("pcf"),
            Family::Artix7 => None,
        }
    }

    /// How place and route is tried where no board's file says it.
    ///
    /// # Errors
    /// [`BoardError::Unreadable`] if a built-in file is damaged.
    pub fn tries(self) -> Result<Tries, BoardError> {
        let FamilyFile { figures, .. } = FamilyFile::load(self)?;
        Value::Table(figures).try_into().map_err(|error: toml::de::Error| unreadable(self, error.to_string()))
    }
}

/// The path of a family's file, relative to the folder of built-in files.
fn file_of(family: Family) -> String {
    format!("families/{}.toml", family.name())
}

fn unreadable(family: Family, reason: String) -> BoardError {
    BoardError::Unreadable { file: Folder::BuiltIn.path().join(file_of(family)).display().to_string(), reason }
}

/// How often, with what and for how long place and route is tried.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Tries {
    /// Seeds 1 … `seeds`, > 0.
    pub seeds: u32,
    /// Placers in the order in which they are tried, at least one.
    pub placers: Vec<String>,
    /// Time limit of one try, min, > 0.
    #[serde(rename = "place_minutes")]
    pub minutes: u32,
}

/// The file of a family.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FamilyFile {
    description: String,
    source: String,
    multiplier: String,
    block_ram: String,
    figures: Table,
    devices: BTreeMap<String, Table>,
    power: Option<Power>,
}

impl FamilyFile {
    fn load(family: Family) -> Result<FamilyFile, BoardError> {
        let text = Folder::BuiltIn.read(&file_of(family)).map_err(|error| unreadable(family, error.to_string()))?;
        toml::from_str(&text).map_err(|error| unreadable(family, error.to_string()))
    }
}

/// A device and what it has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Device {
    /// Name, `device` in a board's file.
    pub name: String,
    /// Its family.
    pub family: Family,
    /// The family in words.
    pub description: String,
    /// Where the figures come from.
    pub source: String,
    /// Name of a multiplier's cell.
    pub multiplier: String,
    /// Name of a block RAM's cell.
    pub block_ram: String,
    /// The fields of a board that it gives.
    pub figures: Table,
}

impl Device {
    /// All devices, by family.
    ///
    /// # Errors
    /// [`BoardError::Unreadable`] if a built-in file is damaged.
    pub fn all() -> Result<Vec<Device>, BoardError> {
        let mut all = Vec::new();
        for (_, family) in Family::NAMES {
            let FamilyFile { description, source, multiplier, block_ram, figures, devices, .. } =
                FamilyFile::load(family)?;
            all.extend(devices.into_iter().map(|(name, own)| Device {
                name: name.clone(),
                family,
                description: description.clone(),
                source: source.clone(),
                multiplier: multiplier.clone(),
                block_ram: block_ram.clone(),
                figures: figures_of(family, figures.clone().into_iter().chain(own)),
            }));
        }
        Ok(all)
    }

    /// A count of the device, 0 if it has no such field.
    pub fn count(&self, field: &str) -> i64 {
        self.figures.get(field).and_then(Value::as_integer).unwrap_or(0)
    }
}

/// The fields of a board that all devices of `family` have.
///
/// # Errors
/// [`BoardError::Unreadable`] if a built-in file is damaged.
pub(super) fn of_all_devices(family: Family) -> Result<Table, BoardError> {
    Ok(figures_of(family, FamilyFile::load(family)?.figures.into_iter()))
}

/// The energies of a family's resources.
///
/// # Errors
/// [`BoardError::Unreadable`] if a built-in file is damaged.
pub(super) fn power_of(family: Family) -> Result<Option<Power>, BoardError> {
    Ok(FamilyFile::load(family)?.power)
}

fn figures_of(family: Family, figures: impl Iterator<Item = (String, Value)>) -> Table {
    let named = ("family".to_owned(), Value::String(family.name().to_owned()));
    figures.chain([named]).collect()
}
