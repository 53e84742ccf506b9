//! What the input's bits cost: the golden model on the stress itself, the golden model on the codes, and the bit-true
//! model on the same codes, on drawn frames of one contact.

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::quantise::quantise;
use dermis_golden::data::reception::full_scale;
use dermis_golden::estimate::float::Golden;
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::Scene;

use super::super::table::{aligned, percent};
use super::drawn::{one_contact, tangential};
use dermis_flow::progress::Progress;

/// Scenes of the table; with a board in place of the scene's own, that one has 16-bit multipliers.
const LINES: [(&str, Option<&str>); 6] = [
    ("sensor-1", None),
    ("sensor-2", None),
    ("sensor-3", None),
    ("eight-by-eight", None),
    ("eight-by-eight", Some("icebreaker")),
    ("sensor-4", None),
];
/// The default width and that of common converters.
pub const BITS: [u32; 2] = [20, 16];

/// A scene at one width of its input.
#[derive(Clone, Debug, PartialEq)]
pub struct InputBitsRow {
    /// The scene, with the board where that is another one than its own.
    pub scene: String,
    /// Width of a code.
    pub bits: u32,
    /// Median tangential error of the golden model, a fraction.
    pub float: Option<f64>,
    /// The same on codes of `bits` bits.
    pub codes: Option<f64>,
    /// The bit-true model's on these codes.
    pub fixed: Option<f64>,
}

/// The scenes of the table: those called by one of `names`, all where there is none; a name that the table does not
/// have is a scene's.
///
/// # Errors
/// A scene that cannot be loaded.
pub fn scenes(names: &[String]) -> Result<Vec<(String, Scene)>> {
    let own = LINES.iter().map(|(name, board)| (*name, *board));
    let of_table = own.filter(|(name, _)| names.is_empty() || names.iter().any(|wanted| wanted == name));
    let others = names.iter().filter(|wanted| LINES.iter().all(|(name, _)| wanted != name));
    let others = others.map(|name| (name.as_str(), None));
    let load = |(name, board): (&str, Option<&str>)| {
        let mut scene = Scene::load(name)?;
        let Some(board) = board else { return Ok((scene.name.clone(), scene)) };
        scene.hardware.board = Some(board.to_owned());
        Ok((format!("{} on {board}", scene.name), scene))
    };
    of_table.chain(others).map(load).collect()
}

/// The rows of one scene, one for each of [`BITS`].
///
/// # Errors
/// A scene that one of the models refuses.
pub fn measure(name: &str, scene: &Scene) -> Result<Vec<InputBitsRow>> {
    let frames = one_contact(scene)?;
    let row = |bits: u32| {
        let mut scene = scene.clone();
        scene.fixed.input_bits = bits;
        let (golden, model) = (Golden::reference(&scene)?, Model::new(&scene)?);
        let float = |frames: &[Frame]| -> Result<Option<f64>> {
            let results: Vec<Reconstruction> =
                frames.iter().map(|frame| golden.run(frame)).collect::<Result<_, _>>()?;
            Ok(tangential(&results))
        };
        let codes: Vec<Frame> = frames.iter().map(|frame| quantised(&scene, frame)).collect();
        let fixed: Vec<_> = frames.iter().map(|frame| model.reconstruct(frame)).collect::<Result<_, _>>()?;
        let (float, codes) = (float(&frames)?, float(&codes)?);
        Ok(InputBitsRow { scene: name.to_owned(), bits, float, codes, fixed: tangential(&fixed) })
    };
    BITS.into_iter().map(row).collect()
}

/// The frame as its codes have it.
fn quantised(scene: &Scene, frame: &Frame) -> Frame {
    let codes = quantise(&frame.stress_MPa, scene.fixed.input_bits, full_scale(scene, frame));
    let stress = codes.codes.iter().map(|&code| f64::from(code) * codes.lsb_MPa()).collect();
    Frame { stress_MPa: stress, ..frame.clone() }
}

/// The table.
///
/// # Errors
/// As [`scenes`] and [`measure`].
pub fn run(names: &[String]) -> Result<String> {
    let mut lines = Vec::new();
    for (name, scene) in scenes(names)? {
        let _progress = Progress::start(&format!("{name}: input bits"));
        lines.extend(measure(&name, &scene)?);
    }
    let line = |row: InputBitsRow| {
        let errors = [row.float, row.codes, row.fixed].map(percent);
        [vec![row.scene, format!("{} bits", row.bits)], errors.to_vec()].concat()
    };
    let head = ["scene", "input", "float", "float, same codes", "fixed"];
    Ok(aligned(2, &head, lines.into_iter().map(line).collect()))
}
