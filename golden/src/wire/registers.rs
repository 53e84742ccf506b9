//! The register map of an engine on a bus: what the hardware decodes, and what a driver and the documentation are made from.
//!
//! Registers have 32 bits and lie at multiples of four. An access to another address, and a write to a register that is only
//! read, has no effect and is answered with an error.
//!
//! A driver in C has two headers: [`c_header`] is the same for all cores, [`core_header`] has the figures of one, whose names begin
//! with that of the core, so that a program can include those of several.

use std::fmt::Write;

use serde::Serialize;

use crate::fixed::stages::send::{status_fields, STATUS_BEATS};
use crate::fixed::words::formats::MU_STEPS;
use crate::fixed::Plan;
use crate::spec::scene::{identifier, largest_code};
use crate::wire::link::scene_hash;

/// Bits of an address: 64 registers.
pub const ADDRESS_BITS: usize = 8;
/// Bits of a register.
pub const REGISTER_BITS: usize = 32;
/// Content of register `id`: the letters DERM, the first in the low byte.
pub const ID: u32 = u32::from_le_bytes(*b"DERM");
/// Content of register `map_version`.
pub const MAP_VERSION: u32 = 3;

/// Cycles for which field `reset` of register `control` resets engine and streams.
pub const RESET_CYCLES: u64 = 16;

/// What a bus can do with a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Access {
    /// The same value always.
    Constant,
    /// Read only; the hardware changes it.
    ReadOnly,
    /// A bit written as 1 becomes 0; the hardware sets it.
    ClearedByOne,
    /// A bit written as 1 acts once; reads as 0.
    Pulse,
    /// A write hands a byte over; a read says whether there is room for one.
    Push,
}

impl Access {
    /// In tables.
    pub fn name(self) -> &'static str {
        match self {
            Access::Constant => "constant",
            Access::ReadOnly => "read",
            Access::ClearedByOne => "read, 1 clears",
            Access::Pulse => "1 acts once",
            Access::Push => "read, a write hands over",
        }
    }

    /// Whether a write has an effect.
    pub fn is_written(self) -> bool {
        matches!(self, Access::ClearedByOne | Access::Pulse | Access::Push)
    }
}

/// A field of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// Lowest bit.
    pub low: usize,
    /// Number of bits.
    pub bits: usize,
    /// Meaning.
    pub meaning: &'static str,
}

/// A register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Register {
    /// Name.
    pub name: &'static str,
    /// Address in bytes, a multiple of four.
    pub address: usize,
    /// What a bus can do with it.
    pub access: Access,
    /// Meaning.
    pub meaning: &'static str,
    /// Its fields; empty for a number of 32 bits.
    pub fields: &'static [Field],
}

const fn number(name: &'static str, address: usize, access: Access, meaning: &'static str) -> Register {
    Register { name, address, access, meaning, fields: &[] }
}

const fn field(name: &'static str, low: usize, bits: usize, meaning: &'static str) -> Field {
    Field { name, low, bits, meaning }
}

impl Register {
    /// Its fields; of a number the whole of it, named `value`.
    pub fn parts(&self) -> &[Field] {
        const WHOLE: &[Field] = &[field("value", 0, REGISTER_BITS, "")];
        if self.fields.is_empty() {
            WHOLE
        } else {
            self.fields
        }
    }
}

/// Bits of `control` and of `errors`, by name.
pub const RESET: Field = field(
    "reset",
    0,
    1,
    "resets engine and input for DERMIS_RESET_CYCLES cycles; frames under way are lost and counted, one that has begun to leave ends \
     as spoiled",
);
/// Sets all counters to 0.
pub const CLEAR: Field = field("clear", 1, 1, "sets the counters to 0");
/// A code did not fit.
pub const CLIPPED: Field = field("clipped", 0, 1, "a code was out of the range of the engine's codes and was clipped");
/// A beat without all its bytes.
pub const PARTIAL: Field = field("partial", 1, 1, "a beat of the input did not have all bytes by `tkeep`");
/// A frame of another length.
pub const FRAMING: Field =
    field("framing", 2, 1, "`tlast` was not on the last taxel of a frame, or `tid` changed within it");
