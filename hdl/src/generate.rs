//! Generation of the engine as files: Verilog, memory files, lint waivers, timing constraints, manifest, C header.

use std::collections::BTreeMap;

use dermis_golden::fixed::plan::interval::frame_interval;
use dermis_golden::fixed::plan::resources::Memory;
use dermis_golden::fixed::plan::storage::word_bits;
use dermis_golden::fixed::stages::send::{status_fields, STATUS_BEATS};
use dermis_golden::fixed::{CasePlan, Cycles, Dropped, Model};
use dermis_golden::result::flags::{Flag, StatusField};
use dermis_golden::spec::partition::Case;
use dermis_golden::spec::scene::identifier;
use dermis_golden::wire::link::c_header;
use serde::Serialize;
use serde_json::json;

use crate::constraints::{constraints, Clock};
use crate::device::Tap;
use crate::engine::stages;
use crate::error::HdlError;
use crate::language::{self, memory_file, Change, Hierarchy, RamStyles};
use crate::manifest::{seal, GeneratedFile, MANIFEST, MANIFEST_VERSION};
use crate::primitives::MEMORY_FILE;
use crate::simulate::design;
use crate::state::{state_elements, StateElement};
use crate::taps::taps;
use crate::usage::{by_stage, total, PlacedMemory, StageUsage, Usage, WrapperUsage};
use crate::waivers::WAIVERS;

/// The generated hardware of one scene.
#[derive(Clone, Debug)]
pub struct Generated {
    /// Name of the top module.
    pub top: String,
    /// `<top>.v`, memory files, `<top>.vlt`, `<top>.sdc`, `manifest.json`, `dermis_link.h`; more by [`Generated::add_integration`].
    pub files: Vec<GeneratedFile>,
    /// The memories that the model plans, with their places in the hardware.
    pub memories: Vec<PlacedMemory>,
    /// The observed streams between the stages; none for a board.
    pub taps: Vec<Tap>,
    /// Registers and memories of the engine.
    pub state: Vec<StateElement>,
    /// Content of `manifest.json`.
    pub manifest: serde_json::Value,
    /// Resources by stage.
    pub usage: StageUsage,
    /// The cases left out of a scene that does not list its cases.
    pub dropped: Vec<Refused>,
}

/// A case left out because the design with it does not fit the device.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// The paper's number of the case.
    pub case: u32,
    /// The paper's numbers of all cases of the design that did not fit, this one included.
    pub with: Vec<u32>,
    /// The resources that design would need.
    pub needs: Usage,
}

/// The cases left out of `model`, with the resources they would need.
fn refused(model: &Model) -> Result<Vec<Refused>, HdlError> {
    let refused = |dropped: &Dropped| {
        let with: Vec<u32> = dropped.design.cases().iter().map(CasePlan::number).collect();
        let case = with.iter().copied().find(|number| Case::numbered(i64::from(*number)) == Some(dropped.case));
        let needs = total(&usage(&model.variant(dropped.design.clone()))?);
        Ok(Refused { case: case.unwrap_or_default(), with, needs })
    };
    model.dropped.iter().map(refused).collect()
}

impl Generated {
    /// Updates sizes and checksums in the manifest from the files ([`crate::manifest`]).
    pub(crate) fn seal(&mut self) {
        let text = seal(&mut self.manifest, &self.files);
        self.files.iter_mut().filter(|file| file.name == MANIFEST).for_each(|file| file.text.clone_from(&text));
    }
}

/// Resources of the engine of `model` by stage.
///
/// # Errors
/// As [`generate`].
pub(crate) fn usage(model: &Model) -> Result<StageUsage, HdlError> {
    let hierarchy = design(model)?;
    Ok(by_stage(model, &hierarchy, &placed(&hierarchy, model)?, None))
}

/// Generates the hardware of `model`. The same model always gives the same bytes.
///
/// # Errors
/// [`HdlError::Check`] if the description is not consistent: a defect of this crate.
pub fn generate(model: &Model) -> Result<Generated, HdlError> {
    generate_changed(model, &[])
}

