//! HTTP server of the page. Each request is answered in its own thread, so that a slow client does not block others.

use super::answer::{self, Answer, Photo};
use super::guard::Guard;
use super::session::Session;
use super::sliders;
use furrow_base::{Error, Result};
use furrow_job::Renderer;
use furrow_render::settings::{Quality, RenderOptions};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tiny_http::{Method, Request};

/// Maximum number of concurrent requests; browsers open six connections per page.
const MOST: usize = 64;
/// Maximum body size of a request, bytes.
const LARGEST: u64 = 64 << 10;
/// Keep-alive interval of an idle event stream, and polling interval for new requests and the stop flag.
const BEAT: Duration = Duration::from_secs(10);
const GLANCE: Duration = Duration::from_millis(50);
/// Interval of the check that the server still accepts connections.
const LOOK: Duration = Duration::from_secs(1);
/// Samples per pixel for the description of a pixel.
const EXPLAINED: u32 = 64;

/// Changes that a request may make.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    index: Option<u64>,
    seed: Option<Seed>,
    width: Option<u32>,
    /// All values that override those of the file.
    values: Option<BTreeMap<String, f64>>,
    sheet: Option<bool>,
}

/// A value to write into the scene file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    path: String,
    value: f64,
}

/// A number, or the word `file` for the scene file's own seed.
#[derive(Deserialize)]
#[serde(untagged)]
enum Seed {
    Number(u64),
    Own(Own),
}

/// The word `file`.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Own {
    File,
}

impl Seed {
    /// Returns the seed that overrides the file's, if any.
    fn instead(self) -> Option<u64> {
        match self {
            Self::Number(seed) => Some(seed),
            Self::Own(Own::File) => None,
        }
    }
}

/// Shared state of the threads that answer requests.
struct Desk {
    guard: Guard,
    session: Arc<Session>,
    photo: Option<Photo>,
    renderer: Renderer,
    busy: AtomicUsize,
    /// Held while the scene file is written: the second of two concurrent writers gets the error that the file has changed.
    writing: Mutex<()>,
}

/// The HTTP server.
pub(super) struct Server {
    http: tiny_http::Server,
    address: SocketAddr,
    desk: Arc<Desk>,
}

impl Server {
    /// Starts listening; port 0 selects a free one.
    pub(super) fn open(
        host: IpAddr,
        port: u16,
        guard: Guard,
        session: Arc<Session>,
        photo: Option<Photo>,
    ) -> Result<Self> {
        let wanted = SocketAddr::new(host, port);
        let http = tiny_http::Server::http(wanted).map_err(|e| {
            Error::failed(format!("cannot listen on {wanted}: {e}")).help("omit --port to use a free one")
        })?;
        let address = http.server_addr().to_ip().unwrap_or(wanted);
        let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(EXPLAINED)))?;
        let desk = Desk { guard, session, photo, renderer, busy: AtomicUsize::new(0), writing: Mutex::new(()) };
        Ok(Self { http, address, desk: Arc::new(desk) })
    }

    /// Prints the address of the page, for this machine and for others.
    pub(super) fn tell(&self) {
        let (address, port) = (self.address, self.address.port());
        furrow_cli::tell!(
            "watching {}: http://{address}/{}/",
            self.desk.session.path().display(),
            self.desk.guard.token()
        );
        if address.ip().is_loopback() {
            let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
            let host = if host.trim().is_empty() { "HOST" } else { host.trim() };
            furrow_cli::tell!("from another machine: ssh -L {port}:{address} {host}, then open the same address there");
        } else {
            furrow_cli::tell!(
                "warning: everyone who can reach {address} and knows this address can view the page and write to the scene file"
            );
        }
        furrow_cli::tell!("press Ctrl-C to stop");
    }

    /// Serves requests until `stop` is set.
    pub(super) fn serve(&mut self, stop: &AtomicBool) {
        let mut looked = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            let request = match self.http.recv_timeout(GLANCE) {
                Ok(Some(request)) => request,
                Ok(None) if looked.elapsed() < LOOK => continue,
                Ok(None) | Err(_) => {
                    looked = Instant::now();
                    self.listen_again();
                    continue;
                }
            };
            let desk = self.desk.clone();
            let Some(request) = bearable(request) else { continue };
            if desk.busy.fetch_add(1, Ordering::SeqCst) >= MOST {
                desk.busy.fetch_sub(1, Ordering::SeqCst);
                let _ = request.respond(answer::text(503, "too many requests at once"));
                continue;
            }
            let work = move || {
                let _busy = Busy(&desk.busy);
                desk.receive(request);
            };
            // If no thread can be started, the request is dropped, which sends status 500.
            if std::thread::Builder::new().name("answer".into()).spawn(work).is_err() {
                self.desk.busy.fetch_sub(1, Ordering::SeqCst);
            }
        }
    }
}

impl Server {
    /// Listens again at the same address if nothing does any more: the thread that accepts connections ends, with an
    /// error or a panic, when no more files can be opened.
    fn listen_again(&mut self) {
        let Ok(listener) = TcpListener::bind(self.address) else { return };
        if let Ok(http) = tiny_http::Server::from_listener(listener, None) {
            furrow_cli::tell!("warning: there were too many connections at once; listening again");
            self.http = http;
        }
    }
}

/// Maximum size in bytes of an unread body, because dropping its request reserves memory for it.
const BEARABLE: usize = 1 << 24;

/// Counts one answering thread until it is dropped, also by a panic.
struct Busy<'a>(&'a AtomicUsize);

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Returns a request whose body size is acceptable, and answers any other. The server library reserves memory for the
/// stated length of an unread body when its request is dropped, so an oversized request is leaked together with its
/// connection.
fn bearable(request: Request) -> Option<Request> {
    if request.body_length().is_none_or(|length| length <= BEARABLE) {
        return Some(request);
    }
    let rest = request.upgrade("close", answer::text(413, "this body is too large"));
    std::mem::forget(rest);
    None
}

