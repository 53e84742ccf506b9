//! Waveforms: a run as a VCD file, and a GTKWave list of its signals.
//!
//! Recorded are the engine's pins and the taps of all stages, with their words split into the fields that the taps name.
//!
//! ```text
//! dermis.clk
//! dermis.input.{valid, ready, last, code}        dermis.output.{valid, ready, last, fx, fy, fz}
//! dermis.fold.{valid, even_even, …}              dermis.search.{valid, best_x, best_y, score, taken}
//! dermis.instruction.{valid, which, step, name}
//! ```
//! `name` is the instruction that issues products, of the listing of `dermis build --explain`, in ASCII: result, group of rows,
//! matrix and operand.
//! A netlist has no taps, so that only its pins are recorded. A stage's fields keep their last word while its `valid`
//! is low. Values are sampled before the rising edge that ends a cycle and drawn over that whole cycle, one period of
//! the board's clock.

use std::fs::Permissions;
use std::io::{BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::plan::program::listing;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::device::{Device, Inputs, Outputs, Tap};
use vcd::{IdCode, SimulationCommand, TimescaleUnit, Value, VarType, Writer};

use super::against_model::{run, DeviceUnderTest};
use super::drive::Stimulus;
use super::hardware::Hardware;
use super::simulator::Simulator;
use dermis_flow::progress::Progress;
use dermis_golden::write::write;

/// A signal in the VCD file, with the last value written.
struct Signal {
    id: IdCode,
    bits: u32,
    last: Option<i64>,
}

/// Wraps a device and writes every cycle to the VCD file.
struct Waves<W: Write> {
    device: Box<dyn Device>,
    writer: Writer<W>,
    clock: IdCode,
    pins: Vec<Signal>,
    /// Signals of each tap: valid, then the fields.
    taps: Vec<Vec<Signal>>,
    /// The instructions' names, where there is a program.
    instructions: Option<Instructions>,
    cycle: u64,
    period_ps: u64,
    /// The first write error; nothing is written after it.
    failed: Option<std::io::Error>,
}

/// The signal with the name of the running instruction.
struct Instructions {
    id: IdCode,
    /// Index of the tap that says which it is.
    tap: usize,
    /// By section and step.
    names: Vec<Vec<String>>,
    last: Option<[usize; 2]>,
}

/// The tap of the instructions, and the signal with their names.
const INSTRUCTION: &str = "instruction";
const NAME: &str = "name";

/// Written while no instruction issues products.
const NO_TEXT: &str = "-";

impl Instructions {
    /// Writes the name if it differs from the last one; `word` is the tap's.
    fn change<W: Write>(&mut self, writer: &mut Writer<W>, word: Option<&[i64]>, first: bool) -> std::io::Result<()> {
        let running = match word {
            Some(&[section, step]) => Some([section as usize, step as usize]),
            _ => None,
        };
        if !first && running == self.last {
            return Ok(());
        }
        self.last = running;
        let name = running.and_then(|[section, step]| self.names.get(section)?.get(step));
        writer.change_string(self.id, name.map_or(NO_TEXT, String::as_str))
    }
}

/// The instructions of each section as texts of ASCII without spaces, at which a value in a VCD file ends.
fn names(model: &Model) -> Vec<Vec<String>> {
    let mut all: Vec<Vec<String>> = Vec::new();
    for own in listing(model) {
        if own.step == 0 {
            all.push(Vec::new());
        }
        let name = format!("{}:group_{}:{}*{}", own.result, own.group, own.matrix, own.operand);
        let ascii = [(" ", "_"), ("−", "-"), ("⁺", "+"), ("∘", "."), ("μ", "mu")];
        let name = ascii.iter().fold(name, |name, (from, to)| name.replace(from, to));
        all.last_mut().into_iter().for_each(|section| section.push(name.clone()));
    }
    all
}

/// The pins in the order of [`Waves::pins`].
const PINS: [(&str, &[(&str, u32)]); 3] = [
    ("reset", &[("rst", 1)]),
    ("input", &[("valid", 1), ("ready", 1), ("last", 1), ("code", 32)]),
    ("output", &[("valid", 1), ("ready", 1), ("last", 1), ("fx", 32), ("fy", 32), ("fz", 32)]),
];

impl<W: Write> Waves<W> {
    /// Writes the VCD header.
    fn new(device: Box<dyn Device>, taps: &[Tap], model: &Model, out: W) -> std::io::Result<Self> {
        let mut writer = Writer::new(out);
        writer.timescale(1, TimescaleUnit::PS)?;
        writer.add_module("dermis")?;
        let clock = writer.add_wire(1, "clk")?;
        let signal = |writer: &mut Writer<W>, name: &str, bits: u32| {
            Ok::<_, std::io::Error>(Signal { id: writer.add_wire(bits, name)?, bits, last: None })
        };
        let mut pins = Vec::new();
        for (scope, names) in PINS {
            writer.add_module(scope)?;
            for (name, bits) in names {
                pins.push(signal(&mut writer, name, *bits)?);
            }
            writer.upscope()?;
        }
        let (mut streams, mut instructions) = (Vec::new(), None);
        for (index, tap) in taps.iter().enumerate() {
            writer.add_module(tap.name)?;
            let mut stream = vec![signal(&mut writer, "valid", 1)?];
            for name in &tap.fields {
                stream.push(signal(&mut writer, name, tap.field_bits)?);
            }
            if tap.name == INSTRUCTION {
                let id = writer.add_var(VarType::String, 1, NAME, None)?;
                instructions = Some(Instructions { id, tap: index, names: names(model), last: None });
            }
            writer.upscope()?;
            streams.push(stream);
        }
        writer.upscope()?;
        writer.enddefinitions()?;
        writer.begin(SimulationCommand::Dumpvars)?;
        writer.end()?;
        // Even, so that half a period is an integer.
        let period_ps = 2 * (5e5 / model.board.clock_MHz).round() as u64;
        Ok(Waves { device, writer, clock, pins, taps: streams, instructions, cycle: 0, period_ps, failed: None })
    }

    fn write(&mut self, inputs: &Inputs, outputs: &Outputs) -> std::io::Result<()> {
        let start = self.cycle * self.period_ps;
        self.writer.timestamp(start)?;
        self.writer.change_scalar(self.clock, Value::V1)?;
        let flag = i64::from;
        let [fx, fy, fz] = outputs.m_data.map(i64::from);
        let values = [
            flag(inputs.rst),
            flag(inputs.s_valid),
            flag(outputs.s_ready),
            flag(inputs.s_last),
            i64::from(inputs.s_data),
            flag(outputs.m_valid),
            flag(inputs.m_ready),
            flag(outputs.m_last),
            fx,
            fy,
            fz,
        ];
        for (signal, value) in self.pins.iter_mut().zip(values) {
            change(&mut self.writer, signal, value)?;
        }
        for (stream, word) in self.taps.iter_mut().zip(&outputs.taps) {
            let Some((valid, fields)) = stream.split_first_mut() else { continue };
            change(&mut self.writer, valid, flag(word.is_some()))?;
            for (signal, value) in fields.iter_mut().zip(word.iter().flatten()) {
                change(&mut self.writer, signal, *value)?;
            }
        }
        if let Some(instructions) = &mut self.instructions {
            let word = outputs.taps[instructions.tap].as_deref();
            instructions.change(&mut self.writer, word, self.cycle == 0)?;
        }
        self.writer.timestamp(start + self.period_ps / 2)?;
        self.writer.change_scalar(self.clock, Value::V0)
    }
}

/// Writes `value` if it differs from the last one.
fn change<W: Write>(writer: &mut Writer<W>, signal: &mut Signal, value: i64) -> std::io::Result<()> {
    if signal.last == Some(value) {
        return Ok(());
    }
    signal.last = Some(value);
    let bit = |k: u32| if value >> k.min(63) & 1 == 1 { Value::V1 } else { Value::V0 };
    match signal.bits {
        1 => writer.change_scalar(signal.id, bit(0)),
        bits => writer.change_vector(signal.id, &(0..bits).rev().map(bit).collect::<Vec<_>>()),
    }
}

impl<W: Write> Device for Waves<W> {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        let outputs = self.device.cycle(inputs);
        if self.failed.is_none() {
            self.failed = self.write(inputs, &outputs).err();
        }
        self.cycle += 1;
        outputs
    }
}

