//! Microcontroller: the bit-true engine of a scene as portable C99.
//!
//! ```text
//! Model ── constants ─┐
//!       └─ tables ────┴─ engine.h, engine.c, example.c, README.md ── target: compiled, run, compared
//! ```
//! `engine.c` is one text for all scenes. What differs between scenes are its constants and tables, which come from the formats,
//! matrices and the schedule of products that the hardware is generated from. A result has every word of the bit-true model.
//! [`Scene::require_c`](dermis_golden::spec::scene::Scene::require_c) says which scenes it serves.
//!
//! | file | content |
//! |---|---|
//! | `NAME.h` | the function, the memory that it needs, its result, with shapes, formats and units |
//! | `NAME.c` | the engine; needs `stdint.h` alone |
//! | `NAME_frames.h`, `NAME_example.c` | readings of frames, and a program that prints their forces |
//! | `README.md` | how to compile and call it |

mod constants;
mod tables;
pub mod target;

use std::path::Path;

use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::stages::send::status_fields;
use dermis_golden::fixed::words::formats::MU_STEPS;
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::result::flags::{Flag, StatusField};
use dermis_golden::spec::scene::{identifier, Scene, SceneError};
use dermis_hdl::GeneratedFile;
use serde::Serialize;

use constants::{constants, status_word, STATUS_WORDS};
use tables::{table, Layout, Tables};

/// What a call returns that refuses its readings.
const OUTSIDE: u32 = 1;
/// What a call returns whose readings are at the end of the stated full scale.
const SATURATED: u32 = 2;
/// Terms of a polynomial of degree 3.
const TERMS: usize = 10;
/// Words of the work memory beside its arrays: position, score, condition, found, two shifts, saturations, ends.
const SINGLE_WORDS: usize = 9;

/// The C of a scene.
#[derive(Clone, Debug)]
pub struct CSource {
    /// Name of function and files.
    pub name: String,
    /// The files.
    pub files: Vec<GeneratedFile>,
    /// Readings of the frames of the example, row-major, one list for each frame.
    pub readings: Vec<Vec<i32>>,
    /// What it needs, known without a compiler.
    pub needs: Needs,
}

impl CSource {
    /// Taxels of the array.
    fn taxels(&self) -> usize {
        self.readings.first().map_or(0, Vec::len)
    }

    /// The files of a program that runs the frames on a simulated board.
    fn bare_metal(&self) -> [GeneratedFile; 2] {
        let values = [
            ("NAME", self.name.clone()),
            ("MACRO", self.name.to_uppercase()),
            ("STATUS_WORDS", STATUS_WORDS.to_string()),
        ];
        let file = |name: &str, template: &str| GeneratedFile { name: name.into(), text: fill(template, &values) };
        [file("bare_metal.c", include_str!("bare_metal.c")), file("bare_metal.ld", include_str!("bare_metal.ld"))]
    }
}

/// What the C of a scene needs, whatever the compiler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// Bytes of coefficients, in flash.
    pub coefficient_bytes: usize,
    /// Bytes of the work memory.
    pub work_bytes: usize,
    /// Bytes of readings and result.
    pub frame_bytes: usize,
    /// Multiplications of the passes for a frame.
    pub products: usize,
}

impl Needs {
    /// Bytes of memory: work memory, readings and result; the stack is not among them.
    pub fn memory_bytes(&self) -> usize {
        self.work_bytes + self.frame_bytes
    }
}

/// Name of function and files of a scene.
fn c_name(scene: &Scene) -> String {
    format!("dermis_{}", identifier(&scene.name, true))
}

impl Needs {
    fn of(model: &Model, layout: &Layout, tables: &Tables) -> Needs {
        let (formats, taxels) = (model.formats(), model.scene.sensor.taxels());
        let vectors = 2 + usize::from(model.has_network());
        let words = 2 * taxels + layout.words + vectors * 4 * formats.quads + SINGLE_WORDS;
        let polynomials = (8 * TERMS + 4 * taxels * formats.vectors()).next_multiple_of(8);
        let searched = if model.searches() { 2 * polynomials } else { 0 };
        Needs {
            coefficient_bytes: tables.coefficient_bytes(),
            work_bytes: (8 * tables.accumulators() + searched + 4 * words).next_multiple_of(8),
            frame_bytes: 4 * (taxels + 3 * taxels + STATUS_WORDS),
            products: tables.products(),
        }
    }
}

/// What the C of a model needs.
///
/// # Errors
/// As [`generate`].
pub fn needs(model: &Model) -> Result<Needs, SceneError> {
    require(model)?;
    let layout = Layout::new(model.formats());
    Ok(Needs::of(model, &layout, &Tables::new(model, &layout)))
}

