//! Tools, commands and cell names of each device family.

use dermis_golden::board::{Board, Family};

use super::tools::Tool;

/// The synthesis tool of all families.
pub const YOSYS: Tool = Tool { name: "yosys" };

/// Tools and cell names of a family.
pub struct Flow {
    /// The tool for place and route.
    pub place: Tool,
    /// The tool that packs a configuration into a bitstream.
    pub pack: Tool,
    /// Yosys commands; `{top}` stands for the top module, `{netlist}` for the file to write.
    pub synthesis: &'static str,
    /// Prefix of the cell names counted as look-up tables, in the report of place and route or in the netlist; includes
    /// carry cells and distributed RAM.
    pub lut: &'static str,
    /// Prefix of flip-flop cells.
    pub flip_flop: &'static str,
    /// Prefix of multiplier cells.
    pub multiplier: &'static str,
    /// Prefix of block RAM cells.
    pub block_ram: &'static str,
    /// File extension of the bitstream.
    pub bitstream: &'static str,
}

/// The flow of a family.
pub fn flow(family: Family) -> Flow {
    match family {
        Family::Ecp5 => Flow {
            place: Tool { name: "nextpnr-ecp5" },
            pack: Tool { name: "ecppack" },
            // -nowidelut: look-up tables joined by a slice's multiplexers are placed as one; single ones can be placed
            // closer to their neighbours. -minsrst, -mince: resets and enables of fewer than 16 flip-flops become
            // logic, because a tile has few reset and enable signals and many small groups would restrict placement.
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
            // Each of these options saves half a percent of the cells.
            synthesis: "synth_ice40 -dsp -abc2 -dff -top {top} -json {netlist}",
            // A logic cell holds a look-up table, a carry and a flip-flop, hence the number of logic cells is counted.
            lut: "ICESTORM_LC",
            flip_flop: "SB_DFF",
            multiplier: "ICESTORM_DSP",
            block_ram: "ICESTORM_RAM",
            bitstream: "bin",
        },
    }
}

/// Arguments of place and route for one seed and placer; output files begin with `name`.
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

/// Arguments of the tool that packs a configuration into a bitstream.
pub fn pack_arguments(family: Family, configuration: &str, bitstream: &str) -> Vec<String> {
    let arguments = match family {
        Family::Ecp5 => vec!["--compress", configuration, bitstream],
        Family::Ice40 => vec![configuration, bitstream],
    };
    arguments.into_iter().map(str::to_owned).collect()
}
