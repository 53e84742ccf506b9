//! Boards: the device for which a design is generated.
//!
//! A board is a TOML file: one of `constraints`, which are built into the program, or a user's, by its path. It names a
//! device ([`Device`]), whose figures count where the file does not state its own, for example a smaller budget.
//!
//! | field | unit | meaning |
//! |---|---|---|
//! | `description` | | one line |
//! | `device` | | a [`Device`]; without it `family`, `luts`, `flip_flops`, `multipliers` and `block_rams` are needed |
//! | `engine` | | `"parallel"` or `"serial"`: [`EngineKind`] |
//! | `family`, `size`, `package`, `speed_grade` | | as the place and route tool names them |
//! | `pins`, `verilog` | | pin file and Verilog beside the file; boards can share them; none: an engine without pins |
//! | `input_clock_MHz` | MHz | oscillator on the board |
//! | `clock_MHz` | MHz | clock of the engine: a design target until place and route has measured it |
//! | `uart_baud` | bit/s | bit rate of the UART; absent if the board has no pins for it |
//! | `converters` | | converters on the pins `adc_*` of its Verilog, for a scene that scans its array; none if absent |
//! | `spi_MHz` | MHz | highest clock of the SPI, which place and route must meet; absent if the board has no pins for it |
//! | `multipliers`, `multiplier_bits` | , bits | signed multipliers and the widths of their operands, the wider first |
//! | `multiplier_part_bits` | bits | width of each further part of an operand that is wider |
//! | `multiplier_blocks` | tiles | positions of the multipliers, [`MultiplierBlocks`]; if absent, the placer chooses them |
//! | `block_rams`, `block_ram_shapes` | , [words, bits] | block RAMs and their configurations |
//! | `distributed_words` | words | largest memory in distributed RAM: always; if block RAM is short |
//! | `large_rams`, `large_ram_shape` | , [words, bits] | single-port RAMs, 0 if absent |
//! | `luts`, `flip_flops` | | logic cells, for estimated utilisation |
//! | `seeds`, `placers` | | place and route is tried with seeds 1, 2, … and each placer until one converges |
//! | `place_minutes` | min | time limit of one try |

mod error;
mod family;
mod files;
mod power;
mod reader;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Value;

pub use error::BoardError;
pub use family::{Device, Family, Tries};
use files::Folder;
pub use power::Power;
use reader::Reader;

use crate::spec::adc::CONVERTERS;
use crate::spec::quads::Quads;

/// The engine of a board; both do the same arithmetic with different schedules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// As many lanes as fit, stages in parallel.
    #[default]
    Parallel,
    /// Four lanes, one taxel after the other: for devices of a few thousand logic cells.
    Serial,
}

/// A board and its device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Name of the file without its ending.
    #[serde(skip)]
    pub name: String,
    /// Description in one line; the name if the file has none.
    #[serde(default)]
    pub description: String,
    /// The engine for this board.
    #[serde(default)]
    pub engine: EngineKind,
    /// The device, by the name of a [`Device`]; `None` if the file states all figures itself.
    pub device: Option<String>,
    /// Device family.
    pub family: Family,
    /// Size within the family, e.g. `85k`; present where there are pins, as the package.
    pub size: Option<String>,
    /// Package name.
    pub package: Option<String>,
    /// Speed grade; `None` where the family has one only.
    pub speed_grade: Option<u32>,
    /// The board's Verilog: names of files beside the board's, at least one where there are pins.
    #[serde(default)]
    pub verilog: Vec<String>,
    /// Name of the pin file beside the board's; `None` for an engine without pins.
    pub pins: Option<String>,
    /// Oscillator on the board, MHz, > 0.
    pub input_clock_MHz: Option<f64>,
    /// Clock of the engine, MHz, > 0.
    pub clock_MHz: f64,
    /// Bit rate of the UART, bit/s, > 0; `None` where the board has no pins for it.
    pub uart_baud: Option<u32>,
    /// Highest clock of the SPI, MHz, > 0; `None` where the board has no pins for it.
    pub spi_MHz: Option<f64>,
    /// Names of the converters on the pins `adc_*`, in the order of `adc_miso`, all of one type.
    #[serde(default)]
    pub converters: Vec<String>,
    /// Number of multipliers.
    pub multipliers: u32,
    /// Widths of a multiplier's signed operands in bits, the wider first.
    pub multiplier_bits: [u32; 2],
    /// Width in bits of each further part of an operand that is wider than the multiplier's.
    pub multiplier_part_bits: u32,
    /// Positions of the multipliers; `None` leaves those of the lanes to the placer.
    pub multiplier_blocks: Option<MultiplierBlocks>,
    /// Number of block RAMs.
    pub block_rams: u32,
    /// Configurations of a block RAM with a read and a write port: [words, bits].
    pub block_ram_shapes: Vec<[usize; 2]>,
    /// Taxels that the search of the parallel engine computes per cycle, one of [`SEARCH_WIDTHS`], unless the scene says it.
    #[serde(default = "full_search_width")]
    pub search_width: usize,
    /// Largest memory in words that goes into distributed RAM: always, and if block RAM is short.
    pub distributed_words: [usize; 2],
    /// Number of single-port RAMs.
    #[serde(default)]
    pub large_rams: u32,
    /// Size of a single-port RAM: [words, bits].
    #[serde(default)]
    pub large_ram_shape: [usize; 2],
    /// Number of four-input look-up tables.
    pub luts: u32,
    /// Number of flip-flops.
    pub flip_flops: u32,
    /// Seeds of place and route, 1 … seeds, > 0.
    pub seeds: u32,
    /// Placers in the order in which they are tried, at least one.
    pub placers: Vec<String>,
    /// Time limit of one try of place and route, min, > 0.
    pub place_minutes: u32,
    /// The board's own file.
    #[serde(skip)]
    own: Reader,
    /// Where its files are.
    #[serde(skip)]
    folder: Folder,
}

