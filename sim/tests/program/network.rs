//! `dermis host` with a core behind Ethernet: the bit-true model behind a network that loses, doubles, reorders and alters packets.

use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_host::link::{open_board, NetworkCore, Session};

use super::host::{run, text};

/// On the loopback a packet takes some tens of microseconds.
const TIMEOUT: Duration = Duration::from_millis(100);
/// How well a frame's time is known beside the true one.
const TIME_ERROR_NS: i64 = 100_000;

/// A network between a host and a core, of which one packet in so many is not as it was.
struct Network {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<[u32; 4]>>,
}

impl Network {
    fn to(core: SocketAddr, one_in: usize, seed: u64) -> Network {
        let host_side = UdpSocket::bind("127.0.0.1:0").unwrap();
        let core_side = UdpSocket::bind("127.0.0.1:0").unwrap();
        core_side.connect(core).unwrap();
        for socket in [&host_side, &core_side] {
            socket.set_nonblocking(true).unwrap();
        }
        let (address, stop) = (host_side.local_addr().unwrap(), Arc::new(AtomicBool::new(false)));
        let ends = stop.clone();
        let thread = std::thread::spawn(move || {
            let (mut random, mut faults, mut host) = (fastrand::Rng::with_seed(seed), [0; 4], None);
            // In each direction a packet that is overtaken by the next.
            let mut held: [Option<Vec<u8>>; 2] = [None, None];
            let mut bytes = [0; 2048];
            while !ends.load(Ordering::Relaxed) {
                let mut quiet = true;
                for (direction, from) in [&host_side, &core_side].into_iter().enumerate() {
                    let Ok((count, sender)) = from.recv_from(&mut bytes) else { continue };
                    quiet = false;
                    if direction == 0 {
                        host = Some(sender);
                    }
                    let send = |packet: &[u8]| match (direction, host) {
                        (0, _) => drop(core_side.send(packet)),
                        (_, Some(host)) => drop(host_side.send_to(packet, host)),
                        _ => (),
                    };
                    let mut packet = bytes[..count].to_vec();
                    let fault = random.usize(..4 * one_in);
                    if let Some(count) = faults.get_mut(fault) {
                        *count += 1;
                    }
                    match fault {
                        0 => continue,
                        1 => send(&packet),
                        2 => {
                            let at = random.usize(..count);
                            packet[at] ^= 1 << random.u32(..8);
                        }
                        3 if held[direction].is_none() => {
                            held[direction] = Some(packet);
                            continue;
                        }
                        _ => (),
                    }
                    send(&packet);
                    if let Some(late) = held[direction].take() {
                        send(&late);
                    }
                }
                if quiet {
                    std::thread::sleep(Duration::from_micros(50));
                }
            }
            faults
        });
        Network { address, stop, thread: Some(thread) }
    }

