//! Waivers of Verilator warnings, as a file that Verilator reads; each stands under its reason.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::device::Tap;
use crate::language::Hierarchy;

/// Reasons why an output of a block inside another one is not read, and the outputs.
const UNREAD: [(&str, &[&str]); 4] = [
    (
        "these counters are cleared from outside; their end is not needed.",
        &["column__last", "frame_quads__last", "quads__last"],
    ),
    ("only `last` of this counter is used.", &["period__value"]),
    (
        "`receive` writes by mask and needs the end of a row, `send` reads by lane: outputs of one block.",
        &["scan__mask", "scan__row_end", "scan__lane"],
    ),
    (
        "constant without contacts, of which the test bench observes them.",
        &["operand_source__of_window", "segment__labelled", "segment__labelled_quad"],
    ),
];
/// The same for the signals of taps.
const OBSERVED: &str = "taps that the test bench observes; synthesis removes them.";

/// The waivers that a design needs.
pub(crate) fn waivers(hierarchy: &Hierarchy, taps: &[Tap]) -> String {
    let mut text =
        "`verilator_config\n// \"Filename does not match MODULE name\": all modules of a design are in one file.\n\
        lint_off -rule DECLFILENAME -file \"*.v\"\n"
            .to_owned();
    let mut waive = |reason: &str, names: Vec<&str>| {
        if !names.is_empty() {
            let _ = writeln!(text, "// \"Signal is not used\": {reason}");
        }
        for name in names {
            let _ = writeln!(text, "lint_off -rule UNUSEDSIGNAL -file \"*.v\" -match \"Signal is not used: '{name}'\"");
        }
    };
    let top: BTreeSet<&str> =
        hierarchy.kernels().filter(|(path, _)| path.is_empty()).flat_map(|(_, top)| top.unread()).collect();
    let signals = taps.iter().flat_map(|tap| tap.valid.iter().chain(tap.word.iter().map(|signal| &signal.name)));
    let observed: BTreeSet<&str> = signals.map(String::as_str).filter(|name| top.contains(name)).collect();
    let all: BTreeSet<&str> = hierarchy.kernels().flat_map(|(_, kernel)| kernel.unread()).collect();
    for (reason, names) in UNREAD {
        let is_unread = |name: &&str| all.contains(name) && !observed.contains(name);
        waive(reason, names.iter().copied().filter(is_unread).collect());
    }
    waive(OBSERVED, observed.into_iter().collect());
    text
}
