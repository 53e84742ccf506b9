//! `dermis live` in headless Chromium: the mouse as finger, the newest frame of a stream, phone and dark, and who is
//! refused.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use serde_json::{json, Value};

use super::browser::{Browser, DESKTOP, PHONE};

const SCENE: &str = "eight-by-eight";

/// The program with the address of its page.
pub(super) struct Live {
    pub(super) child: Child,
    url: String,
}

impl Live {
    pub(super) fn start(more: &[&str]) -> Live {
        Live::listen("127.0.0.1:0", more)
    }

    fn listen(address: &str, more: &[&str]) -> Live {
        Live::run(Command::new(env!("CARGO_BIN_EXE_dermis")).args(["live", SCENE, "--listen", address]).args(more))
    }

    /// The program with so many file descriptors at most.
    fn with_files(most: usize) -> Live {
        let limited = format!("ulimit -n {most}; exec \"$@\"");
        let program = [env!("CARGO_BIN_EXE_dermis"), "live", SCENE, "--listen", "127.0.0.1:0"];
        Live::run(Command::new("sh").args(["-c", &limited, "sh"]).args(program))
    }

    fn run(command: &mut Command) -> Live {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut url = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
        Live { child, url: url.trim().to_owned() }
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(self.host()).unwrap()
    }

    /// Host and port of the page.
    pub(super) fn host(&self) -> &str {
        self.url.trim_start_matches("http://").trim_end_matches('/')
    }

    /// What it has said on standard error, after its end.
    fn errors(mut self) -> String {
        self.child.kill().unwrap();
        let mut errors = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
        errors
    }