impl Desk {
    fn receive(&self, mut request: Request) {
        let url = request.url().to_owned();
        let (path, query) = url.split_once('?').unwrap_or((&url, ""));
        let header = |name: &'static str| {
            request.headers().iter().find(|h| h.field.equiv(name)).map(|h| h.value.as_str().to_owned())
        };
        let admitted = self.guard.admits(header("Host").as_deref(), header("Origin").as_deref());
        let answer = match self.guard.within(path).filter(|_| admitted) {
            None => answer::text(403, "forbidden: use the address that the program has printed"),
            Some("events") if *request.method() == Method::Get => return self.stream(request),
            Some(name) => match request.method().clone() {
                Method::Get => self.get(name, query).unwrap_or_else(|e| answer::error(&e)),
                Method::Post => match body(&mut request) {
                    Ok(body) => self.post(name, &body).unwrap_or_else(|e| answer::error(&e)),
                    Err(refusal) => refusal,
                },
                _ => answer::text(405, "only GET and POST"),
            },
        };
        let _ = request.respond(answer);
    }

    fn get(&self, name: &str, query: &str) -> Result<Answer> {
        let session = &self.session;
        Ok(match name {
            "" => answer::bytes("text/html; charset=utf-8", include_bytes!("page.html").to_vec()),
            "page.css" => answer::bytes("text/css; charset=utf-8", include_bytes!("page.css").to_vec()),
            "page.js" => answer::bytes("text/javascript; charset=utf-8", include_bytes!("page.js").to_vec()),
            "state" => answer::json(&session.state(0, Duration::ZERO).unwrap_or_default().1),
            "at" => answer::json(&session.picture()?.at(pixel(query)?)?),
            "explain" => answer::text(200, session.picture()?.explain(&self.renderer, pixel(query)?)?),
            "photo" => self.photo.as_ref().map_or_else(|| answer::text(404, "no photograph"), Photo::answer),
            _ => match name.split_once('/') {
                Some(("view", view)) => match session.picture()?.png(view) {
                    Some(png) => answer::bytes("image/png", png?),
                    None => answer::text(404, "no such view"),
                },
                Some(("sheet", number)) => {
                    let index: usize = number.parse().unwrap_or(usize::MAX);
                    match session.shown(|shown| shown.sheet.pictures.get(index).cloned()) {
                        Some(Ok(png)) => answer::bytes("image/png", png.to_vec()),
                        Some(Err(words)) => answer::text(404, words),
                        None => answer::text(404, "not rendered yet"),
                    }
                }
                _ => answer::text(404, "no such page"),
            },
        })
    }

    fn post(&self, name: &str, body: &[u8]) -> Result<Answer> {
        let wrong = |e: serde_json::Error| Error::misuse(format!("this request cannot be read: {e}"));
        let asked = match name {
            "wish" => {
                let change: Change = serde_json::from_slice(body).map_err(wrong)?;
                self.session.wish(|wish| {
                    wish.index = change.index.unwrap_or(wish.index);
                    wish.seed = change.seed.map_or(wish.seed, Seed::instead);
                    wish.width = change.width.map_or(wish.width, |width| width.clamp(16, 4096));
                    wish.sheet = change.sheet.unwrap_or(wish.sheet);
                    if let Some(values) = change.values {
                        wish.values = values.into_iter().filter(|(_, value)| value.is_finite()).collect();
                    }
                })
            }
            "write" => {
                let Written { path, value } = serde_json::from_slice(body).map_err(wrong)?;
                let _alone = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
                let seen = self.session.shown(|shown| shown.text.clone());
                let new = sliders::write(self.session.path(), &path, value, &seen)?;
                self.session.show(|shown| (shown.sliders, shown.text) = (sliders::sliders(&new), new));
                self.session.reload();
                self.session.wish(|wish| {
                    wish.values.remove(&path);
                })
            }
            _ => return Ok(answer::text(404, "no such page")),
        };
        Ok(answer::json(&serde_json::json!({ "asked": asked })))
    }

    /// Server-sent events: the current state, and again whenever it changes.
    fn stream(&self, request: Request) {
        let mut out = request.into_writer();
        let head = "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n\
                    X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n";
        let mut send = |words: &str| out.write_all(words.as_bytes()).and_then(|()| out.flush());
        let mut seen = 0;
        let mut gone = send(head).is_err();
        while !gone {
            let Some((version, state)) = self.session.state(seen, BEAT) else { return };
            gone = if version == seen {
                send(": alive\n\n").is_err()
            } else {
                send(&format!("data: {state}\n\n")).is_err()
            };
            seen = version;
        }
    }
}

/// Reads the body of a request; returns an error response if it is too large.
fn body(request: &mut Request) -> std::result::Result<Vec<u8>, Answer> {
    let mut bytes = Vec::new();
    if request.body_length().is_some_and(|length| length as u64 > LARGEST) {
        return Err(answer::text(413, "this body is too large"));
    }
    match request.as_reader().take(LARGEST + 1).read_to_end(&mut bytes) {
        Ok(_) if bytes.len() as u64 > LARGEST => Err(answer::text(413, "this body is too large")),
        Ok(_) => Ok(bytes),
        Err(_) => Err(answer::text(400, "this body cannot be read")),
    }
}

/// Parses `x=…&y=…`.
fn pixel(query: &str) -> Result<(u32, u32)> {
    let number = |name: &str| {
        let value = query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
        value.and_then(|value| value.parse().ok())
    };
    number("x").zip(number("y")).ok_or_else(|| Error::misuse("name a pixel: ?x=10&y=20"))
}
