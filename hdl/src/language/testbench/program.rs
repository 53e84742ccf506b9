//! A subject as a Verilator program of its own: stimulus on the standard input, outputs on the standard output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::sync::LazyLock;

use super::subject::{Pin, Subject};
use super::Word;
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

/// Width of a vector with all of these ports: Verilator has types of its own up to 64 bits.
fn vector_bits(pins: &[Pin]) -> usize {
    pins.iter().map(|(_, bits)| bits).sum::<usize>().max(65)
}

/// The subject, and a bench with one vector for all inputs and one for all outputs, field 0 lowest.
fn modules(subject: &Subject) -> String {
    let mut text = subject.verilog.clone();
    let range = |pins: &[Pin]| format!("[{}:0]", vector_bits(pins) - 1);
    let (inputs, outputs) = (range(&subject.inputs), range(&subject.outputs));
    let _ = writeln!(text, "module bench(input wire clk, input wire {inputs} in, output wire {outputs} out);");
    let mut connections: Vec<String> = subject.clock.iter().map(|clock| format!(".{clock}(clk)")).collect();
    for (pins, vector) in [(&subject.inputs, "in"), (&subject.outputs, "out")] {
        let mut at = 0;
        for (name, bits) in pins {
            connections.push(format!(".{name}({vector}[{at} +: {bits}])"));
            at += bits;
        }
        if vector == "out" && at < vector_bits(pins) {
            let _ = writeln!(text, "assign out[{at} +: {}] = 0;", vector_bits(pins) - at);
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
fn pack(fields: &[Word], pins: &[Pin]) -> Vec<u32> {
    let mut words = vec![0u32; vector_bits(pins).div_ceil(32)];
    let mut at = 0;
    for (field, (_, bits)) in fields.iter().zip(pins) {
        for bit in 0..*bits {
            words[(at + bit) / 32] |= (field.field(bit, 1) as u32) << ((at + bit) % 32);
        }
        at += bits;
    }
    words
}

/// The outputs of every cycle under Verilator.
pub(crate) fn verilated(subject: &Subject, stimulus: &[Vec<Word>]) -> Vec<Vec<Word>> {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    file("bench.v", &modules(subject));
    file("main.cpp", MAIN);
    subject.files.iter().for_each(|(name, text)| file(name, text));
    let mut verilator = Command::new("verilator");
    verilator.current_dir(folder.path()).args(["--cc", "--top-module", "bench", "--output-split", "0", "-O3"]);
    verilator.args(["--x-initial", "unique", "-Wall", "-Wno-fatal", "-Wno-DECLFILENAME", "-Wno-MULTITOP"]);
    let log = succeed(verilator.args(["-Wno-UNUSEDSIGNAL", "bench.v"]));
    assert!(!log.contains("%Warning"), "{log}\n{}", modules(subject));
    succeed(&mut RUNTIME.compile(folder.path(), &["main.cpp"], "bench").unwrap());
    let mut run = Command::new(folder.path().join("bench"))
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = run.stdin.take().unwrap();
    let sent: Vec<u8> =
        stimulus.iter().flat_map(|fields| pack(fields, &subject.inputs)).flat_map(u32::to_le_bytes).collect();
    let writer = std::thread::spawn(move || stdin.write_all(&sent).unwrap());
    let output = run.wait_with_output().unwrap();
    writer.join().unwrap();
    let bytes = 4 * vector_bits(&subject.outputs).div_ceil(32);
    let unpack = |cycle: &[u8]| {
        let bit = |at: usize| cycle[at / 8] >> (at % 8) & 1;
        let mut at = 0;
        let field = |(_, bits): &Pin| {
            let mut word = Word::default();
            (0..*bits).for_each(|k| word.set(k, 1, u64::from(bit(at + k))));
            at += bits;
            word
        };
        subject.outputs.iter().map(field).collect()
    };
    output.stdout.chunks(bytes).map(unpack).collect()
}
