//! The board's link over UART or SPI (`spi`): for any input the board's top module behaves the same under Verilator and
//! in kernel simulation, pin by pin and half cycle by half cycle; its answers are those of the bit-true model; and
//! its counters record every packet dropped.

use std::ops::Deref;

use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::stages::send::FRAMING;
use dermis_golden::fixed::{Cycles, Model};
use dermis_golden::spec::scene::Scene;
use dermis_golden::wire::link::{
    beats_of_bytes, codes_to_bytes, slip, Counters, Decoder, Header, Identity, Kind, Packet, Sums,
};
use dermis_hdl::link::{BoardDevice, BoardOutputs};
use dermis_host::link::{BoardAnswer, HostUart, PhysicalAnswer, UartSymbol};
use dermis_tests::{build_dir, scene, variants, with_network};

mod scan;
mod spi;
mod tables;

/// Clock cycles per bit, the minimum of the link; the rest of the design runs at full speed.
const CYCLES_PER_BIT: u32 = 8;
/// That bit rate at 100 MHz.
const BAUD: u32 = 100_000_000 / CYCLES_PER_BIT;

/// Both simulators, in lockstep; one is a tenth of the work.
const BOTH: [Simulator; 2] = [Simulator::Verilator, Simulator::Kernel];

/// Changes of pins until a board is out of reset; before, Verilator's registers are undefined.
const RESET: u64 = 40;

/// Two simulators in lockstep.
struct Both([Box<dyn BoardDevice>; 2], u64);

impl BoardDevice for Both {
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs {
        let [a, b] = self.0.each_mut().map(|device| device.settle(inputs, clock));
        self.1 += 1;
        assert!(self.1 < RESET || a == b, "change {}: Verilator {a:?}, kernel simulation {b:?}", self.1);
        b
    }
}

/// The board of `model` on one simulator, or on two in lockstep.
fn device(model: &Model, simulators: &[Simulator]) -> Box<dyn BoardDevice> {
    let hardware = Hardware::new(model.clone(), &build_dir()).unwrap();
    let mut devices: Vec<_> = simulators.iter().map(|simulator| hardware.board(*simulator).unwrap()).collect();
    match devices.len() {
        1 => devices.remove(0),
        _ => Box::new(Both(devices.try_into().ok().unwrap(), 0)),
    }
}

/// Frames for a board, and the expected answers.
struct Questions {
    model: Model,
    codes: Vec<Vec<i32>>,
}

impl Questions {
    fn frame(&self, index: usize, kind: Kind, sequence: u8) -> Packet {
        Packet { kind, sequence, payload: codes_to_bytes(&self.codes[index], self.model.formats().input_bits) }
    }

    /// The model's answer to a frame.
    fn answer(&self, index: usize, kind: Kind, sequence: u8, framing: bool) -> Packet {
        let trace = self.model.run(&self.codes[index]);
        let mut status = trace.status.clone();
        if framing {
            FRAMING.put(&mut status, 1);
        }
        let bytes = |beats: &[[i32; 3]]| -> Vec<u8> { beats.iter().flatten().flat_map(|w| w.to_le_bytes()).collect() };
        let (forces, labels) = trace.beats.split_at(trace.beats.len() - self.model.label_beats());
        let front = match kind {
            Kind::FrameForResultants if !self.model.sends_resultants() => {
                Sums::of(forces, self.model.scene.sensor.cols).to_bytes()
            }
            _ => bytes(forces),
        };
        Packet { kind: kind.answer(), sequence, payload: [front, bytes(labels), bytes(&status)].concat() }
    }
}

struct Board {
    uart: HostUart,
    decoder: Decoder,
    questions: Questions,
    /// A number of cycles longer than a frame takes.
    silence: u64,
}

impl Deref for Board {
    type Target = Questions;

    fn deref(&self) -> &Questions {
        &self.questions
    }
}

impl Board {
    fn new(simulators: &[Simulator]) -> Board {
        Board::of(shipped(&scene("eight-by-eight").0), simulators)
    }

    fn of(questions: Questions, simulators: &[Simulator]) -> Board {
        Board::with(questions, |model| device(model, simulators))
    }