/// Taxels per cycle that the search of the parallel engine can compute, the default first: a quad or a part of it.
pub const SEARCH_WIDTHS: [usize; 3] = [Quads::LANES, 2, 1];

fn full_search_width() -> usize {
    SEARCH_WIDTHS[0]
}

/// Positions of the multipliers of an ECP5: a block of four in each of these rows of each of these columns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiplierBlocks {
    /// Columns of the blocks' first multipliers, in tiles as nextpnr counts them.
    pub columns: Vec<u32>,
    /// Rows, in tiles.
    pub rows: Vec<u32>,
}

impl MultiplierBlocks {
    /// Multipliers in a block.
    pub const SIZE: usize = 4;

    /// Number of multipliers.
    pub fn multipliers(&self) -> usize {
        Self::SIZE * self.columns.len() * self.rows.len()
    }
}

/// Fields that neither a family nor a default gives.
const REQUIRED: [&str; 5] = ["clock_MHz", "luts", "flip_flops", "multipliers", "block_rams"];
/// Ending of a board's file.
const ENDING: &str = ".toml";

impl Board {
    /// The board called `name`, or of the file `name` if that ends with `.toml`.
    ///
    /// # Errors
    /// [`BoardError::Unknown`], which lists the known boards; [`BoardError::Unreadable`], [`BoardError::Invalid`] and
    /// [`BoardError::Missing`] for a wrong file.
    pub fn load(name: &str) -> Result<Board, BoardError> {
        if Board::is_file(name) {
            let path = Path::new(name);
            let folder = Folder::At(path.parent().unwrap_or(Path::new("")).to_owned());
            let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
            return Board::read(folder, &part(path.file_name()), &part(path.file_stem()), name);
        }
        if !Board::names().contains(&name) {
            return Err(BoardError::Unknown { name: name.to_owned(), known: Board::names().join(", ") });
        }
        let file = format!("{name}{ENDING}");
        let path = Folder::BuiltIn.path().join(&file).display().to_string();
        Board::read(Folder::BuiltIn, &file, name, &path)
    }

    /// Whether `name` is the path of a board's file, and not the name of a built-in board.
    pub fn is_file(name: &str) -> bool {
        name.ends_with(ENDING)
    }

