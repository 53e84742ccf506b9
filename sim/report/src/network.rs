//! Time of a frame's packets on a gigabit network, for a core behind UDP (`python/litex`).

use dermis_golden::fixed::Model;
use dermis_golden::wire::link::{payloads, supports, Kind};
use dermis_golden::wire::udp::{LAYOUT, WORD_BYTES};

/// Bit rate in bit/s.
pub(super) const BIT_RATE: u32 = 1_000_000_000;
/// Bytes of the headers of IP (RFC 791) and UDP (RFC 768).
const HEADER_BYTES: usize = 20 + 8;
/// Bytes on the wire besides the payload of UDP: these headers, and preamble 8, header 14, CRC 4 and gap 12 of Ethernet
/// (IEEE 802.3).
const OVERHEAD_BYTES: usize = HEADER_BYTES + 8 + 14 + 4 + 12;
/// Ethernet pads its payload, which begins with those headers, to so many bytes.
const LEAST_BYTES: usize = 46;
/// Bytes of a code in a packet.
const CODE_BYTES: usize = 2;

/// Bytes on the wire of the packets with a payload of so many words behind `header_words`.
fn wire_bytes(header_words: usize, words: usize) -> usize {
    let packet_bytes = |words: usize| {
        let payload = WORD_BYTES * (header_words + words + LAYOUT.check_words);
        payload.max(LEAST_BYTES - HEADER_BYTES) + OVERHEAD_BYTES
    };
    let (whole, rest) = (words / LAYOUT.fragment_words, words % LAYOUT.fragment_words);
    whole * packet_bytes(LAYOUT.fragment_words) + if rest > 0 { packet_bytes(rest) } else { 0 }
}

/// Time in ms of so many bytes.
fn wire_ms(bytes: usize) -> f64 {
    bytes as f64 * 8.0 / f64::from(BIT_RATE) * 1e3
}

/// Bits of a force, and the time in ms of each of [`payloads`], `None` for what the core does not send.
pub(super) fn times(model: &Model) -> Vec<(u32, Vec<Option<f64>>)> {
    let [_, (_, resultants), (_, forces)] = payloads(model);
    let taxels = model.scene.sensor.taxels();
    let codes = Some(wire_ms(wire_bytes(LAYOUT.header_words, (CODE_BYTES * taxels).div_ceil(WORD_BYTES))));
    let result_bytes = |words: usize| wire_bytes(LAYOUT.result_header_words, words);
    let whole = |bytes: usize| wire_ms(result_bytes(bytes / WORD_BYTES));
    // Sums of forces are made by a board's link; the core sends records, or forces.
    let records = model.sends_resultants().then(|| whole(resultants));
    if !supports(model, Kind::FrameForForces) {
        return vec![(32, vec![codes, records, None])];
    }
    // Packets of two mantissas in a word, then those of the status.
    let (mantissas, status) = ((3 * taxels).div_ceil(2), forces / WORD_BYTES - 3 * taxels);
    let short = wire_ms(result_bytes(mantissas) + result_bytes(status));
    vec![(32, vec![codes, records, Some(whole(forces))]), (16, vec![codes, records, Some(short)])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::Scene;

    #[test]
    fn times_by_hand() {
        let times = |name: &str| times(&Model::new(&Scene::builtin(name).unwrap()).unwrap());
        // 64 codes in 32 words, and 3 more of header and CRC-32; 192 forces and 9 words of status; 96 words of mantissas, each with 5
        // more, which have the time too.
        let ms =
            |more: usize, payloads: &[usize]| Some(wire_ms(payloads.iter().map(|words| 4 * (words + more) + 66).sum()));
        let codes = ms(3, &[32]);
        let wanted = [(32, ms(5, &[192 + 9])), (16, ms(5, &[96, 9]))];
        assert_eq!(times("eight-by-eight"), wanted.map(|(bits, forces)| (bits, vec![codes, None, forces])));
        assert_eq!(wire_ms(125), 1e-3);
        // 2304 codes in 1152 words: three packets of 360 and one of 72.
        assert_eq!(times("sensor-4")[0].1[0], ms(3, &[360, 360, 360, 72]));
    }
}
