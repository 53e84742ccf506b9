//! The connections, and what is served.
//!
//! | request | answer |
//! |---|---|
//! | `GET /` | the page, whole: style, script and what it must know of the scene |
//! | `GET /newest?after=N` | the newest picture once its number is above N, in the header `Number`; 204 after a second |
//! | `POST /finger` | takes the finger, see [`Finger::read`]; 404 where no finger is drawn |

use std::io::{ErrorKind, Read, Result, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use dermis_golden::spec::scene::Scene;
use serde_json::json;

use super::finger::{Finger, Hand};
use super::newest::Newest;
use super::places::{Places, Taken, CLIENTS, OF_AN_ADDRESS};
use super::request::{read, Request};
use dermis_report::style::{escape, variables};

/// Longest wait of `/newest`.
const WAIT: Duration = Duration::from_secs(1);
/// Longest time for a request, from the end of the answer before it to its last byte, and for an answer to be taken.
const PATIENCE: Duration = Duration::from_secs(10);
/// Wait after which a connection is taken again where that failed.
const RETRY: Duration = Duration::from_millis(50);
/// Shortest time between two words on connections that end for others or are refused.
const BETWEEN_WORDS: Duration = Duration::from_secs(60);
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
    places: Places,
}

/// An answer: status, further header lines, type, body.
struct HttpResponse<'a> {
    status: &'a str,
    headers: String,
    kind: &'a str,
    body: &'a [u8],
}

impl Server {
    /// A server of the pictures of a scene, from `source` in words; with a `hand` the page's mouse moves it.
    pub fn new(scene: &Scene, source: &str, newest: Arc<Newest>, hand: Option<Arc<Hand>>) -> Server {
        let page = page(scene, source, hand.is_some());
        Server { scene: scene.clone(), page, newest, hand, places: Places::default() }
    }

    /// Serves for ever, each connection in its own thread. Where no connection can be taken, as without a free file
    /// descriptor, one that waits for a request is ended and it is tried again; `say` gets a line then, when connections are
    /// taken again, and where they end for others.
    pub fn run(self, listener: &TcpListener, say: impl Fn(&str)) {
        let server = Arc::new(self);
        let (mut failing, mut crowded): (bool, Option<Instant>) = (false, None);
        loop {
            match listener.accept().and_then(|(stream, peer)| server.begin(stream, peer.ip())) {
                Ok(taken) => {
                    if std::mem::take(&mut failing) {
                        say("connections are taken again");
                    }
                    if taken != Taken::Free && crowded.is_none_or(|said| said.elapsed() > BETWEEN_WORDS) {
                        say(&format!(
                            "{CLIENTS} connections are open, or {OF_AN_ADDRESS} of one address: further ones end those that wait"
                        ));
                        crowded = Some(Instant::now());
                    }
                }
                // A client that went away before it was served.
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => (),
                Err(error) => {
                    if !std::mem::replace(&mut failing, true) {
                        say(&format!("no connection can be taken: {error}; it is tried again"));
                    }
                    server.places.end_one();
                    std::thread::sleep(RETRY);
                }
            }
        }
    }

    /// Serves a connection in a thread of its own, or refuses it.
    fn begin(self: &Arc<Self>, stream: TcpStream, address: IpAddr) -> Result<Taken> {
        let stream = Arc::new(stream);
        let taken = self.places.take(&stream, address);
        if taken == Taken::Refused {
            // Here, without a thread: a client that does not read its answer loses it.
            let _ = stream.set_nonblocking(true).and_then(|()| refuse(&stream));
            return Ok(taken);
        }
        let (server, own) = (Arc::clone(self), Arc::clone(&stream));
        let serve = move || {
            // A client that goes away is no error.
            let _ = server.connection(&own);
            server.places.leave(&own);
        };
        let begun = std::thread::Builder::new().spawn(serve).map(|_| taken);
        begun.inspect_err(|_| self.places.leave(&stream))
    }

    fn connection(&self, stream: &Arc<TcpStream>) -> Result<()> {
        stream.set_nodelay(true)?;
        while let Some(request) = read(&mut Until::after(PATIENCE, stream))? {
            self.places.waits(stream, false);
            match request {
                Ok(request) => self.respond(stream, &request)?,
                Err((status, text)) => return last_answer(stream, &plain(status, &text)),
            }
            self.places.waits(stream, true);
        }
        Ok(())
    }

