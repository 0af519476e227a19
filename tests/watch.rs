//! `trace watch`: a scene file is edited while its field is displayed, through HTTP and in a browser.
//!
//! Rationale: authors of a scene file must see each change, and each error in the program's own words, without asking
//! for it; nobody else may read or write. Expected: load → edit → change → break → error → repair, with the last valid
//! image kept; invalid tokens, hosts and origins refused; values written into the file change no other byte; exit code
//! 75 on a signal.

use crate::common::browser::browser;
use crate::common::devtools::Page;
use crate::common::faults;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A scene that renders in a fraction of a second.
const SCENE: &str = r"// One beet.
Field(
    seed: 3, // of the file
    camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 30), pose: Nadir(height_m: 0.5)),
    lights: [Constant(radiance: (1, 1, 1, 1))],
    plants: [(species: SPECIES, growth: Bbch(Choice([14, 16])) /* leaves */, turn_deg: Uniform(0, 360))],
)
";

/// Time limit of any operation on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A running program and the folder of its scene file.
struct Watched {
    program: Child,
    folder: tempfile::TempDir,
    /// `127.0.0.1:port`, and the path that starts with the token.
    host: String,
    base: String,
    message: BufReader<std::process::ChildStderr>,
}

impl Watched {
    fn start(more: &[&str]) -> Self {
        Self::spawn(Command::new(env!("CARGO_BIN_EXE_trace")), more)
    }

