//! Runs a kernel in its own simulation and under Verilator against a reference in plain integers: every output, every
//! cycle.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use super::kernel::{Kernel, Role, Type};
use super::simulate::Simulation;
use crate::wire::Word;

/// A reference in plain integers.
pub(crate) trait Reference {
    /// The outputs before the clock edge of a cycle with these inputs, in the order of the names; `None` for what is
    /// undefined.
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>>;
    /// The clock edge.
    fn clock(&mut self, inputs: &[Word]);
}

/// A reference without state: the outputs are a function of the inputs of `latency` cycles earlier.
pub(crate) struct Pipeline<F> {
    of: F,
    outputs: VecDeque<Vec<Option<Word>>>,
}

impl<F: FnMut(&[Word]) -> Vec<Option<Word>>> Pipeline<F> {
    /// `of` gives the `count` outputs from the inputs; before, they are undefined.
    pub(crate) fn new(latency: usize, count: usize, of: F) -> Self {
        Pipeline { of, outputs: vec![vec![None; count]; latency].into() }
    }
}

impl<F: FnMut(&[Word]) -> Vec<Option<Word>>> Reference for Pipeline<F> {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        self.outputs.push_back((self.of)(inputs));
        self.outputs.pop_front().unwrap()
    }

    fn clock(&mut self, _: &[Word]) {}
}

/// Random words of these widths, of which every fourth is all zeros or all ones.
pub(crate) fn random_words(cycles: usize, widths: &[usize]) -> Vec<Vec<Word>> {
    let mut random = fastrand::Rng::with_seed(20);
    (0..cycles).map(|_| widths.iter().map(|&bits| random_word(&mut random, bits)).collect()).collect()
}

/// A random word of `bits` bits, every fourth all zeros or all ones.
pub(crate) fn random_word(random: &mut fastrand::Rng, bits: usize) -> Word {
    let kind = random.u8(..8);
    let mut word = Word::default();
    for low in (0..bits).step_by(64) {
        let limb = match kind {
            0 => 0,
            1 => u64::MAX,
            _ => random.u64(..),
        };
        word.set(low, (bits - low).min(64), limb);
    }
    word
}

/// Name and width of the ports of a kernel: inputs, driven ports.
fn ports(kernel: &Kernel) -> [Vec<(&str, Type)>; 2] {
    let of = |is_output: bool| {
        let own = move |signal: &&super::kernel::Signal| {
            if is_output {
                signal.output
            } else {
                signal.role == Role::Input
            }
        };
        kernel.signals.iter().filter(own).map(|signal| (signal.name.as_str(), signal.ty)).collect()
    };
    [of(false), of(true)]
}

/// The kernel as a module, and a bench with one vector for all inputs and one for all outputs, field 0 lowest.
fn modules(kernel: &Kernel) -> String {
    let [inputs, outputs] = ports(kernel);
    let range = |bits: usize| format!("[{}:0]", bits - 1);
    let clock = kernel.clock.clone();
    let clock_name = clock.clone().unwrap_or_default();
    let names = inputs.iter().chain(&outputs).map(|(name, _)| *name);
    let head = kernel.header("dut", clock.as_deref().into_iter().chain(names));
    let mut text = format!("{head}\n{}\nendmodule\n", kernel.verilog());
    let sum = |ports: &[(&str, Type)]| ports.iter().map(|(_, ty)| ty.bits).sum::<usize>().max(65);
    let _ = writeln!(
        text,
        "module bench(input wire clk, input wire {} in, output wire {} out);",
        range(sum(&inputs)),
        range(sum(&outputs))
    );
    let mut connections: Vec<String> = clock.iter().map(|_| format!(".{clock_name}(clk)")).collect();
    for (ports, vector) in [(&inputs, "in"), (&outputs, "out")] {
        let mut at = 0;
        for (name, ty) in ports.iter() {
            connections.push(format!(".{name}({vector}[{at} +: {}])", ty.bits));
            at += ty.bits;
        }
        if vector == "out" && at < 65 {
            let _ = writeln!(text, "assign out[{at} +: {}] = 0;", 65 - at);
        }
    }
    let _ = writeln!(text, "dut dut({});\nendmodule", connections.join(", "));
    text
}

/// Reads cycles of `in` from the standard input, clocks, writes `out` of each before its rising edge.
const MAIN: &str = r#"
#include "Vbench.h"
#include "verilated.h"
#include <cstdio>
int main() {
  Verilated::randReset(2);
  Verilated::randSeed(1);
  Vbench* top = new Vbench;
  while (fread(top->in.data(), sizeof(top->in), 1, stdin) == 1) {
    top->clk = 0; top->eval();
    fwrite(top->out.data(), sizeof(top->out), 1, stdout);
    top->clk = 1; top->eval();
  }
  delete top;
}
"#;

