//! A kernel as a Verilator program of its own: stimulus on the standard input, outputs on the standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::sync::LazyLock;

use super::{ports, Kernel, Type, Word};
use crate::verilator::Runtime;

/// Verilator's runtime. For models of a few hundred lines, optimising takes longer than it saves.
static RUNTIME: LazyLock<Runtime> = LazyLock::new(|| {
    // target/debug/deps/<test program>
    let program = std::env::current_exe().unwrap();
    let cache = program.ancestors().nth(2).unwrap().join("verilator-runtime");
    Runtime::new(&["-O0"], &cache).unwrap_or_else(|error| panic!("{error} (make setup)"))
});

/// Runs a program to its end and returns what it wrote; panics with that if it fails.
fn succeed(command: &mut Command) -> String {
    let run = command.output().unwrap_or_else(|e| panic!("{:?}: {e} (make setup)", command.get_program()));
    let log = String::from_utf8_lossy(&[run.stdout, run.stderr].concat()).into_owned();
    assert!(run.status.success(), "{command:?}: {log}");
    log
}

/// The kernel as a module, and a bench with one vector for all inputs and one for all outputs, field 0 lowest.
fn modules(kernel: &Kernel) -> String {
    let [inputs, outputs] = ports(kernel);
    let range = |bits: usize| format!("[{}:0]", bits - 1);
    let clock = kernel.clock.clone();
    let clock_name = clock.clone().unwrap_or_default();
    let names = inputs.iter().chain(&outputs).map(|(name, _)| *name);
    let head = kernel.header("dut", clock.as_deref().into_iter().chain(names), &|_| None);
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
    let mut verilator = Command::new("verilator");
    verilator.current_dir(folder.path()).args(["--cc", "--top-module", "bench", "--output-split", "0", "-O3"]);
    verilator.args(["--x-initial", "unique", "-Wall", "-Wno-fatal", "-Wno-DECLFILENAME", "-Wno-MULTITOP"]);
    let log = succeed(verilator.args(["-Wno-UNUSEDSIGNAL", "bench.v"]));
    assert!(!log.contains("%Warning"), "{log}\n{}", modules(kernel));
    succeed(&mut RUNTIME.compile(folder.path(), &["main.cpp"], "bench").unwrap());
    let mut run = Command::new(folder.path().join("bench"))
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
