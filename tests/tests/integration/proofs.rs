//! Formal proofs for the small blocks with a handshake, for any input, any stall, a reset at any cycle, and any number
//! of cycles: Yosys translates the generated Verilog with a property of `tests/proofs` into an and-inverter graph, and
//! the model checker ABC, which comes with it, finds an inductive invariant (property directed reachability).
//!
//! | property | blocks |
//! |---|---|
//! | `stream.v`: an offered beat stays valid and unchanged | `prepare`, `resultants`, the link's relay |
//! | `calibrate.v`: each beat leaves once, in order, saturated | `calibrate` |
//! | `average.v`: as many sums as taxels, tlast on the last | `average` |
//! | `sliding_mean.v`: each beat leaves once, with tlast and the number of frames | `average` with a sliding mean |
//! | `receive.v`: a frame is stored completely at its address; tlast is checked; dead taxels become 0 | `receive` |
//! | `send.v`: a frame has all its beats, none is sent outside a frame | `send`, `forces` |
//! | `queue.v`: beats leave in order and unchanged, an offered beat stays | `forces`' queue |
//! | `counter.v`: a count is below its limit | counters |
//! | `frame_ingress.v`: an offered code stays; one complete frame per accepted packet and no other | `frame_ingress` |
//! | `slip.v`: each byte is sent once and can be decoded | the link's encoder |
//! | `rescale.v`: rounds half up, saturates, counts saturations | `rescaler` |
//! | `replay.v`: rows wait for their shift, then leave once, in order | `rescale` and its memory |
//! | `operand_writer.v`: addresses are inside the operand memory; "complete" means complete | `pass`'s operand writer |
//! | `packer.v`: header, words, CRC between two ENDs; an offered byte stays | the link's packer |
//! | `roundtrip.v`: decoding restores the encoded bytes, with or without IDLE bytes in between | the link's encoder and decoder |
//! | `label_beats.v`: labels leave between forces and statuses, those of every taxel in its place | `label_beats` |
//! | `axi_lite.v`: every access is answered once, an answer stays, reads and writes take turns | a core's `axi_lite` |
//! | `stream_in.v`: every code leaves once, clipped; frames are counted, labels are theirs | a core's `stream_in` |
//! | `stream_out.v`: words leave in order without gaps, an offered beat stays | a core's `stream_out` |
//! | `sums.v`: forces are accepted, four words sent, the status passed on | the link's resultants |
//!
//! Not proved, but verified by co-simulation: the UART's shift registers, the SPI slave's two clocks, the link's
//! parser, counters and request queue, which have no back-pressure; the banks of an adaptive scene, several `receive`
//! in step; the rounding of the force unit.
//!
//! Each proof has seeded defects with which it must fail. `make nightly` tries all of them, and proves what takes ABC half a
//! minute; without it only a short counterexample of those is looked for.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::stages::send::STATUS_BEATS;
use dermis_golden::fixed::Model;
use dermis_golden::spec::quads::Quads;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::language::Change;
use dermis_hdl::primitives::FORCE_STEPS;

mod buses;
mod prover;
mod queues;

use prover::{number, Hardware, Proof};

const ROWS: usize = 2;
const COLS: usize = 3;
/// The array's one dead taxel, row-major.
const DEAD: usize = 4;
/// Zeros of the taxels in codes of 8 bits, for a full scale of 127.
const ZEROS: [i32; ROWS * COLS] = [13, -25, 38, 0, 114, -114];

/// Narrow words and a small array: the control logic does not depend on them.
fn model(more: &str) -> Model {
    with_inverse(8, more)
}

/// The same with Cz⁺ of `bits` bits.
fn with_inverse(bits: u32, more: &str) -> Model {
    let text = text(bits, more);
    let folder = tempfile::tempdir().unwrap();
    let line = |row: &[i32]| row.iter().map(i32::to_string).collect::<Vec<_>>().join(",") + "\n";
    std::fs::write(folder.path().join("tare.csv"), ZEROS.chunks(COLS).map(line).collect::<String>()).unwrap();
    Model::new(&Scene::parse(&text, folder.path().join("proofs.toml").to_str().unwrap()).unwrap()).unwrap()
}