/// Runs `frames` at full speed through a scene's hardware and writes `<scene>.vcd` and `<scene>.gtkw` into `folder`,
/// each completely or not at all. Returns the GTKWave command that opens them.
///
/// # Errors
/// As [`Hardware::device`]; files that cannot be written.
pub fn waves(scene: &Scene, frames: &[Frame], simulator: Simulator, build: &Path, folder: &Path) -> Result<String> {
    let hardware = Hardware::new(Model::for_frames(scene, frames)?, build)?;
    let at = |path: &Path, error: std::io::Error| anyhow!("{}: {error}", path.display());
    std::fs::create_dir_all(folder).map_err(|e| at(folder, e))?;
    let vectors = hardware.vectors(frames)?;
    let taps = hardware.taps(simulator);
    let (names, vectors) = hardware.observable(simulator, &vectors);
    let _progress = Progress::start(&format!("{}: waveforms", scene.name));
    // A temporary file until the run is complete; deleted on an error.
    let mut part = tempfile::Builder::new();
    // Temporary files are readable by their owner only; the waveforms get the usual permissions.
    part.prefix(".waves-").permissions(Permissions::from_mode(0o644));
    let part = part.tempfile_in(folder).map_err(|e| at(folder, e))?;
    let mut out = BufWriter::new(part.reopen().map_err(|e| at(part.path(), e))?);
    let device = hardware.device(simulator)?;
    let mut device = Waves::new(device, taps, &hardware.model, &mut out).map_err(|e| at(part.path(), e))?;
    let dut = DeviceUnderTest { name: simulator.name(), device: &mut device, taps: &names };
    run(dut, &vectors, Stimulus::FullSpeed);
    let failed = device.failed.take();
    failed.map_or_else(|| out.flush(), Err).map_err(|e| at(part.path(), e))?;
    let vcd = folder.join(format!("{}.vcd", scene.name));
    part.persist(&vcd).map_err(|e| at(&vcd, e.error))?;
    let list = folder.join(format!("{}.gtkw", scene.name));
    write(&list, signal_list(&vcd, taps).as_bytes())?;
    Ok(format!("gtkwave {} {}", vcd.display(), list.display()))
}