    /// Starts the program with a limit on open files.
    fn limited(files: u32) -> Self {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("ulimit -n {files}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_trace")]);
        Self::spawn(shell, &[])
    }

    fn spawn(mut command: Command, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let species = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/species/sugar_beet.ron");
        std::fs::write(folder.path().join("a.ron"), SCENE.replace("SPECIES", &format!("\"{}\"", species.display())))
            .unwrap();
        let mut program = command
            .current_dir(folder.path())
            .args(["watch", "a.ron", "--spp", "2", "--threads", "2"])
            .args(more)
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut message = BufReader::new(program.stderr.take().unwrap());
        let mut line = String::new();
        message.read_line(&mut line).unwrap();
        let address = line.split("http://").nth(1).unwrap_or_else(|| panic!("{line}")).trim();
        let (host, base) = address.split_once('/').unwrap();
        let (host, base) = (host.to_owned(), format!("/{base}"));
        Self { program, folder, host, base, message }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("a.ron")
    }

    fn text(&self) -> String {
        std::fs::read_to_string(self.file()).unwrap()
    }

    /// Saves like many editors: a new file is renamed over the old one.
    fn save(&self, text: &str) {
        let beside = self.folder.path().join("a.ron~");
        std::fs::write(&beside, text).unwrap();
        std::fs::rename(beside, self.file()).unwrap();
    }

    /// Sends a request with these headers; returns status and body.
    fn ask(&self, method: &str, path: &str, headers: &str, body: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let length = body.len();
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\n{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        )
        .unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let head = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
        let status = String::from_utf8_lossy(&answer[9..12]).parse().unwrap();
        (status, answer[head + 4..].to_vec())
    }

    fn get(&self, name: &str) -> (u16, Vec<u8>) {
        self.ask("GET", &format!("{}{name}", self.base), &format!("Host: {}\r\n", self.host), "")
    }

    fn post(&self, name: &str, body: &Value) -> (u16, String) {
        let headers = format!("Host: {0}\r\nOrigin: http://{0}\r\n", self.host);
        let (status, body) = self.ask("POST", &format!("{}{name}", self.base), &headers, &body.to_string());
        (status, String::from_utf8(body).unwrap())
    }

    /// Opens the stream of states.
    fn events(&self) -> Events {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "GET {}events HTTP/1.1\r\nHost: {}\r\n\r\n", self.base, self.host).unwrap();
        Events(BufReader::new(stream))
    }

    /// Ends the program with a signal; returns the exit code and the rest of its output.
    fn end(mut self, signal: &str) -> (Option<i32>, String) {
        let kill = format!("kill -{signal} {}", self.program.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
        let begin = Instant::now();
        let code = loop {
            if let Some(status) = self.program.try_wait().unwrap() {
                break status.code();
            }
            assert!(begin.elapsed() < PATIENCE, "the program did not stop");
            std::thread::sleep(Duration::from_millis(10));
        };
        let mut rest = String::new();
        self.message.read_to_string(&mut rest).unwrap();
        (code, rest)
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Server-sent events.
struct Events(BufReader<TcpStream>);

impl Events {
    /// Waits for the next state that satisfies a condition.
    fn until(&mut self, holds: impl Fn(&Value) -> bool) -> Value {
        let begin = Instant::now();
        loop {
            assert!(begin.elapsed() < PATIENCE, "no such state arrived");
            let mut line = String::new();
            assert!(self.0.read_line(&mut line).unwrap() > 0, "the stream ended");
            if let Some(data) = line.strip_prefix("data: ") {
                let state = serde_json::from_str(data).unwrap();
                if holds(&state) {
                    return state;
                }
            }
        }
    }

    /// Waits for the state in which the newest image is finished.
    fn done(&mut self) -> Value {
        self.until(|s| s["error"].is_null() && s["picture"]["asked"] == s["asked"] && s["picture"]["spp"] == 2)
    }
}

#[test]
fn a_saved_file_is_shown_and_its_error_is_reported_in_the_programs_words() {
    let watched = Watched::start(&[]);
    let mut events = watched.events();
    let first = events.done();
    assert_eq!(
        (first["picture"]["width"].as_u64(), first["picture"]["scale"].as_f64()),
        (Some(96), Some(1.0)),
        "the image must not be larger than the camera's"
    );
    let view = |name: &str| {
        let (status, png) = watched.get(&format!("view/{name}"));
        assert_eq!((status, &png[1..4]), (200, &b"PNG"[..]), "{name}");
        png
    };
    let before: Vec<Vec<u8>> = ["rgb", "nir", "labels", "depth"].map(view).to_vec();

    let good = watched.text();
    watched.save(&good.replace("Choice([14, 16])", "11"));
    let second = events.until(|s| s["picture"]["hash"] != first["picture"]["hash"]);
    assert!(second["error"].is_null());
    events.done();
    assert_ne!(before, ["rgb", "nir", "labels", "depth"].map(view).to_vec());

    let last = view("rgb");
    watched.save(&good.replace("turn_deg", "turn_dge"));
    let broken = events.until(|s| !s["error"].is_null());
    let message = Command::new(env!("CARGO_BIN_EXE_trace"))
        .current_dir(watched.folder.path())
        .args(["--scene", "a.ron"])
        .output()
        .unwrap();
    assert_eq!(format!("{}\n", broken["error"].as_str().unwrap()), String::from_utf8(message.stderr).unwrap());
    assert!(
        broken["error"].as_str().unwrap().contains("a.ron:6:")
            && broken["error"].as_str().unwrap().contains("^^^^^^^^")
    );
    assert_eq!(view("rgb"), last, "the last valid image must stay");

    watched.save(&good);
    let mended = events.done();
    assert_eq!(mended["picture"]["hash"], first["picture"]["hash"]);
    assert_eq!(view("rgb"), before[0], "the same file must give the same image");

    // A file named by the scene file.
    let species = std::fs::read_to_string("scenes/species/sugar_beet.ron").unwrap();
    let own = species.replace("\"../../", &format!("\"{}/", env!("CARGO_MANIFEST_DIR")));
    std::fs::write(watched.folder.path().join("beet.ron"), &own).unwrap();
    let start = good.find('"').unwrap();
    let end = start + 1 + good[start + 1..].find('"').unwrap();
    watched.save(&format!("{}\"beet.ron\"{}", &good[..start], &good[end + 1..]));
    let named = events.until(|s| {
        s["error"].is_null() && s["picture"]["asked"] == s["asked"] && s["picture"]["hash"] != mended["picture"]["hash"]
    });
    std::fs::write(watched.folder.path().join("beet.ron"), own + "// saved\n").unwrap();
    events.until(|s| s["picture"]["hash"] != named["picture"]["hash"]);
    let (code, message) = watched.end("INT");
    assert_eq!(code, Some(75), "{message}");
    assert!(message.contains("ssh -L") && message.contains("stopped watching"), "{message}");
}

/// Rationale: a model's materials and textures are named in the model, not in the scene file, and users who repair them
/// must see the result. Expected: a saved material is displayed; one that names a missing texture is reported; the
/// texture is displayed once it exists.
#[test]
fn what_a_model_names_is_followed_and_so_is_what_it_lacks() {
    let watched = Watched::start(&[]);
    let mut events = watched.events();
    events.done();
    let write = |name: &str, text: &str| std::fs::write(watched.folder.path().join(name), text).unwrap();
    write("square.mtl", "newmtl paint\nKd 0.2 0.4 0.6\n");
    write(
        "square.obj",
        "mtllib square.mtl\nusemtl paint\nv 0 0 0\nv 0.1 0 0\nv 0.1 0 0.1\nv 0 0 0.1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
    );
    let good = watched.text();
    let text = good.trim_end().trim_end_matches(')');
    watched.save(&format!("{text}    models: [(file: \"square.obj\", class: Weed, position_m: (0.05, 0.05))],\n)\n"));
    let mut shown = |hash: &str| {
        let s = events.until(|s| {
            s["error"].is_null() && s["picture"]["asked"] == s["asked"] && s["picture"]["hash"].as_str() != Some(hash)
        });
        s["picture"]["hash"].as_str().unwrap().to_owned()
    };
    let scene = serde_json::from_slice::<Value>(&watched.get("state").1).unwrap()["picture"]["hash"].to_string();
    let with_model = shown(scene.trim_matches('"'));
    write("square.mtl", "newmtl paint\nKd 0.6 0.4 0.2\n");
    let repainted = shown(&with_model);
    assert_ne!(with_model, repainted);
    write("square.mtl", "newmtl paint\nKd 0.6 0.4 0.2\nmap_Kd leaf.png\n");
    let mut events = watched.events();
    let broken = events.until(|s| !s["error"].is_null());
    assert!(broken["error"].as_str().unwrap().contains("leaf.png"), "{broken}");
    std::fs::copy("textures/leaf/galium.png", watched.folder.path().join("leaf.png")).unwrap();
    let mended = events.done();
    assert_ne!(mended["picture"]["hash"].as_str(), Some(repainted.as_str()));
}

/// Rationale: one field among many that is too large must not hide the others. Expected: the requested image is
/// displayed with the sheet open, and a cell of the sheet that cannot be rendered shows the reason.
/// Rationale: a bug in the rendering thread. Expected: it is reported, the page does not stay busy, and the next change
/// of the file is rendered.
#[test]
fn a_panic_is_reported_and_the_next_change_is_rendered() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
    faults::panics(&mut command, "render", 1);
    let watched = Watched::spawn(command, &[]);
    let mut events = watched.events();
    let failed = events.until(|state| !state["error"].is_null() && state["doing"] == "");
    let error = failed["error"].as_str().unwrap_or_else(|| panic!("{failed}"));
    assert!(error.contains("the program failed: ") && failed["picture"].is_null(), "{failed}");
    watched.save(&format!("{}\n", watched.text()));
    let made = events.until(|state| !state["picture"].is_null() && state["doing"] == "");
    assert!(made["error"].is_null(), "{made}");
    let (code, _) = watched.end("INT");
    assert_eq!(code, Some(75));
}

#[test]
fn a_field_that_cannot_grow_leaves_the_picture_and_the_other_fields() {
    let watched = Watched::start(&["--seed", "4"]);
    let mut events = watched.events();
    events.done();
    let good = watched.text();
    let species = good.split('"').nth(1).unwrap();
    let text = good.trim_end().trim_end_matches(')');
    let weeds = "Choice([20, 20, 20, 20, 90000000])";
    watched.save(&format!(
        "{text}    weeds: [(species: \"{species}\", spread: (per_m2: {weeds}), growth: Bbch(12))],\n)\n"
    ));
    assert_eq!(watched.post("wish", &json!({ "sheet": true })).0, 200);
    let sheet = events.until(|s| s["sheet"]["done"] == 12);
    let failed = |i: usize| sheet["sheet"]["failed"][i].as_str();
    assert!(failed(0).is_none(), "the displayed field must be buildable: {sheet}");
    let words: Vec<&str> = (0..12).filter_map(failed).collect();
    assert!(!words.is_empty() && words.len() < 12, "{sheet}");
    assert!(words.iter().all(|words| words.starts_with("error: ") && words.contains("weeds")), "{words:?}");
    let state = events.done();
    assert!(state["error"].is_null());
    for i in 0..12 {
        assert_eq!(watched.get(&format!("sheet/{i}")).0, if failed(i).is_some() { 404 } else { 200 });
    }
}

#[test]
fn a_pixel_reports_what_it_shows() {
    let watched = Watched::start(&[]);
    watched.events().done();
    let at = |x: u32, y: u32| -> Value { serde_json::from_slice(&watched.get(&format!("at?x={x}&y={y}")).1).unwrap() };
    let leaf =
        (0..72 * 96).map(|i| at(i * 7 % 96, i * 7 / 96 % 72)).find(|at| at["organ"] == "blade").expect("no blade");
    assert_eq!(
        (leaf["class"].as_str(), leaf["plant"].as_u64(), leaf["species"].as_str()),
        (Some("crop"), Some(1), Some("sugar beet"))
    );
    assert!(leaf["leaf"].as_u64() > Some(0) && leaf["depth_m"].as_f64() > Some(0.3), "{leaf}");
    let (x, y) = (&leaf["x"], &leaf["y"]);
    let words = String::from_utf8(watched.get(&format!("explain?x={x}&y={y}")).1).unwrap();
    let expected = format!("label: crop plant 1 leaf {}", leaf["leaf"]);
    assert!(words.contains(&expected) && words.contains("reflectance:"), "{words}");
    for odd in ["at", "at?x=1", "at?x=-1&y=2", "at?x=96&y=0", "at?x=1e9&y=0", "explain?x=0&y=99999999999", "at?%ff&&=="]
    {
        assert_eq!(watched.get(odd).0, 400, "{odd}");
    }
    for unknown in ["nothing", "view/none", "sheet/x", "sheet/99", "photo", "../a.ron", "view/../../a.ron"] {
        assert_eq!(watched.get(unknown).0, 404, "{unknown}");
    }
}

#[test]
fn whoever_does_not_know_the_address_is_refused() {
    let watched = Watched::start(&[]);
    watched.events().done();
    let own = format!("Host: {}\r\n", watched.host);
    let status = |path: &str, headers: &str| watched.ask("GET", path, headers, "").0;
    assert_eq!(status(&watched.base, &own), 200);
    // A length that exceeds any memory, from a client without the token: the program keeps running.
    for length in ["1000000000000000", "9223372036854775807"] {
        let mut stream = TcpStream::connect(&watched.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "POST /x/ HTTP/1.1\r\n{own}Content-Length: {length}\r\n\r\nabc").unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"HTTP/1.1 413");
    }
    for path in ["/", "/state", "/00000000000000000000000000000000/", "/00000000000000000000000000000000/state"] {
        assert_eq!(status(path, &own), 403, "{path}");
    }
    for host in ["evil.example", "192.0.2.1", "[::1].evil", "localhost.evil", "127.0.0.1:80.evil"] {
        assert_eq!(status(&watched.base, &format!("Host: {host}\r\n")), 403, "{host}");
    }
    for headers in ["", "Origin: http://localhost\r\n"] {
        assert_eq!(status(&watched.base, headers), 403, "{headers}");
    }
    for origin in ["http://evil.example", "null"] {
        assert_eq!(status(&format!("{}events", watched.base), &format!("{own}Origin: {origin}\r\n")), 403, "{origin}");
    }
    let before = watched.text();
    let wish = format!("{}wish", watched.base);
    assert_eq!(watched.ask("POST", &wish, &own, &"x".repeat(100_000)).0, 413);
    for odd in [
        "",
        "{",
        "[]",
        "{\"index\": -1}",
        "{\"seed\": \"other\"}",
        "{\"other\": 1}",
        "{\"values\": {\"a\": \"b\"}}",
        "\u{0}",
    ] {
        assert_eq!(watched.ask("POST", &wish, &own, odd).0, 400, "{odd}");
    }
    assert_eq!(watched.ask("DELETE", &watched.base, &own, "").0, 405);
    assert_eq!((watched.text(), watched.end("TERM").0), (before, Some(75)));
}

