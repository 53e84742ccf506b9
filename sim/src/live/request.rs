//! Requests: read with a bounded size, refused where a page from elsewhere may have sent them.
//!
//! | checked | against |
//! |---|---|
//! | `Host` is an address or `localhost` | a foreign name that was made to point here (DNS rebinding) |
//! | `Origin`, if there is one, is `http://` and that host | requests by the script of another page |
//! | the head has up to 8 KB, the body up to 1 KB | memory |

use std::io::{Error, ErrorKind, Read, Result};
use std::net::IpAddr;

/// Longest head in bytes.
const MOST_HEAD: usize = 8 << 10;
/// Longest body in bytes: a finger has some 100.
const MOST_BODY: usize = 1 << 10;
/// Most header lines.
const MOST_HEADERS: usize = 64;

/// A request that was read to its end.
#[derive(Debug, PartialEq, Eq)]
pub struct Request {
    /// `GET`, `POST`, …
    pub method: String,
    /// Path and query.
    pub path: String,
    /// The body.
    pub body: Vec<u8>,
}

/// Why a request is refused: status and text.
pub type Refused = (&'static str, String);

/// Reads a request; `None` at the end of the connection.
///
/// # Errors
/// A connection that fails or takes too long; the inner error is the answer to a request that is refused.
pub fn read(stream: &mut dyn Read) -> Result<Option<std::result::Result<Request, Refused>>> {
    let mut head = Vec::new();
    // Byte by byte from the operating system's buffer would be slow; a page sends a head in one piece.
    let end = loop {
        if let Some(end) = head.windows(4).position(|bytes| bytes == b"\r\n\r\n") {
            break end + 4;
        }
        if head.len() > MOST_HEAD {
            return Ok(Some(Err(("431 Request Header Fields Too Large", format!("over {MOST_HEAD} bytes")))));
        }
        let mut piece = [0; 4096];
        match stream.read(&mut piece)? {
            0 if head.is_empty() => return Ok(None),
            0 => return Err(Error::from(ErrorKind::UnexpectedEof)),
            bytes => head.extend_from_slice(&piece[..bytes]),
        }
    };
    let mut body = head.split_off(end);
    let (method, path, length) = match parse(&head) {
        Ok(parsed) => parsed,
        Err(refused) => return Ok(Some(Err(refused))),
    };
    if length > MOST_BODY || body.len() > length {
        return Ok(Some(Err(("413 Content Too Large", format!("a body has up to {MOST_BODY} bytes")))));
    }
    let begun = body.len();
    body.resize(length, 0);
    stream.read_exact(&mut body[begun..])?;
    Ok(Some(Ok(Request { method, path, body })))
}

/// Method, path and length of the body.
fn parse(head: &[u8]) -> std::result::Result<(String, String, usize), Refused> {
    let bad = |what: String| ("400 Bad Request", what);
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    request.parse(head).map_err(|error| bad(error.to_string()))?;
    let header = |name: &str| {
        let found = request.headers.iter().find(|header| header.name.eq_ignore_ascii_case(name));
        found.map(|header| String::from_utf8_lossy(header.value).trim().to_owned())
    };
    let host = header("host").ok_or_else(|| bad("Host is missing".into()))?;
    if !is_address(&host) {
        let known = "open the page at an IP address or at localhost";
        return Err(("403 Forbidden", format!("Host {host:?} is not allowed: {known}")));
    }
    if let Some(origin) = header("origin").filter(|origin| *origin != format!("http://{host}")) {
        return Err(("403 Forbidden", format!("Origin {origin:?} is not allowed: http://{host} is")));
    }
    if header("transfer-encoding").is_some() {
        return Err(("411 Length Required", "Transfer-Encoding is not taken".into()));
    }
    let length = header("content-length").unwrap_or_else(|| "0".into());
    let length = length.parse().map_err(|_| bad(format!("Content-Length {length:?} is not a number")))?;
    match (request.method, request.path) {
        (Some(method), Some(path)) => Ok((method.into(), path.into(), length)),
        _ => Err(bad("no request line".into())),
    }
}

/// Whether a host is an IP address or `localhost`, with or without port.
fn is_address(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let plain = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
    name == "localhost" || plain.parse::<IpAddr>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(text: &str) -> String {
        match read(&mut text.as_bytes()).unwrap().unwrap() {
            Ok(request) => format!("{} {}", request.method, request.path),
            Err((status, _)) => status[..3].to_owned(),
        }
    }

    #[test]
    fn a_request_is_read_with_its_body() {
        let text = "POST /finger HTTP/1.1\r\nHost: 127.0.0.1:80\r\nContent-Length: 4\r\n\r\nnull";
        let request = Request { method: "POST".into(), path: "/finger".into(), body: b"null".to_vec() };
        assert_eq!(read(&mut text.as_bytes()).unwrap(), Some(Ok(request)));
        assert_eq!(read(&mut "".as_bytes()).unwrap(), None);
        assert!(read(&mut "GET / HT".as_bytes()).is_err());
    }

    #[test]
    fn foreign_hosts_and_origins_are_refused() {
        let get = |host: &str, more: &str| status(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n{more}\r\n"));
        for host in ["127.0.0.1:8", "localhost:8", "[::1]:8", "192.168.1.7:8", "localhost"] {
            assert_eq!(get(host, &format!("Origin: http://{host}\r\n")), "GET /");
            for origin in ["http://evil.example", "null", "https://127.0.0.1:8", "http://127.0.0.1:9"] {
                assert_eq!(get(host, &format!("Origin: {origin}\r\n")), "403", "{origin}");
            }
        }
        for host in ["evil.example:8", "localhost.evil.example", "", "127.0.0.1.evil.example:8"] {
            assert_eq!(get(host, ""), "403", "{host}");
        }
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "400");
    }

    #[test]
    fn what_is_too_long_is_refused_before_it_is_read() {
        let host = "Host: 127.0.0.1\r\n";
        assert_eq!(status(&format!("GET /{} HTTP/1.1\r\n", "x".repeat(2 * MOST_HEAD))), "431");
        assert_eq!(status(&format!("POST / HTTP/1.1\r\n{host}Content-Length: {}\r\n\r\n", MOST_BODY + 1)), "413");
        assert_eq!(status(&format!("POST / HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\n")), "411");
        assert_eq!(status(&format!("POST / HTTP/1.1\r\n{host}Content-Length: -1\r\n\r\n")), "400");
    }
}