    /// A board that `device` makes of the model.
    fn with(mut questions: Questions, device: impl FnOnce(&Model) -> Box<dyn BoardDevice>) -> Board {
        let baud = (questions.model.board.clock_MHz * 1e6) as u32 / CYCLES_PER_BIT;
        questions.model = questions.model.with_changed_plan(|plan| plan.board.uart_baud = Some(baud)).unwrap();
        let model = &questions.model;
        let silence = Cycles::longest(model).total + 1_000;
        let clock_hz = Identity::of(model).unwrap().clock_hz;
        let uart = HostUart::new(device(model), baud, clock_hz);
        Board { uart, decoder: Decoder::default(), questions, silence }
    }

    fn send(&mut self, wire: &[u8]) {
        wire.iter().for_each(|&byte| self.uart.send(UartSymbol::Byte(byte)));
    }

    /// All packets received until there is none for longer than a frame takes.
    fn receive(&mut self) -> Vec<Packet> {
        while self.uart.idle_cycles() < self.silence {
            self.uart.cycle();
        }
        let bytes = self.uart.received();
        let packets = bytes.iter().filter_map(|&byte| self.decoder.next(byte));
        packets.collect::<Result<_, _>>().unwrap()
    }

    /// The counters, this request included.
    fn counters(&mut self) -> Counters {
        self.send(&Packet::request(Kind::ReadCounters, 9).to_wire());
        let packets = self.receive();
        assert_eq!(packets.len(), 1);
        Counters::of_bytes(&packets[0].payload).unwrap()
    }
}

/// The counter of a cause.
type Cause = fn(&mut Counters) -> &mut u16;

/// A packet with a correct CRC around any bytes.
fn sealed(kind: u8, length: u16, payload: &[u8]) -> Vec<u8> {
    let mut bytes = [Header { kind, sequence: 1, length }.to_bytes(), payload.to_vec()].concat();
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    slip::encode(&bytes)
}

#[test]
fn both_simulations_answer_as_the_model() {
    let mut board = Board::new(&BOTH);
    board.send(&Packet::request(Kind::Identify, 200).to_wire());
    let identity = Identity::of(&board.model).unwrap().to_bytes();
    assert_eq!(board.receive(), [Packet { kind: Kind::Identity, sequence: 200, payload: identity }]);
    for (index, kind) in [(0, Kind::FrameForResultants), (1, Kind::FrameForForces)] {
        board.send(&board.frame(index, kind, 0xc0 + index as u8).to_wire());
        let wanted = board.answer(index, kind, 0xc0 + index as u8, false);
        assert!(board.receive() == [wanted], "frame {index}");
    }
    // An incomplete frame, one damaged in its last code, and a complete one right after them.
    let frame = board.frame(0, Kind::FrameForResultants, 7).to_wire();
    let mut damaged = frame.clone();
    damaged[190] ^= 1;
    board.send(&frame[..100]);
    board.send(&damaged);
    board.send(&frame);
    assert!(board.receive() == [board.answer(0, Kind::FrameForResultants, 7, true)]);
    assert_eq!(board.counters(), Counters { taken: 5, crc: 2, ..Counters::default() });
}

#[test]
fn a_board_with_the_serial_engine_sends_forces_and_says_that_it_adds_nothing_up() {
    let (mut scene, _) = scene("eight-by-eight");
    scene.hardware.board = Some("icebreaker".into());
    let mut board = Board::of(shipped(&scene), &BOTH);
    board.send(&Packet::request(Kind::Identify, 3).to_wire());
    let packets = board.receive();
    let identity = Identity::of_bytes(&packets[0].payload).unwrap();
    assert_eq!(identity, Identity::of(&board.model).unwrap());
    assert!(identity.supports(Kind::FrameForForces) && !identity.supports(Kind::FrameForResultants));
    for index in 0..2 {
        board.send(&board.frame(index, Kind::FrameForForces, 0xdb).to_wire());
        assert!(board.receive() == [board.answer(index, Kind::FrameForForces, 0xdb, false)], "frame {index}");
    }
    board.send(&board.frame(0, Kind::FrameForResultants, 4).to_wire());
    assert_eq!(board.receive(), []);
    assert_eq!(board.counters(), Counters { taken: 4, unknown_type: 1, ..Counters::default() });
}