/// A wrong access.
pub const ACCESS: Field =
    field("access", 3, 1, "an unknown address, or a write to a register that is only read or has no room");

/// A byte of an image; the low byte of the register.
pub const OCTET: Field = field("octet", 0, 8, "the byte; reads as 0");
/// The image's end.
pub const LAST: Field = field("last", 8, 1, "it is the image's last; reads as 0");
/// The image's array.
pub const ARRAY: Field =
    field("array", 9, 4, "of several arrays the one that the image is of, beside its first byte; reads as 0");
/// No room.
pub const WAITING: Field =
    field("waiting", 16, 1, "the byte written last waits for the frames before it: a write is refused");
/// The engine has writable tables.
pub const WRITABLE: Field = field("writable", 17, 1, "the engine takes tables; else a write is refused");

/// All registers, by address.
pub const REGISTERS: [Register; 18] = [
    number("id", 0x00, Access::Constant, "the letters DERM, the first in the low byte"),
    number("map_version", 0x04, Access::Constant, "version of this map"),
    number("scene", 0x08, Access::Constant, "hash of all that determines the forces, as `dermis host` compares it"),
    Register {
        name: "array",
        address: 0x0c,
        access: Access::Constant,
        meaning: "the array and its codes",
        fields: &[
            field("rows", 0, 8, "rows of the array"),
            field("cols", 8, 8, "columns of the array"),
            field("code_bits", 16, 8, "bits of a code, signed"),
            field("stream_bytes", 24, 8, "bytes of a beat of the output"),
        ],
    },
    number("clock_Hz", 0x10, Access::Constant, "clock for which the hardware was generated"),
    number(
        "force_triples",
        0x14,
        Access::Constant,
        "triples of 32-bit words of a frame's forces, or of its resultants",
    ),
    number("status_triples", 0x18, Access::Constant, "triples behind them: labels of contacts, then status"),
    Register { name: "control", address: 0x1c, access: Access::Pulse, meaning: "commands", fields: &[RESET, CLEAR] },
    Register {
        name: "errors",
        address: 0x20,
        access: Access::ClearedByOne,
        meaning: "what went wrong since it was cleared",
        fields: &[CLIPPED, PARTIAL, FRAMING, ACCESS],
    },
    number("frames_in", 0x24, Access::ReadOnly, "frames received completely"),
    number("frames_out", 0x28, Access::ReadOnly, "frames sent completely"),
    number("codes_clipped", 0x2c, Access::ReadOnly, "codes that were clipped"),
    number("beats_partial", 0x30, Access::ReadOnly, "beats of the input without all bytes"),
    number("frames_misframed", 0x34, Access::ReadOnly, "`tlast` too early or missing, or `tid` changed"),
    number("accesses_refused", 0x38, Access::ReadOnly, "accesses answered with an error"),
    number("cycles", 0x3c, Access::ReadOnly, "clock cycles"),
    Register {
        name: "tables",
        address: 0x40,
        access: Access::Push,
        meaning: "a byte of an image of tables, as `dermis load` makes one; only with hardware.tables = writable",
        fields: &[OCTET, LAST, ARRAY, WAITING, WRITABLE],
    },
    number(
        "frames_lost",
        0x44,
        Access::ReadOnly,
        "frames received completely of which a reset by `control` lost the result",
    ),
];

/// The content of the constant registers of an engine of `plan` whose output has beats of `stream_bytes` bytes, by name.
pub fn constants(plan: &Plan, stream_bytes: usize) -> Vec<(&'static str, u32)> {
    let sensor = &plan.scene.sensor;
    let array = [sensor.rows, sensor.cols, plan.formats().code_bits as usize, stream_bytes];
    vec![
        ("id", ID),
        ("map_version", MAP_VERSION),
        ("scene", scene_hash(plan)),
        ("array", array.iter().rev().fold(0, |word, part| word << 8 | *part as u32)),
        ("clock_Hz", (plan.board.clock_MHz * 1e6).round() as u32),
        ("force_triples", plan.force_triples() as u32),
        ("status_triples", plan.status_triples() as u32),
    ]
}

