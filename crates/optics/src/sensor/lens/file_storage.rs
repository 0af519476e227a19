//! Reads numbers and matrices from files in the format of OpenCV's `FileStorage`, as YAML or XML.
//!
//! The reader takes the keys of the first level: numbers, words, matrices with `rows`, `cols` and `data`, and numbers by
//! name, as in ROS's `roi`. Other values are passed over. YAML without the tag `!!opencv-matrix`, as ROS writes it, is read alike.

use furrow_base::{Error, Result};

/// Most numbers of a matrix; a camera matrix has 9, a list of distortion coefficients at most 14.
const MOST: usize = 64;
/// Help for files that are in neither format.
const FORMS: &str = "write it with cv2.FileStorage(\"camera.yaml\", cv2.FILE_STORAGE_WRITE)";

/// Value of a key of the first level.
#[derive(Debug, Default)]
pub(super) struct Entry {
    pub(super) key: String,
    /// Line of the key, from 1.
    pub(super) line: usize,
    /// Number or word; empty for a matrix.
    pub(super) text: String,
    rows: Option<String>,
    cols: Option<String>,
    /// Words of a matrix's data.
    data: Vec<String>,
    /// Whether a matrix has more data than are kept.
    long: bool,
    /// Other values by name, in lines below the key.
    named: Vec<(String, String)>,
}

impl Entry {
    fn new(key: &str, line: usize) -> Self {
        Self { key: key.to_owned(), line, ..Self::default() }
    }

    /// Returns an error about this entry.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> Error {
        Error::input(format!("line {}: {} {what}", self.line, self.key))
    }

    /// Returns the value as a number.
    pub(super) fn number(&self) -> Result<f64> {
        number(&self.text).ok_or_else(|| self.fault("is not a number").help("write one number"))
    }

    /// Returns the numbers of a matrix, row by row.
    pub(super) fn matrix(&self) -> Result<Vec<f64>> {
        if self.data.is_empty() {
            return Err(self.fault("has no data").help("it is a matrix: write rows, cols and data: [ … ]"));
        }
        if self.long {
            return Err(self.fault(format_args!("has more than {MOST} numbers")).help("this is no calibration"));
        }
        let read = |word: &String| {
            number(word).ok_or_else(|| self.fault(format_args!("contains `{word}`, not a finite number")).help(FORMS))
        };
        let numbers: Vec<f64> = self.data.iter().map(read).collect::<Result<_>>()?;
        let side = |text: &Option<String>| match text {
            None => Ok(None),
            Some(text) => text
                .parse::<usize>()
                .map(Some)
                .map_err(|_| self.fault(format_args!("has `{text}` rows or columns")).help("write whole numbers")),
        };
        if let (Some(rows), Some(cols)) = (side(&self.rows)?, side(&self.cols)?)
            && rows.saturating_mul(cols) != numbers.len()
        {
            let words = format!("has {} numbers, not {rows} × {cols}", numbers.len());
            return Err(self.fault(words).help("the file was cut or edited: write it again"));
        }
        Ok(numbers)
    }

    /// Returns the number with this name below the key, in lines of their own or as `{name: number, …}`; `None` if it has none.
    pub(super) fn named(&self, name: &str) -> Result<Option<f64>> {
        let inline = self.text.trim_matches(['{', '}']).split(',').filter_map(|pair| pair.split_once(':'));
        let own = self.named.iter().map(|(key, value)| (key.as_str(), value.as_str()));
        let Some((_, value)) = own.chain(inline).find(|(key, _)| key.trim().trim_matches('"') == name) else {
            return Ok(None);
        };
        let value = number(value.trim());
        value
            .map(Some)
            .ok_or_else(|| self.fault(format_args!("has a {name} that is not a number")).help("write one number"))
    }

    /// Sets a part of a matrix or a value by name.
    fn set(&mut self, part: &str, text: &str) {
        match part {
            "rows" => self.rows = Some(text.to_owned()),
            "cols" => self.cols = Some(text.to_owned()),
            "data" => self.add(text),
            _ if self.named.len() < MOST => self.named.push((part.to_owned(), text.to_owned())),
            _ => {}
        }
    }

    /// Adds numbers to the data of a matrix.
    fn add(&mut self, text: &str) {
        for word in text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
            if self.data.len() == MOST {
                self.long = true;
                return;
            }
            self.data.push(word.to_owned());
        }
    }
}