#[test]
fn every_packet_dropped_is_counted_once_under_its_cause() {
    let mut board = Board::new(&[Simulator::Verilator]);
    let frame = board.frame(0, Kind::FrameForResultants, 1).to_wire();
    let codes = &board.frame(0, Kind::FrameForResultants, 1).payload;
    let bytes = codes.len() as u16;
    let cases: [(Vec<u8>, Cause); 11] = [
        (vec![1, 2, 3, slip::END], |c| &mut c.crc),
        (vec![slip::ESC, 7, slip::END], |c| &mut c.framing),
        // Incomplete: the END of the next packet ends it.
        ([&frame[..frame.len() / 2], &[slip::END]].concat(), |c| &mut c.crc),
        // This board's tables are in the bitstream.
        (sealed(0x05, 0, &[]), |c| &mut c.unknown_type),
        (sealed(0x00, 0, &[]), |c| &mut c.unknown_type),
        (sealed(0x83, 0, &[]), |c| &mut c.unknown_type),
        (sealed(0x01, 1, &[0]), |c| &mut c.length),
        (sealed(0x01, 0, &[0]), |c| &mut c.length),
        (sealed(0x03, bytes - 1, &codes[1..]), |c| &mut c.length),
        (sealed(0x04, bytes, &codes[1..]), |c| &mut c.length),
        (sealed(0x04, bytes, &[codes.as_slice(), &[0]].concat()), |c| &mut c.length),
    ];
    let mut wanted = board.counters();
    assert_eq!(wanted, Counters { taken: 1, ..Counters::default() });
    for (wire, cause) in cases {
        board.send(&wire);
        assert_eq!(board.receive(), [], "{wire:?}");
        wanted.taken += 1;
        *cause(&mut wanted) += 1;
        assert_eq!(board.counters(), wanted, "{wire:?}");
    }
    // A byte without stop bit affects its own packet only.
    board.send(&frame[..50]);
    board.uart.send(UartSymbol::NoStop(frame[50]));
    board.send(&frame[51..]);
    assert_eq!(board.receive(), []);
    board.send(&frame);
    assert!(board.receive() == [board.answer(0, Kind::FrameForResultants, 1, true)]);
    wanted.framing += 1;
    wanted.taken += 2;
    assert_eq!(board.counters(), wanted);
}

#[test]
fn a_host_whose_bit_rate_is_two_percent_off_is_understood() {
    for baud in [BAUD / 100 * 98, BAUD / 100 * 102] {
        let mut board = Board::new(&[Simulator::Verilator]);
        board.uart.set_baud(baud);
        board.send(&board.frame(0, Kind::FrameForForces, 3).to_wire());
        assert!(board.receive() == [board.answer(0, Kind::FrameForForces, 3, false)], "{baud} bit/s");
    }
}

#[test]
fn requests_that_come_too_fast_are_overruns_and_the_rest_is_answered_in_order() {
    let mut board = Board::new(&[Simulator::Verilator]);
    // Sending all forces takes four times as long as receiving a frame.
    let sequences: Vec<u8> = (0..12).collect();
    let wire: Vec<u8> = sequences.iter().flat_map(|&s| board.frame(1, Kind::FrameForForces, s).to_wire()).collect();
    board.send(&wire);
    let packets = board.receive();
    assert!(packets.len() >= 3, "{}", packets.len());
    let answered: Vec<u8> = packets.iter().map(|packet| packet.sequence).collect();
    assert!(answered.is_sorted() && answered.starts_with(&[0, 1, 2]), "{answered:?}");
    let plain = board.answer(1, Kind::FrameForForces, 0, false).payload;
    for packet in &packets {
        let (beats, wanted) = (beats_of_bytes(&packet.payload).unwrap(), beats_of_bytes(&plain).unwrap());
        assert!(beats[..board.codes[1].len()] == wanted[..board.codes[1].len()], "{}", packet.sequence);
    }
    let (taken, all) = (packets.len() as u16, sequences.len() as u16);
    // Reading the counters is counted as well.
    assert_eq!(board.counters(), Counters { taken: taken + 1, overrun: all - taken, ..Counters::default() });
    // Afterwards the board answers as before.
    board.send(&board.frame(0, Kind::FrameForResultants, 77).to_wire());
    assert_eq!(board.receive().len(), 1);
}

