//! Proofs for the blocks between the streams: rounding of the rescaler, queues, and the link's output.

use dermis_golden::fixed::plan::resources::{count_bits, operand_vectors};
use dermis_golden::fixed::stages::send::STATUS_BEATS;
use dermis_golden::fixed::words::formats::SEARCH_EXTRA_BITS;
use dermis_golden::link::{payloads, Counters, Identity, ANSWER};
use dermis_hdl::link::generate_board;
use dermis_hdl::primitives::QUEUE_PLACES;
use dermis_hdl::{generate, Generated};

use super::prover::{number, Proof};
use super::{model, COLS, ROWS};

/// Widths of the rescaler's words.
fn widths() -> (Generated, Vec<(&'static str, String)>, usize) {
    let model = model("");
    let f = model.formats();
    let given = vec![
        ("SHIFTS", number(count_bits(f.acc_bits as usize))),
        ("ACC", number(f.acc_bits as usize)),
        ("WORD", number(f.vector_bits as usize)),
        ("DATA", number(f.data_bits as usize)),
        ("A_SHIFT", number(f.a_shift as usize)),
        ("LESS", number(SEARCH_EXTRA_BITS as usize)),
        ("ROWS", number(f.quads)),
    ];
    (generate(&model).unwrap(), given, f.vector_bits as usize)
}

#[test]
fn rescaled_words_are_rounded_and_held_to_their_range() {
    let (generated, given, word) = widths();
    let (half, none) = (format!("+ {}'d1;\n", word + 1), format!("+ {}'d0;\n", word + 1));
    let defects = [
        ("word <= lane_0__clipped ? ", "word <= 1'b0 ? "),
        ("lane_0__overflow ? ", "1'b0 ? "),
        (half.as_str(), none.as_str()),
        ("lane_0__carry ? ", "1'b0 ? "),
        ("clipped3 <= valid2 ? ", "clipped3 <= 1'b1 ? "),
    ];
    Proof { generated: &generated, property: "rescale.v", given, defects: &defects, open_products: false }.run();
}

#[test]
fn rows_that_wait_for_their_shift_come_out_in_order() {
    let (generated, given, _) = widths();
    let defects = [
        ("replay__enable = replaying__q;", "replay__enable = 1'b0;"),
        ("raw__write_address = rows__value;", "raw__write_address = ~rows__value;"),
        ("enters = read__q || quad_valid && !collecting__q;", "enters = read__q || quad_valid;"),
    ];
    Proof { generated: &generated, property: "replay.v", given, defects: &defects, open_products: false }.run();
}

#[test]
fn forces_that_wait_leave_in_order() {
    let generated = &generate(&model("")).unwrap();
    let places = format!("now_reserved != 5'd{QUEUE_PLACES}");
    let more = format!("now_reserved != 5'd{}", QUEUE_PLACES + 1);
    let defects = [
        (places.as_str(), more.as_str()),
        ("if (part_0) m_axis_tdata <=", "if (waits) m_axis_tdata <="),
        ("= places[read[3:0]]", "= places[~read[3:0]]"),
    ];
    for bit in [0, 95] {
        let given = vec![("PLACES", number(QUEUE_PLACES)), ("BIT", number(bit))];
        Proof { generated, property: "queue.v", given, defects: &defects, open_products: false }.run();
    }
}

#[test]
fn operand_vectors_stay_inside_their_memory() {
    let model = model("");
    let (vectors, quads) = (operand_vectors(model.formats().degree), model.formats().quads);
    let finished = count_bits(vectors + 1);
    let given = vec![
        ("ADDRESS", number(count_bits(vectors * quads))),
        ("FINISHED", number(finished)),
        ("VECTORS", number(vectors)),
        ("QUADS", number(quads)),
    ];
    let (generated, defects) = (&generate(&model).unwrap(), &[("keep = valid && finished != 1'b1;", "keep = valid;")]);
    Proof { generated, property: "operand_writer.v", given, defects, open_products: false }.run();
}

#[test]
fn the_link_takes_and_gives_each_byte_once() {
    let model = model("");
    let generated = &generate_board(&model).unwrap();
    let [(_, _), (_, resultants), (_, forces)] = payloads(&model);
    let packer = vec![
        ("BLOCK", "@TOP@__link__packer".into()),
        ("IDENTITY", number(Identity::BYTES)),
        ("COUNTERS", number(Counters::BYTES)),
        ("RESULTANTS", number(resultants)),
        ("FORCES", number(forces)),
        ("FIRST", number(usize::from(ANSWER) + 1)),
    ];
    let defects = [
        ("index == (wanted ? 4'd11 : 4'd3)", "index == (wanted ? 4'd10 : 4'd3)"),
        // Defects: a byte changes while it is offered; a byte is sent before the CRC has processed the last one.
        ("if (!valid) content <= stage", "content <= stage"),
        ("!crc_busy && (!wanted || word_valid)", "(!wanted || word_valid)"),
    ];
    Proof { generated, property: "packer.v", given: packer, defects: &defects, open_products: false }.run();
    let both = vec![("ENCODER", "@TOP@__link__encoder".into()), ("DECODER", "@TOP@__link__decoder".into())];
    let defects = [
        ("data[0] ? 8'd219 : 8'd192", "data[0] ? 8'd192 : 8'd219"),
        // Defect: an IDLE between an escape and the next byte ends the escape.
        ("if (valid && !is_idle) escaped", "if (valid) escaped"),
    ];
    Proof { generated, property: "roundtrip.v", given: both, defects: &defects, open_products: false }.run();
}

#[test]
fn sums_come_before_the_status() {
    let generated = &generate_board(&model("")).unwrap();
    let given = vec![
        ("BLOCK", "@TOP@__link__resultants".into()),
        ("TAXELS", number(ROWS * COLS)),
        ("LAST", number(ROWS * COLS + STATUS_BEATS - 1)),
        ("MOST", number(ROWS.max(COLS) + 1)),
    ];
    let defect = ("leaves && out == 2'd3", "leaves && out == 2'd2");
    Proof { generated, property: "sums.v", given, defects: &[defect], open_products: false }.run();
}
