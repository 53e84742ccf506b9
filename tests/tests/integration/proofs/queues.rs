//! Proofs for the blocks between the streams: rounding of the rescaler, queues, and the link's output.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::stages::send::{LABELS_PER_BEAT, LABEL_BITS, STATUS_BEATS};
use dermis_golden::fixed::words::formats::SEARCH_EXTRA_BITS;
use dermis_golden::fixed::Model;
use dermis_golden::spec::quads::Quads;
use dermis_golden::wire::link::{payloads, Counters, Identity, ANSWER};
use dermis_hdl::language::Change;
use dermis_hdl::primitives::QUEUE_CAPACITY;
use dermis_tests::{variants, with_network};

use super::prover::{number, Hardware, Proof};
use super::{model, text, with_inverse, COLS, ROWS};

/// The widths of a model's rescaler.
fn widths(model: &Model) -> Vec<(&'static str, String)> {
    let f = model.formats();
    vec![
        ("SHIFTS", number(count_bits(f.acc_bits as usize))),
        ("ACC", number(f.acc_bits as usize)),
        ("LANE", number(f.lane_bits as usize)),
        ("ALIGN", number(f.limb_align as usize)),
        ("WORD", number(f.vector_bits as usize)),
        ("DATA", number(f.data_bits as usize)),
        ("A_SHIFT", number(f.a_shift as usize)),
        ("LESS", number(SEARCH_EXTRA_BITS as usize)),
        ("ROWS", number(f.quads)),
    ]
}

#[test]
fn rescaled_words_are_rounded_and_held_to_their_range() {
    let model = model("");
    let given = widths(&model);
    let word = model.formats().vector_bits as usize;
    let never = |lane: &str, signal: &'static str| {
        Change::within("rescale__rescaler", &format!("lane_0__{lane}"), move |k| [k.named(signal), k.constant(1, 0)])
    };
    let defects = vec![
        // A word, an operand is not saturated; a half is not added; its carry, and whether a quad is valid, not heeded.
        never("word", "lane_0__clipped"),
        never("operand", "lane_0__overflow"),
        Change::within("rescale__rescaler", "lane_0__half_up", move |k| [1, 0].map(|half| k.constant(word + 1, half))),
        never("clipped", "lane_0__carry"),
        Change::within("rescale__rescaler", "clipped3", |k| [k.named("valid2"), k.constant(1, 1)]),
    ];
    let hardware = Hardware::Engine(&model);
    Proof { hardware, property: "rescale.v", given, defects, open_products: false }.run();
}

#[test]
fn rows_that_wait_for_their_shift_come_out_in_order() {
    // With and without low limbs.
    for &(inverse_bits, limbs) in variants(&[(20, 2), (8, 1)], 1) {
        let model = with_inverse(inverse_bits, "");
        let given = [widths(&model), vec![("LIMBS", number(limbs))]].concat();
        let mut defects = vec![
            // The replay stands still; rows are written in the wrong order; raw rows pass unshifted.
            Change::value("rescale", "reads__enable", |k| k.named("collecting__q") & k.named("quad_soon")),
            Change::value("rescale", "raw__write_address", |k| !k.named("row__q")),
            Change::value("rescale", "enters", |k| k.named("read__q") | k.named("quad_valid")),
        ];
        if limbs == 2 {
            // High limbs are not added; rows of the low limbs are read too late.
            defects.push(Change::value("rescale__limb_sum", "sum", |k| k.named("low")));
            defects.push(Change::value("rescale", "reads__enable", |k| {
                k.named("replaying__q") | k.named("collecting__q") & k.named("quad_valid")
            }));
        }
        let hardware = Hardware::Engine(&model);
        Proof { hardware, property: "replay.v", given, defects, open_products: false }.run();
    }
}

#[test]
fn forces_that_wait_leave_in_order() {
    let model = model("");
    for &bit in variants(&[0, 95], 1) {
        let queue = "forces__leaving";
        let defects = vec![
            // One place too many is promised; an offered word changes; words leave in the wrong order.
            Change::value(queue, "room", |k| !k.named("now_reserved").is(QUEUE_CAPACITY as u64 + 1)),
            Change::within(queue, "m_axis_tdata", |k| [k.named("moves") & k.named("waits"), k.named("waits")]),
            Change::value(queue, "head", |k| k.array("places").read(!k.named("read").low(4))),
        ];
        let given = vec![("PLACES", number(QUEUE_CAPACITY)), ("BIT", number(bit))];
        let hardware = Hardware::Engine(&model);
        Proof { hardware, property: "queue.v", given, defects, open_products: false }.run();
    }
}