fn text(inverse_bits: u32, more: &str) -> String {
    format!(
        "name = \"proofs\"\n[sensor]\nrows = {ROWS}\ncols = {COLS}\npitch_x_mm = 4.0\npitch_y_mm = 4.0\n\
         thickness_mm = 3.0\n[fixed]\ninput_bits = 8\ndata_bits = 12\ncoef_bits = 8\ninverse_bits = {inverse_bits}\n\
         [search]\nmu_max = 0.05\n{more}"
    )
}

fn prepared() -> Model {
    model("[input]\naverage = 1\nfull_scale_MPa = 127.0\ntare = \"tare.csv\"\ndead = [[1, 1]]\n")
}

#[test]
fn streams_keep_what_they_offer() {
    let (prepared, sums, plain) = (prepared(), model("[output]\nforces = \"resultants\"\n"), model(""));
    let streams = [
        (
            Hardware::Engine(&prepared),
            "prepare",
            [8, 9],
            Change::value("prepare__average", "moves", |k| k.constant(1, 1)),
        ),
        (Hardware::Engine(&sums), "resultants", [96, 96], Change::value("resultants", "sent", |k| k.named("sending"))),
        (
            Hardware::Board(&plain),
            "link__back",
            [96, 96],
            Change::value("link__back", "m_axis_tdata", |k| k.named("s_axis_tdata")),
        ),
    ];
    for (hardware, block, [taken, offered], defect) in streams {
        let given = vec![("BLOCK", format!("@TOP@__{block}")), ("IN", number(taken)), ("OUT", number(offered))];
        Proof { hardware, property: "stream.v", given, defects: vec![defect], open_products: true }.run();
    }
}

#[test]
fn calibrate_loses_nothing_and_saturates() {
    let hardware = Hardware::Engine(&prepared());
    let sign = |zero: i32| if zero < 0 { "-" } else { "" };
    let zero = |(taxel, zero): (usize, &i32)| format!("      3'd{taxel}: zero = {}16'sd{};\n", sign(*zero), zero.abs());
    let zeros: String = ZEROS.iter().enumerate().map(zero).collect();
    let never = |signal, bit| Change::value("prepare__calibrate", signal, move |k| k.constant(1, bit));
    let defects = vec![never("moves", 1), never("clipped", 0)];
    let given = vec![("ZEROS", zeros), ("BITS", number(8)), ("MOST", number(127)), ("LAST", number(ZEROS.len() - 1))];
    Proof { hardware, property: "calibrate.v", given, defects, open_products: false }.run();
}

#[test]
fn average_gives_as_many_sums_as_taxels() {
    let hardware = Hardware::Engine(&prepared());
    let given = vec![("BITS", number(8)), ("LAST", number(ROWS * COLS - 1))];
    // A sum leaves with every frame.
    let defects =
        vec![Change::within("prepare__average", "m_axis_tvalid", |k| [k.named("held_leaves"), k.constant(1, 1)])];
    Proof { hardware, property: "average.v", given, defects, open_products: false }.run();
}

#[test]
fn a_sliding_mean_loses_nothing_and_counts_its_frames() {
    let model = model("[input]\naverage = 1\nmean = \"sliding\"\n");
    let given = vec![("BITS", number(8)), ("LAST", number(ROWS * COLS - 1))];
    // A stall is ignored; the count starts again after its largest number.
    let defects = vec![
        Change::value("prepare__average", "moves", |k| k.constant(1, 1)),
        Change::value("prepare__average", "next", |k| k.named("whole").plus(1)),
    ];
    let hardware = Hardware::Engine(&model);
    Proof { hardware, property: "sliding_mean.v", given, defects, open_products: false }.run();
}

