//! Tools, commands and cell names of each device family.

use dermis_golden::spec::board::Family;

use super::tools::Tool;

/// The synthesis tool of all families.
pub const YOSYS: Tool = Tool { name: "yosys" };

/// Tools of a family.
pub struct Flow {
    /// What makes a bitstream of the netlist; `None` where place and route is not run.
    pub routing: Option<Routing>,
    /// Yosys commands; `{top}` stands for the top module, `{netlist}` for the file to write.
    pub synthesis: &'static str,
}

/// Tools that make a bitstream of a netlist, and names of the cells that are then counted.
#[derive(Debug)]
pub struct Routing {
    /// The tool for place and route.
    pub place: Tool,
    /// The tool that packs a configuration into a bitstream.
    pub pack: Tool,
    /// Option of place and route for the pin file.
    pub pins: &'static str,
    /// Option of place and route for the speed grade; `None` where the family has one only.
    pub speed_grade: Option<&'static str>,
    /// Option of place and route for the configuration that it writes.
    pub configuration: &'static str,
    /// Further options of place and route.
    pub place_options: &'static [&'static str],
    /// Options of the packer.
    pub pack_options: &'static [&'static str],
    /// File extension of the bitstream.
    pub bitstream: &'static str,
    /// Prefix of the cell names counted as look-up tables, in the report of place and route or in the netlist; includes
    /// carry cells and distributed RAM.
    pub lut: &'static str,
    /// Prefix of flip-flop cells.
    pub flip_flop: &'static str,
    /// Prefix of multiplier cells.
    pub multiplier: &'static str,
    /// Prefix of block RAM cells.
    pub block_ram: &'static str,
}

/// A device as the tool for place and route names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Size within the family, e.g. `85k`.
    pub size: String,
    /// Package name.
    pub package: String,
    /// Speed grade; `None` where the family has one only.
    pub speed_grade: Option<u32>,
}

/// The flow of a family.
pub fn flow(family: Family) -> Flow {
    match family {
        Family::Ecp5 => Flow {
            routing: Some(Routing {
                place: Tool { name: "nextpnr-ecp5" },
                pack: Tool { name: "ecppack" },
                pins: "--lpf",
                speed_grade: Some("--speed"),
                configuration: "--textcfg",
                // Three times the default: half of the longest paths and more is wire.
                place_options: &["--placer-heap-timingweight", "30"],
                pack_options: &["--compress"],
                bitstream: "bit",
                lut: "TRELLIS_COMB",
                flip_flop: "TRELLIS_FF",
                multiplier: "MULT18X18D",
                block_ram: "DP16KD",
            }),
            // -nowidelut: look-up tables joined by a slice's multiplexers are placed as one; single ones can be placed
            // closer to their neighbours. -minsrst, -mince: resets and enables of fewer than 16 flip-flops become
            // logic, because a tile has few reset and enable signals and many small groups would restrict placement.
            synthesis: "synth_ecp5 -nowidelut -run begin:map_ffs -top {top}; \
                dfflegalize -minsrst 16 -mince 16 -cell $_DFF_?_ 01 -cell $_DFF_?P?_ r -cell $_SDFF_?P?_ r \
                -cell $_DFFE_??_ 01 -cell $_DFFE_?P??_ r -cell $_SDFFE_?P??_ r; \
                synth_ecp5 -nowidelut -run map_ffs: -json {netlist}",
        },
        Family::Ice40 => Flow {
            routing: Some(Routing {
                place: Tool { name: "nextpnr-ice40" },
                pack: Tool { name: "icepack" },
                pins: "--pcf",
                speed_grade: None,
                configuration: "--asc",
                place_options: &[],
                pack_options: &[],
                bitstream: "bin",
                // A logic cell holds a look-up table, a carry and a flip-flop, hence the number of logic cells is counted.
                lut: "ICESTORM_LC",
                flip_flop: "SB_DFF",
                multiplier: "ICESTORM_DSP",
                block_ram: "ICESTORM_RAM",
            }),
            // Each of these options saves half a percent of the cells.
            synthesis: "synth_ice40 -dsp -abc2 -dff -top {top} -json {netlist}",
        },
        Family::Artix7 => {
            Flow { routing: None, synthesis: "synth_xilinx -family xc7 -top {top}; write_json {netlist}" }
        }
    }
}

impl Routing {
    /// Arguments of place and route of the file `netlist` with the pin file `pins`, for one seed and placer; output files
    /// begin with `name`.
    pub fn place_arguments(
        &self,
        part: &Part,
        [netlist, pins]: [&str; 2],
        seed: u32,
        placer: &str,
        name: &str,
    ) -> Vec<String> {
        let size = format!("--{}", part.size);
        let (report, configuration) = (format!("{name}.report.json"), format!("{name}.config"));
        let seed = seed.to_string();
        let mut arguments =
            vec![&*size, "--package", &part.package, self.pins, pins, self.configuration, &configuration];
        let speed = part.speed_grade.map(|speed| speed.to_string());
        if let (Some(option), Some(speed)) = (self.speed_grade, &speed) {
            arguments.extend([option, &**speed]);
        }
        arguments.extend(["--json", netlist, "--seed", &seed, "--placer", placer, "--report", &report]);
        arguments.push("--timing-allow-fail");
        arguments.extend(self.place_options);
        arguments.into_iter().map(str::to_owned).collect()
    }

    /// Arguments of the tool that packs a configuration into a bitstream.
    pub fn pack_arguments(&self, configuration: &str, bitstream: &str) -> Vec<String> {
        [self.pack_options, &[configuration, bitstream]].concat().into_iter().map(str::to_owned).collect()
    }
}
