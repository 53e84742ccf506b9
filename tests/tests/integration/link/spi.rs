//! The link over SPI: a controller with rates from 1 MHz to the highest allowed, and transactions that end anywhere.

use dermis_cosim::simulator::Simulator;
use dermis_cosim::VerilatedBoard;
use dermis_golden::fixed::{Cycles, Model, Plan};
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::Scene;
use dermis_golden::wire::link::slip::{END, IDLE};
use dermis_golden::wire::link::{Counters, Decoder, Identity, Kind, Packet, PacketError};
use dermis_hdl::language::Change;
use dermis_hdl::link::{generate_board, generate_board_changed, BoardDevice};
use dermis_host::link::SpiController;
use dermis_tests::{build_dir, scene, variants};

use super::{device, shipped, small, Questions, BOTH, RESET, SINGLE_BYTE, TWO_SUBARRAYS};

/// Edges of the controller's clock per byte.
const EDGES: usize = 16;
/// Bytes after which the test gives up waiting for an answer; longer than any frame takes.
const PATIENCE: usize = 20_000;
/// Bytes per transaction in the guide's example of an 8×8 frame per millisecond.
const A_MILLISECOND: usize = 1_100;
/// SPI rate that the boards' files allow, Hz.
const RATE: u32 = 25_000_000;

/// A board with an SPI and its controller.
struct Board {
    controller: SpiController,
    decoder: Decoder,
    questions: Questions,
}

/// A test board with an SPI of `rate`.
fn over_spi(mut questions: Questions, rate: u32) -> Questions {
    let change = |plan: &mut Plan| {
        plan.scene.hardware.link = LinkKind::Spi;
        let slowest = plan.board.spi_MHz.unwrap();
        plan.board.spi_MHz = Some(slowest.max(f64::from(rate) / 1e6));
    };
    questions.model = questions.model.with_changed_plan(change).unwrap();
    questions
}

impl Board {
    fn new(questions: Questions, rate: u32, phase: f64, simulators: &[Simulator]) -> Board {
        let questions = over_spi(questions, rate);
        let device = device(&questions.model, simulators);
        Board::with(device, questions, rate, phase)
    }

    fn with(device: Box<dyn BoardDevice>, questions: Questions, rate: u32, phase: f64) -> Board {
        let clock_hz = Identity::of(&questions.model).unwrap().clock_hz;
        let mut controller = SpiController::new(device, clock_hz, rate, phase);
        controller.wait(RESET);
        Board { controller, decoder: Decoder::default(), questions }
    }

    fn read(&mut self, bytes: Vec<u8>) -> Vec<Result<Packet, PacketError>> {
        bytes.into_iter().filter_map(|byte| self.decoder.next(byte)).collect()
    }

    /// Sends bytes in one transaction and reads in others until the given number of packets has been received.
    fn ask(&mut self, wire: &[u8], answers: usize) -> Vec<Packet> {
        let bytes = self.controller.transfer(wire);
        let mut packets = self.read(bytes);
        for _ in 0..PATIENCE / 50 {
            if packets.len() >= answers {
                break;
            }
            let bytes = self.controller.transfer(&[IDLE; 50]);
            packets.extend(self.read(bytes));
        }
        packets.into_iter().collect::<Result<_, _>>().unwrap()
    }

    fn counters(&mut self) -> Counters {
        let packets = self.ask(&Packet::request(Kind::ReadCounters, 9).to_wire(), 1);
        Counters::of_bytes(&packets[0].payload).unwrap()
    }

    /// The board's identity and its answers to the first frame.
    fn answers_as_the_model(&mut self, kinds: &[Kind]) {
        let identity = Identity::of(&self.questions.model).unwrap();
        let packets = self.ask(&Packet::request(Kind::Identify, 200).to_wire(), 1);
        assert_eq!(packets, [Packet { kind: Kind::Identity, sequence: 200, payload: identity.to_bytes() }]);
        for &kind in kinds {
            let wanted = self.questions.answer(0, kind, IDLE, false);
            assert!(self.ask(&self.questions.frame(0, kind, IDLE).to_wire(), 1) == [wanted], "{kind:?}");
        }
        let taken = kinds.len() as u16 + 2;
        assert_eq!(self.counters(), Counters { taken, ..Counters::default() });
    }
}