    fn respond(&self, stream: &TcpStream, request: &Request) -> Result<()> {
        let (path, query) = request.path.split_once('?').unwrap_or((&request.path, ""));
        match (request.method.as_str(), path, &self.hand) {
            ("GET", "/", _) => {
                let body = self.page.as_bytes();
                answer(stream, &HttpResponse { kind: "text/html; charset=utf-8", body, ..plain("200 OK", "") }, true)
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
                answer(stream, &HttpResponse { headers, kind: "application/json", body, ..plain("200 OK", "") }, true)
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

fn plain<'a>(status: &'a str, text: &'a str) -> HttpResponse<'a> {
    HttpResponse { status, headers: String::new(), kind: "text/plain; charset=utf-8", body: text.as_bytes() }
}

/// A connection whose bytes come and go until a moment, however few at a time.
struct Until<'a> {
    stream: &'a TcpStream,
    end: Instant,
}

impl Until<'_> {
    fn after(wait: Duration, stream: &TcpStream) -> Until<'_> {
        Until { stream, end: Instant::now() + wait }
    }

    /// The time that is left.
    fn left(&self) -> Result<Duration> {
        let left = self.end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(left)
    }
}

impl Read for Until<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        self.stream.set_read_timeout(Some(self.left()?))?;
        self.stream.read(buffer)
    }
}

impl Write for Until<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.stream.set_write_timeout(Some(self.left()?))?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.stream.flush()
    }
}

fn answer(stream: &TcpStream, answer: &HttpResponse, more: bool) -> Result<()> {
    Until::after(PATIENCE, stream).write_all(&answer.bytes(more))
}

impl HttpResponse<'_> {
    /// The answer as it is sent; `more` requests may follow on the connection.
    fn bytes(&self, more: bool) -> Vec<u8> {
        let HttpResponse { status, headers, kind, body } = self;
        let connection = if more { "keep-alive" } else { "close" };
        let mut bytes = format!("HTTP/1.1 {status}\r\n{HEADERS}{headers}Connection: {connection}\r\n").into_bytes();
        // An answer without content has no length either.
        if !status.starts_with("204") {
            bytes.extend(format!("Content-Type: {kind}\r\nContent-Length: {}\r\n", body.len()).bytes());
        }
        bytes.extend(b"\r\n");
        bytes.extend(*body);
        bytes
    }
}

/// Answers and ends the connection. What the client still sends is read for a while: a connection that is closed with
/// bytes unread is reset, and the client may lose the answer.
fn last_answer(stream: &TcpStream, last: &HttpResponse) -> Result<()> {
    answer(stream, last, false)?;
    stream.shutdown(Shutdown::Write)?;
    let mut rest = Until::after(WAIT, stream);
    let mut unread = [0; 4096];
    while rest.read(&mut unread)? > 0 {}
    Ok(())
}

/// Refuses a connection, without waiting for its request or for it to take the answer.
fn refuse(mut stream: &TcpStream) -> Result<()> {
    let text = format!("{CLIENTS} connections are open");
    // What has come of the request: unread it would reset the connection, and the client may lose the answer.
    let _ = stream.read(&mut [0; 4096]);
    stream.write_all(&plain("503 Service Unavailable", &text).bytes(false))?;
    stream.shutdown(Shutdown::Write)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Both ends of a connection.
    fn connection() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        (listener.accept().unwrap().0, client)
    }

    #[test]
    fn a_request_that_comes_byte_by_byte_ends_in_time() {
        let (server, mut client) = connection();
        let wait = Duration::from_millis(200);
        std::thread::scope(|scope| {
            // Bytes come far more often than the wait, until the other end is closed.
            scope.spawn(move || {
                while client.write_all(b"a").is_ok() {
                    std::thread::sleep(wait / 20)
                }
            });
            let begun = Instant::now();
            let error = read(&mut Until::after(wait, &server)).unwrap_err();
            assert!(matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock), "{error}");
            assert!((wait..20 * wait).contains(&begun.elapsed()), "{:?}", begun.elapsed());
            server.shutdown(Shutdown::Both).unwrap();
        });
    }

    #[test]
    fn an_answer_that_nobody_takes_ends_in_time() {
        let (server, _client) = connection();
        let wait = Duration::from_millis(200);
        let error = Until::after(wait, &server).write_all(&vec![0; 64 << 20]).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock), "{error}");
    }

    #[test]
    fn a_refused_client_is_told_why() {
        let (server, mut client) = connection();
        client.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        server.peek(&mut [0]).unwrap();
        server.set_nonblocking(true).unwrap();
        refuse(&server).unwrap();
        drop(server);
        let mut answer = String::new();
        client.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 503") && answer.contains("24 connections are open"), "{answer}");
    }
}
