//! HTTP/1.1 requests and responses over one connection each, with limits on size and time.
//!
//! A client decides how much it sends, and when. The head of a request may therefore have at most 64 KiB, and a whole
//! request must arrive within ten seconds. A connection is closed after its response.

use super::answer::{self, Answer};
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Maximum size of a request's head (request line and headers), bytes.
const LARGEST_HEAD: usize = 64 << 10;
/// Maximum number of headers; browsers send about fifteen.
const MOST_HEADERS: usize = 64;
/// Maximum size of a request's body, bytes.
const LARGEST_BODY: usize = 64 << 10;
/// Time in which a request must arrive completely, and in which a client must accept each part of a response.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time in which what a client still sends after its response is discarded. If a connection is closed with unread data,
/// the client may lose the response (RFC 9112, section 9.6).
const LINGER: Duration = Duration::from_secs(1);

/// A connection to a client.
pub(super) struct Connection {
    stream: TcpStream,
    /// End of the time for the current exchange.
    until: Instant,
}

/// The head of a request.
pub(super) struct Head {
    /// Method, in capital letters.
    pub(super) method: String,
    /// Path and query.
    pub(super) target: String,
    headers: Vec<(String, String)>,
    /// Body size, bytes.
    length: usize,
    /// Body bytes that arrived together with the head.
    rest: Vec<u8>,
}

/// Why there is no request.
pub(super) enum Refusal {
    /// The client has closed the connection, or sent nothing.
    Gone,
    /// The client gets this response.
    Answer(Answer),
}

impl Connection {
    /// Takes over a new connection.
    pub(super) fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Self { stream, until: Instant::now() + PATIENCE })
    }

    /// Reads some bytes before the end of the time; 0 at the end of the stream.
    fn some(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        loop {
            let left = self.until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.stream.set_read_timeout(Some(left))?;
            match self.stream.read(bytes) {
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                // A read timeout is `WouldBlock` on Unix.
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => return Err(io::ErrorKind::TimedOut.into()),
                read => return read,
            }
        }
    }

    /// Reads the head of a request.
    pub(super) fn head(&mut self) -> Result<Head, Refusal> {
        let mut bytes = Vec::new();
        let mut part = [0; 4096];
        loop {
            let read = match self.some(&mut part) {
                Ok(0) => return Err(Refusal::Gone),
                Ok(read) => read,
                Err(e) if e.kind() == io::ErrorKind::TimedOut && !bytes.is_empty() => return Err(late()),
                Err(_) => return Err(Refusal::Gone),
            };
            // A head ends with an empty line. It is parsed only once it may be complete, so that small parts cost no
            // more than large ones.
            let seen = bytes.len().saturating_sub(2);
            bytes.extend_from_slice(&part[..read]);
            let ends = |w: &[u8]| w.ends_with(b"\n\n") || w == b"\n\r\n";
            if bytes[seen..].windows(3).any(ends)
                && let Some(head) = parse(&bytes)?
            {
                return Ok(head);
            }
            if bytes.len() > LARGEST_HEAD {
                return Err(refuse(431, "the headers of this request are too large"));
            }
        }
    }

    /// Reads the body of a request.
    pub(super) fn body(&mut self, head: Head) -> Result<Vec<u8>, Refusal> {
        let Head { length, rest: mut body, .. } = head;
        body.truncate(length);
        let mut had = body.len();
        body.resize(length, 0);
        while had < length {
            had += match self.some(&mut body[had..]) {
                Ok(0) => return Err(Refusal::Gone),
                Ok(read) => read,
                Err(e) if e.kind() == io::ErrorKind::TimedOut => return Err(late()),
                Err(_) => return Err(Refusal::Gone),
            };
        }
        Ok(body)
    }

    /// Sends a response and closes the connection.
    pub(super) fn respond(mut self, answer: &Answer) {
        if self.write(answer.head().as_bytes()).and_then(|()| self.write(answer.body())).is_err() {
            return;
        }
        if self.stream.shutdown(Shutdown::Write).is_ok() {
            self.until = Instant::now() + LINGER;
            let mut part = [0; 4096];
            while self.some(&mut part).is_ok_and(|read| read > 0) {}
        }
    }

    /// Sends a small response and closes the connection at once.
    pub(super) fn refuse(mut self, answer: &Answer) {
        let _ = self.write(&[answer.head().as_bytes(), answer.body()].concat());
    }

    /// Sends bytes.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }
}

