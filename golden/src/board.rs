//! Boards: the device for which a design is generated, from `constraints/<board>.toml`.
//!
//! The files are embedded in the program.
//!
//! | field | unit | meaning |
//! |---|---|---|
//! | `engine` | | `"parallel"` (default) or `"serial"`: [`EngineKind`] |
//! | `device`, `family`, `size`, `package`, `speed_grade` | | as the place and route tool names them |
//! | `verilog` | | files of `constraints`, which boards can share |
//! | `input_clock_MHz` | MHz | oscillator on the board |
//! | `clock_MHz` | MHz | clock of the engine: a design target until place and route has measured it |
//! | `uart_baud` | bit/s | bit rate of the UART |
//! | `spi_MHz` | MHz | highest clock of the SPI, which place and route must meet; absent if the board has no pins for it |
//! | `multipliers`, `multiplier_bits` | , bits | signed multipliers and the width of their operands |
//! | `multiplier_blocks` | tiles | positions of the multipliers, [`MultiplierBlocks`]; if absent, the placer chooses them |
//! | `block_rams`, `block_ram_shapes` | , [words, bits] | block RAMs and their configurations |
//! | `distributed_words` | words | largest memory in distributed RAM: always; if block RAM is short |
//! | `large_rams`, `large_ram_shape` | , [words, bits] | single-port RAMs, 0 if absent |
//! | `luts`, `flip_flops` | | logic cells, for estimated utilisation |
//! | `seeds`, `placers` | | place and route is tried with seeds 1, 2, … and each placer until one converges |
//! | `place_minutes` | min | time limit of one try |
//!
//! Beside it stand the board's Verilog (pins and PLL around the top module: the files of `verilog`, or that of the same name
//! with the ending `.v`) and, under the same name with another ending, its pin constraints.

use include_dir::{include_dir, Dir};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::symmetry::quads::Quads;

static FILES: Dir = include_dir!("$CARGO_MANIFEST_DIR/../constraints");

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
#[allow(non_snake_case)]
pub struct Board {
    /// Name of the file, and of `hardware.board` in a scene.
    #[serde(skip_deserializing)]
    pub name: String,
    /// Description in one line.
    pub description: String,
    /// The engine for this board.
    #[serde(default)]
    pub engine: EngineKind,
    /// Ordering code of the device.
    pub device: String,
    /// Device family.
    pub family: Family,
    /// Size within the family, e.g. `85k`.
    pub size: String,
    /// Package name.
    pub package: String,
    /// Speed grade.
    pub speed_grade: u32,
    /// The board's Verilog, files of `constraints`; empty: the file of the board's name.
    #[serde(default)]
    pub verilog: Vec<String>,
    /// Oscillator on the board, MHz, > 0.
    pub input_clock_MHz: f64,
    /// Clock of the engine, MHz, > 0.
    pub clock_MHz: f64,
    /// Bit rate of the UART, bit/s, > 0.
    pub uart_baud: u32,
    /// Highest clock of the SPI, MHz, > 0; `None` where the board has no pins for it.
    pub spi_MHz: Option<f64>,
    /// Number of multipliers.
    pub multipliers: u32,
    /// Width of a multiplier's signed operands in bits.
    pub multiplier_bits: u32,
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

/// A device family, whose members share their tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// Lattice ECP5.
    Ecp5,
    /// Lattice iCE40.
    Ice40,
}

impl Family {
    /// File name extension of the pin constraints.
    pub fn pin_file_extension(self) -> &'static str {
        match self {
            Family::Ecp5 => "lpf",
            Family::Ice40 => "pcf",
        }
    }
}

/// A board cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BoardError {
    /// There is no board of this name.
    #[error("hardware.board = \"{name}\": unknown board; there are: {known}")]
    Unknown {
        /// The name given.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// The board's file is invalid or another file is missing.
    #[error("constraints/{name}.toml: {reason}")]
    Invalid {
        /// The board's name.
        name: String,
        /// The reason.
        reason: String,
    },
}

impl Board {
    /// The board called `name`.
    ///
    /// # Errors
    /// [`BoardError::Unknown`], which lists the known boards; [`BoardError::Invalid`] for an invalid file.
    pub fn load(name: &str) -> Result<Board, BoardError> {
        let unknown = || BoardError::Unknown { name: name.to_owned(), known: Board::names().join(", ") };
        let file = FILES.get_file(format!("{name}.toml")).ok_or_else(unknown)?;
        Board::parse(name, file.contents_utf8().unwrap_or_default())
    }

