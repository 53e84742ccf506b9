//! The prover: runs Yosys and ABC on a property of `tests/proofs` and the Verilog.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_hdl::bus::{generate_core_changed, CoreShape};
use dermis_hdl::language::Change;
use dermis_hdl::link::generate_board_changed;
use dermis_hdl::{generate_changed, Generated};
use dermis_tests::tools::{folder_of, yosys};
use dermis_tests::{nightly, variants};

/// Properties whose proof takes ABC half a minute: `make nightly` proves them, `make test` only looks for a short
/// counterexample.
const LONG: [&str; 3] = ["queue.v", "replay.v", "label_beats.v"];

/// What is proved.
#[derive(Clone, Copy)]
pub enum Hardware<'a> {
    /// The engine of a model.
    Engine(&'a Model),
    /// The same behind its board's link.
    Board(&'a Model),
    /// The same as a core on a bus.
    Core(&'a Model, CoreShape),
}

impl Hardware<'_> {
    fn generate(self, changes: &[Change]) -> Generated {
        let generated = match self {
            Hardware::Engine(model) => generate_changed(model, changes),
            Hardware::Board(model) => generate_board_changed(model, changes),
            Hardware::Core(model, shape) => generate_core_changed(model, shape, changes),
        };
        generated.unwrap_or_else(|error| panic!("{error}"))
    }
}

/// A property, the hardware to be proved, and defects that must break it.
pub struct Proof<'a> {
    /// The hardware.
    pub hardware: Hardware<'a>,
    /// File in `tests/proofs`. A module defined in it replaces the design's module of that name.
    pub property: &'a str,
    /// Placeholders of the property file and their values.
    pub given: Vec<(&'a str, String)>,
    /// Seeded defects, each with which the property must fail; `make test` tries the first.
    pub defects: Vec<Change>,
    /// Whether products are left undetermined, because no property depends on them.
    pub open_products: bool,
}

/// The modules of `verilog` that `property` uses, directly or through others, and does not define itself.
fn used(verilog: &str, property: &str) -> String {
    let names = |text: &str| -> BTreeSet<String> {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned).collect()
    };
    let name = |module: &str| module.split([' ', '(']).next().unwrap_or_default().to_owned();
    let modules = |text: &str| -> Vec<String> { text.split("\nmodule ").skip(1).map(str::to_owned).collect() };
    let own: Vec<String> = modules(&format!("\n{property}")).iter().map(|module| name(module)).collect();
    let (mut found, mut left) = (names(property), modules(verilog));
    left.retain(|module| !own.contains(&name(module)));
    let mut text = String::new();
    while let Some(next) = left.iter().position(|module| found.contains(&name(module))) {
        let module = left.swap_remove(next);
        found.extend(names(&module));
        text += &format!("module {module}\n");
    }
    text
}

/// The property in `proof.v` on the modules of `used.v` as gates, in the file `proof.aig`.
fn to_gates(folder: &Path, open_products: bool) {
    let cut = if open_products { "cutpoint t:$mul; " } else { "" };
    let script = format!(
        "read_verilog used.v; read_verilog -formal -sv proof.v; hierarchy -top proof; {cut}\
         prep -flatten -nordff -top proof; setundef -undriven -anyseq; setattr -unset keep; delete -output; opt -full; \
         techmap; opt -fast; memory_map; simplemap; dffunmap; abc -g AND -fast; opt_clean; \
         write_aiger -I -B -zinit -no-startoffset proof.aig"
    );
    yosys(folder, &script).unwrap_or_else(|error| panic!("{error}"));
}

/// Whether the property in `proof.aig` is proved; panics if ABC can neither prove nor refute it.
fn proved(folder: &Path) -> bool {
    // Signals that are always equal are merged first, which makes the problem smaller by a third; some are only proved to
    // be equal over several cycles.
    let text = abc(folder, "read_aiger proof.aig; fold; strash; scorr; dc2; scorr -F 4; write_aiger small.aig");
    let header = std::fs::read(folder.join("small.aig")).unwrap_or_default();
    let header = String::from_utf8_lossy(header.split(|&byte| byte == b'\n').next().unwrap_or_default()).into_owned();
    let assertions: usize = header.split(' ').nth(4).and_then(|count| count.parse().ok()).expect(&text);
    assert!(assertions > 0, "nothing is asserted");
    // Together first, because one assertion may be the invariant of another. What this leaves open is decided one by
    // one: then the states that refute one assertion are not mixed with those of another.
    verdict(&abc(folder, "read_aiger small.aig; pdr -T 60")).unwrap_or_else(|_| {
        (0..assertions).all(|assertion| {
            let check = format!("read_aiger small.aig; cone -O {assertion} -s; scorr; pdr -T 60");
            verdict(&abc(folder, &check)).unwrap_or_else(|text| panic!("neither proved nor refuted: {text}"))
        })
    })
}

/// Whether the property in `proof.aig` fails within some cycles after the start, without the simplification that a proof
/// needs: most defects show there. `None` if ABC did not look.
fn fails_soon(folder: &Path) -> Option<bool> {
    let text = abc(folder, "read_aiger proof.aig; fold; strash; bmc3 -F 40 -T 3");
    match verdict(&text) {
        Ok(holds) => Some(!holds),
        Err(text) => text.contains("No output asserted in").then_some(false),
    }
}

/// Whether ABC proved (`true`) or refuted (`false`) what it was given; its output if neither.
fn verdict(text: &str) -> Result<bool, &str> {
    match (text.contains("Property proved."), text.contains("was asserted in frame")) {
        (true, false) => Ok(true),
        (false, true) => Ok(false),
        _ => Err(text),
    }
}

/// What ABC prints for `commands`.
fn abc(folder: &Path, commands: &str) -> String {
    let output = Command::new("yosys-abc").current_dir(folder).args(["-c", commands]).output();
    String::from_utf8_lossy(&output.expect("yosys-abc comes with yosys").stdout).into_owned()
}

impl Proof<'_> {
    /// Proves the property, then checks that it fails with each of the defects.
    pub fn run(self) {
        let generated = &self.hardware.generate(&[]);
        let (folder, top) = (folder_of(generated), &generated.top);
        let property = Path::new(env!("CARGO_MANIFEST_DIR")).join("proofs").join(self.property);
        let mut text = std::fs::read_to_string(&property).unwrap();
        for (name, value) in &self.given {
            text = text.replace(&format!("@{name}@"), value);
        }
        let text = text.replace("@TOP@", top);
        std::fs::write(folder.path().join("proof.v"), &text).unwrap();
        let verilog = format!("{top}.v");
        let gates = |generated: &Generated| {
            let file = generated.files.iter().find(|file| file.name == verilog).unwrap();
            std::fs::write(folder.path().join("used.v"), used(&file.text, &text)).unwrap();
            to_gates(folder.path(), self.open_products);
        };
        gates(generated);
        let holds = match LONG.contains(&self.property) && !nightly() {
            true => fails_soon(folder.path()) == Some(false),
            false => proved(folder.path()),
        };
        assert!(holds, "{} {:?}", self.property, self.given);

        for defect in variants(&self.defects, 1) {
            gates(&self.hardware.generate(std::slice::from_ref(defect)));
            let noticed = fails_soon(folder.path()) == Some(true) || !proved(folder.path());
            assert!(noticed, "{}: the defect in {defect} went unnoticed", self.property);
        }
    }
}

/// A number in the form that a property file needs.
pub fn number(value: usize) -> String {
    value.to_string()
}