/// The shipped frames of a scene.
fn shipped(scene: &Scene) -> Questions {
    let model = Model::new(scene).unwrap();
    let codes = Frame::shipped(scene).iter().map(|frame| model.codes(frame).unwrap().codes).collect();
    Questions { model, codes }
}

/// A small array; a small mu_max makes a small search.
fn small(text: &str) -> Questions {
    extremes(Model::new(&Scene::parse(&small_text(text), "small").unwrap()).unwrap())
}

fn small_text(text: &str) -> String {
    let lengths = "pitch_x_mm = 3.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    format!("[search]\nmu_max = 0.05\n[sensor]\n{lengths}{text}")
}

/// Frames of the largest codes.
fn extremes(model: Model) -> Questions {
    let (taxels, bits) = (model.scene.sensor.taxels(), model.formats().input_bits);
    let largest = (1i32 << (bits - 1)) - 1;
    let codes = vec![
        vec![largest; taxels],
        vec![-largest - 1; taxels],
        (0..taxels as i32).map(|taxel| if taxel % 3 == 0 { -largest } else { largest / (taxel + 1) }).collect(),
    ];
    Questions { model, codes }
}

/// 5×6 taxels in two subarrays with two-byte codes.
const TWO_SUBARRAYS: &str = "rows = 5\ncols = 6\n[partition]\nrows = 1\ncols = 2\n[fixed]\ninput_bits = 16\n";
/// 2×3 taxels with one-byte codes.
const SINGLE_BYTE: &str =
    "rows = 2\ncols = 3\n[fixed]\ninput_bits = 8\ndata_bits = 12\ncoef_bits = 8\ninverse_bits = 8\n";

const CONTACTS: &str =
    "rows = 5\ncols = 6\n[partition]\ncase = \"contacts\"\nmax_contacts = 2\n[input]\nfull_scale_MPa = 0.5\n";

/// A scene of contacts, its network, and a frame with two of them as the first.
fn two_contacts(more: &str) -> (Questions, Frame, impl Sized) {
    let (scene, file) = with_network(&small_text(&format!("{CONTACTS}{more}")), &[6]);
    let mut questions = extremes(Model::new(&scene).unwrap());
    let pressed = |taxel: usize| if [7, 8, 22, 28].contains(&taxel) { 0.3 } else { 0.001 };
    let frame = Frame::from_stress("two", &scene.sensor, (0..30).map(pressed).collect()).unwrap();
    questions.codes[0] = questions.model.codes(&frame).unwrap().codes;
    (questions, frame, file)
}

/// What a board sends in the place of forces is the answer to a request for resultants; there is none for forces.
#[test]
fn records_of_contacts_are_the_resultants() {
    let (questions, frame, _file) = two_contacts("[output]\nforces = \"resultants\"\n");
    let mut board = Board::of(questions, &[Simulator::Verilator]);
    board.send(&Packet::request(Kind::Identify, 3).to_wire());
    let identity = Identity::of_bytes(&board.receive()[0].payload).unwrap();
    assert!(identity.supports(Kind::FrameForResultants) && !identity.supports(Kind::FrameForForces));
    assert_eq!((identity.statuses, identity.label_bits), (2, 0));
    board.send(&board.frame(0, Kind::FrameForForces, 4).to_wire());
    assert_eq!(board.receive(), []);
    board.send(&board.frame(0, Kind::FrameForResultants, 5).to_wire());
    let mut answers = board.receive();
    assert!(answers == [board.answer(0, Kind::FrameForResultants, 5, false)]);
    assert_eq!(board.counters(), Counters { taken: 3, unknown_type: 1, ..Counters::default() });
    let answer = BoardAnswer::of_bytes(&board.model, &answers.remove(0).payload, false).unwrap();
    assert_eq!(answer.compare_with_model(&board.model, &board.codes[0]), None);
    let physical = PhysicalAnswer::new(&board.model, &frame, &answer).unwrap();
    let of_model = board.model.reconstruct(&frame).unwrap();
    assert_eq!((physical.contacts, physical.resultant_N), (of_model.contacts(), of_model.resultant_N));
    assert_eq!(physical.flags, of_model.flags);
}