    /// Packets that were lost, doubled, altered and overtaken.
    fn end(mut self) -> [u32; 4] {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

fn session(address: SocketAddr, model: &Model, tables: Option<Model>) -> Session {
    let board = open_board(&format!("udp:{address}"), model, None, TIMEOUT, "host").unwrap();
    Session::new(board, model.clone(), tables, None, true, true).unwrap()
}

/// Frames of several packets, of two cores at once: each core, and each answer, is the right one.
#[test]
fn over_a_network_with_faults_every_answer_of_each_core_is_right_and_every_fault_is_counted() {
    let all = ["sensor-1", "eight-by-eight"].map(|name| {
        std::thread::spawn(move || {
            let model = Model::new(&Scene::builtin(name).unwrap()).unwrap();
            let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
            let network = Network::to(core.address(), 12, name.len() as u64);
            let mut session = session(network.address, &model, None);
            for round in 0..60 {
                for frame in &Frame::shipped(&model.scene)[..3] {
                    let (_, answer) = session.request(frame).unwrap();
                    assert_eq!(answer.difference, Some(None), "{name}, {}, round {round}", frame.id);
                }
            }
            let (errors, counters) = (session.board.link_errors(), session.board.counters().unwrap());
            let [lost, doubled, altered, overtaken] = network.end();
            assert!(lost > 0 && doubled > 0 && altered > 0 && overtaken > 0);
            let damaged = errors.damaged + u64::from(counters.dropped_for("damaged"));
            assert!(
                damaged > 0 && errors.repeated > 0 && counters.dropped_for("ignored") > 0,
                "{errors:?} {counters:?}"
            );
            assert_eq!(counters.dropped_for("refused"), 0, "{counters:?}");
        })
    });
    all.into_iter().for_each(|one| one.join().unwrap());
}

#[test]
fn the_time_of_a_frame_is_right_within_what_is_said() {
    let model = Model::new(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    let mut session = session(core.address(), &model, None);
    let base = (Instant::now(), SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64);
    let begun_ns = base.1 - (base.0 - core.begun()).as_nanos() as i64;
    let frame = &Frame::shipped(&model.scene)[0];
    let mut errors = Vec::new();
    for _ in 0..200 {
        let (_, answer) = session.request(frame).unwrap();
        let own = answer.acquired.unwrap();
        let true_ns = begun_ns + (own.cycles as f64 / model.board.clock_MHz * 1e3) as i64;
        let error = own.time_ns - true_ns;
        // The base is known within the time of two calls, and a cycle is some nanoseconds.
        assert!(error.abs() <= own.error_ns as i64 + 5_000, "{error} ns, said {} ns", own.error_ns);
        errors.push(error.abs());
    }
    errors.sort_unstable();
    // A busy machine may delay single answers; what is said of them holds above.
    assert!(errors[errors.len() / 2] < TIME_ERROR_NS, "{errors:?}");
}

#[test]
fn tables_are_written_over_a_network_with_faults() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    // So many taxels that an image has several packets.
    let sensor = "rows = 16\ncols = 16\npitch_x_mm = 2.0\npitch_y_mm = 2.0\nthickness_mm = 2.0\n";
    let hand = format!(
        "name = \"hand\"\n[sensor]\n{sensor}[input]\nfull_scale_MPa = 1.0\n[hardware]\ntables = \"writable\"\n"
    );
    std::fs::write(path("hand.toml"), &hand).unwrap();
    std::fs::write(path("left.toml"), format!("{hand}[search]\nnoise_floor_MPa = 0.05\n")).unwrap();
    let model = Model::new(&Scene::load(&path("hand.toml")).unwrap()).unwrap();
    let left = Scene::load(&path("left.toml")).unwrap();
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    let network = Network::to(core.address(), 8, 3);
    let press = Frame::from_stress("press", &left.sensor, (0..256).map(|k| f64::from(k % 7) / 10.0).collect()).unwrap();
    let mut repeated = 0;
    for version in 1..12 {
        let own = model.with_tables(&left, version).unwrap();
        let mut session = session(network.address, &model, Some(own));
        let (_, answer) = session.request(&press).unwrap();
        assert_eq!(answer.difference, Some(None), "version {version}");
        repeated += session.board.link_errors().repeated;
    }
    assert!(repeated > 0 && network.end()[0] > 0);
}

/// The hardware of a hand of four arrays with zeros of their own, whose tables are written.
fn hand(folder: &Path) -> (String, Model) {
    const ARRAYS: usize = 4;
    for array in 0..ARRAYS {
        let places = (0..64).map(|taxel| (taxel / 8, taxel % 8));
        let lines: String =
            places.map(|(row, col)| format!("{row},{col},{},1\n", 0.001 * (array * (1 + row)) as f64)).collect();
        std::fs::write(folder.join(format!("zero-{array}.csv")), format!("row,col,offset,gain\n{lines}")).unwrap();
    }
    let path = folder.join("hand.toml").to_string_lossy().into_owned();
    let sensor = "rows = 8\ncols = 8\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n";
    let input = "full_scale_MPa = 1.0\ncalibration = \"zero-{array}.csv\"\n";
    let text = format!(
        "name = \"hand\"\n[sensor]\n{sensor}[input]\n{input}[hardware]\narrays = {ARRAYS}\ntables = \"writable\"\n"
    );
    std::fs::write(&path, text).unwrap();
    let model = Model::new(&Scene::load(&path).unwrap()).unwrap();
    (path, model)
}

/// A host for each array of one core, all at once, over a network with faults: each answer is that of the array's own model, and tables
/// that are written for one array are those of no other.
#[test]
fn each_array_of_a_core_has_its_host() {
    let folder = tempfile::tempdir().unwrap();
    let (_, model) = hand(folder.path());
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    let press =
        Frame::from_stress("press", &model.scene.sensor, (0..64).map(|k| f64::from(k % 7) / 10.0).collect()).unwrap();
    let networks: Vec<Network> = (0..4).map(|array| Network::to(core.address(), 8, array)).collect();
    let ask = |session: &mut Session| -> Vec<[i32; 3]> {
        let answers: Vec<_> = (0..25).map(|_| session.request(&press).unwrap().1).collect();
        assert!(answers.iter().all(|answer| answer.difference == Some(None)));
        let counters = session.board.counters().unwrap();
        assert!(counters.taken >= 25 && counters.taken < 80, "of this array alone: {counters:?}");
        answers[0].forces.clone().unwrap()
    };
    let of_all: Vec<Vec<[i32; 3]>> = std::thread::scope(|scope| {
        let one = |(array, network): (usize, &Network)| {
            let address = format!("udp:{}#{array}", network.address);
            let model = &model;
            scope.spawn(move || {
                let board = open_board(&address, model, None, TIMEOUT, "host").unwrap();
                ask(&mut Session::new(board, model.clone(), None, None, true, true).unwrap())
            })
        };
        let hosts: Vec<_> = networks.iter().enumerate().map(one).collect();
        hosts.into_iter().map(|host| host.join().unwrap()).collect()
    });
    assert!((1..4).all(|array| of_all[array] != of_all[0]));
    // The tables of the first array, written for the third.
    let to = |array: usize, tables: Option<Model>| {
        let board = open_board(&format!("udp:{}#{array}", core.address()), &model, None, TIMEOUT, "host").unwrap();
        Session::new(board, model.clone(), tables, None, true, true).unwrap()
    };
    let first = model.with_tables(&model.scene.of_array(0), 5).unwrap();
    assert_eq!(ask(&mut to(2, Some(first))), of_all[0]);
    [0, 1, 3].into_iter().for_each(|array| assert_eq!(ask(&mut to(array, None)), of_all[array]));
}

#[test]
fn an_array_that_a_core_has_not_is_refused_with_the_arrays_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let (path, model) = hand(folder.path());
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    for (array, wanted) in [
        ("", format!("the core serves 4 arrays: name one, as udp:{}#0", core.address())),
        ("#4", "the core serves 4 arrays, the first of which is 0".to_owned()),
        ("#left", "#left: a number from 0 to 15 is wanted".to_owned()),
    ] {
        let address = format!("{}{array}", core.address());
        let refused = run(&["host", "--udp", &address, "--scene", &path], "");
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(&wanted), "{}", text(&refused.stderr));
    }
}