    /// Names of the built-in boards, sorted.
    pub fn names() -> Vec<&'static str> {
        files::built_in_names()
    }

    /// Path of the board's file as it was given; of a built-in board relative to the repository's root.
    pub fn file(&self) -> &str {
        &self.own.file
    }

    /// The folder of the board's file.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The board's Verilog: file names and texts.
    ///
    /// # Errors
    /// [`BoardError::Invalid`], which names the missing file.
    pub fn verilog_files(&self) -> Result<Vec<(String, String)>, BoardError> {
        self.verilog.iter().map(|name| self.beside("verilog", name)).collect()
    }

    /// The board's pin constraints: file name and text.
    ///
    /// # Errors
    /// [`BoardError::Missing`] without pins; [`BoardError::Invalid`] if the file cannot be read, or of a family for which
    /// no bitstream is made.
    pub fn pin_file(&self) -> Result<(String, String), BoardError> {
        match (&self.pins, self.family.pin_file_extension()) {
            (Some(name), _) => self.beside("pins", name),
            (None, Some(ending)) => {
                let allowed = format!("the pin file beside this one, a .{ending}, for a bitstream");
                Err(BoardError::Missing { file: self.own.file.clone(), field: "pins", allowed })
            }
            (None, None) => {
                let (field, family) = (if self.device.is_some() { "device" } else { "family" }, self.family.name());
                let reason =
                    format!("{field}: place and route of family {family} is not run here, so there is no bitstream");
                Err(self.invalid(field, reason))
            }
        }
    }

    /// How place and route is tried.
    pub fn tries(&self) -> Tries {
        Tries { seeds: self.seeds, placers: self.placers.clone(), minutes: self.place_minutes }
    }

    /// Energies of the device's resources; `None` for a family without them.
    ///
    /// # Errors
    /// [`BoardError::Unreadable`] if a built-in file is damaged.
    pub fn power(&self) -> Result<Option<Power>, BoardError> {
        family::power_of(self.family)
    }

    /// The board as a file that states every field.
    ///
    /// # Errors
    /// A value that TOML cannot hold; there is none.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// The error for what is wrong with the board, at the line of `field`.
    pub fn invalid(&self, field: &str, reason: String) -> BoardError {
        BoardError::Invalid { file: self.own.file.clone(), line: self.own.line(field), reason }
    }

    /// Path of a file beside the board's.
    pub fn path_of(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// Name without its folder, and text of the file that `field` names.
    fn beside(&self, field: &str, name: &str) -> Result<(String, String), BoardError> {
        let unreadable =
            |error: std::io::Error| self.invalid(field, format!("{field}: {}: {error}", self.path_of(name)));
        let text = self.folder.read(name).map_err(unreadable)?;
        Ok((name.rsplit('/').next().unwrap_or(name).to_owned(), text))
    }

    /// Reads the file `file` of `folder`; `path` is its path in messages.
    fn read(folder: Folder, file: &str, name: &str, path: &str) -> Result<Board, BoardError> {
        let unreadable =
            |error: std::io::Error| BoardError::Unreadable { file: path.into(), reason: error.to_string() };
        let text = folder.read(file).map_err(unreadable)?;
        Ok(Board { folder, ..Board::parse(name, path, &text)? })
    }

    /// The board called `name` from the text of its file, whose path is `file`; files beside it are not read.
    ///
    /// # Errors
    /// [`BoardError::Invalid`] and [`BoardError::Missing`].
    pub fn parse(name: &str, file: &str, text: &str) -> Result<Board, BoardError> {
        let own = Reader::new(file, text)?;
        let device = device(&own)?;
        let mut table = match &device {
            Some(device) => device.figures.clone(),
            None => family::of_all_devices(family(&own)?)?,
        };
        table.extend(own.table.clone());
        if let Some(field) = REQUIRED.into_iter().find(|field| !table.contains_key(*field)) {
            return Err(own.missing(field));
        }
        let mut board: Board = serde_path_to_error::deserialize(Value::Table(table.clone())).map_err(|error| {
            let path = error.path().to_string();
            let field = path.split(['.', '[']).next().unwrap_or_default();
            own.wrong(field, table.get(field).unwrap_or(&Value::String(error.inner().message().to_owned())))
        })?;
        if let Some(field) = board.wrong_field(device.as_ref()) {
            return Err(table.get(field).map_or_else(|| own.missing(field), |value| own.wrong(field, value)));
        }
        if board.description.is_empty() {
            name.clone_into(&mut board.description);
        }
        Ok(Board { name: name.to_owned(), own, ..board })
    }

    /// The first field whose value is out of range or does not suit the others.
    fn wrong_field(&self, device: Option<&Device>) -> Option<&'static str> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let is_name =
            |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "._-/".contains(c));
        let ending = self.family.pin_file_extension();
        let is_pin_file = |name: &str| ending.is_some_and(|ending| name.ends_with(&format!(".{ending}")));
        let needed = |there: bool| there || self.pins.is_none();
        let in_device = |field: &str, count: u32| device.is_none_or(|device| i64::from(count) <= device.count(field));
        let [wide, narrow] = self.multiplier_bits;
        let converter =
            |name: &String| CONVERTERS.iter().any(|known| known.name == name) && *name == self.converters[0];
        let blocks = self.multiplier_blocks.as_ref().map(MultiplierBlocks::multipliers);
        let rules = [
            ("clock_MHz", positive(self.clock_MHz)),
            ("input_clock_MHz", self.input_clock_MHz.is_none_or(positive)),
            ("uart_baud", self.uart_baud != Some(0)),
            ("spi_MHz", self.spi_MHz.is_none_or(positive)),
            ("converters", self.converters.iter().all(converter)),
            ("pins", self.pins.as_ref().is_none_or(|name| is_name(name) && is_pin_file(name))),
            ("verilog", self.verilog.iter().all(|name| is_name(name)) && needed(!self.verilog.is_empty())),
            ("size", needed(self.size.is_some())),
            ("package", needed(self.package.is_some())),
            ("luts", self.luts > 0 && in_device("luts", self.luts)),
            ("flip_flops", self.flip_flops > 0 && in_device("flip_flops", self.flip_flops)),
            ("multipliers", in_device("multipliers", self.multipliers)),
            ("multiplier_bits", narrow >= 2 && wide >= narrow),
            ("multiplier_part_bits", (1..=narrow).contains(&self.multiplier_part_bits)),
            ("multiplier_blocks", blocks.is_none_or(|placed| placed > 0 && placed >= self.multipliers as usize)),
            ("block_rams", in_device("block_rams", self.block_rams)),
            (
                "block_ram_shapes",
                !self.block_ram_shapes.is_empty() && !self.block_ram_shapes.as_flattened().contains(&0),
            ),
            ("large_rams", in_device("large_rams", self.large_rams)),
            ("large_ram_shape", self.large_rams == 0 || !self.large_ram_shape.contains(&0)),
            ("search_width", SEARCH_WIDTHS.contains(&self.search_width)),
            ("seeds", self.seeds > 0),
            ("placers", needed(!self.placers.is_empty())),
            ("place_minutes", self.place_minutes > 0),
        ];
        rules.into_iter().find(|(_, right)| !right).map(|(field, _)| field)
    }

    /// Number of block RAMs for a memory of `words` words of `bits` bits, in the configuration that takes the fewest. A
    /// memory deeper than a configuration is split into parts side by side, as Yosys does: several parts may share the
    /// word of a block RAM. Of a memory of more than sixteen parts Yosys also counts what selects between them, and may take
    /// a few block RAMs more.
    pub fn block_rams_for(&self, words: usize, bits: usize) -> usize {
        let of = |&[w, b]: &[usize; 2]| (words.div_ceil(w) * bits).div_ceil(b);
        self.block_ram_shapes.iter().map(of).min().unwrap_or(0)
    }

    /// Number of single-port RAMs for a memory of `words` words of `bits` bits.
    pub fn large_rams_for(&self, words: usize, bits: usize) -> usize {
        let [most_words, most_bits] = self.large_ram_shape.map(|size| size.max(1));
        words.div_ceil(most_words) * bits.div_ceil(most_bits)
    }

    /// Number of multipliers for a product of signed operands of `a` and `b` bits, each split into as few parts as
    /// possible; the wider operand takes the wider input, as in Yosys.
    pub fn multipliers_for(&self, a: u32, b: u32) -> usize {
        let parts = |bits: u32, width: u32| 1 + bits.saturating_sub(width).div_ceil(self.multiplier_part_bits);
        let [wide, narrow] = self.multiplier_bits;
        (parts(a.max(b), wide) * parts(a.min(b), narrow)) as usize
    }

    /// Duration of `cycles` cycles of the engine's clock in µs.
    pub fn microseconds(&self, cycles: u64) -> f64 {
        cycles as f64 / self.clock_MHz
    }
}

/// The device that a board's file names.
fn device(own: &Reader) -> Result<Option<Device>, BoardError> {
    let Some(named) = own.table.get("device") else { return Ok(None) };
    let all = Device::all()?;
    let Some(device) = all.iter().find(|device| named.as_str() == Some(&device.name)) else {
        let names: Vec<_> = all.iter().map(|device| format!("{:?}", device.name)).collect();
        let instead = "or left out, with family and the device's counts in this file";
        return Err(own.wrong_for("device", named, &format!("{}; {instead}", names.join(", "))));
    };
    match own.table.get("family") {
        Some(family) if family.as_str() != Some(device.family.name()) => {
            let allowed = format!("{:?}, that of {}", device.family.name(), device.name);
            Err(own.wrong_for("family", family, &allowed))
        }
        _ => Ok(Some(device.clone())),
    }
}

/// The family that a board's file names where it names no device.
fn family(own: &Reader) -> Result<Family, BoardError> {
    let named = own.table.get("family").ok_or_else(|| own.missing("device"))?;
    let family = Family::NAMES.into_iter().find(|(name, _)| named.as_str() == Some(name));
    family.map(|(_, family)| family).ok_or_else(|| own.wrong("family", named))
}
