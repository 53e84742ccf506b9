//! The prover: runs Yosys and ABC on a property of `tests/proofs` and the Verilog.

use std::path::Path;
use std::process::Command;

use dermis_golden::fixed::Model;
use dermis_hdl::bus::{generate_core_changed, CoreShape};
use dermis_hdl::language::Change;
use dermis_hdl::link::generate_board_changed;
use dermis_hdl::{generate_changed, Generated};
use dermis_tests::tools::{folder_of, yosys};

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
    /// Seeded defects, each with which the property must fail.
    pub defects: Vec<Change>,
    /// Whether products are left undetermined, because no property depends on them.
    pub open_products: bool,
}

/// Modules of the design `top` that a property replaces.
fn replaced(top: &str, property: &str) -> String {
    let own = property.lines().filter_map(|line| line.strip_prefix("module ")?.strip_prefix(top));
    own.map(|rest| format!("delete {top}{}; ", rest.split('(').next().unwrap_or_default())).collect()
}

/// The property on the Verilog of `top` as gates, in the file `proof.aig`.
fn to_gates(folder: &Path, top: &str, open_products: bool) {
    let cut = if open_products { "cutpoint t:$mul; " } else { "" };
    let own = replaced(top, &std::fs::read_to_string(folder.join("proof.v")).unwrap());
    let script = format!(
        "read_verilog {top}.v; {own}read_verilog -formal -sv proof.v; hierarchy -top proof; {cut}\
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

/// Whether the property in `proof.aig` fails within some cycles after the start: most defects show there, without the
/// simplification that a proof needs.
fn fails_soon(folder: &Path) -> bool {
    verdict(&abc(folder, "read_aiger proof.aig; fold; strash; bmc3 -F 40 -T 3")) == Ok(false)
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
        std::fs::write(folder.path().join("proof.v"), text.replace("@TOP@", top)).unwrap();
        let gates = || to_gates(folder.path(), top, self.open_products);
        gates();
        assert!(proved(folder.path()), "{} {:?}", self.property, self.given);

        let verilog = format!("{top}.v");
        for defect in self.defects {
            let name = defect.to_string();
            let broken = self.hardware.generate(&[defect]).files.into_iter().find(|file| file.name == verilog);
            std::fs::write(folder.path().join(&verilog), broken.unwrap().text).unwrap();
            gates();
            let noticed = fails_soon(folder.path()) || !proved(folder.path());
            assert!(noticed, "{}: the defect in {name} went unnoticed", self.property);
        }
    }
}

/// A number in the form that a property file needs.
pub fn number(value: usize) -> String {
    value.to_string()
}
