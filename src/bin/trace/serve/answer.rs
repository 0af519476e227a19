//! Answers to requests: a line of JSON, and the bytes of maps.

use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_dataset::model::sample::Sample;
use furrow_job::Image;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Shortest interval between lines of progress.
const EVERY: Duration = Duration::from_millis(100);

/// A successful answer.
pub(super) struct Answer {
    /// Names and values as JSON.
    values: Vec<(&'static str, String)>,
    maps: Vec<Map>,
}

/// One value for each pixel.
struct Map {
    name: &'static str,
    /// Type of a value: `u1`, `i4` or `f4`, as NumPy names it.
    kind: &'static str,
    /// Number of values of a pixel, if there are several.
    channels: Option<usize>,
    bytes: Vec<u8>,
}

impl Map {
    fn bytes(name: &'static str, bytes: &[u8]) -> Self {
        Self { name, kind: "u1", channels: None, bytes: bytes.to_vec() }
    }

    fn rgb(bytes: &[u8]) -> Self {
        Self { channels: Some(3), ..Self::bytes("rgb", bytes) }
    }

    fn numbers(name: &'static str, numbers: impl Iterator<Item = u32>) -> Self {
        Self { name, kind: "i4", channels: None, bytes: numbers.flat_map(u32::to_le_bytes).collect() }
    }

    fn depth(depth: &[f32]) -> Self {
        let bytes = depth.iter().flat_map(|z| z.to_le_bytes()).collect();
        Self { name: "depth", kind: "f4", channels: None, bytes }
    }
}

impl Answer {
    /// Returns an answer without maps, with one value as JSON.
    pub(super) fn of(name: &'static str, json: String) -> Self {
        Self { values: vec![(name, json)], maps: Vec::new() }
    }

    /// Returns the same answer with a further value.
    pub(super) fn with(mut self, name: &'static str, value: &Value) -> Self {
        self.values.push((name, value.to_string()));
        self
    }

    /// Returns the answer with a whole image and its record.
    pub(super) fn sample(sample: &Sample) -> Result<Self> {
        let record =
            serde_json::to_string(&sample.record).map_err(|e| Error::failed(format!("cannot write JSON: {e}")))?;
        let maps = vec![
            Map::rgb(sample.rgb.as_flattened()),
            Map::bytes("nir", &sample.nir),
            Map::bytes("semantics", &sample.semantics),
            Map::numbers("plants", sample.plants.iter().copied()),
            Map::numbers("leaves", sample.leaves.iter().map(|leaf| u32::from(*leaf))),
            Map::depth(&sample.rendered("record")?.labels.depth),
        ];
        Ok(Self::sized(sample.size(), record, maps))
    }

    /// Returns the answer with a part of an image. Its record has no plants: their pixels are known in whole images only.
    pub(super) fn part(image: &Image<'_>) -> Self {
        let (photograph, labels) = (image.photograph(), &image.labels);
        let classes: Vec<u8> = labels.tags.iter().map(|tag| tag.class as u8).collect();
        let maps = vec![
            Map::rgb(&photograph.rgb),
            Map::bytes("nir", &photograph.nir),
            Map::bytes("semantics", &classes),
            Map::numbers("plants", labels.tags.iter().map(|tag| tag.plant)),
            Map::numbers("leaves", labels.tags.iter().map(|tag| u32::from(tag.leaf))),
            Map::depth(&labels.depth),
        ];
        let (field, window) = (image.field().grown(), labels.window);
        let record = json!({
            "index": field.index,
            "width": window.width(),
            "height": window.height(),
            "crop": [window.x0, window.y0, window.width(), window.height()],
            "conditions": field.conditions,
            "warnings": field.warnings,
        });
        Self::sized((window.width(), window.height()), record.to_string(), maps)
    }

    fn sized((width, height): (u32, u32), record: String, maps: Vec<Map>) -> Self {
        let shape = |map: &Map| [width.to_usize(), height.to_usize()].into_iter().rev().chain(map.channels).collect();
        let about = |map: &Map| {
            let shape: Vec<usize> = shape(map);
            json!({ "name": map.name, "type": map.kind, "shape": shape })
        };
        let described: Vec<Value> = maps.iter().map(about).collect();
        let values = vec![("maps", Value::from(described).to_string()), ("record", record)];
        Self { values, maps }
    }
}

/// Sends an answer. Returns `false` if the other program has closed the pipe.
pub(super) fn send(answer: Result<Answer>) -> Result<bool> {
    let Answer { values, maps } = answer.unwrap_or_else(|error| Answer::of("error", described(&error).to_string()));
    let values: Vec<String> = values.iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
    let mut bytes = format!("{{{}}}\n", values.join(", ")).into_bytes();
    for map in &maps {
        bytes.extend(&map.bytes);
    }
    written(&bytes)
}

/// Sends lines of progress, not more often than [`EVERY`].
pub(super) struct Progress {
    last: Mutex<Instant>,
}

impl Progress {
    /// Begins to measure the interval.
    pub(super) fn begin() -> Self {
        Self { last: Mutex::new(Instant::now()) }
    }

    /// Sends a fraction from 0 to 1, unless the last line was sent just before.
    pub(super) fn send(&self, done: f64) {
        let Ok(mut last) = self.last.try_lock() else { return };
        if last.elapsed() >= EVERY {
            *last = Instant::now();
            // A closed pipe is noticed when the answer is sent.
            let _ = written(format!("{}\n", json!({ "progress": done.min(1.0) })).as_bytes());
        }
    }
}

fn written(bytes: &[u8]) -> Result<bool> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(e) => Err(Error::failed(format!("cannot write to stdout: {e}"))),
    }
}

/// Returns an error as JSON.
fn described(error: &Error) -> Value {
    let place = error.place().map(|place| {
        let span = place.span.as_ref();
        json!({
            "file": place.file,
            "line": span.map(|span| span.line),
            "column": span.map(|span| span.column),
        })
    });
    json!({
        "text": error.to_string(),
        "message": error.message(),
        "kind": format!("{:?}", error.kind()).to_lowercase(),
        "help": error.advice(),
        "place": place,
    })
}