/// Checks that C serves the scene of a model. Besides what [`Scene::require_c`] checks, the images of its network must fit.
fn require(model: &Model) -> Result<(), SceneError> {
    let scene = &model.scene;
    scene.require_c()?;
    let formats = model.formats();
    // The widest words of `engine.c` beside its sums: sums of four rounded rows of a layer. All others are below 30 bits.
    let image_bits = model.quantised().network.as_ref().map_or(0, |network| formats.lane_bits - network.shift + 2);
    if image_bits > u32::BITS {
        let network = scene.search.network.as_deref().unwrap_or(Path::new("none"));
        return Err(SceneError::NotAvailable {
            scene: scene.name.clone(),
            field: "search.network",
            value: format!("{} with images of {image_bits} bits", network.display()),
            available: "a network whose images have up to 32 bits, in C",
        });
    }
    Ok(())
}

/// The C of a model, with `frames` for its example, at least one.
///
/// # Errors
/// The field of the scene that C does not serve; frames that are not of the scene's sensor.
pub fn generate(model: &Model, frames: &[Frame]) -> Result<CSource, FixedError> {
    let one = |frame: &Frame| model.readings(std::slice::from_ref(frame));
    generate_for(model, frames.iter().map(one).collect::<Result<_, _>>()?)
}

/// As [`generate`], with the readings of the example's frames, row-major, of the width of a code.
///
/// # Errors
/// The field of the scene that C does not serve.
pub fn generate_for(model: &Model, readings: Vec<Vec<i32>>) -> Result<CSource, FixedError> {
    let scene = &model.scene;
    require(model)?;
    let layout = Layout::new(model.formats());
    let tables = Tables::new(model, &layout);
    let needs = Needs::of(model, &layout, &tables);
    let name = c_name(scene);
    let (formats, taxels) = (model.formats(), scene.sensor.taxels());
    let quads = 4 * formats.quads;
    let (polynomials, work64) = match model.searches() {
        true => (polynomials(&name, taxels, formats.vectors()), search_memory(&name)),
        false => Default::default(),
    };
    let first = format!("    int32_t first[{quads}]; /* v_00 */\n");
    let values = [
        ("NAME", name.clone()),
        ("MACRO", name.to_uppercase()),
        ("SCENE", scene.name.clone()),
        ("SENSOR", scene.sensor.to_string()),
        ("SHAPES", shapes(model)),
        ("DEFINES", defines(model, &name.to_uppercase())),
        ("STATUS", status(model, &name.to_uppercase())),
        ("CONSTANTS", constants(model, &layout)),
        ("TABLES", tables.text()?),
        ("POLYNOMIALS", polynomials),
        ("WORK64", work64),
        ("WORK32", if model.has_network() { first } else { String::new() }),
        ("WORK_BYTES", needs.work_bytes.to_string()),
        ("SUMS", tables.accumulators().to_string()),
        ("TAXELS", taxels.to_string()),
        ("COLUMNS", scene.sensor.cols.to_string()),
        ("OPERANDS", layout.words.to_string()),
        ("PARITIES", quads.to_string()),
        ("MU_STEPS", MU_STEPS.to_string()),
        ("STATUS_WORDS", STATUS_WORDS.to_string()),
        ("FLASH", needs.coefficient_bytes.to_string()),
        ("MEMORY", needs.memory_bytes().to_string()),
    ];
    let file = |name: String, template: &str| GeneratedFile { name, text: fill(template, &values) };
    let files = vec![
        file(format!("{name}.h"), include_str!("engine.h")),
        file(format!("{name}.c"), include_str!("engine.c")),
        file(format!("{name}_example.c"), include_str!("example.c")),
        file("README.md".into(), include_str!("README.md")),
        GeneratedFile { name: format!("{name}_frames.h"), text: frames_header(&name, taxels, &readings) },
    ];
    Ok(CSource { name, files, readings, needs })
}

/// A template with its values in the places of `@KEY@`, in ASCII, which every compiler reads.
fn fill(template: &str, values: &[(&str, String)]) -> String {
    let text = values.iter().fold(template.to_owned(), |text, (key, value)| text.replace(&format!("@{key}@"), value));
    let letters = [("μ", "mu"), ("σ", "sigma"), ("Σ", "sum of "), ("×", "x"), ("−", "-")];
    let text = letters.iter().fold(text, |text, (letter, name)| text.replace(letter, name));
    text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect()
}

/// The memory of a search.
fn polynomials(name: &str, taxels: usize, vectors: usize) -> String {
    format!(
        "/* Polynomials in mu about one centre. */\n\
         struct {name}_polynomials {{\n    int64_t sum[{TERMS}];\n    int32_t taxel[{taxels}][{vectors}];\n}};\n\n"
    )
}