    /// The status of the page.
    fn page_status(&self) -> String {
        status(&self.answer(&format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", self.host())))
    }

    /// The answer to a request, sent on a connection of its own.
    pub(super) fn answer(&self, request: &str) -> String {
        let mut stream = self.connect();
        let _ = stream.write_all(request.as_bytes());
        // A refused connection may be closed already.
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The status of an answer; nothing where there is none.
fn status(answer: &str) -> String {
    answer.split(' ').nth(1).unwrap_or_default().to_owned()
}

/// Cells of the row with this name in the table of forces, as numbers.
fn row(browser: &mut Browser, name: &str) -> Vec<f64> {
    let script = format!(
        "[...document.querySelectorAll('#forces tr')].filter(row => row.cells[0].textContent == '{name}')\
         .flatMap(row => [...row.cells].slice(1).map(cell => parseFloat(cell.textContent)))"
    );
    serde_json::from_value(browser.evaluate(&script)).unwrap()
}

/// Moves, presses or releases the mouse at a place on the first map, as a share of its width and height.
fn mouse(browser: &mut Browser, kind: &str, x: f64, y: f64) {
    let place = browser.evaluate(
        "(box => [box.x, box.y, box.width, box.height])(document.querySelector('#found svg').getBoundingClientRect())",
    );
    let side = |k: usize| place[k].as_f64().unwrap();
    let (x, y) = (side(0) + x * side(2), side(1) + y * side(3));
    let event = json!({"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1});
    browser.call("Input.dispatchMouseEvent", event);
}

/// An expression: the row of true forces has this text.
fn true_row(text: &str) -> String {
    format!("[...document.querySelectorAll('#forces tr')].some(row => row.innerText.replace(/\\s+/g, ' ') == '{text}')")
}

#[test]
fn the_mouse_is_a_finger_whose_true_forces_stand_beside_those_found() {
    let live = Live::start(&["--noise", "0.0001"]);
    let mut browser = Browser::open(&live.url);
    // A press plays and the map says what to do, until the mouse takes over.
    let normal = "parseFloat([...document.querySelectorAll('#forces tr')]
        .find(row => row.cells[0].textContent == 'true, sum')?.cells[3].textContent)";
    browser.wait_for(&format!("{normal} > 1"));
    let hint = "document.querySelector('#found .hint')?.textContent || ''";
    assert_eq!(browser.evaluate(hint), "press here and drag");
    assert_eq!(browser.evaluate("document.querySelector('#flags').innerText.includes('no-contact')"), false);
    let axes = "[...document.querySelectorAll('#found .axis')].map(axis => axis.textContent).join()";
    assert_eq!(browser.evaluate(axes), "x,y");
    mouse(&mut browser, "mousePressed", 0.5, 0.5);
    browser.wait_for(&true_row("true, sum 0.000 0.000 5.000"));
    // To the right, far enough for the full friction.
    for x in [0.55, 0.6, 0.7, 0.8] {
        mouse(&mut browser, "mouseMoved", x, 0.5);
    }
    browser.wait_for(&true_row("true, sum 2.500 0.000 5.000"));
    // The frame in which all this is seen is the same: found and true forces are those of one picture.
    let found = row(&mut browser, "found, sum");
    for (found, wanted) in found.iter().zip([2.5, 0.0, 5.0]) {
        assert!((found - wanted).abs() < 0.1 * 5.0, "{found} for {wanted}");
    }
    let shown = browser.evaluate(
        "({ contact: document.querySelector('#forces').innerText, flags: document.querySelector('#flags').innerText,
            columns: Array.from({ length: 64 }, (_, k) => Math.max(0, ...[...document.querySelectorAll('#found .plus')]
                .filter(path => path.getAttribute('d').includes(`M${k % 8} ${Math.floor(k / 8)}h`))
                .map(path => parseFloat(path.getAttribute('fill-opacity'))))),
            arrows: document.querySelector('#found .arrows').getAttribute('d'),
            real: document.querySelector('#true .arrows').getAttribute('d'),
            contactArrow: document.querySelector('#found .contact').getAttribute('d'),
            bars: document.querySelector('#found .bars').getAttribute('d'),
            trails: document.querySelector('#found .trails').getAttribute('d'),
            tracks: document.querySelector('#tracks').innerText,
            plotted: [...document.querySelectorAll('#plot polyline')].map(l => l.getAttribute('points').split(' ').length),
            hidden: document.querySelector('#true').hidden, state: document.querySelector('#state').innerText })",
    );
    assert!(shown["contact"].as_str().unwrap().contains("±"), "{shown}");
    assert!(!shown["flags"].as_str().unwrap().contains("no-contact"), "{shown}");
    assert_eq!(shown["hidden"], false);
    // The finger has slid from the middle to the right: pressure there, none at the left edge.
    let columns: Vec<f64> = serde_json::from_value(shown["columns"].clone()).unwrap();
    let column = |c: usize| (0..8).map(|r| columns[8 * r + c]).fold(0.0, f64::max);
    assert!(column(5) > 0.6 && column(5) > 2.0 * column(0), "{shown}");
    // The contact's path leads from the middle, 4, to the right, where the finger is a reach of 2 behind the mouse.
    let trail = shown["trails"].as_str().unwrap();
    let right = trail.split(['M', 'L']).filter_map(|point| point.split(' ').next()?.parse::<f64>().ok());
    let right: Vec<f64> = right.collect();
    let pressed = right.iter().position(|x| (x - 4.0).abs() < 0.05);
    assert!(pressed.is_some_and(|at| at + 1 < right.len()) && right[right.len() - 1] > 4.3, "{shown}");
    let tracks = shown["tracks"].as_str().unwrap();
    assert!(tracks.starts_with("contact ") && tracks.contains(" mm/s, shear over normal force 0."), "{shown}");
    for path in ["arrows", "real", "contactArrow", "bars"] {
        assert!(shown[path].as_str().unwrap().starts_with('M'), "{path}: {shown}");
    }
    assert!(shown["plotted"].as_array().unwrap().iter().all(|n| n.as_u64() > Some(3)), "{shown}");
    for part in ["golden", "results/s", "drawn/s", "reconstruction", "frame to screen", "0 dropped", "0 refused"] {
        assert!(shown["state"].as_str().unwrap().contains(part), "{part}: {shown}");
    }
    mouse(&mut browser, "mouseReleased", 0.8, 0.5);
    browser.wait_for(&true_row("true, sum 0.000 0.000 0.000"));
    // At rest the flags are there, without alarm.
    let rest = "[...document.querySelectorAll('#flags span')].map(chip => chip.className)";
    let rest = browser.evaluate(rest);
    assert!(rest.as_array().is_some_and(|all| !all.is_empty() && all.iter().all(|own| own == "rest")), "{rest}");
    assert_eq!(browser.evaluate(hint), "");
    assert_eq!(browser.problems, Vec::<Value>::new());
}

#[test]
fn the_newest_frame_of_a_stream_is_drawn_and_older_ones_are_left_out() {
    let mut live = Live::start(&["--stream", "--engine", "fixed"]);
    let frames = Frame::shipped(&Scene::builtin(SCENE).unwrap());
    let line = |frame: &Frame| frame.stress_MPa.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
    let mut input = live.child.stdin.take().unwrap();
    // Answered before the browser is there: nothing newer replaces it.
    input.write_all(b"1,2\n").unwrap();
    let mut browser = Browser::open(&live.url);
    input.write_all(line(&frames[0]).as_bytes()).unwrap();
    browser.wait_for("document.querySelector('#state').innerText.includes('frame 0 ')");
    let state = browser.evaluate("document.querySelector('#state').innerText");
    let refusal = "1 refused (line 1: 2 values, wanted 64)";
    assert!(state.as_str().unwrap().contains(refusal), "{state}");
    assert_eq!(browser.evaluate("document.querySelector('#true').hidden"), true);
    // From now on the page notes what it draws; while it is busy many frames arrive.
    browser.evaluate(
        "drawn = []; drawAsBefore = draw;
         draw = (picture, now) => { drawn.push(picture.sequence); drawAsBefore(picture, now); }; true",
    );
    const LINES: usize = 30;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for frame in vec![&frames[0]; LINES].into_iter().chain([&frames[1]]) {
                input.write_all(line(frame).as_bytes()).unwrap();
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        browser.evaluate("for (const begun = performance.now(); performance.now() - begun < 3000;); true");
    });
    // The last frame has other forces; it is drawn although most before it were not.
    let model = Model::new(&Scene::builtin(SCENE).unwrap()).unwrap();
    let wanted = model.reconstruct(&frames[1]).unwrap().resultant_N.map(|force| format!("{force:.3}")).join(" ");
    browser.wait_for(&true_row(&format!("found, sum {wanted}")));
    let drawn = browser.evaluate("drawn");
    let (drawn, dropped) =
        (drawn.as_array().unwrap().clone(), browser.evaluate("document.querySelector('#state').innerText"));
    let dropped: u64 =
        dropped.as_str().unwrap().split(" dropped").next().unwrap().rsplit(' ').next().unwrap().parse().unwrap();
    let newest = drawn.last().unwrap().as_u64().unwrap();
    assert_eq!(newest + dropped, LINES as u64 + 1);
    assert!(drawn.len() as u64 <= newest / 2 + 1, "{drawn:?}, {dropped} dropped");
    assert_eq!(browser.problems, Vec::<Value>::new());
}

#[test]
fn the_page_is_readable_on_a_phone_and_in_the_dark_and_asks_nobody_else() {
    let live = Live::start(&[]);
    let mut browser = Browser::open(&live.url);
    // With the widest rows in the table.
    mouse(&mut browser, "mousePressed", 0.3, 0.3);
    browser.wait_for("document.querySelector('#forces').innerText.includes('±')");
    let mut colours = Vec::new();
    for (width, dark) in [(DESKTOP, false), (DESKTOP, true), (PHONE, false), (PHONE, true)] {
        browser.set(width, dark);
        let found = browser.evaluate(
            "({ inner: innerWidth, width: document.documentElement.scrollWidth,
                colours: [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color],
                small: Math.min(...[...document.querySelectorAll('#plot text')]
                    .map(text => text.getBoundingClientRect().height)),
                table: document.querySelector('.scroll').scrollWidth, room: document.querySelector('.scroll').clientWidth,
                map: document.querySelector('#found svg').getBoundingClientRect().width,
                elsewhere: performance.getEntriesByType('resource').map(entry => entry.name)
                    .filter(name => !name.startsWith(location.origin)) })",
        );
        assert_eq!((&found["inner"], &found["elsewhere"]), (&json!(width), &json!([])), "{found}");
        assert!(found["width"].as_u64() <= Some(width.into()), "{found}");
        assert!(found["table"].as_u64() <= found["room"].as_u64(), "{found}");
        assert!(found["small"].as_f64() > Some(9.0) && found["map"].as_f64() > Some(300.0), "{found}");
        assert_ne!(found["colours"][0], found["colours"][1]);
        colours.push(found["colours"].clone());
    }
    assert_eq!((&colours[0], &colours[1]), (&colours[2], &colours[3]));
    assert_ne!(colours[0], colours[1]);
    assert_eq!(browser.problems, Vec::<Value>::new());
}

