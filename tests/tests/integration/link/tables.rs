//! Images of tables in packets: the board holds them afterwards, and what is not whole is never used.

use dermis_golden::fixed::stages::load::Outcome;

use super::*;
use crate::tables::{specimen, COVERS, SCENE};

const FULL_SCALE: &str = "[input]\nfull_scale_MPa = 1.0\n";

/// A board of the writable scene with `more`, and the model with the tables of a specimen.
fn board(more: &str, simulators: &[Simulator]) -> (Board, Model) {
    let scene = Scene::parse(&format!("{SCENE}{more}"), "writable.toml").unwrap();
    let (_folder, other) = specimen(&scene);
    let hardware = Model::new(&scene).unwrap();
    let own = hardware.with_tables(&other, 4321).unwrap();
    (Board::of(extremes(hardware), simulators), own)
}

pub(super) fn image(model: &Model, sequence: u8) -> Packet {
    Packet { kind: Kind::Tables, sequence, payload: model.image() }
}

impl Board {
    /// Two frames are answered as by `model`, the first with these flags of lost packets.
    fn is(&mut self, model: &Model, framing: bool) {
        self.questions.model = model.clone();
        for (index, framing) in [(0, framing), (2, false)] {
            let kind = [Kind::FrameForResultants, Kind::FrameForForces][index / 2];
            self.send(&self.frame(index, kind, 0xdb).to_wire());
            assert!(self.receive() == [self.answer(index, kind, 0xdb, framing)], "frame {index}");
        }
    }

    /// The board takes the tables of `model`.
    fn load(&mut self, model: &Model, sequence: u8) {
        self.send(&image(model, sequence).to_wire());
        let answers = self.receive();
        let heads: Vec<_> = answers.iter().map(|packet| (packet.kind, packet.sequence)).collect();
        assert_eq!(heads, [(Kind::Counters, sequence)]);
    }
}

#[test]
fn a_board_holds_the_tables_of_a_packet() {
    let (mut board, own) = board(FULL_SCALE, variants(&BOTH, 1));
    let hardware = board.model.clone();
    board.send(&Packet::request(Kind::Identify, 3).to_wire());
    let identity = Identity::of_bytes(&board.receive()[0].payload).unwrap();
    assert!(identity.supports(Kind::Tables));
    board.is(&hardware, false);
    board.load(&own, 0xc0);
    board.is(&own, false);
    assert_eq!(board.counters(), Counters { taken: 7, ..Counters::default() });
}

#[test]
fn coefficients_come_in_a_packet_too() {
    let (mut board, own) = board(COVERS, &[Simulator::Verilator]);
    board.load(&own, 9);
    board.is(&own, false);
}

#[test]
fn an_image_that_is_damaged_cut_or_early_is_never_used() {
    let (mut board, own) = board(FULL_SCALE, &[Simulator::Verilator]);
    let hardware = board.model.clone();
    // Damaged on the way: all but the last bytes are written.
    let whole = image(&own, 1).to_wire();
    let mut damaged = whole.clone();
    let at = damaged.iter().rposition(|&byte| byte < 0x80).unwrap();
    damaged[at] ^= 1;
    let mut spoiled = hardware.clone();
    assert_eq!(spoiled.load(&own.image()[..100]), Outcome::Broken);
    board.send(&damaged);
    assert_eq!(board.receive(), []);
    board.is(&spoiled, false);
    board.load(&own, 2);
    board.is(&own, false);
    // Cut off in its first word, and after it.
    let mut refused = own.clone();
    assert_eq!(refused.load(&[0; 4]), Outcome::Refused);
    for (bytes, left) in [(10, &refused), (60, &spoiled)] {
        board.send(&[&whole[..bytes], &[slip::END]].concat());
        assert_eq!(board.receive(), []);
        board.is(left, false);
        board.load(&own, 3);
        board.is(&own, false);
    }
    // Another length than that of the board's tables.
    board.send(&sealed(Kind::Tables as u8, 12, &own.image()[..12]));
    assert_eq!(board.receive(), []);
    board.is(&own, false);
    // While a frame is solved: the board drops the packet, and answers the frame by the tables of before.
    board.send(&[board.frame(0, Kind::FrameForForces, 5).to_wire(), image(&own, 6).to_wire()].concat());
    let answers = board.receive();
    assert!(answers == [board.answer(0, Kind::FrameForForces, 5, false)], "{}", answers.len());
    board.is(&refused, false);
    let wanted = Counters { taken: 3 + 2 * 8 + 2, crc: 3, length: 1, overrun: 1, ..Counters::default() };
    assert_eq!(board.counters(), wanted);
}