/// The map as a C header: an offset per register, mask and shift per field, and the contents of `id` and `map_version`; then word, mask
/// and shift of each field of a status.
pub fn c_header() -> String {
    let mut text = String::from(
        "/* Register map of an engine on a bus. Generated by `dermis build --bus`; do not edit. */\n\
         #ifndef DERMIS_REGISTERS_H\n#define DERMIS_REGISTERS_H\n\n",
    );
    let _ = writeln!(text, "#define DERMIS_ID 0x{ID:08x}u\n#define DERMIS_MAP_VERSION {MAP_VERSION}u");
    let _ = writeln!(text, "#define DERMIS_RESET_CYCLES {RESET_CYCLES}u\n");
    for register in REGISTERS {
        let name = register.name.to_uppercase();
        let _ = writeln!(text, "/* {}; {} */", register.meaning, register.access.name());
        let _ = writeln!(text, "#define DERMIS_{name}_OFFSET 0x{:02x}u", register.address);
        for field in register.fields {
            let prefix = format!("DERMIS_{name}_{}", field.name.to_uppercase());
            let mask = ((1_u64 << field.bits) - 1) << field.low;
            let _ = writeln!(
                text,
                "/* {} */\n#define {prefix}_SHIFT {}\n#define {prefix}_MASK 0x{mask:08x}u",
                field.meaning, field.low
            );
        }
        text.push('\n');
    }
    text.push_str(
        "/* Fields of a status, the last words of a frame: one status for each subarray, or for each contact that may have a mu of its \
         own.\n * A field that the hardware does not have is 0. */\n",
    );
    let _ = writeln!(text, "#define DERMIS_STATUS_WORDS {}u", 3 * STATUS_BEATS);
    for field in status_fields() {
        let prefix = format!("DERMIS_STATUS_{}", field.name.to_uppercase());
        let (meaning, word, shift, mask) = (field.meaning, field.index(), field.low, field.mask());
        let _ = writeln!(
            text,
            "/* {meaning} */\n#define {prefix}_WORD {word}\n#define {prefix}_SHIFT {shift}\n#define {prefix}_MASK 0x{mask:08x}u"
        );
    }
    text + "\n#endif\n"
}

/// The figures of the core of `plan` whose top module is called `top`, as a C header: sizes of a frame, and the scales of codes, forces and
/// μ. `suffix` is the last part of the module's name.
pub fn core_header(plan: &Plan, top: &str, suffix: &str) -> String {
    let (sensor, formats) = (&plan.scene.sensor, plan.formats());
    let name = format!("dermis_{}_{suffix}", identifier(&plan.scene.name, true)).to_uppercase();
    let mut text = format!(
        "/* The core {top}: sizes and scales. Generated by `dermis build --bus`; do not edit. */\n#ifndef {name}_H\n#define {name}_H\n\n"
    );
    let mut define = |meaning: &str, constant: &str, value: String| {
        let _ = writeln!(text, "/* {meaning} */\n#define {name}_{constant} {value}");
    };
    let count = |count: usize| format!("{count}u");
    define("content of register scene", "SCENE", format!("0x{:08x}u", scene_hash(plan)));
    define("rows of the array", "ROWS", count(sensor.rows));
    define("columns of the array", "COLS", count(sensor.cols));
    define("largest code; a larger word is clipped", "CODE_MAX", largest_code(formats.code_bits).to_string());
    define("triples of words of a frame: forces or resultants", "FORCE_TRIPLES", count(plan.force_triples()));
    define("behind them: labels of contacts", "LABEL_TRIPLES", count(plan.label_beats()));
    define("behind them: the words of the statuses", "STATUS_TRIPLES", count(plan.status_beats()));
    define(
        "unit of the words of mu in a status",
        "MU_LSB",
        format!("{:e}", plan.scene.search.mu_max / MU_STEPS as f64),
    );
    define(
        "force in N of a word that is 1, for each MPa of the stress of CODE_MAX",
        "FORCE_LSB_N_PER_MPA",
        format!("{:e}", plan.force_lsb_N(1.0)),
    );
    if let Some(full_scale) = plan.scene.input.full_scale_MPa {
        define("stress of CODE_MAX in MPa", "FULL_SCALE_MPA", format!("{full_scale:e}"));
        let readings = full_scale * plan.prepare.reading_per_MPa;
        define(
            "reading of CODE_MAX, in the unit of the readings: with a gain it is not FULL_SCALE_MPA",
            "FULL_SCALE_READINGS",
            format!("{readings:e}"),
        );
        define("force in N of a word that is 1", "FORCE_LSB_N", format!("{:e}", plan.force_lsb_N(full_scale)));
    }
    text + "\n#endif\n"
}