/// As [`generate()`], with seeded defects in the Verilog: for a test that a check finds them.
///
/// # Errors
/// As [`generate()`]; a change that does not apply to the hardware.
pub fn generate_changed(model: &Model, changes: &[Change]) -> Result<Generated, HdlError> {
    let top = top_name(&model.scene.name);
    let file = |name: String, text: String| GeneratedFile { name, text };
    let hierarchy = design(model)?.changed(changes)?;
    let memories = placed(&hierarchy, model)?;
    let styles = names_family(model).then(|| ram_styles(&memories));
    let verilog = header(model, &top) + &hierarchy.verilog(&top, styles.as_ref());
    let usage = by_stage(model, &hierarchy, &memories, None);
    let dropped = refused(model)?;
    let manifest = manifest(model, &top, &usage, &memories, &dropped);
    let taps = taps(model, &hierarchy);
    let state = state_elements(&hierarchy, stages(model.board.engine), &memories);
    let mut files = vec![
        file(format!("{top}.v"), verilog),
        file(format!("{top}.vlt"), WAIVERS.to_owned()),
        constraints(&top, clock(model, &hierarchy), None),
        file(MANIFEST.to_string(), format!("{manifest:#}\n")),
        file("dermis_link.h".to_string(), c_header()),
    ];
    files.extend(hierarchy.memory_files(&top).into_iter().map(|(name, text)| file(name, text)));
    let mut generated = Generated { top, files, memories, taps, state, manifest, usage, dropped };
    generated.seal();
    Ok(generated)
}

/// The clock of the top module of `hierarchy`.
fn clock<'h>(model: &Model, hierarchy: &'h Hierarchy) -> Clock<'h> {
    let port = hierarchy.top().and_then(|top| top.clock.as_deref()).unwrap_or_default();
    Clock { port, MHz: model.board.clock_MHz }
}

/// The instance of the engine in a module around it.
const ENGINE: &str = "engine";

/// A module around the engine: a board's top, or a core for a SoC.
pub(crate) struct Wrapper {
    /// Its name.
    pub top: String,
    /// All its modules.
    pub hierarchy: Hierarchy,
    /// Comment at the head of the file.
    pub header: String,
    /// Row of its own blocks in the table of resources.
    pub row: &'static str,
    /// It has the pins of a board.
    pub is_board: bool,
    /// The clock of its link, where that has one.
    pub link_clock: Option<Clock<'static>>,
}

impl Wrapper {
    /// The files of `engine`, those of its top module under this module's name and with its Verilog, without taps; not sealed.
    ///
    /// # Errors
    /// [`HdlError::Check`] if a planned memory is missing.
    pub(crate) fn generated(self, model: &Model, mut engine: Generated) -> Result<Generated, HdlError> {
        let Wrapper { top, hierarchy, header, row, is_board, link_clock } = self;
        let memories = placed(&hierarchy, model)?;
        let styles = (is_board || names_family(model)).then(|| ram_styles(&memories));
        let verilog =
            GeneratedFile { name: format!("{top}.v"), text: header + &hierarchy.verilog(&top, styles.as_ref()) };
        let own = [verilog, constraints(&top, clock(model, &hierarchy), link_clock)];
        for file in &mut engine.files {
            if let Some(rest) = file.name.strip_prefix(&engine.top) {
                file.name = format!("{top}{rest}");
            }
            if let Some(own) = own.iter().find(|own| own.name == file.name) {
                file.text.clone_from(&own.text);
            }
        }
        let usage = by_stage(model, &hierarchy, &memories, Some(WrapperUsage { engine: ENGINE, row }));
        engine.manifest["top"] = json!(top);
        engine.manifest["resources"] = resources(&usage, &memories);
        Ok(Generated { top, memories, taps: Vec::new(), usage, ..engine })
    }
}

/// Finds every memory that the model plans in the hardware, by its label.
///
/// # Errors
/// [`HdlError::Check`] if one is missing, or not of its size.
fn placed(hierarchy: &Hierarchy, model: &Model) -> Result<Vec<PlacedMemory>, HdlError> {
    let memories: Vec<(&str, &language::Memory)> = hierarchy
        .kernels()
        .flat_map(|(block, kernel)| kernel.memories().iter().map(move |memory| (block, memory)))
        .collect();
    let place = |planned: &Memory| {
        let label = planned.holds.to_string();
        let is = |memory: &language::Memory| {
            memory.label.as_ref() == Some(&label) && (memory.words, memory.bits) == (planned.words, planned.bits)
        };
        let found = memories.iter().find(|(_, memory)| is(memory));
        let missing = || HdlError::Check(format!("the model's memory {planned:?} is not in the hardware"));
        found.map(|(block, memory)| PlacedMemory::new(block, &memory.name, planned)).ok_or_else(missing)
    };
    model.resources.memories.iter().map(place).collect()
}