#[test]
fn a_board_answers_as_the_model() {
    let mut board = Board::new(shipped(&scene("eight-by-eight").0), RATE, 0.3, variants(&BOTH, 1));
    board.answers_as_the_model(&[Kind::FrameForResultants]);
}

#[test]
fn the_serial_engines_board_answers_at_a_rate_near_its_clock_without_a_gap() {
    let (mut scene, _) = scene("eight-by-eight");
    scene.hardware.board = Some("icebreaker".into());
    let mut board = Board::new(shipped(&scene), RATE, 0.7, &BOTH);
    board.answers_as_the_model(&[]);
    // One transaction for the frame and, after the time it takes, one for the answer.
    let kind = Kind::FrameForForces;
    let request = board.questions.frame(1, kind, 7).to_wire();
    board.controller.transfer(&request);
    board.controller.wait(Cycles::longest(&board.questions.model).total);
    let answer = board.questions.answer(1, kind, 7, false);
    let bytes = board.controller.transfer(&vec![IDLE; answer.to_wire().len() + 1]);
    assert!(bytes == [vec![IDLE], answer.to_wire()].concat());
}

#[test]
fn one_transaction_a_millisecond_holds_a_frame_and_all_its_forces() {
    let mut board = Board::new(shipped(&scene("eight-by-eight").0), RATE, 0.4, &[Simulator::Verilator]);
    let clock_hz = Identity::of(&board.questions.model).unwrap().clock_hz as usize;
    let cycles = A_MILLISECOND * 8 * clock_hz / RATE as usize;
    for index in 0..board.questions.codes.len() {
        let mut wire = board.questions.frame(index, Kind::FrameForForces, index as u8).to_wire();
        wire.resize(A_MILLISECOND, IDLE);
        let bytes = board.controller.transfer(&wire);
        let answer = board.questions.answer(index, Kind::FrameForForces, index as u8, false);
        assert!(board.read(bytes) == [Ok(answer)], "frame {index}");
        board.controller.wait((clock_hz / 1_000 - cycles) as u64);
    }
}

#[test]
fn every_rate_and_phase_is_understood() {
    let kinds = [Kind::FrameForResultants, Kind::FrameForForces];
    // The highest rate at 100 MHz, and rates without a common period with the clock.
    let rates = [(160_000_000, 0.5), (99_999_999, 0.1), (33_333_333, 0.9), (RATE, 0.0)];
    for (rate, phase) in rates {
        Board::new(small(SINGLE_BYTE), rate, phase, variants(&BOTH, 1)).answers_as_the_model(&kinds);
    }
    Board::new(small(TWO_SUBARRAYS), rates[0].0, 0.8, variants(&BOTH, 1)).answers_as_the_model(&kinds);
    for phase in variants(&[0.0, 0.4], 1) {
        Board::new(small(SINGLE_BYTE), 1_000_000, *phase, &[Simulator::Verilator]).answers_as_the_model(&kinds);
    }
}

#[test]
fn idle_reads_bring_idle_and_garbage_is_counted_and_forgotten() {
    let mut board = Board::new(small(SINGLE_BYTE), RATE, 0.2, &BOTH);
    assert_eq!(board.controller.transfer(&[IDLE; 30]), [IDLE; 30]);
    let garbage: Vec<u8> =
        (0u8..60).map(|byte| byte.wrapping_mul(7).wrapping_add(1)).filter(|byte| *byte != END).collect();
    let frame = board.questions.frame(0, Kind::FrameForForces, 1).to_wire();
    // A frame with IDLE bytes in any place, after bytes that belong to no packet.
    let spread: Vec<u8> = frame.iter().flat_map(|&byte| [IDLE, byte, IDLE]).collect();
    let answer = board.questions.answer(0, Kind::FrameForForces, 1, false);
    assert!(board.ask(&[garbage, spread].concat(), 1) == [answer]);
    assert_eq!(board.counters(), Counters { taken: 2, crc: 1, ..Counters::default() });
}

