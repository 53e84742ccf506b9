use super::*;
use crate::spec::link_kind::LinkKind;
use crate::spec::scene::{RunningZero, Scene, Zero};
use proptest::prelude::*;

/// Everything that a decoder finds in `wire`.
fn decode(wire: &[u8]) -> Vec<Result<Packet, PacketError>> {
    let mut decoder = Decoder::default();
    wire.iter().filter_map(|&byte| decoder.next(byte)).collect()
}

proptest! {
    #[test]
    fn packets_come_back_after_any_garbage(
        garbage in prop::collection::vec(any::<u8>(), 0..40),
        payload in prop::collection::vec(any::<u8>(), 0..300),
        sequence in any::<u8>(),
        kind in 0..Kind::ALL.len(),
    ) {
        let packet = Packet { kind: Kind::ALL[kind], sequence, payload };
        let found = decode(&[garbage, packet.to_wire(), packet.to_wire()].concat());
        prop_assert_eq!(&found[found.len() - 2..], &[Ok(packet.clone()), Ok(packet)]);
    }

    #[test]
    fn idle_bytes_are_skipped_wherever_they_come_and_are_in_no_packet(
        payload in prop::collection::vec(prop_oneof![any::<u8>(), 0xdbu8..0xe0, Just(slip::END)], 0..100),
        places in prop::collection::vec(any::<prop::sample::Index>(), 0..40),
    ) {
        let packet = Packet { kind: Kind::Forces, sequence: slip::IDLE, payload };
        let mut wire = packet.to_wire();
        prop_assert!(!wire.contains(&slip::IDLE));
        places.iter().for_each(|place| wire.insert(place.index(wire.len() + 1), slip::IDLE));
        prop_assert_eq!(decode(&wire), [Ok(packet)]);
    }

    #[test]
    fn one_flipped_bit_never_passes(
        payload in prop::collection::vec(any::<u8>(), 0..60), at in any::<prop::sample::Index>(), bit in 0u8..8,
    ) {
        let packet = Packet { kind: Kind::Forces, sequence: 7, payload };
        let mut wire = packet.to_wire();
        // Flipped ENDs are another matter: without the first one the packet is still complete.
        let at = 1 + at.index(wire.len() - 2);
        wire[at] ^= 1 << bit;
        prop_assert!(decode(&wire).iter().all(|found| found.is_err()));
    }

    #[test]
    fn codes_come_back(codes in prop::collection::vec(-(1i32 << 19)..1 << 19, 0..50)) {
        prop_assert_eq!(codes_of_bytes(&codes_to_bytes(&codes, 20), 20), Some(codes));
    }
}

#[test]
fn the_check_value_is_the_published_one() {
    // CRC-32/ISO-HDLC of "123456789".
    assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
    let mut all = b"123456789".to_vec();
    all.extend(0xcbf4_3926u32.to_le_bytes());
    assert_eq!(crc32fast::hash(&all) ^ u32::MAX, CRC_RESIDUE);
}

#[test]
fn what_is_wrong_is_named() {
    let bytes = |kind: u8, length: u16, payload: &[u8]| {
        let mut bytes = [Header { kind, sequence: 0, length }.to_bytes(), payload.to_vec()].concat();
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        slip::encode(&bytes)
    };
    assert_eq!(decode(&bytes(9, 0, &[])), [Err(PacketError::UnknownType(9))]);
    assert_eq!(decode(&bytes(1, 2, &[5])), [Err(PacketError::Length { says: 2, has: 1 })]);
    assert_eq!(decode(&[slip::END, 1, 2, slip::END]), [Err(PacketError::Crc { bytes: 2 })]);
    assert_eq!(decode(&[slip::ESC, 1, slip::END]), [Err(PacketError::Framing)]);
}