#[test]
fn receive_holds_whole_frames() {
    let quads = Quads { rows: ROWS, cols: COLS };
    let bits = count_bits(quads.len());
    let place = |k: usize| format!("      {}'d{k}: own = 8'd{};\n", bits + 2, quads.taxel(k / 4, k % 4));
    let defects = vec![
        // A dead taxel keeps its code; a lane is written without a beat.
        Change::value("receive__input_mask", "kept", |k| k.named("word")),
        Change::value("receive", "frame__write", |k| k.named("scan__mask")),
    ];
    let given = vec![
        ("PLACES", (0..4 * quads.len()).map(place).collect()),
        ("DEAD", format!("count == 8'd{DEAD}")),
        ("BITS", number(9)),
        ("LAST", number(ROWS * COLS - 1)),
        ("ADDRESS", number(bits)),
    ];
    let hardware = Hardware::Engine(&prepared());
    Proof { hardware, property: "receive.v", given, defects, open_products: false }.run();
}

#[test]
fn send_gives_whole_frames() {
    let model = prepared();
    let given = vec![
        ("VALUES", number(4 * model.formats().search_bits[0] as usize)),
        ("ADDRESS", number(count_bits(model.formats().quads))),
        ("LAST", number(ROWS * COLS + STATUS_BEATS - 1)),
        ("STEPS", number(FORCE_STEPS)),
        ("WIDTH", number(FORCE_STEPS + 10)),
    ];
    let defects = vec![
        // tlast comes a beat early; a beat is requested without room.
        Change::within("forces__unit", "last", |k| [3, 2].map(|beat| k.named("beat_out").is(beat))),
        Change::value("send", "step", |k| k.named("sending__q")),
    ];
    let hardware = Hardware::Engine(&model);
    Proof { hardware, property: "send.v", given, defects, open_products: true }.run();
}

#[test]
fn counters_stay_below_their_limits() {
    let model = prepared();
    for (block, limit) in [("receive__scan__col", COLS), ("send__scan__col", COLS), ("send__words", STATUS_BEATS)] {
        let bits = count_bits(limit);
        let given = vec![("BLOCK", format!("@TOP@__{block}")), ("BITS", number(bits)), ("LIMIT", number(limit))];
        let defects = vec![Change::value(block, "last", move |k| k.named("value").is(limit as u64))];
        let hardware = Hardware::Engine(&model);
        Proof { hardware, property: "counter.v", given, defects, open_products: false }.run();
    }
}

#[test]
fn bytes_of_the_link_read_back() {
    let given = vec![("BLOCK", "@TOP@__link__encoder".into())];
    // A byte that follows an escape is sent again and again.
    let defects = vec![Change::within("link__encoder", "second", |k| {
        [k.named("special") & !k.named("second"), k.named("special")]
    })];
    let hardware = Hardware::Board(&model(""));
    Proof { hardware, property: "slip.v", given, defects, open_products: false }.run();
}

#[test]
fn the_frame_ingress_keeps_what_it_offers_and_gives_the_engine_good_frames_only() {
    let taxels = ROWS * COLS;
    let ingress = "link__ingress";
    let defects = vec![
        // An offered code is dropped with its packet; codes that leave before the end of the packet are one too many.
        Change::within(ingress, "fill", |k| [k.named("waits").extend(2), k.constant(2, 0)]),
        Change::within(ingress, "ahead", |k| [3, 4].map(|last| k.named("delivered").is(last))),
    ];
    let given = vec![
        ("BLOCK", format!("@TOP@__{ingress}")),
        ("BITS", number(8)),
        ("BYTES", number(taxels)),
        ("LAST", number(taxels - 1)),
    ];
    let hardware = Hardware::Board(&model(""));
    Proof { hardware, property: "frame_ingress.v", given, defects, open_products: false }.run();
}