impl Head {
    /// Returns the value of a header; refuses a request that has it twice, because it would be ambiguous which one
    /// applies.
    pub(super) fn only(&self, name: &str) -> Result<Option<&str>, Refusal> {
        let mut values = self.headers.iter().filter(|(header, _)| header.eq_ignore_ascii_case(name));
        match (values.next(), values.next()) {
            (_, Some(_)) => Err(refuse(400, format!("this request has {name} twice"))),
            (first, None) => Ok(first.map(|(_, value)| value.as_str())),
        }
    }
}

/// Parses a head; `None` if it is incomplete.
fn parse(bytes: &[u8]) -> Result<Option<Head>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Partial) => Ok(None),
        Err(httparse::Error::TooManyHeaders) => Err(refuse(431, "this request has too many headers")),
        Err(e) => Err(refuse(400, format!("this is no HTTP request: {e}"))),
        Ok(httparse::Status::Complete(length)) if length > LARGEST_HEAD => {
            Err(refuse(431, "the headers of this request are too large"))
        }
        Ok(httparse::Status::Complete(length)) => {
            let headers = request.headers.iter();
            let mut head = Head {
                method: request.method.unwrap_or_default().to_owned(),
                target: request.path.unwrap_or_default().to_owned(),
                headers: headers.map(|h| (h.name.to_owned(), String::from_utf8_lossy(h.value).into_owned())).collect(),
                length: 0,
                rest: bytes[length..].to_vec(),
            };
            head.length = body_length(&head)?;
            Ok(Some(head))
        }
    }
}

/// Returns the size of the body that a head states.
fn body_length(head: &Head) -> Result<usize, Refusal> {
    if head.only("Transfer-Encoding")?.is_some() {
        return Err(refuse(411, "this body needs a Content-Length"));
    }
    let length = match head.only("Content-Length")? {
        None => 0,
        // Digits only: `parse` would accept a sign.
        Some(text) if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) => {
            return Err(refuse(400, "this Content-Length is no number"));
        }
        Some(text) => text.parse().unwrap_or(usize::MAX),
    };
    if length > LARGEST_BODY {
        return Err(refuse(413, "this body is too large"));
    }
    Ok(length)
}

fn refuse(status: u16, words: impl Into<String>) -> Refusal {
    Refusal::Answer(answer::text(status, words))
}

fn late() -> Refusal {
    refuse(408, "this request did not arrive in time")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the refusal's status; 0 if there is none.
    fn status<T>(result: Result<T, Refusal>) -> u16 {
        match result {
            Err(Refusal::Answer(answer)) => answer.status(),
            Ok(_) | Err(Refusal::Gone) => 0,
        }
    }

    #[test]
    fn heads_are_parsed_and_odd_ones_refused() {
        let head = parse(b"POST /a/b?c HTTP/1.1\r\nhost: x\r\nA: 1\r\na: 2\r\n\r\nbody").ok().flatten().unwrap();
        assert_eq!((head.method.as_str(), head.target.as_str(), &head.rest[..]), ("POST", "/a/b?c", &b"body"[..]));
        assert_eq!(head.only("Host").ok(), Some(Some("x")));
        assert_eq!(head.only("Origin").ok(), Some(None));
        assert_eq!(status(head.only("A")), 400);
        assert!(matches!(parse(b"GET / HTTP/1.1\r\nHost:"), Ok(None)));
        assert_eq!(status(parse(b"\x16\x03\x01\n\n")), 400);
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: 1\r\n".repeat(MOST_HEADERS + 1));
        assert_eq!(status(parse(many.as_bytes())), 431);
    }

    #[test]
    fn body_sizes_are_numbers_within_the_limit() {
        let of = |header: &str| parse(format!("POST / HTTP/1.1\r\n{header}\r\n\r\n").as_bytes());
        assert_eq!(of("Content-Length: 65536").ok().flatten().map(|head| head.length), Some(LARGEST_BODY));
        for (header, expected) in [
            ("Content-Length: 65537", 413),
            ("Content-Length: 99999999999999999999999", 413),
            ("Content-Length: +1", 400),
            ("Content-Length:", 400),
            ("Content-Length: 1\r\nContent-Length: 2", 400),
            ("Transfer-Encoding: chunked", 411),
        ] {
            assert_eq!(status(of(header)), expected, "{header}");
        }
    }
}