#[test]
fn sums_by_hand() {
    let sums = Sums::of(&[[1, 2, 3], [0, 0, 0], [-4, 5, i32::MIN], [0, 1, 7]], 2);
    let wanted =
        Sums { fx: -3, fy: 8, fz: 10 + i64::from(i32::MIN), moment_x: 7, moment_y: 7 + i64::from(i32::MIN), loaded: 3 };
    assert_eq!(sums, wanted);
    assert_eq!(Sums::of_bytes(&sums.to_bytes()), Some(sums));
    assert_eq!(Sums::of_bytes(&[0; 47]), None);
    assert_eq!(Sums::of(&[[0, 0, 2], [0, 0, 6]], 2).centre(), Some([0.75, 0.0]));
}

#[test]
fn the_hash_tells_scenes_apart_and_clocks_not() {
    let model = |change: &dyn Fn(&mut Scene)| {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        change(&mut scene);
        crate::fixed::plan::cases::planned(&scene).unwrap()
    };
    let plain = model(&|_| ());
    let mut faster = model(&|scene| scene.name = "other".into());
    faster.board.clock_MHz = 50.0;
    assert_eq!(scene_hash(&plain), scene_hash(&faster));
    let others = [
        model(&|scene| scene.search.mu_max = 0.5),
        model(&|scene| scene.sensor.thickness_mm *= 1.01),
        model(&|scene| scene.input.dead = vec![[3, 4]]),
    ];
    assert!(others.iter().all(|other| scene_hash(other) != scene_hash(&plain)));
    // The dead taxels are part of the hash even if the matrices are the same.
    let mut blanked = plain.clone();
    blanked.dead = vec![9];
    assert_ne!(scene_hash(&blanked), scene_hash(&plain));
    // Another calibration of the same sensor is another bitstream.
    let calibrated = |zero: i32, gain: i32| {
        let mut other = plain.clone();
        (other.prepare.zero, other.prepare.gain) = (Some(vec![zero; 64]), Some(vec![gain; 64]));
        scene_hash(&other)
    };
    let hashes = [scene_hash(&plain), calibrated(0, 1 << 16), calibrated(1, 1 << 16), calibrated(0, 1 << 15)];
    assert!((1..4).all(|k| !hashes[..k].contains(&hashes[k])), "{hashes:?}");
    faster.board.uart_baud = Some(10_000_000);
    let error = Identity::of(&faster).unwrap_err().to_string();
    let wanted = "constraints/ulx3s-85f.toml: uart_baud = 10000000: the clock of 50 MHz takes at most 6250000";
    assert_eq!(error, wanted);
}

#[test]
fn the_boards_clock_and_pins_limit_the_spi() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.hardware.link = LinkKind::Spi;
    let mut model = crate::fixed::plan::cases::planned(&scene).unwrap();
    assert_eq!(Identity::of(&model).unwrap().bit_rate, 25_000_000);
    let mut of = |spi_MHz| {
        model.board.spi_MHz = spi_MHz;
        Identity::of(&model).map(|identity| identity.bit_rate).map_err(|error| error.to_string())
    };
    assert_eq!(of(Some(160.0)), Ok(160_000_000));
    let wanted = "constraints/ulx3s-85f.toml: spi_MHz = 160.1: the clock of 100 MHz takes at most 160";
    assert_eq!(of(Some(160.1)), Err(wanted.to_string()));
    let wanted = "hardware.link = \"spi\": board ulx3s-85f has no pins for it (no spi_MHz in \
                  constraints/ulx3s-85f.toml); it has \"uart\"";
    assert_eq!(of(None), Err(wanted.to_string()));
    // A board without any pins.
    let text = "device = \"LFE5U-85F\"\nclock_MHz = 100.0\n";
    model.board = crate::spec::board::Board::parse("alone", "alone.toml", text).unwrap();
    let wanted = "hardware.link = \"spi\": board alone has no pins for it (no spi_MHz in alone.toml); it has no link";
    assert_eq!(Identity::of(&model).unwrap_err().to_string(), wanted);
}

