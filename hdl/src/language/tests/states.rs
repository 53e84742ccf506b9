//! State machines: their registers, and their states by name.

use super::bound;
use crate::language::testbench::{check, Pipeline};
use crate::language::{Builder, Kernel};
use crate::states;
use crate::wire::Word;

states! {
    /// What a door does.
    enum Door { Closed, Opens, Open }
}

/// A door that opens where it is asked to, and closes by a reset.
fn door() -> Kernel {
    let k = Builder::new("door");
    let [rst, asked] = ["rst", "asked"].map(|name| k.input(name, 1));
    let state = k.machine("state", rst, Door::Closed);
    k.when(state.is(Door::Closed) & asked, || state.goes(Door::Opens));
    k.when(state.is(Door::Opens), || state.goes_to(state.following()));
    k.wire("open", state.is(Door::Open));
    bound(k.finish(), &[("open", 1)])
}

#[test]
fn a_door_opens_in_two_cycles() {
    let mut stimulus = vec![[1, 0], [0, 0], [0, 1], [0, 0], [0, 0], [0, 1], [1, 0], [0, 0]];
    stimulus.extend([[0, 1], [0, 0], [0, 0]]);
    let opens = [0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 1];
    let mut cycle = 0;
    let mut reference = Pipeline::new(0, 1, |_: &[Word]| {
        cycle += 1;
        // Before the first reset it may be anything.
        vec![(cycle > 1).then(|| Word::from(opens[cycle - 1] == 1))]
    });
    let words: Vec<Vec<Word>> =
        stimulus.iter().map(|inputs| inputs.map(|bit| Word::from(bit == 1u8)).to_vec()).collect();
    check(&door(), &words, &mut reference);
}

/// Icarus says the state in words.
#[test]
fn waves_show_a_state_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (folder.path().join("door.v"), folder.path().join("door"));
    let body = door().verilog();
    let test = "initial begin\n  #1 rst = 0; asked = 1; clk = 1;\n  #1 $display(\"%0s\", state_text);\nend\n";
    let ports = "reg clk = 0, rst = 1, asked = 0;\nwire open;\n";
    let first = "initial begin\n  clk = 1; #0 clk = 0;\nend\n";
    std::fs::write(&source, format!("module door;\n{ports}{body}\n{first}{test}endmodule\n")).unwrap();
    let run = |command: &mut std::process::Command| {
        let done = command.output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    };
    run(std::process::Command::new("iverilog").arg("-o").args([&program, &source]));
    assert_eq!(run(std::process::Command::new("vvp").arg(&program)).trim(), "Opens");
    // Synthesis does not see it.
    std::fs::write(&source, format!("module door;\n{ports}{body}\nendmodule\n")).unwrap();
    run(std::process::Command::new("iverilog").arg("-E").arg("-DSYNTHESIS").arg("-o").args([&program, &source]));
    assert!(!std::fs::read_to_string(&program).unwrap().contains("state_text"));
}