    /// The board's Verilog: file names and texts.
    ///
    /// # Errors
    /// [`BoardError::Invalid`], which names the missing file.
    pub fn verilog_files(&self) -> Result<Vec<(String, &'static str)>, BoardError> {
        let own = [format!("{}.v", self.name)];
        let names = if self.verilog.is_empty() { &own[..] } else { &self.verilog };
        names.iter().map(|name| self.file(name)).collect()
    }

    /// The board's pin constraints: file name and text.
    ///
    /// # Errors
    /// [`BoardError::Invalid`], which names the missing file.
    pub fn pin_file(&self) -> Result<(String, &'static str), BoardError> {
        self.file(&format!("{}.{}", self.name, self.family.pin_file_extension()))
    }

    fn file(&self, name: &str) -> Result<(String, &'static str), BoardError> {
        let missing = || BoardError::Invalid { name: self.name.clone(), reason: format!("needs {name} beside it") };
        let text = FILES.get_file(name).and_then(|file| file.contents_utf8()).ok_or_else(missing)?;
        Ok((name.to_owned(), text))
    }

    /// Names of all boards, sorted.
    pub fn names() -> Vec<&'static str> {
        let stems = FILES.files().filter(|f| f.path().extension().is_some_and(|e| e == "toml"));
        let mut names: Vec<_> = stems.filter_map(|f| f.path().file_stem()?.to_str()).collect();
        names.sort_unstable();
        names
    }

    fn parse(name: &str, text: &str) -> Result<Board, BoardError> {
        let invalid = |reason: String| BoardError::Invalid { name: name.to_owned(), reason };
        let board: Board = toml::from_str(text).map_err(|e| invalid(e.to_string()))?;
        let clocks = [("input_clock_MHz", board.input_clock_MHz), ("clock_MHz", board.clock_MHz)];
        for (field, value) in clocks.into_iter().chain(board.spi_MHz.map(|rate| ("spi_MHz", rate))) {
            if !(value.is_finite() && value > 0.0) {
                return Err(invalid(format!("{field} = {value}: must be positive")));
            }
        }
        if board.block_ram_shapes.is_empty() || board.block_ram_shapes.iter().flatten().any(|&size| size == 0) {
            return Err(invalid(format!("block_ram_shapes = {:?}: must be [words, bits]", board.block_ram_shapes)));
        }
        if board.large_rams > 0 && board.large_ram_shape.contains(&0) {
            return Err(invalid(format!("large_ram_shape = {:?}: must be [words, bits]", board.large_ram_shape)));
        }
        let counts = [
            ("uart_baud", board.uart_baud),
            ("seeds", board.seeds),
            ("place_minutes", board.place_minutes),
            ("placers", board.placers.len() as u32),
        ];
        if let Some((field, _)) = counts.iter().find(|(_, count)| *count == 0) {
            return Err(invalid(format!("{field} = 0: must be positive")));
        }
        let placed = board.multiplier_blocks.as_ref().map(MultiplierBlocks::multipliers);
        if let Some(placed) = placed.filter(|&placed| placed == 0 || placed != board.multipliers as usize) {
            let has = board.multipliers;
            return Err(invalid(format!("multiplier_blocks: has {placed} multipliers, multipliers = {has}")));
        }
        if !SEARCH_WIDTHS.contains(&board.search_width) {
            return Err(invalid(format!("search_width = {}: must be 4, 2 or 1", board.search_width)));
        }
        if board.multiplier_bits < 2 {
            return Err(invalid(format!("multiplier_bits = {}: must be at least 2", board.multiplier_bits)));
        }
        Ok(Board { name: name.to_owned(), ..board })
    }

    /// Number of block RAMs for a memory of `words` words of `bits` bits, in the configuration that takes the fewest. A
    /// memory deeper than a configuration is split into parts side by side, as Yosys does: several parts may share the
    /// word of a block RAM.
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
    /// possible.
    pub fn multipliers_for(&self, a: u32, b: u32) -> usize {
        (a.div_ceil(self.multiplier_bits) * b.div_ceil(self.multiplier_bits)) as usize
    }

    /// Duration of `cycles` cycles of the engine's clock in µs.
    pub fn microseconds(&self, cycles: u64) -> f64 {
        cycles as f64 / self.clock_MHz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_board_loads() {
        assert!(Board::names().contains(&"ulx3s-85f"));
        for name in Board::names() {
            let board = Board::load(name).unwrap();
            assert_eq!(board.name, name);
            let verilog = board.verilog_files().unwrap();
            assert!(verilog.iter().any(|(_, text)| text.contains("module board (")), "{name}");
            // Every port has its site.
            let (_, pins) = board.pin_file().unwrap();
            let ports = verilog.iter().filter_map(|(_, text)| text.split_once("module board (")?.1.split_once(");"));
            let ports: Vec<&str> = ports
                .flat_map(|(ports, _)| ports.lines())
                .filter_map(|l| l.rsplit_once("wire "))
                .map(|(_, port)| port.trim_end_matches(',').rsplit(' ').next().unwrap_or_default())
                .collect();
            assert!(!ports.is_empty() && ports.iter().all(|port| pins.contains(port)), "{name}: {ports:?}");
        }
        // 100 MHz: one cycle is 10 ns.
        let board = Board::load("ulx3s-85f").unwrap();
        assert_eq!(board.microseconds(100), 1.0);
        // Two lanes share a block RAM up to 512 words; 27 bits are split into two parts of 18.
        assert_eq!(
            [(512, 36), (513, 36), (1025, 72), (2048, 9)].map(|(w, b)| board.block_rams_for(w, b)),
            [1, 2, 6, 1]
        );
        // Three parts of 6 bits share a word of 18; Yosys 0.23 takes as many for each of these.
        assert_eq!(
            [(2853, 6), (1500, 20), (5000, 3), (1100, 54)].map(|(w, b)| board.block_rams_for(w, b)),
            [1, 2, 1, 5]
        );
        assert_eq!([board.multipliers_for(27, 18), board.multipliers_for(18, 18)], [2, 1]);
    }

    #[test]
    fn a_missing_verilog_file_is_named() {
        let text = FILES.get_file("colorlight-i5.toml").unwrap().contents_utf8().unwrap();
        let board = Board::parse("x", &text.replace("colorlight.v", "colourlight.v")).unwrap();
        let error = board.verilog_files().unwrap_err().to_string();
        assert_eq!(error, "constraints/x.toml: needs colourlight.v beside it");
    }

    #[test]
    fn an_unknown_board_lists_the_known_ones() {
        let error = Board::load("ulx3s").unwrap_err().to_string();
        assert!(error.contains("\"ulx3s\"") && error.contains("ulx3s-85f"), "{error}");
    }

    #[test]
    fn a_clock_of_zero_names_file_field_and_value() {
        let text = FILES.get_file("ulx3s-85f.toml").unwrap().contents_utf8().unwrap();
        let error = Board::parse("x", &text.replace("clock_MHz = 100.0", "clock_MHz = 0.0")).unwrap_err();
        assert_eq!(error.to_string(), "constraints/x.toml: clock_MHz = 0: must be positive");
    }

    #[test]
    fn a_search_width_that_divides_no_quad_is_refused() {
        let text = FILES.get_file("ulx3s-85f.toml").unwrap().contents_utf8().unwrap();
        let with = |width: usize| Board::parse("x", &format!("search_width = {width}\n{text}"));
        assert_eq!(with(2).unwrap().search_width, 2);
        let error = with(3).unwrap_err().to_string();
        assert_eq!(error, "constraints/x.toml: search_width = 3: must be 4, 2 or 1");
    }

    #[test]
    fn blocks_that_hold_another_number_of_multipliers_are_refused() {
        let text = FILES.get_file("ulx3s-85f.toml").unwrap().contents_utf8().unwrap();
        for (rows, held) in [("[10, 34]", 104), ("[]", 0)] {
            let error = Board::parse("x", &text.replace("rows = [10, 34, 58]", &format!("rows = {rows}"))).unwrap_err();
            let told = format!("constraints/x.toml: multiplier_blocks: has {held} multipliers, multipliers = 156");
            assert_eq!(error.to_string(), told);
        }
    }
}