/// Whether the Verilog is for a family that somebody has named. Another family may have no such RAMs, and synthesis then refuses an
/// attribute; without one it takes what there is.
fn names_family(model: &Model) -> bool {
    model.scene.hardware.board.is_some()
}

/// The kind of RAM of every memory that the model plans.
fn ram_styles(memories: &[PlacedMemory]) -> RamStyles {
    let style = |memory: &PlacedMemory| {
        let style = match (memory.planned.large_rams, memory.planned.block_rams) {
            (0, 0) => "distributed",
            (0, _) => "block",
            _ => "huge",
        };
        ((memory.block.clone(), memory.array.clone()), style.to_owned())
    };
    memories.iter().map(style).collect()
}

/// `dermis_` and the scene's name as an identifier.
pub(crate) fn top_name(scene: &str) -> String {
    format!("dermis_{}", identifier(scene, false))
}

fn header(model: &Model, top: &str) -> String {
    let (scene, f) = (&model.scene, model.formats());
    format!(
        "\
// {top}: forces per taxel from normal stress, {sensor}.
//
// Generated by `dermis build {name}`; do not edit, build it again.
//
//   clk, rst         clock; synchronous reset, active high
//   s_axis_tdata     [{input_end}:0], a taxel's code, signed; row-major, tlast on the last code of a frame{tables}
//   m_axis_tdata     [95:0], {{fz, fy, fx}} of 32 bits signed; {forces}, then {status} status beats
//
// {lanes} MAC lanes, degree {degree}; coefficients in {memory}, one line per word of the lanes' memory.
",
        sensor = scene.sensor,
        name = scene.name,
        input_end = model.stream_bits() - 1,
        tables = match model.has_writable_tables() {
            false => "",
            true => "; a number beyond the codes is a byte of an image of tables",
        },
        forces = match model.sends_resultants() {
            false if model.label_beats() > 0 => {
                format!("{} forces row-major, {} beats of labels", model.force_triples(), model.label_beats())
            }
            false => format!("{} forces row-major", model.force_beats()),
            true => format!("{} beats of sums", model.force_beats()),
        },
        status = match model.chooses() {
            false => model.status_beats().to_string(),
            true => format!("{STATUS_BEATS} per subarray of the frame's case"),
        },
        lanes = 4 * f.lanes_per_parity,
        degree = f.degree,
        memory = memory_file(top, MEMORY_FILE),
    )
}

/// Cycles of a frame of which all subarrays are searched, and of one of which none is.
fn cycles(of: impl Fn(&[bool]) -> Cycles, parts: usize) -> serde_json::Value {
    json!({ "searched": of(&vec![true; parts]), "not_searched": of(&vec![false; parts]) })
}

/// Manifest entry of one of several cases; its cycles exclude the
/// [`LATENCY`](dermis_golden::fixed::stages::choose::LATENCY) of the choice.
fn case(model: &Model, case: &CasePlan) -> serde_json::Value {
    json!({
        "case": case.number(),
        "subarrays": case.parts.len(),
        "quads": case.formats.quads,
        "status_beats": case.status_beats(),
        "coefficient_words": case.storage.words(),
        "cycles": cycles(|searched| Cycles::of_case(model, case, searched), case.parts.len()),
        "frame_interval": frame_interval(model, case),
    })
}

/// The manifest's resources.
fn resources(usage: &StageUsage, memories: &[PlacedMemory]) -> serde_json::Value {
    json!({
        "total": total(usage),
        "stages": usage.iter().copied().collect::<BTreeMap<_, _>>(),
        "memories": memories,
    })
}

/// Where the bits and numbers of a status are that not every hardware has: a mask, or the lowest bit of a number; `null` where
/// this one does not have them.
fn status_masks(model: &Model) -> BTreeMap<String, Option<u32>> {
    let entry = |field: StatusField| {
        let (name, value) = field.manifest_entry()?;
        Some((name, field.feature.is_in(&model.scene).then_some(value)))
    };
    status_fields().into_iter().filter_map(entry).collect()
}