/// Rationale: a client decides how much it sends and when. Expected: with seventy requests whose bodies never come, the
/// page still answers, and Ctrl-C ends the program; a head without an end is refused, also without the token.
#[test]
fn slow_and_endless_requests_stop_nothing() {
    let watched = Watched::start(&[]);
    watched.events().done();
    let open = |head: &str| {
        let mut stream = TcpStream::connect(&watched.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "{head}").unwrap();
        stream
    };
    let mut endless = open("GET / HTTP/1.1\r\nX: ");
    endless.write_all("x".repeat(100_000).as_bytes()).unwrap();
    let mut answer = [0; 12];
    endless.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 431");
    let head = format!("POST {}wish HTTP/1.1\r\nHost: {}\r\nContent-Length: 100\r\n\r\n{{", watched.base, watched.host);
    let slow: Vec<TcpStream> = (0..70).map(|_| open(&head)).collect();
    assert_eq!(watched.get("state").0, 200);
    let begin = Instant::now();
    let (code, message) = watched.end("INT");
    assert_eq!(code, Some(75), "{message}");
    // Half a second is enough; the machine may be busy.
    assert!(begin.elapsed() < Duration::from_secs(3), "{:?}", begin.elapsed());
    drop(slow);
}

#[test]
fn a_slider_is_a_look_until_it_is_written() {
    let watched = Watched::start(&[]);
    let mut events = watched.events();
    let first = events.done();
    let paths: Vec<&str> = first["sliders"].as_array().unwrap().iter().map(|s| s["path"].as_str().unwrap()).collect();
    assert_eq!(paths[..2], ["plants[0].growth.Bbch", "plants[0].turn_deg"], "{paths:?}");
    let before = watched.text();
    let values = json!({ "plants[0].growth.Bbch": 12, "plants[0].turn_deg": 90.5 });
    assert_eq!(watched.post("wish", &json!({ "values": values, "index": 2 })).0, 200);
    let moved = events.until(|s| s["picture"]["asked"] == s["asked"] && s["picture"]["index"] == 2);
    let command = moved["command"].as_str().unwrap();
    assert_eq!(
        command.split_once(" --index").unwrap().1,
        " 2 --width 96 --spp 2 --set 'plants[0].growth.Bbch=12' --set 'plants[0].turn_deg=90.5'",
        "{command}"
    );
    assert_ne!(moved["picture"]["hash"], first["picture"]["hash"]);
    assert_eq!(watched.text(), before, "a request for an image must not write to the file");
    let (status, message) = watched.post("write", &json!({ "path": "plants[0].growth.Bbch", "value": 12 }));
    assert_eq!(status, 200, "{message}");
    assert_eq!(watched.text(), before.replace("Choice([14, 16])", "12"), "comments and all other text must stay");
    let written =
        events.until(|s| s["values"].as_object().is_some_and(|v| v.len() == 1) && s["picture"]["asked"] == s["asked"]);
    assert_eq!(written["picture"]["hash"], moved["picture"]["hash"], "the image must equal that of the slider");
    for path in ["nothing", "seed"] {
        assert_eq!(watched.post("write", &json!({ "path": path, "value": 1 })).0, 400, "{path} has no slider");
    }
    // An invalid value is not written to the file.
    let before = watched.text();
    let (status, message) = watched.post("write", &json!({ "path": "plants[0].growth.Bbch", "value": -1 }));
    assert_eq!(status, 400, "{message}");
    assert!(message.contains("nothing was written"), "{message}");
    assert_eq!(watched.text(), before);
    assert_eq!(watched.post("wish", &json!({ "values": {}, "index": 0, "seed": 9, "sheet": true })).0, 200);
    let sheet = events.until(|s| s["sheet"]["done"] == 12);
    assert_eq!(sheet["seed"], 9);
    assert_eq!(watched.post("wish", &json!({ "seed": "file", "sheet": false })).0, 200);
    assert_eq!(events.until(|s| s["seed"].is_null() && s["picture"]["asked"] == s["asked"])["picture"]["seed"], 3);
    assert_ne!(watched.get("sheet/0").1, watched.get("sheet/1").1);
}

