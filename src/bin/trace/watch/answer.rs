//! HTTP responses with the headers that isolate the page.

use furrow_base::{Error, Result};
use std::fmt::Write;
use std::path::Path;

/// Content security policy: the page may load scripts, styles and images only from its own address, and may not be
/// framed.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Maximum size of a photograph, bytes.
const LARGEST: u64 = 256 << 20;

/// Headers of every response: nothing is kept, and no other page may use it.
const HEADERS: [(&str, &str); 6] = [
    ("Cache-Control", "no-store"),
    ("Connection", "close"),
    ("Content-Security-Policy", POLICY),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Referrer-Policy", "no-referrer"),
    ("X-Content-Type-Options", "nosniff"),
];

/// An HTTP response.
pub(super) struct Answer {
    status: u16,
    kind: &'static str,
    body: Vec<u8>,
}

impl Answer {
    /// Returns status line and headers, with the empty line after them.
    pub(super) fn head(&self) -> String {
        let Self { status, kind, body } = self;
        let mut head = format!("HTTP/1.1 {status} {}\r\n", reason(*status));
        let _ = write!(head, "Content-Type: {kind}\r\nContent-Length: {}\r\n", body.len());
        for (name, value) in HEADERS {
            let _ = write!(head, "{name}: {value}\r\n");
        }
        head + "\r\n"
    }

    /// Returns the body.
    pub(super) fn body(&self) -> &[u8] {
        &self.body
    }

    /// Returns the status.
    #[cfg(test)]
    pub(super) fn status(&self) -> u16 {
        self.status
    }
}

/// Returns the reason phrase of a status that this program sends.
fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        411 => "Length Required",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        500 => "Internal Server Error",
        503 => "Service Unavailable",
        _ => "Bad Request",
    }
}

/// Response with bytes of a content type.
pub(super) fn bytes(kind: &'static str, body: Vec<u8>) -> Answer {
    Answer { status: 200, kind, body }
}

/// Plain text response.
pub(super) fn text(status: u16, words: impl Into<String>) -> Answer {
    Answer { status, kind: "text/plain; charset=utf-8", body: words.into().into_bytes() }
}

/// JSON response.
pub(super) fn json(value: &serde_json::Value) -> Answer {
    bytes("application/json", value.to_string().into_bytes())
}

/// Error response: status 400 for errors of the user, 500 for others.
pub(super) fn error(error: &Error) -> Answer {
    text(if error.exit_code() == 2 { 400 } else { 500 }, format!("error: {error}"))
}

/// A photograph as stored on disk.
pub(super) struct Photo {
    kind: &'static str,
    bytes: Vec<u8>,
}

impl Photo {
    /// Reads a photograph in a format that browsers support.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let bytes = furrow_base::input::read(path, LARGEST).map_err(|refusal| refusal.into_error(path))?;
        let kind = match bytes.as_slice() {
            [0x89, b'P', b'N', b'G', ..] => "image/png",
            [0xff, 0xd8, ..] => "image/jpeg",
            _ => {
                let wrong = Error::input("this is neither a PNG nor a JPEG image").in_file(path);
                return Err(wrong.help("give --photo a photograph in one of these formats"));
            }
        };
        Ok(Self { kind, bytes })
    }

    /// Response with the photograph.
    pub(super) fn answer(&self) -> Answer {
        bytes(self.kind, self.bytes.clone())
    }
}