fn number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Reads the entries of the first level of a file.
pub(super) fn read(text: &str) -> Result<Vec<Entry>> {
    match text.trim_start().chars().next() {
        None => Err(Error::input("the file is empty").help(FORMS)),
        Some('<') => xml(text),
        Some('{') => Err(Error::input("line 1: calibrations in JSON are not read").help(FORMS)),
        Some(_) => yaml(text),
    }
}

fn yaml(text: &str) -> Result<Vec<Entry>> {
    let mut all: Vec<Entry> = Vec::new();
    // Line of a `[` that no `]` has closed yet.
    let mut open: Option<usize> = None;
    for (line, raw) in (1..).zip(text.lines()) {
        let text = raw.split_once(" #").map_or(raw, |(text, _)| text).trim_end();
        let plain = text.trim_start();
        if open.is_some() {
            let (inside, closed) = plain.split_once(']').map_or((plain, false), |(inside, _)| (inside, true));
            if let Some(entry) = all.last_mut() {
                entry.add(inside);
            }
            if closed {
                open = None;
            }
            continue;
        }
        if plain.is_empty() || ["%", "---", "...", "#"].iter().any(|mark| plain.starts_with(mark)) {
            continue;
        }
        let first = plain.len() == text.len();
        // Items of lists belong to keys that are passed over.
        if plain.starts_with('-') && !first {
            continue;
        }
        let Some((key, value)) = plain.split_once(':') else {
            if first {
                return Err(Error::input(format!("line {line} is not `key: value`")).help(FORMS));
            }
            continue;
        };
        let (key, value) = (key.trim().trim_matches('"'), value.trim());
        let value = value.split_once("!!opencv-matrix").map_or(value, |(_, after)| after.trim());
        if first {
            all.push(Entry::new(key, line));
        }
        let Some(entry) = all.last_mut() else { continue };
        let part = if first { "data" } else { key };
        match value.strip_prefix('[') {
            Some(list) => {
                let (inside, closed) = list.split_once(']').map_or((list, false), |(inside, _)| (inside, true));
                entry.set(part, inside);
                open = (!closed).then_some(line);
            }
            None if first => value.trim_matches('"').clone_into(&mut entry.text),
            None => entry.set(part, value),
        }
    }
    match open {
        Some(line) => {
            Err(Error::input(format!("line {line}: the list has no `]`")).help("the file was cut: write it again"))
        }
        None => Ok(all),
    }
}

fn xml(text: &str) -> Result<Vec<Entry>> {
    let mut all: Vec<Entry> = Vec::new();
    let mut within: Vec<&str> = Vec::new();
    let mut line = 1;
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('<') {
        match (within.as_slice(), all.last_mut()) {
            ([_, _], Some(entry)) => entry.text.push_str(before.trim()),
            ([_, _, part], Some(entry)) => entry.set(part, before.trim()),
            _ => {}
        }
        line += before.matches('\n').count();
        let end = if after.starts_with("!--") { "-->" } else { ">" };
        let Some((tag, next)) = after.split_once(end) else {
            return Err(Error::input(format!("line {line}: a tag has no `>`")).help("the file was cut: write it again"));
        };
        if let Some(name) = tag.strip_prefix('/') {
            if within.pop() != Some(name.trim()) {
                return Err(Error::input(format!("line {line}: </{name}> closes no tag")).help(FORMS));
            }
        } else if !tag.starts_with(['!', '?']) && !tag.ends_with('/') {
            let name = tag.split_whitespace().next().unwrap_or_default();
            if within.len() == 1 {
                all.push(Entry::new(name, line));
            }
            within.push(name);
        }
        line += tag.matches('\n').count();
        rest = next;
    }
    match within.last() {
        Some(name) => {
            Err(Error::input(format!("line {line}: <{name}> is not closed")).help("the file was cut: write it again"))
        }
        None => Ok(all),
    }
}
