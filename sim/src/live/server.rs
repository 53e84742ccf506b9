//! The connections, and what is served.
//!
//! | request | answer |
//! |---|---|
//! | `GET /` | the page, whole: style, script and what it must know of the scene |
//! | `GET /newest?after=N` | the newest picture once its number is above N, in the header `Number`; 204 after a second |
//! | `POST /finger` | takes the finger, see [`Finger::read`]; 404 where no finger is drawn |

use std::io::{ErrorKind, Read, Result, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use dermis_golden::spec::scene::Scene;
use serde_json::json;

use super::finger::{Finger, Hand};
use super::newest::Newest;
use super::request::{read, Request};
use crate::report::style::{escape, variables};

/// Most connections at a time; a browser opens up to six.
const CLIENTS: usize = 24;
/// Longest wait of `/newest`.
const WAIT: Duration = Duration::from_secs(1);
/// Longest wait for a client's bytes, and for it to take some.
const PATIENCE: Duration = Duration::from_secs(10);
/// Sent with every answer: nothing from elsewhere, in no frame, never stored.
const HEADERS: &str = "Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; script-src \
                       'unsafe-inline'; connect-src 'self'; img-src data:; frame-ancestors 'none'\r\n\
                       X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\n\
                       Referrer-Policy: no-referrer\r\nCache-Control: no-store\r\n";

/// What the connections share.
pub struct Server {
    scene: Scene,
    page: String,
    newest: Arc<Newest>,
    hand: Option<Arc<Hand>>,
    clients: AtomicUsize,
}

/// An answer: status, further header lines, type, body.
struct Answer<'a> {
    status: &'a str,
    headers: String,
    kind: &'a str,
    body: &'a [u8],
}

impl Server {
    /// A server of the pictures of a scene, from `source` in words; with a `hand` the page's mouse moves it.
    pub fn new(scene: &Scene, source: &str, newest: Arc<Newest>, hand: Option<Arc<Hand>>) -> Server {
        let page = page(scene, source, hand.is_some());
        Server { scene: scene.clone(), page, newest, hand, clients: AtomicUsize::new(0) }
    }

    /// Serves until the listener fails, each connection in its own thread.
    ///
    /// # Errors
    /// The listener's.
    pub fn run(self, listener: &TcpListener) -> Result<()> {
        let server = Arc::new(self);
        loop {
            let (stream, _) = match listener.accept() {
                Err(error) if error.kind() == ErrorKind::ConnectionAborted => continue,
                other => other?,
            };
            let server = Arc::clone(&server);
            // Counted here, in the order of arrival: the threads may run in any.
            let others = server.clients.fetch_add(1, Ordering::Relaxed);
            std::thread::spawn(move || {
                // A client that goes away is no error.
                let _ = server.connection(stream, others < CLIENTS);
                server.clients.fetch_sub(1, Ordering::Relaxed);
            });
        }
    }

    fn connection(&self, mut stream: TcpStream, admitted: bool) -> Result<()> {
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        if !admitted {
            let text = format!("{CLIENTS} connections are open");
            return last_answer(&mut stream, &plain("503 Service Unavailable", &text));
        }
        while let Some(request) = read(&mut stream)? {
            match request {
                Ok(request) => self.respond(&mut stream, &request)?,
                Err((status, text)) => return last_answer(&mut stream, &plain(status, &text)),
            }
        }
        Ok(())
    }

    fn respond(&self, stream: &mut TcpStream, request: &Request) -> Result<()> {
        let (path, query) = request.path.split_once('?').unwrap_or((&request.path, ""));
        match (request.method.as_str(), path, &self.hand) {
            ("GET", "/", _) => {
                let body = self.page.as_bytes();
                answer(stream, &Answer { kind: "text/html; charset=utf-8", body, ..plain("200 OK", "") }, true)
            }
            ("GET", "/newest", _) => {
                let Some(Ok(seen)) = query.strip_prefix("after=").map(str::parse) else {
                    return answer(stream, &plain("400 Bad Request", "wanted /newest?after=N"), true);
                };
                let Some((number, picture)) = self.newest.after(seen, WAIT) else {
                    return answer(stream, &plain("204 No Content", ""), true);
                };
                let headers = format!("Number: {number}\r\n");
                let body = picture.as_bytes();
                answer(stream, &Answer { headers, kind: "application/json", body, ..plain("200 OK", "") }, true)
            }
            ("POST", "/finger", Some(hand)) => match Finger::read(&request.body, &self.scene) {
                Ok(finger) => {
                    hand.set(finger);
                    answer(stream, &plain("204 No Content", ""), true)
                }
                Err(error) => answer(stream, &plain("400 Bad Request", &error), true),
            },
            (_, "/" | "/newest" | "/finger", _) => answer(stream, &plain("405 Method Not Allowed", ""), true),
            _ => answer(stream, &plain("404 Not Found", ""), true),
        }
    }
}

/// The address at which others than this computer reach the server; `None` at a loopback address.
pub fn open_to_others(address: SocketAddr) -> Option<SocketAddr> {
    (!address.ip().is_loopback()).then_some(address)
}

fn plain<'a>(status: &'a str, text: &'a str) -> Answer<'a> {
    Answer { status, headers: String::new(), kind: "text/plain; charset=utf-8", body: text.as_bytes() }
}

fn answer(stream: &mut TcpStream, answer: &Answer, more: bool) -> Result<()> {
    let Answer { status, headers, kind, body } = answer;
    let connection = if more { "keep-alive" } else { "close" };
    let mut bytes = format!("HTTP/1.1 {status}\r\n{HEADERS}{headers}Connection: {connection}\r\n").into_bytes();
    // An answer without content has no length either.
    if !status.starts_with("204") {
        bytes.extend(format!("Content-Type: {kind}\r\nContent-Length: {}\r\n", body.len()).bytes());
    }
    bytes.extend(b"\r\n");
    bytes.extend(*body);
    stream.write_all(&bytes)
}

/// Answers and ends the connection. What the client still sends is read for a while: a connection that is closed with
/// bytes unread is reset, and the client may lose the answer.
fn last_answer(stream: &mut TcpStream, last: &Answer) -> Result<()> {
    answer(stream, last, false)?;
    stream.shutdown(Shutdown::Write)?;
    stream.set_read_timeout(Some(WAIT))?;
    let end = Instant::now() + WAIT;
    let mut unread = [0; 4096];
    while Instant::now() < end && stream.read(&mut unread)? > 0 {}
    Ok(())
}

/// The page: colours of the report, style, script, and what it must know of the scene.
fn page(scene: &Scene, source: &str, finger: bool) -> String {
    let sensor = &scene.sensor;
    let known = json!({
        "rows": sensor.rows, "cols": sensor.cols, "pitch_mm": [sensor.pitch_x_mm, sensor.pitch_y_mm],
        "finger": finger,
    });
    let title = format!("{}, {source}", scene.name);
    include_str!("page.html")
        .replace("{{style}}", &(variables() + include_str!("page.css")))
        .replace("{{title}}", &escape(&title))
        // Numbers and words of this program alone: nothing that could end the script element.
        .replace("{{known}}", &known.to_string())
        .replace("{{script}}", include_str!("page.js"))
}
