//! What the tools are asked for a family of devices: one place for all that differs between families.

use dermis_golden::board::{Board, Family};

use super::tools::Tool;

/// Synthesis, for all families.
pub const YOSYS: Tool = Tool { name: "yosys" };

/// A family's tools and cells.
pub struct Flow {
    /// Place and route.
    pub place: Tool,
    /// Configuration to bitstream.
    pub pack: Tool,
    /// Yosys's commands; `{top}` stands for the module and `{netlist}` for the file that is written.
    pub synthesis: &'static str,
    /// What the names of look-up tables begin with, in the report of place and route or else in the netlist; a carry's
    /// halves and distributed RAM are among them.
    pub lut: &'static str,
    /// A flip-flop.
    pub flip_flop: &'static str,
    /// A multiplier.
    pub multiplier: &'static str,
    /// A block RAM.
    pub block_ram: &'static str,
    /// Ending of the bitstream.
    pub bitstream: &'static str,
}

/// The flow of a family.
pub fn flow(family: Family) -> Flow {
    match family {
        Family::Ecp5 => Flow {
            place: Tool { name: "nextpnr-ecp5" },
            pack: Tool { name: "ecppack" },
            // Tables joined by a slice's multiplexers move as one in placement; single ones find a place nearer to what
            // they belong to. For the same reason a reset or an enable of a few flip-flops goes into their tables: a tile
            // has few of each, and hundreds of them, for a flip-flop or two each, leave little choice of places.
            synthesis: "synth_ecp5 -nowidelut -run begin:map_ffs -top {top}; \
                dfflegalize -minsrst 16 -mince 16 -cell $_DFF_?_ 01 -cell $_DFF_?P?_ r -cell $_SDFF_?P?_ r \
                -cell $_DFFE_??_ 01 -cell $_DFFE_?P??_ r -cell $_SDFFE_?P??_ r; \
                synth_ecp5 -nowidelut -run map_ffs: -json {netlist}",
            lut: "TRELLIS_COMB",
            flip_flop: "TRELLIS_FF",
            multiplier: "MULT18X18D",
            block_ram: "DP16KD",
            bitstream: "bit",
        },
        Family::Ice40 => Flow {
            place: Tool { name: "nextpnr-ice40" },
            pack: Tool { name: "icepack" },
            // Each of these saves half a percent of the cells.
            synthesis: "synth_ice40 -dsp -abc2 -dff -top {top} -json {netlist}",
            // A logic cell holds a look-up table, a carry and a flip-flop: what counts is how many cells are taken.
            lut: "ICESTORM_LC",
            flip_flop: "SB_DFF",
            multiplier: "ICESTORM_DSP",
            block_ram: "ICESTORM_RAM",
            bitstream: "bin",
        },
    }
}

/// Arguments of place and route for one try.
pub fn place_arguments(board: &Board, netlist: &str, seed: u32, placer: &str, name: &str) -> Vec<String> {
    let Board { size, package, speed_grade, .. } = board;
    let seed = seed.to_string();
    let pins = format!("{}.{}", board.name, board.family.pin_file_extension());
    let (report, configuration) = (format!("{name}.report.json"), format!("{name}.config"));
    let (size, speed) = (format!("--{size}"), speed_grade.to_string());
    let mut arguments = match board.family {
        Family::Ecp5 => {
            vec![&size, "--package", package, "--speed", &speed, "--lpf", &pins, "--textcfg", &configuration]
        }
        Family::Ice40 => vec![&size, "--package", package, "--pcf", &pins, "--asc", &configuration],
    };
    arguments.extend(["--json", netlist, "--seed", &seed, "--placer", placer, "--report", &report]);
    arguments.push("--timing-allow-fail");
    arguments.into_iter().map(str::to_owned).collect()
}

/// Arguments of the packer.
pub fn pack_arguments(family: Family, configuration: &str, bitstream: &str) -> Vec<String> {
    let arguments = match family {
        Family::Ecp5 => vec!["--compress", configuration, bitstream],
        Family::Ice40 => vec![configuration, bitstream],
    };
    arguments.into_iter().map(str::to_owned).collect()
}