#[test]
fn a_browser_shows_changes_and_mistakes() {
    let Some(browser) = browser() else { return };
    let photo = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gallery/field.jpg");
    let watched = Watched::start(&["--photo", photo.to_str().unwrap()]);
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::open(&browser, folder.path(), &format!("http://{}{}", watched.host, watched.base));
    page.wait("document.getElementById('picture')?.naturalWidth === 96 && state.picture.spp === 2");
    page.wait("document.getElementById('photo').naturalWidth > 0");
    let scales = page.ask(
        "['photo', 'picture'].map((id) => document.getElementById(id)).map((i) => i.clientWidth / i.naturalWidth)",
    );
    let scale = |i: usize| scales[i].as_f64().unwrap();
    assert!((scale(0) / scale(1) - 1.0).abs() < 0.02, "the pixel scales differ: {scales}");

    let good = watched.text();
    let before = page.ask("document.body.dataset.shown");
    watched.save(&good.replace("Choice([14, 16])", "11"));
    page.wait(&format!("document.body.dataset.shown !== {before} && !document.body.classList.contains('failed')"));
    watched.save(&good.replace("turn_deg", "turn_dge"));
    page.wait("document.body.classList.contains('failed')");
    let shown = page.ask("document.getElementById('error-text').textContent");
    assert!(
        shown.as_str().unwrap().contains("unknown field `turn_dge`") && shown.as_str().unwrap().contains("^^^^^^^^"),
        "{shown}"
    );
    assert_eq!(page.ask("document.getElementById('error').hidden || !document.getElementById('picture').src"), false);
    page.wait("Number(getComputedStyle(document.getElementById('picture')).opacity) < 0.5");
    watched.save(&good);
    page.wait("!document.body.classList.contains('failed') && document.getElementById('error').hidden");

    // Keys, a pixel and a slider.
    let press = |key: &str| format!("dispatchEvent(new KeyboardEvent('keydown', {{ key: {key:?}, bubbles: true }}))");
    let press = |key: &str| format!("document.body.{}", press(key));
    page.ask(&press("3"));
    page.wait("document.body.dataset.shown.startsWith('view/labels')");
    page.ask(&press("ArrowRight"));
    page.wait("state.picture.index === 1 && state.picture.asked === state.asked");
    page.ask("inspect({ x: 48, y: 36 })");
    page.wait("document.getElementById('pixel').textContent.includes('class')");
    page.ask(&press("Enter"));
    page.wait("document.getElementById('explained').textContent.includes('reflectance')");
    page.ask("(() => { const i = document.querySelector('.slider input'); i.value = 1; i.dispatchEvent(new Event('input')); })()");
    page.wait("state.values['plants[0].growth.Bbch'] === 16 && state.picture.asked === state.asked");
    // The image before the slider was moved, in the place of the new one.
    page.wait("document.getElementById('before').dataset.view === 'labels' && !document.getElementById('before-toggle').disabled");
    assert_eq!(page.ask("document.getElementById('before').hidden"), true);
    page.ask(&press("b"));
    let boxes =
        page.ask("['before', 'picture'].map((id) => document.getElementById(id).getBoundingClientRect().toJSON())");
    assert!(boxes[0] == boxes[1] && boxes[0]["width"].as_f64() > Some(10.0), "{boxes}");
    assert_eq!(page.ask("document.getElementById('before').hidden"), false);
    assert_ne!(
        page.ask("document.getElementById('before').dataset.asked"),
        page.ask("document.getElementById('picture').dataset.asked")
    );
    page.ask(&press("b"));
    assert_eq!(
        page.ask("document.getElementById('command').textContent.includes(\"--set 'plants[0].growth.Bbch=16'\")"),
        true
    );
    page.ask("document.querySelector('.slider .acts button:last-child').click()");
    page.wait("state.sliders[0].path === 'plants[0].turn_deg'");
    assert_eq!(watched.text(), good.replace("Choice([14, 16])", "16"));

    for width in [1280, 400] {
        page.resize(width, 800);
        let over = "document.documentElement.scrollWidth - innerWidth";
        for state in ["", "s", "s", "?"] {
            if !state.is_empty() {
                page.ask(&press(state));
            }
            std::thread::sleep(Duration::from_millis(300));
            assert!(page.ask(over).as_i64() <= Some(0), "{width} {state}");
        }
        page.ask(&press("?"));
    }
    let foreign = "performance.getEntriesByType('resource').map((e) => e.name).filter((n) => !n.startsWith(location.href) && !n.startsWith('blob:') && !n.startsWith('data:'))";
    assert_eq!(page.ask(foreign), json!([]));
    assert!(page.complaints.is_empty(), "{:?}", page.complaints);
}

