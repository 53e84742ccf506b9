//! The Verilog in an event-driven simulator, Icarus, which knows undefined values (X) and runs a process only when
//! something it reads changes: the words and cycles of the bit-true model, stage by stage, and after a reset no X on
//! valid, ready or last, none on the data of a beat.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use crate::arrays;
use dermis_cosim::bench::{valid, word};
use dermis_cosim::drive::Stimulus;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::{run, DeviceUnderTest, Findings, Vector};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_hdl::device::{Device, Inputs, Outputs, Tap};
use dermis_hdl::language::Change;
use dermis_hdl::{generate_changed, Generated};
use dermis_tests::tools::folder_of;
use dermis_tests::{assert_equal, build_dir, scene, with_network};
use tempfile::TempDir;

/// Bits of an output word.
const WORD: usize = 32;

/// A bench that reads the pins of a cycle as a hexadecimal number and writes the output pins and the taps, valid and
/// word, in binary, before the rising edge.
fn bench(top: &str, code_bits: u32, array_bits: usize, taps: &[Tap]) -> String {
    let declared = taps.iter().enumerate().map(|(k, tap)| {
        format!("  wire v{k} = {};\n  wire [{}:0] d{k} = {};\n", valid(tap, "dut"), tap.bits() - 1, word(tap, "dut"))
    });
    let declared: String = declared.collect();
    let format = " %b %b".repeat(taps.len());
    let words: String = (0..taps.len()).map(|k| format!(", v{k}, d{k}")).collect();
    // Of one array there is no port for its number, which is then 0.
    let array_end = array_bits.max(1) - 1;
    let array = if array_bits == 0 { "" } else { ".s_axis_tid(s_array), .m_axis_tid(m_array), " };
    let none = if array_bits == 0 { "  assign m_array = 1'b0;\n" } else { "" };
    format!(
        "module bench;
  reg clk, rst, s_valid, s_last, m_ready;
  reg [{code_end}:0] s_data;
  reg [{array_end}:0] s_array;
  wire [{array_end}:0] m_array;
{none}  wire s_ready, m_valid, m_last;
  wire [{data_end}:0] m_data;
  reg [63:0] pins;
  {top} dut(.clk(clk), .rst(rst), .s_axis_tdata(s_data), .s_axis_tvalid(s_valid), .s_axis_tready(s_ready),
    .s_axis_tlast(s_last), {array}.m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(m_ready),
    .m_axis_tlast(m_last));
{declared}  initial begin
    clk = 0;
    while ($fscanf(32'h8000_0000, \"%h\", pins) == 1) begin
      {{s_array, s_data, m_ready, s_last, s_valid, rst}} = pins;
      #1 $display(\"%b %b %b %b %b{format}\", s_ready, m_valid, m_last, m_array, m_data{words});
      $fflush;
      clk = 1;
      #1 clk = 0;
    end
    $finish;
  end
endmodule
",
        code_end = code_bits - 1,
        data_end = 3 * WORD - 1,
    )
}

/// A design under Icarus.
struct Icarus {
    process: Child,
    inputs: ChildStdin,
    outputs: BufReader<ChildStdout>,
    code_bits: u32,
    array_bits: usize,
    taps: Vec<Tap>,
    cycle: u64,
    was_reset: bool,
    /// Cycles after a reset with an undefined output, and its name.
    undefined: Vec<(u64, &'static str)>,
    _folder: TempDir,
}

impl Icarus {
    fn new(generated: &Generated, model: &Model) -> Self {
        let folder = folder_of(generated);
        let (code_bits, array_bits) = (model.formats().code_bits, model.scene.hardware.array_bits());
        let bench = bench(&generated.top, code_bits, array_bits, &generated.taps);
        std::fs::write(folder.path().join("bench.v"), bench).unwrap();
        let is_verilog = |name: &&str| Path::new(name).extension().is_some_and(|end| end == "v");
        let sources = generated.files.iter().map(|file| file.name.as_str()).filter(is_verilog);
        let built = Command::new("iverilog")
            .current_dir(folder.path())
            .args(["-g2005", "-Wall", "-s", "bench", "-o", "bench.vvp", "bench.v"])
            .args(sources)
            .output()
            .expect("iverilog is installed (make setup)");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let mut process = Command::new("vvp")
            .current_dir(folder.path())
            .args(["-n", "bench.vvp"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (inputs, outputs) = (process.stdin.take().unwrap(), BufReader::new(process.stdout.take().unwrap()));
        let (undefined, taps) = (Vec::new(), generated.taps.clone());
        let (cycle, was_reset) = (0, false);
        Icarus { process, inputs, outputs, code_bits, array_bits, taps, cycle, was_reset, undefined, _folder: folder }
    }
}

impl Drop for Icarus {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Device for Icarus {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let bits = [inputs.rst, inputs.s_valid, inputs.s_last, inputs.m_ready];
        let control: u64 = bits.iter().enumerate().map(|(at, bit)| u64::from(*bit) << at).sum();
        let code = u64::from(inputs.s_data as u32) & (u64::MAX >> (64 - self.code_bits));
        let array = (inputs.s_array as u64) << (bits.len() + self.code_bits as usize);
        writeln!(self.inputs, "{:x}", array | code << bits.len() | control).unwrap();
        let mut line = String::new();
        self.outputs.read_line(&mut line).unwrap();
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [ready, valid, last, array, data, ref words @ ..] = fields[..] else {
            panic!("cycle {}: {line:?}", self.cycle)
        };
        if self.was_reset && !inputs.rst {
            let known = |bits: &str| bits.chars().all(|bit| matches!(bit, '0' | '1'));
            let [data, array] = [data, array].map(|bits| if valid == "1" { bits } else { "" });
            let outputs = [("ready", ready), ("valid", valid), ("last", last), ("array", array), ("data", data)];
            let undefined = outputs.iter().filter(|(_, bits)| !known(bits));
            self.undefined.extend(undefined.map(|(name, _)| (self.cycle, *name)));
        }
        self.was_reset |= inputs.rst;
        self.cycle += 1;
        // Field 0 is in the low bits, the last characters. What is undefined counts as 0 here; it has been noted above.
        let field = |word: &str, index: usize, bits: usize| {
            let end = word.len() - index * bits;
            let value = u64::from_str_radix(&word[end - bits..end].replace(|bit| bit != '1', "0"), 2).unwrap();
            (value << (64 - bits)) as i64 >> (64 - bits)
        };
        let tap = |(tap, pair): (&Tap, &[&str])| {
            let word = |index| field(pair[1], index, tap.field_bits as usize);
            (pair[0] == "1").then(|| (0..tap.fields.len()).map(word).collect())
        };
        Outputs {
            s_ready: ready == "1",
            m_valid: valid == "1",
            m_last: last == "1",
            m_array: array.chars().fold(0, |number, bit| 2 * number + usize::from(bit == '1')) % (1 << self.array_bits),
            m_data: [0, 1, 2].map(|index| field(data, index, WORD) as i32),
            taps: self.taps.iter().zip(words.chunks(2)).map(tap).collect(),
        }
    }
}

/// Runs the vectors under Icarus; what differs from the model, and which outputs were undefined.
fn simulate(hardware: &Hardware, vectors: &[Vector], stimulus: Stimulus) -> (Findings, Vec<(u64, &'static str)>) {
    let mut device = Icarus::new(&hardware.generated, &hardware.model);
    let dut = DeviceUnderTest { name: "icarus", device: &mut device, taps: &hardware.tap_names() };
    let (findings, _) = run(dut, vectors, stimulus);
    (findings, device.undefined.clone())
}

/// A built-in scene with its own estimator, or searching so many taxels per cycle.
fn setup(name: &str, frames: usize, search_width: Option<usize>) -> (Hardware, Vec<Vector>) {
    let (mut scene, shipped) = scene(name);
    if search_width.is_some() {
        (scene.hardware.estimator, scene.hardware.search_width) = (Some(EstimatorKind::Search), search_width);
    }
    of_scene(&scene, &shipped[..frames])
}

fn of_scene(scene: &Scene, frames: &[Frame]) -> (Hardware, Vec<Vector>) {
    let hardware = Hardware::new(Model::new(scene).unwrap(), &build_dir()).unwrap();
    let vectors = frames.iter().map(|frame| hardware.vector(std::slice::from_ref(frame)).unwrap()).collect();
    (hardware, vectors)
}

#[test]
fn words_and_cycles_are_those_of_the_model_and_nothing_is_undefined() {
    for (name, frames, search_width, stimulus) in [
        ("eight-by-eight", 3, Some(4), Stimulus::FullSpeed),
        ("eight-by-eight", 3, Some(4), Stimulus::Stalls { seed: 1 }),
        ("eight-by-eight-bonded", 1, Some(1), Stimulus::FullSpeed),
        // With its network.
        ("sensor-1-bonded", 1, None, Stimulus::FullSpeed),
    ] {
        let (hardware, vectors) = setup(name, frames, search_width);
        let (findings, undefined) = simulate(&hardware, &vectors, stimulus);
        assert_equal(&findings, stimulus);
        assert!(undefined.is_empty(), "{stimulus}: {} {:?}", undefined.len(), &undefined[..undefined.len().min(9)]);
    }
}

#[test]
fn several_arrays_are_equal_too() {
    let (_folder, scene) = arrays::scene(arrays::SCENES[0].1);
    let (hardware, _) = of_scene(&scene, &[]);
    let vectors = arrays::vectors(&hardware.model);
    let (findings, undefined) = simulate(&hardware, &vectors[..40], Stimulus::BackToBack);
    assert_equal(&findings, "arrays");
    assert!(undefined.is_empty(), "{} {:?}", undefined.len(), &undefined[..undefined.len().min(9)]);
}

#[test]
fn with_a_network_and_with_contacts_nothing_is_undefined_either() {
    let contacts = "[partition]\ncase = \"contacts\"\nmax_contacts = 3\n";
    let records = &format!("{contacts}[output]\nforces = \"resultants\"\n");
    for more in ["", contacts, records] {
        let text = format!(
            "name = \"network\"\n[sensor]\nrows = 4\ncols = 5\npitch_x_mm = 2.0\npitch_y_mm = 2.0\nthickness_mm = 2.0\n{more}"
        );
        let (scene, _file) = with_network(&text, &[13, 7]);
        let frames = [Frame::eq2(&scene.sensor), Frame::from_stress("plain", &scene.sensor, vec![0.1; 20]).unwrap()];
        let (hardware, vectors) = of_scene(&scene, &frames);
        for stimulus in [Stimulus::FullSpeed, Stimulus::Stalls { seed: 2 }] {
            let (findings, undefined) = simulate(&hardware, &vectors, stimulus);
            assert_equal(&findings, stimulus);
            assert!(
                undefined.is_empty(),
                "{more} {stimulus}: {} {:?}",
                undefined.len(),
                &undefined[..undefined.len().min(9)]
            );
        }
    }
}

/// Registers without a value that reach an output: the valid bit of the output, which a two-state simulation with a lucky
/// start value shows as correct; the data of a queue place that has not been written.
#[test]
fn an_undefined_register_is_found() {
    let (mut hardware, vectors) = setup("eight-by-eight", 1, Some(4));
    let queue = "forces__leaving";
    let unwritten = |k: &'static str| Change::value(queue, k, |k| k.array("places").read(!k.named("read").low(4)));
    let defects = [(Change::undefined(queue, "m_axis_tvalid"), "valid"), (unwritten("head"), "data")];
    for (defect, output) in defects {
        let name = defect.to_string();
        hardware.generated = generate_changed(&hardware.model, &[defect]).unwrap();
        let (_, undefined) = simulate(&hardware, &vectors, Stimulus::FullSpeed);
        assert!(
            undefined.iter().any(|(_, name)| *name == output),
            "the defect in {name} went unnoticed: {undefined:?}"
        );
    }
}
