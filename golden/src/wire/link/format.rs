//! The packet format as a page of documentation, `format.md`; a test checks that the committed page is up to date.

use std::fmt::Write as _;

use super::payload::{Beat, Counters, Field, Header, Identity, Sums};
use super::{slip, Kind, CRC_BYTES, VERSION};

/// Contents of a packet's payload.
pub(super) fn contents(kind: Kind) -> &'static str {
    match kind {
        Kind::Identify | Kind::ReadCounters => "none",
        Kind::FrameForResultants | Kind::FrameForForces => {
            "one code per taxel, row-major: two's complement in as many bytes as `input_bits` needs; none where the board scans"
        }
        Kind::Tables => "an image of tables, for a board with `hardware.tables = \"writable\"`; answered with counters",
        Kind::Identity => "identity",
        Kind::Counters => "counters",
        Kind::Resultants => {
            "sums, or the records of a board that answers no request for forces; then labels, status and code beats"
        }
        Kind::Forces => "one beat per taxel, row-major, then labels, status and code beats",
    }
}

/// The page in Markdown.
pub fn markdown() -> String {
    let mut text = format!(
        "\
# Packets, version {VERSION}

All numbers are little-endian. Packets are framed by SLIP (RFC 1055): each stands between two END bytes, 0x{end:02x}, so a
receiver resynchronises at the next END. A byte 0x{idle:02x}, IDLE, is skipped everywhere; an SPI, which always transfers bytes
in both directions, sends it when there is nothing else to send. Inside a packet
these bytes are escaped: {special}.

The UART has 8 data bits, no parity, one stop bit. On the SPI the board is the slave: mode 0, most significant bit first.

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
| {at} + n | {CRC_BYTES} | CRC-32 of all bytes before it: 0x04c11db7 reflected, initial value and final inversion 0xffffffff, as in zlib |

The host sends requests; the board answers each request that it accepts, frames in the order of their arrival. An answer
repeats the sequence number of its request. A damaged request is dropped and counted, but not answered. Up to three
frames may be in flight at a time.

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
    text + "\nThe board ignores the bits of a code above `input_bits`. There are labels only where `label_bits` is not 0,\nand codes only where the board scans its array: a request for a frame is answered with the next scan then, and the answer\nends with its codes, three in a beat.\nLabels and status beats are described in stage [`send`](crate::fixed::stages::send), records in stage\n[`resultants`](crate::fixed::stages::resultants), images in stage [`load`](crate::fixed::stages::load). The answer to an\nimage says that the engine has it; the status of the next frame says whether it is whole, and its version. A board\nwhose engine is not idle for the image drops it, and counts an overrun.\n"
}

/// How a special byte is escaped in a packet.
fn escaped((byte, after): (u8, u8)) -> String {
    format!("0x{byte:02x} as 0x{:02x} 0x{after:02x}", slip::ESC)
}

fn row(text: &mut String, at: usize, field: &Field) {
    let _ = writeln!(text, "| {at} | {} | `{}`, {}: {} |", field.bytes, field.name, field.kind, field.about.trim());
}