/// Where the fields of a status are that this hardware has: word of the status, lowest bit, bits, and the flag that the bit raises.
fn status_layout(model: &Model) -> Vec<serde_json::Value> {
    let entry = |field: StatusField| {
        let flag = Flag::ALL.into_iter().find(|flag| flag.status_bit() == Some(field));
        json!({
            "name": field.name,
            "word": field.index(),
            "low": field.low,
            "bits": field.bits,
            "flag": flag,
            "meaning": field.meaning,
        })
    };
    status_fields().into_iter().filter(|field| field.feature.is_in(&model.scene)).map(entry).collect()
}

fn manifest(
    model: &Model,
    top: &str,
    usage: &StageUsage,
    memories: &[PlacedMemory],
    dropped: &[Refused],
) -> serde_json::Value {
    let (scene, f) = (&model.scene, model.formats());
    let full_scale = scene.input.full_scale_MPa;
    json!({
        "manifest_version": MANIFEST_VERSION,
        "scene": scene.name,
        "top": top,
        "sensor": scene.sensor,
        "board": model.board.name,
        "clock_MHz": model.board.clock_MHz,
        "formats": f,
        "input": {
            "bits": f.code_bits,
            "arrays": scene.hardware.arrays,
            "tables": model.tables().map(|tables| json!({
                "stream_bits": model.stream_bits(),
                "image_bytes": tables.image_bytes(),
                "coefficients": tables.coefficients.len(),
                "layout": model.table_layout(),
            })),
            "average": model.prepare.average,
            "mean": model.prepare.mean.name(),
            "full_scale_readings": full_scale.map(|full_scale| full_scale * model.prepare.reading_per_MPa),
            "full_scale_MPa": full_scale,
            "noise_floor_codes": model.of_each_array(|array| array.noise_floor.into()),
        },
        "output": {
            "force_beats": model.force_beats(),
            "resultants": model.sends_resultants(),
            "status_beats": model.status_beats(),
            // Without a full scale, a force LSB is this many N per MPa of the largest code.
            "force_lsb_N": full_scale.map(|full_scale| model.force_lsb_N(full_scale)),
            "force_lsb_N_per_MPa": model.force_lsb_N(1.0),
            "threshold_lsb": model.of_each_array(|array| array.threshold.into()),
            "flags": status_masks(model),
            "status": status_layout(model),
        },
        "sizes": {
            "quads": f.quads,
            "lanes": 4 * f.lanes_per_parity,
            "coefficient_words": model.cases().iter().map(|case| case.storage.words()).sum::<usize>(),
            "columns_left_out": model.cases().iter().any(|case| case.storage.is_pruned(case.formats.quads)),
            "coefficient_word_bits": word_bits(f),
        },
        "resources": resources(usage, memories),
        "cycles": cycles(|searched| Cycles::of(model, searched), model.parts().len()),
        "frame_interval": frame_interval(model, model.first()),
        "cases": model.chooses().then(|| model.cases().iter().map(|plan| case(model, plan)).collect::<Vec<_>>()),
        "dropped": model.chooses().then_some(dropped),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::model;
    use dermis_golden::fixed::stages::send::{CASE, FRAMES, TABLES_VERSION, WINDOW};
    use dermis_golden::result::flags::Feature;
    use dermis_golden::spec::scene::Scene;

    /// The fields of a status in the manifest: of hardware with a feature those that the feature adds, of all others `null`.
    #[test]
    fn the_manifest_has_each_field_of_the_status() {
        let scan = "[input]\nfull_scale_MPa = 0.5\n[hardware]\nsource = \"adc-scan\"\n[hardware.adc_scan]\n\
                    converter = \"max11125\"\nsclk_MHz = 12.5\nperiod_us = 1000\n";
        let scenes = [
            (Feature::Always, model(4, 4, "")),
            (Feature::CoefficientCheck, model(4, 4, "[hardware]\ncoefficient_check = \"signature\"\n")),
            (Feature::Adaptive, model(8, 8, "[partition]\ncases = [0, 1]\n")),
            (Feature::SlidingMean, model(4, 4, "[input]\nfull_scale_MPa = 0.5\naverage = 1\nmean = \"sliding\"\n")),
            (
                Feature::AdaptiveMean,
                model(4, 4, "[input]\nfull_scale_MPa = 0.5\nmean = \"adaptive\"\ntemplate = false\n"),
            ),
            (Feature::RunningZero, model(4, 4, "[input]\nfull_scale_MPa = 0.5\nzero = \"running\"\n")),
            (
                Feature::WritableTables,
                model(4, 4, "[input]\nfull_scale_MPa = 0.5\n[hardware]\ntables = \"writable\"\n"),
            ),
            (Feature::Scan, model(4, 4, scan)),
            (Feature::Contacts, Model::new(&Scene::builtin("eight-by-eight-contacts").unwrap()).unwrap()),
        ];
        for (feature, model) in &scenes {
            let masks = status_masks(model);
            // An adaptive mean slides.
            let slides = if *feature == Feature::AdaptiveMean { Feature::SlidingMean } else { *feature };
            let with = [Feature::Always, slides, *feature];
            for flag in Flag::ALL {
                let Some(bit) = flag.status_bit() else { continue };
                // Most of the scenes search the whole array.
                let has = match bit.feature {
                    Feature::WholeSearch => !matches!(feature, Feature::Adaptive | Feature::Contacts),
                    // All have four rows and columns and the parallel engine.
                    Feature::CodeCheck => *feature != Feature::WritableTables,
                    other => with.contains(&other),
                };
                let wanted = has.then_some(bit.mask());
                assert_eq!(masks.get(bit.name), Some(&wanted), "{flag:?}, {feature:?}");
            }
            // The layout has the same fields, and those that are always there.
            let layout = status_layout(model);
            for field in status_fields() {
                let own: Vec<_> = layout.iter().filter(|entry| entry["name"] == field.name).collect();
                assert_eq!(own.len(), usize::from(field.feature.is_in(&model.scene)), "{}, {feature:?}", field.name);
                for entry in own {
                    let at =
                        [&entry["word"], &entry["low"], &entry["bits"]].map(|number| number.as_u64().unwrap() as u32);
                    assert_eq!(at, [(3 * field.beat + field.word) as u32, field.low, field.bits]);
                }
            }
            for field in [CASE, FRAMES, WINDOW, TABLES_VERSION] {
                let wanted = with.contains(&field.feature).then_some(field.low);
                assert_eq!(masks.get(&format!("{}_shift", field.name)), Some(&wanted), "{feature:?}");
            }
        }
        // And it is what the file says.
        let (_, plain) = &scenes[0];
        let manifest = generate(plain).unwrap().manifest;
        assert_eq!(manifest["output"]["flags"], json!(status_masks(plain)));
        let status = manifest["output"]["status"].as_array().unwrap();
        let no_contact = status.iter().find(|field| field["flag"] == "no-contact").unwrap();
        assert_eq!((&no_contact["word"], &no_contact["low"]), (&json!(2), &json!(2)));
    }

    /// Two designs have no file in common but those that are the same for all.
    #[test]
    fn the_files_of_two_scenes_stand_in_one_folder() {
        let named = |name: &str| {
            let mut scene = model(4, 4, "[input]\nfull_scale_MPa = 0.5\nzero = \"running\"\n[fixed]\nprune_bits = 8\n")
                .scene
                .clone();
            scene.name = name.into();
            generate(&Model::new(&scene).unwrap()).unwrap().files
        };
        let [one, other] = ["pad", "pad-low"].map(named);
        let shared: Vec<&str> = one
            .iter()
            .filter(|file| other.iter().any(|own| own.name == file.name))
            .map(|file| file.name.as_str())
            .collect();
        assert_eq!(shared, [MANIFEST, "dermis_link.h"]);
        let memories = one.iter().filter(|file| file.name.ends_with(".hex")).count();
        let verilog = &one[0].text;
        assert!(memories > 0 && verilog.matches("$readmemh(\"dermis_pad__").count() == memories, "{memories}");
        assert_eq!(verilog.matches("$readmemh").count(), memories);
    }

    /// The kinds of RAM are stated once, and only for a family that was named.
    #[test]
    fn kinds_of_ram_are_those_of_a_family_that_was_named() {
        let mut scene = Scene::builtin("eight-by-eight-contacts").unwrap();
        let styles = |scene: &Scene| {
            let generated = generate(&Model::new(scene).unwrap()).unwrap();
            let kinds = ["ram_style", "rom_style"];
            let count = |line: &str| kinds.map(|kind| line.matches(kind).count()).iter().sum::<usize>();
            let lines = generated.files[0].text.lines().map(count);
            (lines.clone().max().unwrap_or(0), lines.sum::<usize>(), generated.memories.len())
        };
        scene.hardware.board = None;
        assert_eq!(styles(&scene).1, 0);
        scene.hardware.board = Some("ulx3s-85f".into());
        let (most, all, planned) = styles(&scene);
        assert_eq!((most, all), (1, planned));
    }
}
