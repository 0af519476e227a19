//! `trace serve`: renders images for another program, one request after the other, without a process for each.
//!
//! | file | idea |
//! |---|---|
//! | `scene` | scene files kept between requests, read again when one of their files has changed |
//! | `answer` | lines and bytes of an answer |

mod answer;
mod scene;

use crate::render;
use answer::{Answer, Progress};
use clap::Parser;
use furrow_base::ron_file::to_json;
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use furrow_dataset::make::single;
use scene::{Kept, SceneSource};
use serde::Deserialize;
use serde_json::Value;
use std::cell::RefCell;
use std::io::{self, BufRead, IsTerminal, Read};
use std::path::PathBuf;

/// Length in bytes that no line of a request exceeds.
const LONGEST: u64 = 64 << 20;

/// No options.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {}

const AFTER: &str = "\
Each line of stdin is a request, a JSON object; each answer on stdout is a line of JSON, followed by the bytes of its maps. The program ends
with its input. The Python module `furrow` uses it.

  {\"open\": \"field\"}                                   the scene file as JSON: {\"scene\": {…}, \"file\": \"…\"}
  {\"write\": {\"scene\": {…}, \"folder\": \"…\"}}            the text of a scene file: {\"text\": \"Field(…)\"}
  {\"render\": {\"file\": \"field\", \"arguments\": [\"--spp\", \"1\"]}}   an image, with the options of `trace --scene`
  {\"render\": {\"scene\": {…}, \"folder\": \"…\", \"arguments\": []}}   the same of a scene as JSON; its paths are relative to the folder

An image is {\"maps\": [{\"name\": \"rgb\", \"type\": \"u1\", \"shape\": [72, 96, 3]}, …], \"record\": {…}, \"provenance\": \"…\", \"warnings\": […]} and the
maps' bytes, in their order, rows from the top, little-endian. Before it, lines {\"progress\": 0.4} may come, with \"progress\": true in the
request. A failed request is {\"error\": {…}} with message, kind, help and place.";

/// A request.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase")]
enum Request {
    /// Returns a scene file as JSON.
    Open(PathBuf),
    /// Returns the text of a scene given as JSON.
    Write(SceneSource),
    /// Renders an image.
    Render(RenderRequest),
}

/// An image to render: a [`SceneSource`] and options. serde cannot refuse unknown keys beside a flattened struct.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RenderRequest {
    file: Option<PathBuf>,
    scene: Option<Value>,
    #[serde(default)]
    folder: PathBuf,
    /// Options of `trace --scene`.
    #[serde(default)]
    arguments: Vec<String>,
    /// Whether lines of progress are sent before the answer.
    #[serde(default)]
    progress: bool,
}

/// Options of an image, parsed like those of the command line.
#[derive(Parser)]
#[command(name = "trace", no_binary_name = true)]
struct Options {
    #[command(flatten)]
    render: render::Args,
}

/// Answers requests until the input ends.
pub(crate) fn run(_: &Args) -> Result<Vec<PathBuf>> {
    if io::stdin().is_terminal() {
        return Err(Error::misuse("stdin is a terminal, and requests come from a program")
            .help("use the Python module `furrow`, or see `trace serve --help`"));
    }
    let (mut kept, mut input) = (Kept::default(), io::stdin().lock());
    while let Some(line) = line(&mut input).map_err(|e| Error::failed(format!("cannot read stdin: {e}")))? {
        let answer = line.and_then(|line| supervised(|| answer(&line, &mut kept)).and_then(|answer| answer));
        if answer.is_err() {
            // An error may have interrupted a change of what is kept.
            kept = Kept::default();
        }
        if !answer::send(answer)? {
            break;
        }
    }
    Ok(Vec::new())
}

/// Reads a line without its end; `None` at the end of the input. A line that is too long is passed over and becomes an error.
fn line(input: &mut impl BufRead) -> io::Result<Option<Result<Vec<u8>>>> {
    let mut line = Vec::new();
    if input.take(LONGEST + 1).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() as u64 > LONGEST {
        input.skip_until(b'\n')?;
        let words = format!("this is not a request: its line is longer than {} MiB", LONGEST >> 20);
        return Ok(Some(Err(Error::misuse(words).help("see `trace serve --help`"))));
    }
    Ok(Some(Ok(line)))
}

/// Parses a request. Errors name a byte that is not UTF-8, and unknown keys.
fn request(line: &[u8]) -> Result<Request> {
    let wrong = |what: String| Error::misuse(format!("this is not a request: {what}")).help("see `trace serve --help`");
    let text = std::str::from_utf8(line).map_err(|e| {
        let at = e.valid_up_to();
        wrong(format!("byte {} of the line, {:#04x}, is not UTF-8 text", at + 1, line[at]))
    })?;
    serde_json::from_str(text).map_err(|e| wrong(e.to_string()))
}

fn answer(line: &[u8], kept: &mut Kept) -> Result<Answer> {
    match request(line)? {
        Request::Open(file) => {
            let file = furrow_base::input::shipped::scene_file(file);
            let text = SceneSource::of(file.clone()).text()?;
            Ok(Answer::of("scene", to_json(&text)).with("file", &file.to_string_lossy().into()))
        }
        Request::Write(source) => Ok(Answer::of("text", Value::from(source.absolute_text()?).to_string())),
        Request::Render(request) => image(request, kept),
    }
}

/// Renders an image and describes it.
fn image(request: RenderRequest, kept: &mut Kept) -> Result<Answer> {
    let RenderRequest { file, scene, folder, arguments, progress } = request;
    let source = SceneSource { file, scene, folder };
    let path = source.path().display().to_string();
    let words = ["--scene".to_owned(), path, "--quiet".to_owned()].into_iter().chain(arguments);
    let options = Options::try_parse_from(words).map_err(|e| unparsed(&e))?.render;
    if let Some(option) = options.beyond_image() {
        return Err(Error::misuse(format!(
            "the argument {option} has no effect in a request: its answer is the image"
        ))
        .help("leave it out"));
    }
    let scene = kept.scene(&source, options.edit()?)?;
    let warnings = RefCell::new(Vec::new());
    let warn = |words: &str| warnings.borrow_mut().push(words.to_owned());
    let sent = progress.then(Progress::begin);
    let progress = |done: f64| sent.iter().for_each(|progress| progress.send(done));
    let (answer, files) = options.image(scene, &progress, &warn, |made| {
        let files = made.image.field().grown().files.clone();
        let provenance = made.image.provenance.photograph_text(made.image.denoised.is_some());
        let answer = if made.whole {
            Answer::sample(&single::sample(made.scene, made.renderer, made.image)?)?
        } else {
            made.image.check_denoised()?;
            Answer::part(&made.image)
        };
        Ok((answer.with("provenance", &provenance.into()), files))
    })?;
    kept.read(&files);
    Ok(answer.with("warnings", &warnings.into_inner().into()))
}

/// Converts an error of the command line.
fn unparsed(error: &clap::Error) -> Error {
    let text = error.render().to_string();
    let words = text.strip_prefix("error: ").unwrap_or(&text);
    Error::misuse(words.split("\n\nUsage").next().unwrap_or(words).split("\n\nFor more").next().unwrap_or(words).trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(line: &[u8]) -> String {
        let error = answer(line, &mut Kept::default()).err().expect("an error");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    /// Rationale: a line without an end filled the memory. Expected: an error, after which the next line is read; the last line
    /// needs no end.
    #[test]
    fn lines_have_a_limit() {
        let text = io::repeat(b'a').take(LONGEST + 9).chain(&b"\nnext\n\nlast"[..]);
        let mut input = io::BufReader::new(text);
        let mut next = || line(&mut input).expect("a line");
        let error = next().expect("a line").expect_err("too long");
        assert!(error.exit_code() == 2 && error.to_string().contains("longer than 64 MiB"), "{error}");
        for expected in ["next", "", "last"] {
            assert_eq!(next().expect("a line").expect("a short line"), expected.as_bytes());
        }
        assert!(next().is_none());
    }

    /// Rationale: a line that was not UTF-8 ended the server, and a misspelt key or an argument without effect was passed
    /// over. Expected: an error that names it.
    #[test]
    fn malformed_requests_are_refused_with_their_cause() {
        assert!(refused(b"{\"open\": \"\xff\"}").contains("byte 11 of the line, 0xff, is not UTF-8"));
        assert!(refused(b"").contains("this is not a request: EOF"));
        for line in [
            r#"{"render": {"file": "a.ron", "extra": 1}}"#,
            r#"{"write": {"scene": {}, "extra": 1}}"#,
            r#"{"open": "a.ron", "extra": 1}"#,
        ] {
            let shown = refused(line.as_bytes());
            assert!(shown.contains("this is not a request") && (shown.contains("`extra`") || line.contains("open")));
        }
        for [option, value] in [["--out", "x"], ["--pixel", "1,1"], ["--profile", ""]] {
            let arguments: Vec<&str> = [option, value].into_iter().filter(|word| !word.is_empty()).collect();
            let line = serde_json::json!({ "render": { "file": "a.ron", "arguments": arguments } }).to_string();
            assert!(refused(line.as_bytes()).contains(&format!("the argument {option} has no effect")), "{option}");
        }
    }
}