#[test]
fn a_sheet_shows_several_indices() {
    let watched = Watched::start(&[]);
    let out = watched.folder.path().join("sheet.png");
    let run = |indices: &str, out: &Path| {
        let arguments = ["preview", "a.ron", "--width", "48", "--spp", "1", "--indices", indices, "--out"];
        Command::new(env!("CARGO_BIN_EXE_trace"))
            .current_dir(watched.folder.path())
            .args(arguments)
            .arg(out)
            .output()
            .unwrap()
    };
    let done = run("3..9", &out);
    assert_eq!(String::from_utf8(done.stdout).unwrap().trim(), out.to_str().unwrap());
    let (width, height, _) = furrow_output::read_photo(&out).unwrap();
    // Four wide, two high; the captions are wider than such small images.
    assert!(width > 4 * 48 && height > 2 * 36, "{width} × {height}");
    assert_eq!(run("9..3", &out).status.code(), Some(2));
    assert_eq!(run("0..2", watched.folder.path()).status.code(), Some(2));
}

/// Rationale: pages open in many windows, or port scanners, must not end a session. Expected: the program survives more
/// connections than its limit on open files; once they are closed it answers again, and ends normally. The shell sets
/// the limit.
#[cfg(target_os = "linux")]
#[test]
fn too_many_connections_end_nothing() {
    const LIMIT: u32 = 96;
    let watched = Watched::limited(LIMIT);
    watched.events().done();
    let address = watched.host.parse().unwrap();
    let connect = || TcpStream::connect_timeout(&address, Duration::from_secs(1));
    // Connect until the limit on open files is reached, and then some more times.
    let files = || std::fs::read_dir(format!("/proc/{}/fd", watched.program.id())).unwrap().count() as u32;
    let (mut idle, begin) = (Vec::new(), Instant::now());
    while files() + 2 < LIMIT {
        idle.extend(connect());
        assert!(begin.elapsed() < PATIENCE, "{} connections, {} files", idle.len(), files());
    }
    idle.extend((0..8).filter_map(|_| connect().ok()));
    drop(idle);
    let begin = Instant::now();
    let answers = || {
        let mut stream = connect().ok()?;
        stream.set_read_timeout(Some(Duration::from_secs(5))).ok()?;
        write!(stream, "GET {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", watched.base, watched.host).ok()?;
        let mut message = Vec::new();
        stream.read_to_end(&mut message).ok()?;
        message.starts_with(b"HTTP/1.1 200").then_some(())
    };
    while answers().is_none() {
        assert!(begin.elapsed() < PATIENCE, "the program never answered again");
        std::thread::sleep(Duration::from_millis(100));
    }
    let (code, message) = watched.end("TERM");
    assert_eq!(code, Some(75), "{message}");
    assert!(message.contains("too many connections"), "the limit was not reached: {message}");
}