#[test]
fn scenes_that_the_link_does_not_fit_are_refused_by_field() {
    let plain = crate::fixed::plan::cases::planned(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut model = plain.clone();
        change(&mut model.scene);
        Identity::of(&model).unwrap_err().to_string()
    };
    assert!(refused(&|scene| scene.input.average = 2).starts_with("input.average = 2: "));
    let running = Zero::Running(RunningZero { average: 10, limit_MPa: 0.01 });
    assert!(refused(&|scene| scene.input.zero = running).starts_with("input.zero = running: "));
    let long = refused(&|scene| scene.sensor.rows = 800);
    assert_eq!(long, "scene eight-by-eight: forces of 6400 taxels take 76836 bytes, a packet holds 65535");
}

/// Four beats of the one record and three of the status.
#[test]
fn records_are_the_resultants_of_a_board() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.output.forces = crate::spec::scene::ForceOutput::Resultants;
    let plan = crate::fixed::plan::cases::planned(&scene).unwrap();
    let identity = Identity::of(&plan).unwrap();
    assert!(identity.supports(Kind::FrameForResultants) && !identity.supports(Kind::FrameForForces));
    assert_eq!(payloads(&plan)[1], ("resultants", (4 + 3) * BEAT_BYTES));
    // A host that expects forces is told that it is another board.
    let forces = crate::fixed::plan::cases::planned(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    assert_ne!(identity.scene, scene_hash(&forces));
}

#[test]
fn time_on_the_wire_by_hand() {
    let model = crate::fixed::plan::cases::planned(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    assert_eq!(payloads(&model), [("codes", 192), ("resultants", 48 + 36), ("forces", 768 + 36)]);
    // 290 payload bytes and 10 more, at 300 000 and 3 125 000 bytes a second.
    assert_eq!(LinkKind::Uart.wire_ms(290, 3_000_000), 1.0);
    assert_eq!(LinkKind::Spi.wire_ms(290, 25_000_000), 0.096);
}

#[test]
fn the_committed_page_is_the_generated_one() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/wire/link/format.md");
    if std::env::var_os("DERMIS_ACCEPT").is_some() {
        std::fs::write(&path, markdown()).unwrap();
    }
    assert!(std::fs::read_to_string(path).unwrap() == markdown(), "DERMIS_ACCEPT=1 writes it anew");
}

#[test]
fn the_c_header_builds_the_same_packet() {
    let folder = tempfile::tempdir().unwrap();
    let main = "#include <stdio.h>\n#include \"dermis_link.h\"\nint main(void) {\n  \
                const uint8_t payload[] = {0xc0, 1, 0xdb, 2, 0xde, 3};\n  uint8_t wire[64];\n  \
                size_t size = dermis_packet(DERMIS_FRAME_FOR_FORCES, 222, payload, 6, wire);\n  \
                fwrite(wire, 1, size, stdout);\n  \
                printf(\"%08x %zu %zu %zu %zu %zu\", dermis_crc32((const uint8_t *)\"123456789\", 9),\n    \
                sizeof(dermis_header), sizeof(dermis_identity), sizeof(dermis_counters), sizeof(dermis_sums),\n    \
                sizeof(dermis_beat));\n}\n";
    std::fs::write(folder.path().join("main.c"), main).unwrap();
    std::fs::write(folder.path().join("dermis_link.h"), c_header()).unwrap();
    let build = std::process::Command::new("gcc")
        .current_dir(folder.path())
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-o", "main", "main.c"])
        .output()
        .expect("gcc is installed (make setup)");
    assert!(build.status.success(), "{}", String::from_utf8_lossy(&build.stderr));
    let output = std::process::Command::new(folder.path().join("main")).output().unwrap().stdout;
    let packet = Packet { kind: Kind::FrameForForces, sequence: 222, payload: vec![0xc0, 1, 0xdb, 2, 0xde, 3] };
    let sizes = [Header::BYTES, Identity::BYTES, Counters::BYTES, Sums::BYTES, Beat::BYTES].map(|n| n.to_string());
    let wanted = [packet.to_wire(), format!("cbf43926 {}", sizes.join(" ")).into_bytes()].concat();
    assert!(output == wanted, "{output:?}");
}