/// GTKWave's save file: pins, then the stages in pipeline order; single bits in binary, words as signed decimals.
fn signal_list(vcd: &Path, taps: &[Tap]) -> String {
    const BINARY: &str = "@28";
    const SIGNED: &str = "@420";
    const COMMENT: &str = "@200";
    let name = |path: &Path| PathBuf::from(path.file_name().unwrap_or_default()).display().to_string();
    let mut text = format!("[*] Signals of dermis cosim --waves\n[dumpfile] \"{}\"\n[timestart] 0\n", name(vcd));
    let mut add = |flag: &str, line: &str| text.push_str(&format!("{flag}\n{line}\n"));
    add(BINARY, "dermis.clk");
    let mut group = |scope: &str, signals: &mut dyn Iterator<Item = (&str, u32)>| {
        add(COMMENT, &format!("-{scope}"));
        for (signal, bits) in signals {
            match bits {
                1 => add(BINARY, &format!("dermis.{scope}.{signal}")),
                bits => add(SIGNED, &format!("dermis.{scope}.{signal}[{}:0]", bits - 1)),
            }
        }
    };
    for (scope, pins) in PINS {
        group(scope, &mut pins.iter().copied());
    }
    for tap in taps {
        let words = tap.fields.iter().map(|field| (*field, tap.field_bits));
        let text = (tap.name == INSTRUCTION).then_some((NAME, 1));
        group(tap.name, &mut [("valid", 1)].into_iter().chain(words).chain(text));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::fs::File;
    use vcd::{Command, Parser, ScopeItem};

    /// What a file holds: width of every signal and values of every vector, one per change, by name; the texts of the one signal
    /// that has texts.
    struct Recorded {
        widths: BTreeMap<String, u32>,
        values: BTreeMap<String, Vec<i64>>,
        texts: Vec<String>,
    }

    fn read(path: &Path) -> Recorded {
        let mut parser = Parser::new(std::io::BufReader::new(File::open(path).unwrap()));
        let header = parser.parse_header().unwrap();
        let (mut names, mut widths) = (BTreeMap::new(), BTreeMap::new());
        let mut open: Vec<(String, &[ScopeItem])> = vec![(String::new(), &header.items)];
        while let Some((prefix, items)) = open.pop() {
            for item in items {
                match item {
                    ScopeItem::Scope(scope) => open.push((format!("{prefix}{}.", scope.identifier), &scope.children)),
                    ScopeItem::Var(var) => {
                        names.insert(var.code, format!("{prefix}{}", var.reference));
                        widths.insert(format!("{prefix}{}", var.reference), var.size);
                    }
                }
            }
        }
        let mut values: BTreeMap<String, Vec<i64>> = BTreeMap::new();
        let mut texts = Vec::new();
        for command in parser {
            match command.unwrap() {
                Command::ChangeVector(id, bits) => {
                    let sign = if bits.first() == Some(&Value::V1) { -1 } else { 0 };
                    let value = bits.iter().fold(sign, |value: i64, bit| value << 1 | i64::from(*bit == Value::V1));
                    values.entry(names[&id].clone()).or_default().push(value);
                }
                Command::ChangeString(id, text) => {
                    assert_eq!(names[&id], "dermis.instruction.name");
                    texts.push(text);
                }
                _ => {}
            }
        }
        Recorded { widths, values, texts }
    }

    #[test]
    fn the_file_holds_the_run_by_name() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let frames = &Frame::shipped(&scene)[2..3];
        let work = tempfile::tempdir().unwrap();
        let folder = work.path().join("waves");
        let command = waves(&scene, frames, Simulator::Kernel, work.path(), &folder).unwrap();
        let (vcd, list) = (folder.join("eight-by-eight.vcd"), folder.join("eight-by-eight.gtkw"));
        assert_eq!(command, format!("gtkwave {} {}", vcd.display(), list.display()));
        assert_eq!(std::fs::metadata(&vcd).unwrap().permissions().mode() & 0o777, 0o644);
        // No temporary file remains.
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        let Recorded { widths, values, texts } = read(&vcd);
        // Every listed signal is in the file, with its width.
        let list = std::fs::read_to_string(list).unwrap();
        let listed = list.lines().filter_map(|line| line.strip_prefix("dermis."));
        let mut count = 0;
        for signal in listed {
            let (name, bits) = signal.split_once('[').map_or((signal, 1), |(name, range)| {
                (name, range.split(':').next().unwrap().parse::<u32>().unwrap() + 1)
            });
            assert_eq!(widths.get(&format!("dermis.{name}")), Some(&bits), "{signal}");
            count += 1;
        }
        assert_eq!(count, widths.len());
        // Every instruction of the program has run once, in order.
        let model = Model::new(&scene).unwrap();
        let running: Vec<&String> = texts.iter().filter(|text| *text != NO_TEXT).collect();
        assert!(running.iter().all(|name| name.is_ascii()));
        let mut once = running.clone();
        once.dedup();
        assert_eq!(once, names(&model)[0].iter().collect::<Vec<_>>());
        assert_eq!(texts[0], NO_TEXT);
        assert!(running.iter().any(|name| *name == "v_11:group_0:-Ax*v_01"), "{running:?}");
        // The words are the model's: the search's last word is its result.
        let trace = model.run(&model.readings(frames).unwrap());
        let stage = |name: &str| &trace.stages.iter().find(|stage| stage.name == name).unwrap().words;
        assert_eq!(values["dermis.search.best_x"].last(), Some(&stage("search").last().unwrap()[0]));
        let mut folded: Vec<i64> = stage("fold").iter().map(|word| word[3]).collect();
        folded.dedup();
        assert_eq!(values["dermis.fold.odd_odd"], folded);
        assert_eq!(
            values["dermis.output.fz"].iter().max(),
            trace.beats.iter().map(|beat| i64::from(beat[2])).max().as_ref()
        );
    }
}