/// `dermis board SCENE --udp`, and where it listens.
fn board(scene: &str) -> (Child, String) {
    let mut board = Command::new(env!("CARGO_BIN_EXE_dermis"))
        .args(["board", scene, "--udp", "127.0.0.1:0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(board.stdout.take().unwrap()).read_line(&mut line).unwrap();
    (board, line.trim().to_owned())
}

#[test]
fn the_program_sends_checks_and_streams_over_a_network() {
    let (mut core, port) = board("eight-by-eight");
    let address = port.strip_prefix("udp:").unwrap();
    let sent = run(&["host", "--udp", address, "--scene", "eight-by-eight", "--check"], "");
    assert_eq!(sent.status.code(), Some(0), "{}", text(&sent.stderr));
    let shown = text(&sent.stdout);
    assert_eq!(shown.matches("against model   equal, every bit\n").count(), 5, "{shown}");
    assert!(shown.contains("board dropped   0 ignored, 0 refused, 0 damaged, 0 overrun, 0 cut\n"), "{shown}");
    assert!(!shown.contains("in the simulation"), "{shown}");

    let line = format!("{{\"id\": 1, \"stress_MPa\": {:?}}}\n", vec![0.25; 64]);
    let timed = line.replace("\"id\"", "\"time_ns\": 1790000000000000000, \"id\"");
    let streamed =
        run(&["host", "--port", &port, "--scene", "eight-by-eight", "--stream", "--check"], &(line + &timed));
    assert_eq!(streamed.status.code(), Some(0), "{}", text(&streamed.stderr));
    let shown = text(&streamed.stdout);
    let lines: Vec<serde_json::Value> = shown.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let ns = |second: &serde_json::Value| (second.as_f64().unwrap() * 1e9) as i64;
    let (time_ns, error_ns) = (lines[0]["time_ns"].as_i64().unwrap(), lines[0]["time_error_ns"].as_i64().unwrap());
    // Seconds as a double are rounded to some hundred nanoseconds.
    assert!(ns(&lines[0]["sent_s"]) - error_ns - 1000 <= time_ns, "{}", lines[0]);
    assert!(time_ns <= ns(&lines[0]["answered_s"]) + error_ns + 1000, "{}", lines[0]);
    // A time in the line goes first.
    assert_eq!((&lines[1]["time_ns"], &lines[1]["time_error_ns"]), (&1_790_000_000_000_000_000i64.into(), &().into()));

    let other = run(&["host", "--udp", address, "--scene", "sensor-1"], "");
    assert_eq!(other.status.code(), Some(2));
    assert!(
        text(&other.stderr).contains("the board was built for another scene: 8×8 taxels"),
        "{}",
        text(&other.stderr)
    );
    core.kill().unwrap();
    core.wait().unwrap();

    let nobody = run(&["host", "--udp", address, "--scene", "eight-by-eight", "--timeout", "20"], "");
    assert_eq!(nobody.status.code(), Some(2));
    let message = format!(
        "error: udp:{address}: no answer to identify, sent 8 times with a timeout of 20 ms each: is it a Dermis core"
    );
    assert!(text(&nobody.stderr).contains(&message), "{}", text(&nobody.stderr));
    let wrong = run(&["host", "--udp", "no such host", "--scene", "eight-by-eight"], "");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("udp:no such host: "), "{}", text(&wrong.stderr));
}

/// What cannot be asked over a network that loses packets is refused by field.
#[test]
fn a_scene_whose_frames_count_twice_is_refused() {
    let mut scene = Scene::builtin("eight-by-eight").unwrap();
    scene.input.average = 4;
    let model = Model::new(&scene).unwrap();
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    let mut board = open_board(&format!("udp:{}", core.address()), &model, None, TIMEOUT, "host").unwrap();
    let error = board.identify(&model).unwrap_err().to_string();
    assert!(error.contains("input.average = 4: a board's link does not support it"), "{error}");
}
