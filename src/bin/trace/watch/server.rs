//! HTTP server of the page. Each request is answered in its own thread, so that a slow client does not block others.
//! Nobody waits for these threads at the end.

use super::answer::{self, Answer, Photo};
use super::guard::Guard;
use super::http::{Connection, Head, Refusal};
use super::session::Session;
use super::sliders;
use furrow_base::{Error, Result};
use furrow_job::Renderer;
use furrow_render::settings::{Quality, RenderOptions};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Maximum number of concurrent connections; browsers open six per page.
const MOST: usize = 256;
/// Keep-alive interval of an idle event stream, and minimum interval between warnings about too many connections.
const BEAT: Duration = Duration::from_secs(10);
/// Polling interval of the stop flag, and pause after a connection could not be accepted.
const GLANCE: Duration = Duration::from_millis(50);
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
struct ServerState {
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
    listener: TcpListener,
    address: SocketAddr,
    desk: Arc<ServerState>,
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
        let listener = TcpListener::bind(wanted).map_err(|e| {
            Error::failed(format!("cannot listen on {wanted}: {e}")).help("omit --port to use a free one")
        })?;
        let address = listener.local_addr().unwrap_or(wanted);
        let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(EXPLAINED)))?;
        let desk = ServerState { guard, session, photo, renderer, busy: AtomicUsize::new(0), writing: Mutex::new(()) };
        Ok(Self { listener, address, desk: Arc::new(desk) })
    }

    /// Prints the address of the page, for this machine and for others.
    pub(super) fn print_address(&self) {
        let (address, port) = (self.address, self.address.port());
        furrow_cli::message!(
            "watching {}: http://{address}/{}/",
            self.desk.session.path().display(),
            self.desk.guard.token()
        );
        if address.ip().is_loopback() {
            let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
            let host = if host.trim().is_empty() { "HOST" } else { host.trim() };
            furrow_cli::message!(
                "from another machine: ssh -L {port}:{address} {host}, then open the same address there"
            );
        } else {
            furrow_cli::message!(
                "warning: everyone who can reach {address} and knows this address can view the page and write to the scene file"
            );
        }
        furrow_cli::message!("press Ctrl-C to stop");
    }

    /// Serves requests until `stop` is set. The thread that accepts connections ends with the program.
    pub(super) fn serve(self, stop: &AtomicBool) -> Result<()> {
        let accept = move || self.accept();
        std::thread::Builder::new().name("accept".into()).spawn(accept).map_err(Error::no_thread)?;
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(GLANCE);
        }
        Ok(())
    }

    /// Accepts connections; each is served in its own thread.
    fn accept(&self) {
        let mut warned: Option<Instant> = None;
        loop {
            let admitted = if let Ok((stream, _)) = self.listener.accept() {
                self.admit(stream)
            } else {
                // No more files can be opened, or the client has gone. Connections that end may help.
                std::thread::sleep(GLANCE);
                false
            };
            if !admitted && warned.is_none_or(|at| at.elapsed() > BEAT) {
                warned = Some(Instant::now());
                furrow_cli::message!("warning: there are too many connections at once; some are refused");
            }
        }
    }

    /// Serves a connection in a new thread. Returns `false` if there are too many connections or threads.
    fn admit(&self, stream: TcpStream) -> bool {
        let Ok(connection) = Connection::new(stream) else { return true };
        let busy = Busy::new(&self.desk);
        if busy.0.busy.load(Ordering::SeqCst) > MOST {
            connection.refuse(&answer::text(503, "too many connections at once"));
            return false;
        }
        let work = move || busy.0.receive(connection);
        std::thread::Builder::new().name("answer".into()).spawn(work).is_ok()
    }
}

/// Counts one connection until it is dropped, also by a panic.
struct Busy(Arc<ServerState>);

impl Busy {
    fn new(desk: &Arc<ServerState>) -> Self {
        desk.busy.fetch_add(1, Ordering::SeqCst);
        Self(desk.clone())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.busy.fetch_sub(1, Ordering::SeqCst);
    }
}

impl ServerState {
    /// Reads a request and answers it.
    fn receive(&self, mut connection: Connection) {
        let answer = match connection.head().and_then(|head| self.answer(&mut connection, head)) {
            Ok(Some(answer)) | Err(Refusal::Answer(answer)) => answer,
            Ok(None) => return self.stream(connection),
            Err(Refusal::Gone) => return,
        };
        connection.respond(&answer);
    }

    /// Returns the response to a request; `None` for the event stream.
    fn answer(&self, connection: &mut Connection, head: Head) -> std::result::Result<Option<Answer>, Refusal> {
        let target = head.target.clone();
        let (path, query) = target.split_once('?').unwrap_or((&target, ""));
        let admitted = self.guard.admits(head.only("Host")?, head.only("Origin")?);
        Ok(Some(match (self.guard.within(path).filter(|_| admitted), head.method.as_str()) {
            // The body of a request that is refused is not read.
            (None, _) => answer::text(403, "forbidden: use the address that the program has printed"),
            (Some("events"), "GET") => return Ok(None),
            (Some(name), "GET") => self.get(name, query).unwrap_or_else(|e| answer::error(&e)),
            (Some(name), "POST") => {
                let body = connection.body(head)?;
                self.post(name, &body).unwrap_or_else(|e| answer::error(&e))
            }
            _ => answer::text(405, "only GET and POST"),
        }))
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
                if let Some(values) = &change.values {
                    self.session.shown(|shown| sliders::check_paths(&shown.sliders, values))?;
                }
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
                let only = BTreeMap::from([(path.clone(), value)]);
                self.session.shown(|shown| sliders::check_paths(&shown.sliders, &only))?;
                let seen = self.session.shown(|shown| shown.text.clone());
                let new = sliders::write(self.session.path(), &path, value, &seen)?;
                self.session
                    .show(|shown| (shown.sliders, shown.text) = (sliders::sliders(&new, self.session.assigned()), new));
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
    fn stream(&self, mut connection: Connection) {
        let head = "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n\
                    X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n";
        let mut send = |words: &str| connection.write(words.as_bytes());
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

/// Parses `x=…&y=…`.
fn pixel(query: &str) -> Result<(u32, u32)> {
    let number = |name: &str| {
        let value = query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
        value.and_then(|value| value.parse().ok())
    };
    number("x").zip(number("y")).ok_or_else(|| Error::misuse("name a pixel: ?x=10&y=20"))
}
