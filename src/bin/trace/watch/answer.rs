//! HTTP responses with the headers that isolate the page.

use furrow_base::{Error, Result};
use std::io::Cursor;
use std::path::Path;
use tiny_http::{Header, Response};

/// Content security policy: the page may load scripts, styles and images only from its own address, and may not be
/// framed.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Maximum size of a photograph, bytes.
const LARGEST: u64 = 256 << 20;

/// An HTTP response.
pub(super) type Answer = Response<Cursor<Vec<u8>>>;

/// Response with bytes of a content type.
pub(super) fn bytes(kind: &str, bytes: Vec<u8>) -> Answer {
    let headers = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("Content-Security-Policy", POLICY),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Referrer-Policy", "no-referrer"),
        ("X-Content-Type-Options", "nosniff"),
    ];
    let known = headers.into_iter().filter_map(|(name, value)| Header::from_bytes(name, value).ok());
    known.fold(Response::from_data(bytes), Response::with_header)
}

/// Plain text response.
pub(super) fn text(status: u16, words: impl Into<String>) -> Answer {
    bytes("text/plain; charset=utf-8", words.into().into_bytes()).with_status_code(status)
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