#[test]
fn foreign_pages_are_refused() {
    let live = Live::start(&[]);
    let host = live.host();
    let get = |host: &str| status(&live.answer(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n")));
    assert_eq!((get(host), get("evil.example")), ("200".into(), "403".into()));
    let post = |origin: &str, body: &str| {
        let length = body.len();
        status(&live.answer(&format!(
            "POST /finger HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nContent-Length: {length}\r\n\r\n{body}"
        )))
    };
    let own = format!("http://{host}");
    assert_eq!((post(&own, "null"), post("http://evil.example", "null")), ("204".into(), "403".into()));
    assert_eq!((post(&own, "{}"), post(&own, &" ".repeat(2000))), ("400".into(), "413".into()));
}

/// Clients that hold connections, more than there are places, after the begin of a request or a whole one.
fn holders(live: &Live, request: &str) -> Vec<TcpStream> {
    let connect = |_| {
        let mut stream = live.connect();
        // It may have ended for another one already.
        let _ = stream.write_all(request.as_bytes());
        stream
    };
    (0..60).map(connect).collect()
}

#[test]
fn clients_that_hold_connections_do_not_keep_others_out() {
    let live = Live::start(&[]);
    let whole = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", live.host());
    for request in ["", "G", &whole] {
        let held = holders(&live, request);
        assert_eq!([(); 5].map(|()| live.page_status()), ["200"; 5], "{request:?}");
        drop(held);
    }
    // Now and then a byte: they would last for hours, and hold every place.
    let end = std::sync::atomic::AtomicBool::new(false);
    let served = std::thread::scope(|scope| {
        let (mut held, live, end) = (holders(&live, "GET / HTTP/1.1\r\n"), &live, &end);
        scope.spawn(move || {
            while !end.load(std::sync::atomic::Ordering::Relaxed) {
                let ended = held.iter_mut().filter_map(|stream| stream.write_all(b"a").is_err().then_some(stream));
                // A storm of new connections would end each before it is read.
                ended.take(2).for_each(|stream| *stream = live.connect());
                std::thread::sleep(Duration::from_millis(50));
            }
        });
        let served = [(); 20].map(|()| {
            std::thread::sleep(Duration::from_millis(20));
            live.page_status()
        });
        end.store(true, std::sync::atomic::Ordering::Relaxed);
        served
    });
    assert_eq!(served, ["200"; 20]);
    let errors = live.errors();
    assert_eq!(errors.matches("further ones end those that wait").count(), 1, "{errors}");
}

#[test]
fn without_free_file_descriptors_it_goes_on_and_says_so() {
    let live = Live::with_files(20);
    let held = holders(&live, "G");
    assert_eq!(live.page_status(), "200");
    drop(held);
    assert_eq!([(); 3].map(|()| live.page_status()), ["200"; 3]);
    let errors = live.errors();
    for said in ["no connection can be taken: Too many open files", "connections are taken again"] {
        assert!(errors.contains(said), "{said}: {errors}");
    }
}

#[test]
fn an_address_that_others_reach_is_warned_of() {
    for (address, warned) in [("0.0.0.0:0", true), ("127.0.0.1:0", false)] {
        let errors = Live::listen(address, &[]).errors();
        assert_eq!(errors.contains("open to the network"), warned, "{errors}");
    }
}