#[test]
fn operand_vectors_stay_inside_their_memory() {
    let model = model("");
    let (vectors, quads) = (model.formats().operand_vectors(), model.formats().quads);
    let finished = count_bits(vectors + 1);
    let given = vec![
        ("ADDRESS", number(count_bits(vectors * quads))),
        ("FINISHED", number(finished)),
        ("VECTORS", number(vectors)),
        ("QUADS", number(quads)),
        ("BEGUN", number(if model.first().storage.streamed { quads - 1 } else { 0 })),
    ];
    // Vectors are written beyond the last operand.
    let defects = vec![Change::value("pass__operand_writer", "keep", |k| k.named("valid"))];
    let hardware = Hardware::Engine(&model);
    Proof { hardware, property: "operand_writer.v", given, defects, open_products: false }.run();
}

#[test]
fn the_link_takes_and_gives_each_byte_once() {
    let model = model("");
    let hardware = Hardware::Board(&model);
    let [(_, _), (_, resultants), (_, forces)] = payloads(&model);
    let packer = vec![
        ("BLOCK", "@TOP@__link__packer".into()),
        ("IDENTITY", number(Identity::BYTES)),
        ("COUNTERS", number(Counters::BYTES)),
        ("RESULTANTS", number(resultants)),
        ("FORCES", number(forces)),
        ("FIRST", number(usize::from(ANSWER) + 1)),
    ];
    let defects = vec![
        // A word ends a byte early; a byte changes while it is offered; a byte is sent before the CRC has processed the
        // last one.
        Change::within("link__packer", "at_end", |k| [11, 10].map(|last| k.constant(4, last))),
        Change::within("link__packer", "content", |k| [!k.named("valid"), k.constant(1, 1)]),
        Change::within("link__packer", "stands", |k| [!k.named("crc_busy"), k.constant(1, 1)]),
    ];
    Proof { hardware, property: "packer.v", given: packer, defects, open_products: false }.run();
    let both = vec![("ENCODER", "@TOP@__link__encoder".into()), ("DECODER", "@TOP@__link__decoder".into())];
    let defects = vec![
        // Two special bytes are taken for one another; an IDLE between an escape and the next byte ends the escape.
        Change::within("link__decoder", "content", |k| [219, 192].map(|byte| k.constant(8, byte))),
        Change::within("link__decoder", "escaped", |k| [k.named("valid") & !k.named("is_idle"), k.named("valid")]),
    ];
    Proof { hardware, property: "roundtrip.v", given: both, defects, open_products: false }.run();
}

#[test]
fn labels_leave_between_forces_and_statuses() {
    let contacts = "[partition]\ncase = \"contacts\"\nmax_contacts = 2\n";
    let (scene, _file) = with_network(&text(20, contacts), &[4]);
    let model = Model::new(&scene).unwrap();
    let (quads, bits) = (Quads { rows: ROWS, cols: COLS }, count_bits(model.contacts() + 1));
    let address = count_bits(quads.len());
    let label = |taxel: usize| format!("own[{} +: {bits}]", bits * taxel);
    let lanes =
        |quad: usize| (0..Quads::LANES).rev().map(|lane| label(quads.taxel(quad, lane))).collect::<Vec<_>>().join(", ");
    let quad = |quad: usize| format!("      {address}'d{quad}: quad = {{{}}};\n", lanes(quad));
    let wanted = |taxel: usize| format!("{}'d0, {}", LABEL_BITS as usize - bits, label(taxel));
    let given = vec![
        ("BLOCK", "@TOP@__label_beats".into()),
        ("BITS", number(bits)),
        ("ADDRESS", number(address)),
        ("QUADS", (0..quads.len()).map(quad).collect()),
        ("WANTED", (0..ROWS * COLS).rev().map(wanted).collect::<Vec<_>>().join(", ")),
        ("TAXELS", number(ROWS * COLS)),
        ("LAST", number(ROWS * COLS + model.status_beats() - 1)),
        ("MOST", number(LABELS_PER_BEAT + 5)),
    ];
    let block = "label_beats";
    let defects = vec![
        // A label is taken a cycle early; places beyond the last taxel are not 0; a beat passes while labels are read.
        Change::value(block, "arrives_4", |k| k.named("arrives_2")),
        Change::value(block, "empty_4", |k| k.constant(1, 0)),
        Change::value(block, "s_axis_tready", |k| k.named("m_axis_tready")),
    ];
    Proof { hardware: Hardware::Engine(&model), property: "label_beats.v", given, defects, open_products: true }.run();
}

#[test]
fn sums_come_before_the_status() {
    let given = vec![
        ("BLOCK", "@TOP@__link__resultants".into()),
        ("TAXELS", number(ROWS * COLS)),
        ("LAST", number(ROWS * COLS + STATUS_BEATS - 1)),
        ("MOST", number(ROWS.max(COLS) + 1)),
    ];
    // The status comes a word early.
    let defects = vec![Change::within("link__resultants", "stage", |k| {
        [3, 2].map(|word| k.named("leaves") & k.named("out").is(word))
    })];
    let hardware = Hardware::Board(&model(""));
    Proof { hardware, property: "sums.v", given, defects, open_products: false }.run();
}