fn search_memory(name: &str) -> String {
    format!(
        "    struct {name}_polynomials kept; /* about the best centre so far */\n    \
         struct {name}_polynomials current; /* about the centre of the coarse grid */\n"
    )
}

/// Shape, format and unit of input and output.
fn shapes(model: &Model) -> String {
    let (scene, formats) = (&model.scene, model.formats());
    let (rows, cols, bits) = (scene.sensor.rows, scene.sensor.cols, formats.code_bits);
    let reading = match scene.input.full_scale_MPa {
        Some(full_scale) => {
            let lsb = full_scale * model.prepare.reading_per_MPa / model.prepare.largest();
            format!("{lsb:.9e} units of the readings per LSB (MPa without a calibration table)")
        }
        None => "full scale, any stress in MPa, over the largest code per LSB".to_owned(),
    };
    let force = model.force_lsb_N(1.0);
    let rows = [
        format!("readings | [{rows}][{cols}] | Q{}.0, {bits} bits with sign, in int32_t | {reading} |", bits - 1),
        format!("force | [{rows} * {cols}][3] | Q31.0, int32_t | {force:.9e} N per LSB and MPa of full scale |"),
        format!("status, position | 2 | Q9.0 | mu_max / {MU_STEPS}, with mu_max = {} |", scene.search.mu_max),
        "status, others | | | as in the macros below |".to_owned(),
    ];
    rows.map(|row| format!(" * | {row}")).join("\n")
}

/// Sizes and units as macros.
fn defines(model: &Model, prefix: &str) -> String {
    let scene = &model.scene;
    let mut lines = vec![
        format!("#define {prefix}_ROWS {}", scene.sensor.rows),
        format!("#define {prefix}_COLS {}", scene.sensor.cols),
        format!("#define {prefix}_TAXELS {}", scene.sensor.taxels()),
        format!("#define {prefix}_READING_BITS {}", model.formats().code_bits),
        format!("/* mu = position * {prefix}_MU_MAX / {MU_STEPS} */"),
        format!("#define {prefix}_MU_MAX {:?}", scene.search.mu_max),
        "/* Force in N = word * this * full scale in MPa. */".to_owned(),
        format!("#define {prefix}_FORCE_LSB_N_PER_MPA {:e}", model.force_lsb_N(1.0)),
    ];
    if let Some(full_scale_MPa) = scene.input.full_scale_MPa {
        lines.push("/* Stress of the largest code in MPa. */".to_owned());
        lines.push(format!("#define {prefix}_FULL_SCALE_MPA {full_scale_MPa:?}"));
    }
    lines.push("/* Returned without a result: a reading needs more bits. */".to_owned());
    lines.push(format!("#define {prefix}_OUTSIDE {OUTSIDE}"));
    let saturated = Flag::Saturated.name();
    lines.push(format!(
        "/* Flag {saturated}, returned with a result: a reading is at the end of the stated full scale. */"
    ));
    lines.push(format!("#define {prefix}_SATURATED {SATURATED}"));
    lines.join("\n")
}

/// A macro for each field of the status that the scene has, with its meaning and, of a flag, its name.
fn status(model: &Model, prefix: &str) -> String {
    let fields = status_fields().into_iter().filter(|field| field.feature.is_in(&model.scene));
    fields.map(|field| accessor(&field, prefix)).collect::<Vec<_>>().join("\n")
}

fn accessor(field: &StatusField, prefix: &str) -> String {
    let (name, word) = (field.name.to_uppercase(), status_word(field));
    let flag = Flag::ALL.into_iter().find(|flag| flag.status_bit() == Some(*field));
    let flag = flag.map_or_else(String::new, |flag| format!("flag {}: ", flag.name()));
    let value = match field.bits {
        u32::BITS => format!("((int32_t)(result)->status[{word}])"),
        bits => format!("(((result)->status[{word}] >> {}) & {:#x}U)", field.low, u32::MAX >> (u32::BITS - bits)),
    };
    format!("/* {flag}{} */\n#define {prefix}_{name}(result) {value}", field.meaning)
}

/// The readings of the example.
fn frames_header(name: &str, taxels: usize, readings: &[Vec<i32>]) -> String {
    let count = readings.len();
    let all: Vec<i32> = readings.iter().flatten().copied().collect();
    format!(
        "/* Readings of {count} frames of {taxels} taxels, frame after frame, for the example. */\n#include <stdint.h>\n\n\
         #define {}_FRAMES {count}\n\n{}",
        name.to_uppercase(),
        table("int32_t", &format!("{name}_frames"), &all),
    )
}