/// The map in SystemRDL 2.0.
pub fn system_rdl() -> String {
    let mut text = String::from(
        "// Register map of an engine on a bus. Generated by `dermis build --bus`; do not edit.\n\
         addrmap dermis {\n  default regwidth = 32;\n",
    );
    for register in REGISTERS {
        let Register { name, address, access, meaning, .. } = register;
        let properties = match access {
            Access::Constant => "sw = r; hw = na;",
            Access::ReadOnly => "sw = r; hw = w;",
            Access::ClearedByOne => "sw = rw; hw = w; woclr;",
            Access::Pulse => "sw = w; hw = r; singlepulse; reset = 0;",
            Access::Push => "sw = rw; hw = rw; swacc;",
        };
        let _ = writeln!(text, "  reg {{\n    desc = \"{}\";", meaning.replace('"', "\\\""));
        for Field { name, low, bits, meaning } in register.parts() {
            let own = if meaning.is_empty() { String::new() } else { format!(" desc = \"{meaning}\";") };
            let _ = writeln!(text, "    field {{ {properties}{own} }} {name}[{}:{low}];", low + bits - 1);
        }
        let _ = writeln!(text, "  }} {name} @ 0x{address:02x};");
    }
    text + "};\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::Model;
    use crate::spec::scene::Scene;

    #[test]
    fn addresses_and_fields_do_not_overlap() {
        for (index, register) in REGISTERS.iter().enumerate() {
            assert_eq!(register.address, 4 * index, "{}", register.name);
            assert!(register.address < 1 << ADDRESS_BITS);
            let mut used = 0_u64;
            for field in register.fields {
                let mask = ((1_u64 << field.bits) - 1) << field.low;
                assert!(used & mask == 0 && mask < 1 << REGISTER_BITS, "{}.{}", register.name, field.name);
                used |= mask;
            }
        }
        assert_eq!(ID, 0x4d52_4544);
    }

    #[test]
    fn header_and_rdl_have_every_register_and_field() {
        let (header, rdl) = (c_header(), system_rdl());
        for register in REGISTERS {
            let upper = register.name.to_uppercase();
            assert!(
                header.contains(&format!("#define DERMIS_{upper}_OFFSET 0x{:02x}u\n", register.address)),
                "{upper}"
            );
            assert!(rdl.contains(&format!("}} {} @ 0x{:02x};", register.name, register.address)), "{upper}");
            for field in register.fields {
                assert!(header.contains(&format!(
                    "DERMIS_{upper}_{}_SHIFT {}\n",
                    field.name.to_uppercase(),
                    field.low
                )));
                assert!(rdl.contains(&format!(" {}[{}:{}];", field.name, field.low + field.bits - 1, field.low)));
            }
        }
        for field in status_fields() {
            let own = format!("#define DERMIS_STATUS_{}", field.name.to_uppercase());
            let (word, mask) = (3 * field.beat + field.word, field.mask());
            assert!(
                header.contains(&format!("{own}_WORD {word}\n{own}_SHIFT {}\n{own}_MASK 0x{mask:08x}u\n", field.low))
            );
            assert_eq!(header.matches(&format!("{own}_WORD ")).count(), 1, "{}", field.name);
        }
        assert!(header.contains("DERMIS_STATUS_TABLES_VERSION_WORD 5\n#define DERMIS_STATUS_TABLES_VERSION_SHIFT 16\n"));
        assert!(header.contains("DERMIS_ERRORS_ACCESS_MASK 0x00000008u"));
        assert!(header.contains("DERMIS_ARRAY_COLS_MASK 0x0000ff00u"));
    }

    fn model(scene: &str) -> Model {
        Model::new(&Scene::builtin(scene).unwrap()).unwrap()
    }

    fn content(constants: &[(&str, u32)], name: &str) -> u32 {
        constants.iter().find(|(own, _)| *own == name).unwrap().1
    }

    #[test]
    fn the_header_of_a_core_has_its_scales_under_its_own_name() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        (scene.input.full_scale_MPa, scene.name) = (Some(0.5), "left-pad".into());
        let model = Model::new(&scene).unwrap();
        let header = core_header(&model, "dermis_left_pad_axi", "axi");
        let value = |name: &str| {
            let start = format!("#define DERMIS_LEFT_PAD_AXI_{name} ");
            let (_, rest) = header.split_once(&start).unwrap_or_else(|| panic!("{name}: {header}"));
            rest.lines().next().unwrap().to_owned()
        };
        assert_eq!(["ROWS", "FORCE_TRIPLES", "LABEL_TRIPLES", "STATUS_TRIPLES"].map(value), ["8u", "64u", "0u", "3u"]);
        assert_eq!(value("CODE_MAX"), "524287");
        let numbers =
            ["FULL_SCALE_MPA", "FULL_SCALE_READINGS", "FORCE_LSB_N", "MU_LSB"].map(|name| value(name).parse::<f64>());
        let wanted = [0.5, 0.5, model.force_lsb_N(0.5), scene.search.mu_max / 384.0];
        assert_eq!(numbers.map(Result::unwrap), wanted);
        // Without a full scale there is the force per MPa alone.
        scene.input.full_scale_MPa = None;
        let header = core_header(&Model::new(&scene).unwrap(), "dermis_left_pad_axi", "axi");
        assert!(
            header.contains("FORCE_LSB_N_PER_MPA ")
                && !header.contains("FULL_SCALE")
                && !header.contains("FORCE_LSB_N ")
        );
    }

    #[test]
    fn forces_and_what_is_behind_them_are_all_triples_of_a_frame() {
        for scene in ["eight-by-eight", "eight-by-eight-contacts"] {
            let model = model(scene);
            let trace = model.run(&[0; 64]);
            let constants = constants(&model, 4);
            let [forces, others] = ["force_triples", "status_triples"].map(|name| content(&constants, name) as usize);
            assert_eq!((forces, forces + others), (64, trace.beats.len() + trace.status.len()), "{scene}");
        }
    }

    #[test]
    fn constants_are_those_of_the_scene() {
        let model = model("eight-by-eight");
        let constants = constants(&model, 16);
        let of = |name| content(&constants, name);
        assert_eq!(of("array"), 8 | 8 << 8 | model.formats().code_bits << 16 | 16 << 24);
        assert_eq!([of("force_triples"), of("status_triples"), of("clock_Hz")], [64, 3, 100_000_000]);
        // A register that is constant has a content, another none.
        let is_constant = |register: &Register| register.access == Access::Constant;
        let named: Vec<&str> = REGISTERS.iter().filter(|own| is_constant(own)).map(|own| own.name).collect();
        assert_eq!(named, constants.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    }
}
