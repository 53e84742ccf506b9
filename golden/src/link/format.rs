//! The packets as a page of documentation, `format.md`; a test keeps the committed page equal.

use std::fmt::Write as _;

use super::payload::{Beat, Counters, Field, Header, Identity, Sums};
use super::{slip, Kind, CRC_BYTES, VERSION};

/// What a packet's payload is made of.
pub(super) fn contents(kind: Kind) -> &'static str {
    match kind {
        Kind::Identify | Kind::ReadCounters => "nothing",
        Kind::FrameForResultants | Kind::FrameForForces => {
            "one code per taxel, row-major: two's complement in the fewest bytes for `input_bits`"
        }
        Kind::Identity => "identity",
        Kind::Counters => "counters",
        Kind::Resultants => "sums, then one beat per status beat",
        Kind::Forces => "one beat per taxel, row-major, then one beat per status beat",
    }
}

/// The page, in Markdown.
pub fn markdown() -> String {
    let mut text = format!(
        "\
# Packets, version {VERSION}

All numbers are little-endian. On the wire a packet stands between two bytes 0x{end:02x} (SLIP, RFC 1055). A byte 0x{idle:02x}
says nothing and is skipped wherever it comes: an SPI, which always moves bytes both ways, has it where there is nothing to
send. In a packet {special}.

The UART has 8 data bits, no parity, one stop bit. The SPI's slave is the board: mode 0, most significant bit first.

| byte | size | packet |
|---:|---:|---|
",
        end = slip::END,
        idle = slip::IDLE,
        special = slip::SPECIAL.map(escaped).join(", "),
    );
    let mut at = 0;
    for field in Header::FIELDS {
        row(&mut text, at, field);
        at += field.bytes;
    }
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "\
| {at} | n | payload |
| {at} + n | {CRC_BYTES} | CRC-32 of all before it: 0x04c11db7 reflected, start and final inversion 0xffffffff, as zlib |

The host asks, the board answers each request that it takes, frames in the order in which they came; an answer has its
request's sequence number. A request that is damaged is dropped, counted and not answered. Up to three frames may be on
their way at a time.

| type | from | packet | payload |
|---:|---|---|---|
"
    );
    for kind in Kind::ALL {
        let from = if kind.answer() == kind { "board" } else { "host" };
        let _ = writeln!(text, "| 0x{:02x} | {from} | {} | {} |", kind as u8, kind.name(), contents(kind));
    }
    for (name, fields) in
        [("identity", Identity::FIELDS), ("counters", Counters::FIELDS), ("sums", Sums::FIELDS), ("beat", Beat::FIELDS)]
    {
        let _ = write!(text, "\n| byte | size | {name} |\n|---:|---:|---|\n");
        let mut at = 0;
        for field in fields {
            row(&mut text, at, field);
            at += field.bytes;
        }
    }
    text + "\nThe board ignores the bits of a code above `input_bits`. The status beats are described with stage [`send`](crate::fixed::send).\n"
}

/// How a special byte stands in a packet.
fn escaped((byte, after): (u8, u8)) -> String {
    format!("0x{byte:02x} is 0x{:02x} 0x{after:02x}", slip::ESC)
}

fn row(text: &mut String, at: usize, field: &Field) {
    let _ = writeln!(text, "| {at} | {} | `{}`, {}: {} |", field.bytes, field.name, field.kind, field.about.trim());
}
