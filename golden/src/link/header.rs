//! The packets as a C header, `dermis_link.h`, for hosts that are not written in Rust.

use std::fmt::Write as _;

use super::payload::{Beat, Counters, Field, Header, Identity, Sums};
use super::{format::contents, slip, Kind, CRC_BYTES, VERSION};

/// Functions that every host needs, in C99.
const FUNCTIONS: &str = "\
/* CRC-32 of `size` bytes, as zlib's crc32(0, data, size). */
static inline uint32_t dermis_crc32(const uint8_t *data, size_t size)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < size; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1u ? crc >> 1 ^ 0xedb88320u : crc >> 1;
    }
    return ~crc;
}

/* Escapes a byte; returns how many of the two bytes that it writes to `wire` count. */
static inline size_t dermis_slip(uint8_t byte, uint8_t *wire)
{
    uint8_t after = 0;
    if (byte == DERMIS_SLIP_END)
        after = DERMIS_SLIP_ESC_END;
    else if (byte == DERMIS_SLIP_ESC)
        after = DERMIS_SLIP_ESC_ESC;
    else if (byte == DERMIS_SLIP_IDLE)
        after = DERMIS_SLIP_ESC_IDLE;
    wire[0] = after ? DERMIS_SLIP_ESC : byte;
    wire[1] = after;
    return after ? 2 : 1;
}

/* Writes a packet to `wire`, which has room for 2 * (size + 8) + 2 bytes; returns the bytes written. */
static inline size_t dermis_packet(uint8_t kind, uint8_t sequence, const uint8_t *payload, uint16_t size,
                                   uint8_t *wire)
{
    const uint8_t header[4] = {kind, sequence, (uint8_t)(size & 0xff), (uint8_t)(size >> 8)};
    uint32_t crc = 0xffffffffu;
    size_t at = 0;
    wire[at++] = DERMIS_SLIP_END;
    for (size_t i = 0; i < 4u + size; i++) {
        const uint8_t byte = i < 4 ? header[i] : payload[i - 4];
        crc ^= byte;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1u ? crc >> 1 ^ 0xedb88320u : crc >> 1;
        at += dermis_slip(byte, wire + at);
    }
    for (int i = 0; i < 4; i++)
        at += dermis_slip((uint8_t)(~crc >> 8 * i), wire + at);
    wire[at++] = DERMIS_SLIP_END;
    return at;
}
";

/// The header's text.
pub fn c_header() -> String {
    let mut text = String::from(
        "\
/* Packets between a host and a Dermis board, written by `dermis build`; do not edit.
 *
 * All numbers are little-endian; the structures have no gaps, so a little-endian host may copy payloads into them.
 *
 * Over SPI (mode 0, most significant bit first) the board is the slave. What it sends comes while the controller sends:
 * move a packet, then bytes DERMIS_SLIP_IDLE until the answer's second END has come. A transaction may end after any
 * byte and another one go on. Skip each DERMIS_SLIP_IDLE that comes, inside a packet, too.
 */
#ifndef DERMIS_LINK_H
#define DERMIS_LINK_H

#include <stddef.h>
#include <stdint.h>

",
    );
    let mut define = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "#define DERMIS_{name} {value}");
    };
    define("LINK_VERSION", VERSION.to_string());
    define("CRC_BYTES", CRC_BYTES.to_string());
    let slip = [
        ("END", slip::END),
        ("ESC", slip::ESC),
        ("IDLE", slip::IDLE),
        ("ESC_END", slip::ESC_END),
        ("ESC_ESC", slip::ESC_ESC),
        ("ESC_IDLE", slip::ESC_IDLE),
    ];
    for (name, value) in slip {
        define(&format!("SLIP_{name}"), format!("0x{value:02x}u"));
    }
    text.push_str("\n/* Packet types and payloads. */\n");
    for kind in Kind::ALL {
        let about = contents(kind).replace('`', "");
        let _ = writeln!(text, "/* {about} */\n#define DERMIS_{} 0x{:02x}u", kind.name().to_uppercase(), kind as u8);
    }
    let all = [
        ("header", Header::FIELDS),
        ("identity", Identity::FIELDS),
        ("counters", Counters::FIELDS),
        ("sums", Sums::FIELDS),
        ("beat", Beat::FIELDS),
    ];
    for (name, fields) in all {
        structure(&mut text, name, fields);
    }
    text + "\n" + FUNCTIONS + "\n#endif\n"
}

fn structure(text: &mut String, name: &str, fields: &[Field]) {
    text.push_str("\ntypedef struct {\n");
    for field in fields {
        // Rust's `u16` is C's `uint16_t`.
        let (sign, bits) = field.kind.split_at(1);
        let kind = if sign == "u" { format!("uint{bits}_t") } else { format!("int{bits}_t") };
        let _ = writeln!(text, "    {kind} {}; /* {} */", field.name, field.about.trim());
    }
    let _ = writeln!(text, "}} dermis_{name};");
}
