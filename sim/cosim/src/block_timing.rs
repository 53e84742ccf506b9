//! The cycles of a frame that a picture of a block's timing shows: those in which a handshake changes.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::describe::{Recorder, Trace};
use dermis_hdl::wire::Word;

use super::against_model::{run, DeviceUnderTest};
use super::drive::Stimulus;
use super::hardware::Hardware;
use dermis_flow::progress::Progress;

/// The scene of the guide's tables and pictures.
pub const SCENE: &str = "sensor-1";
/// Ports without a timing of their own.
const LEFT_OUT: [&str; 3] = ["clk", "rst", "case_index"];
/// Most columns of a picture: cycles and gaps between them.
const COLUMNS: usize = 26;

/// A port in the cycles shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lane {
    /// Name of the port.
    pub name: String,
    /// Whether the block drives it.
    pub output: bool,
    /// Width in bits.
    pub bits: usize,
    /// A value for each cycle shown.
    pub values: Vec<Word>,
}

/// A block's ports in some cycles of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Timing {
    /// The cycles, ascending, from the first change on.
    pub cycles: Vec<usize>,
    /// The ports that change during the frame.
    pub lanes: Vec<Lane>,
}

/// Simulates the scene's first shipped frame at full speed; the ports of all described blocks in every cycle.
///
/// # Errors
/// A scene without frames or with the serial engine.
pub fn traces(scene: &Scene, build: &Path) -> Result<Vec<Trace>> {
    let (shipped, wanted) = (Frame::shipped(scene), scene.input.frames_per_result());
    let Some(frames) = shipped.get(..wanted) else {
        bail!("{}: {} frames are shipped for its sensor, wanted {wanted}", scene.name, shipped.len());
    };
    let hardware = Hardware::new(Model::for_frames(scene, frames)?, build)?;
    let vector = hardware.vector(frames)?.without_stages();
    let _progress = Progress::start(&format!("{}: ports of a frame", scene.name));
    let mut recorder = Recorder::new(&hardware.model)?;
    run(DeviceUnderTest { name: "kernel", device: &mut recorder, taps: &[] }, &[vector], Stimulus::FullSpeed);
    Ok(recorder.into_traces())
}

/// Columns that these cycles take, with one for each gap.
fn columns(cycles: &BTreeSet<usize>) -> usize {
    let gaps = cycles.iter().zip(cycles.iter().skip(1)).filter(|(cycle, next)| **cycle + 1 < **next).count();
    cycles.len() + gaps
}

/// The first change of every port, the second, the last, then the further ones.
fn by_rank(changes: &[Vec<usize>]) -> Vec<usize> {
    let most = changes.iter().map(Vec::len).max().unwrap_or_default();
    let rank = |rank: usize| changes.iter().filter_map(move |changes| changes.get(rank)).copied();
    let last = changes.iter().filter_map(|changes| changes.last()).copied();
    (0..2).flat_map(rank).chain(last).chain((2..most).flat_map(rank)).collect()
}

/// Adds changes, each with the cycle before it, as long as they take at most `room` columns.
fn add(shown: &mut BTreeSet<usize>, changes: Vec<usize>, room: usize) {
    for cycle in changes {
        let more: BTreeSet<usize> = shown.iter().copied().chain([cycle - 1, cycle]).collect();
        if columns(&more) <= room {
            *shown = more;
        }
    }
}

/// Chooses what to show of a trace.
pub fn timing(trace: &Trace) -> Timing {
    let ports = &trace.block.ports;
    // The cycles of reset are not part of the frame.
    let reset = ports.iter().position(|port| port.name == "rst");
    let is_reset = |cycle: &Vec<Word>| reset.is_some_and(|rst| cycle[rst].number() == 1);
    let begin = trace.cycles.iter().rposition(is_reset).map_or(0, |last| last + 1);
    let cycles = &trace.cycles[begin..];
    let changes = |port: usize, cycle: usize| cycle > 0 && cycles[cycle][port] != cycles[cycle - 1][port];
    let drawn: Vec<usize> = (0..ports.len())
        .filter(|&port| !LEFT_OUT.contains(&ports[port].name.as_str()))
        .filter(|&port| (0..cycles.len()).any(|cycle| changes(port, cycle)))
        .collect();
    let changes_of = |port: usize| (1..cycles.len()).filter(|&cycle| changes(port, cycle)).collect::<Vec<usize>>();
    let of = |words: bool| drawn.iter().filter(move |&&port| words == (ports[port].bits > 1));
    let handshakes: Vec<Vec<usize>> = of(false).map(|&port| changes_of(port)).collect();
    let mut shown = BTreeSet::new();
    add(&mut shown, by_rank(&handshakes), COLUMNS);
    // Where little changes, the words' changes after the first handshake.
    let from = shown.first().copied().unwrap_or_default();
    let words = of(true).map(|&port| changes_of(port).into_iter().filter(|&cycle| cycle > from).collect());
    add(&mut shown, by_rank(&words.collect::<Vec<_>>()), COLUMNS / 3);
    // A gap of one cycle takes as much room as the cycle.
    let single =
        |&cycle: &usize| !shown.contains(&cycle) && shown.contains(&(cycle - 1)) && shown.contains(&(cycle + 1));
    let fill: Vec<usize> = (1..cycles.len()).filter(single).collect();
    shown.extend(fill);
    let lane = |&port: &usize| Lane {
        name: ports[port].name.clone(),
        output: ports[port].output,
        bits: ports[port].bits,
        values: shown.iter().map(|&cycle| cycles[cycle][port]).collect(),
    };
    let lanes = drawn.iter().map(lane).collect();
    let origin = shown.iter().next().copied().unwrap_or_default();
    Timing { cycles: shown.iter().map(|cycle| cycle - origin).collect(), lanes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_hdl::describe::{BlockText, PortText};

    #[test]
    fn cycles_around_changes_are_shown_and_constant_ports_left_out() {
        let port = |name: &str, output, bits| PortText {
            name: name.into(),
            output,
            bits,
            meaning: String::new(),
            valid: String::new(),
        };
        let ports = vec![port("clk", false, 1), port("rst", false, 1), port("valid", true, 1), port("still", true, 4)];
        let block = BlockText { name: "fold", instance: "fold", purpose: String::new(), ports };
        // Two cycles of reset, then valid in the cycles 10 and 30.
        let row = |cycle: u64| {
            let valid = cycle == 12 || cycle == 32;
            vec![cycle % 2, u64::from(cycle < 2), u64::from(valid), 5].into_iter().map(Word::from).collect()
        };
        let timing = timing(&Trace { block, cycles: (0..50).map(row).collect() });
        assert_eq!(timing.cycles, [0, 1, 2, 20, 21, 22]);
        assert_eq!(timing.lanes.len(), 1);
        let shown: Vec<u64> = timing.lanes[0].values.iter().map(Word::number).collect();
        assert_eq!((timing.lanes[0].name.as_str(), shown), ("valid", vec![0, 1, 0, 0, 1, 0]));
    }
}
