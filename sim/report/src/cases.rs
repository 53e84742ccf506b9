//! The cases of a scene whose hardware chooses among several per frame, as text.

use dermis_golden::fixed::stages::choose::LATENCY;
use dermis_golden::fixed::{CasePlan, Cycles, Model};
use dermis_hdl::Refused;

use super::table::markdown;

/// A table of the cases in hardware with their cycles, and the cases left out with the reason; empty if the scene has
/// one case.
pub fn cases(model: &Model, refused: &[Refused]) -> String {
    if !model.chooses() {
        return String::new();
    }
    let row = |case: &CasePlan| {
        let latency = Cycles::longest_of_case(model, case).latency + LATENCY;
        let cells = [case.parts.len(), case.formats.quads, case.storage.words(), case.status_beats(), latency as usize];
        [vec![case.number().to_string()], cells.map(|cell| cell.to_string()).to_vec()].concat()
    };
    let head = ["case", "subarrays", "quads", "coefficient words", "status beats", "cycles"];
    let mut text = format!("chosen per frame:\n{}", markdown(&head, model.cases().iter().map(row).collect()));
    let board = &model.board;
    for Refused { case, with, needs } in refused {
        let with: Vec<String> = with.iter().map(u32::to_string).collect();
        text.push_str(&format!(
            "case {case} is left out: {} together need {} of {} block RAMs, {} of {} multipliers, {} of {} LUTs\n",
            with.join(", "),
            needs.block_rams,
            board.block_rams,
            needs.multipliers,
            board.multipliers,
            needs.luts,
            board.luts,
        ));
    }
    text
}