/// Whether frames and answers are transferred correctly when transactions end after these numbers of edges in turn.
fn is_whole(board: &mut Board, cuts: [usize; 2]) -> bool {
    let kind = Kind::FrameForForces;
    let frames = [0, 1, 2].map(|index| board.questions.frame(index, kind, index as u8).to_wire()).concat();
    let (mut sent, mut packets) = (0, Vec::new());
    for &edges in cuts.iter().cycle().take(PATIENCE / 10) {
        let bytes = board.controller.transfer_edges(&frames[sent.min(frames.len())..], edges);
        // The board has a byte at the rising edge of its last bit.
        sent += (edges + 1) / EDGES;
        packets.extend(board.read(bytes));
        if packets.len() == 3 {
            break;
        }
    }
    let wanted = [0, 1, 2].map(|index| Ok(board.questions.answer(index, kind, index as u8, false)));
    packets == wanted
}

/// A small board under Verilator with this defect.
fn small_board_with(defect: &Change) -> Board {
    let questions = over_spi(small(SINGLE_BYTE), RATE);
    let generated = generate_board_changed(&questions.model, std::slice::from_ref(defect)).unwrap();
    let device = VerilatedBoard::new(&generated, &questions.model, &build_dir().join("verilator")).unwrap();
    Board::with(Box::new(device), questions, RATE, 0.6)
}

/// The first number of edges after which a transaction may not end, the other ones being of four bytes: the first byte
/// of a transaction brings nothing back.
fn broken(board: &mut Board) -> Option<usize> {
    (1..=3 * EDGES).find(|&edges| !is_whole(board, [edges, 4 * EDGES]))
}

#[test]
fn transactions_may_end_after_any_edge() {
    let mut board = Board::new(small(SINGLE_BYTE), RATE, 0.6, &[Simulator::Verilator]);
    assert_eq!(broken(&mut board), None);
    // Many of the shortest possible transactions.
    assert!(is_whole(&mut board, [2 * EDGES; 2]));
    let taken = 3 * (3 * EDGES as u16 + 1) + 1;
    assert_eq!(board.counters(), Counters { taken, ..Counters::default() });
}

#[test]
fn a_byte_given_up_too_early_or_too_late_is_found() {
    let defects = [
        // Dropped when the next byte is ready, whether or not its bits have been read, or at the end of a transaction.
        Change::value("line", "sclk_stores", |k| k.named("sclk_last")),
        Change::undefined("line", "sclk_carries"),
        // Acknowledged whether or not there was a byte.
        Change::within("line", "sclk_taken", |k| [k.named("sclk_offered").at(1), !k.named("sclk_taken")]),
    ];
    for defect in variants(&defects, 1) {
        assert_ne!(broken(&mut small_board_with(defect)), None, "the defect in {defect} went unnoticed");
    }
}

#[test]
fn a_scene_names_its_link_and_the_verilog_has_no_other() {
    let text = "[hardware]\nlink = \"spi\"\n[sensor]\nrows = 2\ncols = 2\npitch_x_mm = 4.0\npitch_y_mm = 4.0\n\
                thickness_mm = 3.0\n[search]\nmu_max = 0.05\n";
    for (text, own, other) in [(text, "spi", "uart"), (&text.replace("spi", "uart"), "uart", "spi")] {
        let model = Model::new(&Scene::parse(text, "link").unwrap()).unwrap();
        let generated = generate_board(&model).unwrap();
        let verilog = &generated.files.iter().find(|file| file.name.ends_with("_board.v")).unwrap().text;
        assert!(verilog.contains(&format!("{own}_")) && !verilog.contains(&format!("{other}_")), "{own}");
    }
}