/// Words of 32 bits of the fields, field 0 lowest.
fn pack(fields: &[Word], types: &[(&str, Type)]) -> Vec<u32> {
    let total = types.iter().map(|(_, ty)| ty.bits).sum::<usize>().max(65);
    let mut words = vec![0u32; total.div_ceil(32)];
    let mut at = 0;
    for (field, (_, ty)) in fields.iter().zip(types) {
        for bit in 0..ty.bits {
            words[(at + bit) / 32] |= (field.field(bit, 1) as u32) << ((at + bit) % 32);
        }
        at += ty.bits;
    }
    words
}

/// The outputs of every cycle under Verilator.
pub(crate) fn verilated(kernel: &Kernel, stimulus: &[Vec<Word>]) -> Vec<Vec<Word>> {
    let [inputs, outputs] = ports(kernel);
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    file("bench.v", &modules(kernel));
    file("main.cpp", MAIN);
    kernel.memory_files().iter().for_each(|(name, text)| file(name, text));
    let built = Command::new("verilator")
        .current_dir(folder.path())
        .args(["--cc", "--exe", "--build", "--top-module", "bench", "-Wall", "-Wno-fatal", "-Wno-DECLFILENAME"])
        .args(["-Wno-MULTITOP", "-Wno-UNUSEDSIGNAL", "--x-initial", "unique", "-O3", "-CFLAGS", "-O1", "bench.v"])
        .arg("main.cpp")
        .output()
        .expect("verilator is installed (make setup)");
    let log = String::from_utf8_lossy(&built.stderr).into_owned();
    assert!(built.status.success() && !log.contains("%Warning"), "{log}\n{}", modules(kernel));
    let mut run = Command::new(folder.path().join("obj_dir/Vbench"))
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = run.stdin.take().unwrap();
    let sent: Vec<u8> = stimulus.iter().flat_map(|fields| pack(fields, &inputs)).flat_map(u32::to_le_bytes).collect();
    let writer = std::thread::spawn(move || stdin.write_all(&sent).unwrap());
    let output = run.wait_with_output().unwrap();
    writer.join().unwrap();
    let bytes = 4 * outputs.iter().map(|(_, ty)| ty.bits).sum::<usize>().max(65).div_ceil(32);
    let unpack = |cycle: &[u8]| {
        let bit = |at: usize| cycle[at / 8] >> (at % 8) & 1;
        let mut at = 0;
        let field = |(_, ty): &(&str, Type)| {
            let mut word = Word::default();
            (0..ty.bits).for_each(|k| word.set(k, 1, u64::from(bit(at + k))));
            at += ty.bits;
            word
        };
        outputs.iter().map(field).collect()
    };
    output.stdout.chunks(bytes).map(unpack).collect()
}

/// The outputs of every cycle in the kernel's simulation.
pub(crate) fn simulated(kernel: &Kernel, stimulus: &[Vec<Word>]) -> Vec<Vec<Word>> {
    let [inputs, outputs] = ports(kernel);
    let mut simulation = Simulation::new(kernel);
    let mut all = Vec::new();
    for fields in stimulus {
        for (field, (name, ty)) in fields.iter().zip(&inputs) {
            let slot = simulation.slot_of(kernel, name).unwrap();
            simulation.set(slot, &field.limbs()[..ty.bits.div_ceil(64)]);
        }
        simulation.show();
        let value = |(name, ty): &(&str, Type)| {
            let mut word = Word::default();
            let limbs = ty.bits.div_ceil(64);
            let slot = simulation.slot_of(kernel, name).unwrap();
            // A signed number has its sign above its width.
            for (limb, value) in simulation.get(slot, limbs).iter().enumerate() {
                word.set(64 * limb, (ty.bits - 64 * limb).min(64), *value);
            }
            word
        };
        all.push(outputs.iter().map(value).collect());
        simulation.clock();
    }
    all
}

/// Checks both simulations of a kernel against `reference`; inputs and outputs in the order of the kernel's signals.
pub(crate) fn check(kernel: &Kernel, stimulus: &[Vec<Word>], reference: &mut dyn Reference) {
    assert!(kernel.errors().is_empty(), "{:?}", kernel.errors());
    let [_, outputs] = ports(kernel);
    let runs = [("simulation", simulated(kernel, stimulus)), ("verilator", verilated(kernel, stimulus))];
    let mut compared = 0;
    for (cycle, inputs) in stimulus.iter().enumerate() {
        let expected = reference.outputs(inputs);
        for (name, run) in &runs {
            for (k, (output, _)) in outputs.iter().enumerate() {
                if let Some(expected) = expected[k] {
                    assert_eq!(run[cycle][k], expected, "{name}, cycle {cycle}, {output}");
                    compared += 1;
                }
            }
        }
        reference.clock(inputs);
    }
    assert!(compared > stimulus.len(), "hardly anything is defined");
}