/// Labels between forces and statuses, a status for each of two contacts; the host reads the contacts.
#[test]
fn contacts_are_answered_with_their_labels() {
    let (questions, frame, _file) = two_contacts("");
    let mut board = Board::of(questions, variants(&BOTH, 1));
    board.send(&Packet::request(Kind::Identify, 3).to_wire());
    let identity = Identity::of_bytes(&board.receive()[0].payload).unwrap();
    assert_eq!((identity.statuses, identity.label_bits), (2, 4));
    let mut payload = Vec::new();
    for (index, kind) in [(1, Kind::FrameForForces), (0, Kind::FrameForResultants), (0, Kind::FrameForForces)] {
        board.send(&board.frame(index, kind, 5).to_wire());
        let (mut answers, wanted) = (board.receive(), board.answer(index, kind, 5, false));
        assert!(answers == [wanted], "frame {index}, {kind:?}");
        payload = answers.remove(0).payload;
    }
    let answer = BoardAnswer::of_bytes(&board.model, &payload, true).unwrap();
    assert_eq!(answer.compare_with_model(&board.model, &board.codes[0]), None);
    let contacts = PhysicalAnswer::new(&board.model, &frame, &answer).unwrap().contacts.unwrap();
    let of_model = board.model.reconstruct(&frame).unwrap().contacts().unwrap();
    assert_eq!((contacts.len(), &contacts), (2, &of_model));
    // A label that is not the model's is found.
    let mut other = answer.clone();
    other.labels[0][0] ^= 1;
    let found = other.compare_with_model(&board.model, &board.codes[0]).unwrap();
    assert!(found.starts_with("row 0, column 0: label"), "{found}");
}

#[test]
fn a_code_on_offer_when_its_packet_turns_out_bad_is_taken_and_its_frame_dropped() {
    let mut board = Board::of(small(SINGLE_BYTE), &BOTH);
    // Sending all forces takes longer than receiving a frame: while the first frame's are sent, the second waits behind
    // them, the third in the engine's buffer, and the first code of the fourth in front of it until after the packet's
    // end.
    let kind = Kind::FrameForForces;
    for sequence in 0..3 {
        board.send(&board.frame(2, kind, sequence).to_wire());
    }
    board.send(&[&board.frame(0, kind, 9).to_wire()[..8], &[slip::END]].concat());
    let answers = board.receive();
    assert!(answers == [0, 1, 2].map(|sequence| board.answer(2, kind, sequence, false)), "{}", answers.len());
    // The engine received some codes and an early tlast, and flags it once.
    for framing in [true, false] {
        board.send(&board.frame(0, kind, 10).to_wire());
        assert!(board.receive() == [board.answer(0, kind, 10, framing)], "framing {framing}");
    }
    assert_eq!(board.counters(), Counters { taken: 6, crc: 1, ..Counters::default() });
}

#[test]
fn other_arrays_codes_of_one_and_two_bytes_and_the_largest_sums_are_answered() {
    for text in [TWO_SUBARRAYS, SINGLE_BYTE] {
        let simulators = variants(&BOTH, if text == SINGLE_BYTE { 2 } else { 1 });
        let mut board = Board::of(small(text), simulators);
        for index in 0..3 {
            for kind in [Kind::FrameForResultants, Kind::FrameForForces] {
                board.send(&board.frame(index, kind, 5).to_wire());
                let (answers, wanted) = (board.receive(), board.answer(index, kind, 5, false));
                assert!(answers == [wanted], "{text}: frame {index}, {kind:?}");
            }
        }
        assert_eq!(board.counters(), Counters { taken: 7, ..Counters::default() });
    }
}
