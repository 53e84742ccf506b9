//! Proofs for the blocks that make a core of an engine.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_hdl::bus::{Bus, CoreShape, WIDTHS};
use dermis_hdl::language::Change;
use dermis_tests::variants;

use super::prover::{number, Hardware, Proof};
use super::{model, COLS, ROWS};

fn proof<'a>(
    hardware: Hardware<'a>,
    property: &'a str,
    block: &str,
    more: Vec<(&'a str, String)>,
    defects: Vec<Change>,
) -> Proof<'a> {
    let given = [vec![("BLOCK", format!("@TOP@__{block}"))], more].concat();
    Proof { hardware, property, given, defects, open_products: true }
}

#[test]
fn every_access_is_answered_once_and_reads_and_writes_take_turns() {
    let model = model("");
    let hardware = Hardware::Core(&model, CoreShape { bus: Bus::AxiLite, words: 1 });
    let defects = vec![
        // An answer does not wait.
        Change::value("bus", "s_axil_bvalid", |k| k.named("asked") & k.named("writes")),
        // Writes go first always.
        Change::value("bus", "read_next", |k| k.constant(1, 0)),
        // The address of a write counts only while its data are there.
        Change::value("bus", "can_write", |k| k.named("s_axil_awvalid")),
    ];
    proof(hardware, "axi_lite.v", "bus", vec![], defects).run();
}

#[test]
fn codes_are_clipped_and_frames_counted() {
    let model = model("");
    let hardware = Hardware::Core(&model, CoreShape { bus: Bus::Wishbone, words: 1 });
    let bits = model.formats().code_bits as usize;
    let taxels = ROWS * COLS;
    let more = vec![
        ("WIDE", number(bits + 1)),
        ("BITS", number(bits)),
        ("MOST", number((1 << (bits - 1)) - 1)),
        ("COUNT", number(count_bits(taxels))),
        ("LAST", number(taxels - 1)),
    ];
    let defects = vec![
        // A code that is too large wraps.
        Change::value("stream_in", "fits", |k| k.constant(1, 1)),
        // A frame that is spoiled spoils the next one.
        Change::value("stream_in", "now_spoiled", |k| {
            k.named("clipped") | k.named("partial") | k.named("foreign") | k.named("spoiled")
        }),
        // Beats of two frames are mixed unnoticed.
        Change::value("stream_in", "foreign", |k| k.constant(1, 0)),
        // Codes are taken without room for a label.
        Change::value("stream_in", "s_axis_tready", |k| k.named("moves")),
    ];
    proof(hardware, "stream_in.v", "stream_in", more, defects).run();
}

#[test]
fn words_leave_in_order_without_gaps() {
    let model = model("");
    for &words in variants(&WIDTHS, 1) {
        let hardware = Hardware::Core(&model, CoreShape { bus: Bus::Wishbone, words });
        let defects = vec![
            // The last words of a frame are mixed with the next one's first.
            Change::value("stream_out", "s_axis_tready", move |k| {
                k.named("left").less(k.constant(k.named("left").bits(), words as u64))
            }),
            // Words that were not taken are dropped.
            Change::value("stream_out", "taken", |k| k.named("m_axis_tvalid")),
            // A frame that is abandoned while there is no room for its end stays open.
            Change::value("stream_out", "closing", |k| k.constant(1, 0)),
            // The end of a frame that is abandoned has what the engine sends.
            Change::value("stream_out", "given", |k| {
                k.named("closed") | (k.named("s_axis_tvalid") & k.named("s_axis_tready"))
            }),
        ];
        proof(hardware, "stream_out.v", "stream_out", vec![("WORDS", number(words))], defects).run();
    }
}
