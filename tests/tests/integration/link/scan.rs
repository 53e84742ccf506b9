//! A board that scans its array: a request is answered with a scan, whose codes follow the forces.

use dermis_cosim::scan::ScannedBoard;
use dermis_cosim::VerilatedBoard;
use dermis_golden::fixed::stages::load::Outcome;
use dermis_hdl::link::{board_simulator, generate_board};

use super::tables::image;
use super::*;
use crate::tables::{specimen, SCENE};

const SCAN: &str = "[input]\nfull_scale_MPa = 1.0\n[hardware.adc_scan]\nconverter = \"max11125\"\nsclk_MHz = 12.5\n\
                    row_settling_us = 2\nchannel_settling_us = 0.5\nperiod_us = 60\n";

/// Of the two frames that the array shows.
const STEPS: [usize; 2] = [5, 7];

/// What a taxel of it reads, in MPa.
fn shown(taxel: usize, step: usize) -> f64 {
    (taxel * step % 9) as f64 / 20.0
}

fn scene() -> Scene {
    let hardware = "tables = \"writable\"\n";
    let text = SCENE.replace(hardware, &format!("{hardware}source = \"adc-scan\"\n"));
    Scene::parse(&format!("{text}{SCAN}"), "scan.toml").unwrap()
}

/// A board whose array shows two frames in turn, scan by scan.
fn board(simulators: &[Simulator]) -> Board {
    let scene = scene();
    let readings = |step: usize| (0..scene.sensor.taxels()).map(|taxel| shown(taxel, step)).collect();
    let frames = STEPS.map(|step| Frame::from_stress("readings", &scene.sensor, readings(step)).unwrap());
    let raw = |model: &Model, simulator: &Simulator| -> Box<dyn BoardDevice> {
        let cache = build_dir().join("verilator");
        match simulator {
            Simulator::Kernel => board_simulator(model).unwrap(),
            _ => Box::new(VerilatedBoard::new(&generate_board(model).unwrap(), model, &cache).unwrap()),
        }
    };
    let scanned = |model: &Model| -> Box<dyn BoardDevice> {
        let mut devices: Vec<_> = simulators.iter().map(|simulator| raw(model, simulator)).collect();
        let device = match devices.len() {
            1 => devices.remove(0),
            _ => Box::new(Both(devices.try_into().ok().unwrap(), 0)),
        };
        Box::new(ScannedBoard::new(device, model, &frames).unwrap())
    };
    let mut board = Board::with(Questions { model: Model::new(&scene).unwrap(), codes: Vec::new() }, scanned);
    board.silence += 3 * board.model.scan_timing().unwrap().period;
    board
}

impl Board {
    /// The codes of an answer, which must be the model's result for them.
    fn scanned(&self, packet: &Packet) -> Vec<i32> {
        let answer = BoardAnswer::of_bytes(&self.model, &packet.payload, packet.kind == Kind::Forces).unwrap();
        assert_eq!(answer.compare_with_model(&self.model, &answer.codes), None);
        let readings = self.model.readings_of("scan", &answer.codes).unwrap();
        assert_eq!(self.model.readings(&[readings]).unwrap(), answer.codes);
        answer.codes
    }

    /// The codes of the answer to a request for the next scan.
    fn ask(&mut self, kind: Kind, sequence: u8) -> Vec<i32> {
        self.send(&Packet::request(kind, sequence).to_wire());
        let packets = self.receive();
        assert_eq!(packets.iter().map(|packet| packet.sequence).collect::<Vec<_>>(), [sequence]);
        self.scanned(&packets[0])
    }
}

#[test]
fn a_request_is_answered_with_the_next_scan_and_its_codes() {
    let mut board = board(variants(&BOTH, 1));
    board.send(&Packet::request(Kind::Identify, 3).to_wire());
    let identity = Identity::of_bytes(&board.receive()[0].payload).unwrap();
    assert!(identity.scans() && identity.supports(Kind::Tables));
    // To some LSB of the converter, whose range is 0.5 here because of the largest gain.
    let shows = |board: &Board, codes: &[i32], step: usize| {
        let readings = board.model.readings_of("scan", codes).unwrap().stress_MPa;
        readings.iter().enumerate().all(|(taxel, reading)| (reading - shown(taxel, step)).abs() < 5.0 * 0.5 / 4096.0)
    };
    let [sums, forces] = [Kind::FrameForResultants, Kind::FrameForForces].map(|kind| board.ask(kind, 9));
    assert!([sums, forces].iter().all(|codes| STEPS.iter().any(|step| shows(&board, codes, *step))));
    assert_eq!(board.counters(), Counters { taken: 4, ..Counters::default() });
}

#[test]
fn requests_beyond_the_queue_are_overruns_and_each_answer_is_of_a_later_scan() {
    let mut board = board(&[Simulator::Verilator]);
    let wire: Vec<u8> = (0..7).flat_map(|sequence| Packet::request(Kind::FrameForForces, sequence).to_wire()).collect();
    board.send(&wire);
    let packets = board.receive();
    let answered: Vec<u8> = packets.iter().map(|packet| packet.sequence).collect();
    assert!(
        (4..7).contains(&answered.len()) && answered.is_sorted() && answered.starts_with(&[0, 1, 2, 3]),
        "{answered:?}"
    );
    let codes: Vec<Vec<i32>> = packets.iter().map(|packet| board.scanned(packet)).collect();
    // Noise: no scan is answered twice.
    assert!(codes.windows(2).all(|pair| pair[0] != pair[1]));
    let taken = answered.len() as u16;
    assert_eq!(board.counters(), Counters { taken: taken + 1, overrun: 7 - taken, ..Counters::default() });
    // A request with codes is one of another board.
    board.send(&sealed(Kind::FrameForForces as u8, 4, &[0; 4]));
    assert_eq!(board.receive(), []);
    assert_eq!(board.counters().length, 1);
}

#[test]
fn tables_come_in_a_packet_while_the_array_is_scanned() {
    let mut board = board(&[Simulator::Verilator]);
    let (_folder, other) = specimen(&scene());
    let hardware = board.model.clone();
    let own = hardware.with_tables(&other, 4321).unwrap();
    let before = board.ask(Kind::FrameForForces, 1);
    assert_ne!(hardware.run(&before).beats, own.run(&before).beats);
    // A frame may be in the engine when the first bytes come: the packet is sent again.
    let mut sent = 0;
    while {
        sent += 1;
        board.send(&image(&own, sent).to_wire());
        board.receive().is_empty()
    } {}
    assert!(sent < 5, "{sent}");
    board.questions.model = own;
    (0..3).for_each(|round| drop(board.ask(Kind::FrameForForces, 10 + round)));
    // Cut off: the tables are not whole, and frames say so, until they come again.
    let wire = image(&board.model, 7).to_wire();
    board.send(&[&wire[..60], &[slip::END]].concat());
    assert_eq!(board.receive(), []);
    board.send(&Packet::request(Kind::FrameForForces, 8).to_wire());
    let answer = board.receive().remove(0);
    let answer = BoardAnswer::of_bytes(&board.model, &answer.payload, true).unwrap();
    let mut spoiled = hardware.clone();
    assert_eq!(spoiled.load(&board.model.image()[..50]), Outcome::Broken);
    assert_eq!(answer.compare_with_model(&spoiled, &answer.codes), None);
}
