//! Reads numbers and matrices from files in the format of OpenCV's `FileStorage`, as YAML or XML.
//!
//! The reader takes the keys of the first level: numbers, words, matrices with `rows`, `cols` and `data`, and numbers by
//! name, as in ROS's `roi`. Other values are passed over. YAML without the tag `!!opencv-matrix`, as ROS writes it, is read alike.
//! A parser of all of YAML would refuse what OpenCV writes: its header `%YAML:1.0`, and tabs.

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
    /// Number or word; a map as written; empty for a list.
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
            if self.text.starts_with(['|', '>', '&', '*']) {
                return Err(self.fault("is written with an anchor or as a block of text").help(FORMS));
            }
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
        let Some((_, value)) = self.named.iter().find(|(key, _)| key == name) else {
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

    /// Sets the value of the entry itself: a list of numbers, a map of its parts, or a number or word.
    fn give(&mut self, value: &str) {
        if value.starts_with('[') {
            return self.add(&value.replace(['[', ']'], " "));
        }
        unquoted(value).clone_into(&mut self.text);
        let Some(mut rest) = value.strip_prefix('{').and_then(|map| map.strip_suffix('}')) else { return };
        while let Some((key, after)) = rest.split_once(':') {
            let after = untagged(after);
            // A list may contain commas; it ends at the bracket that closes its first one.
            let mut depth = 0_usize;
            let ends = |(_, c): &(usize, char)| {
                match c {
                    '[' => depth += 1,
                    ']' => depth = depth.saturating_sub(1),
                    _ => {}
                }
                *c == ',' && depth == 0
            };
            let end = after.char_indices().find(ends).map_or(after.len(), |(at, _)| at);
            self.set(unquoted(key.trim_start_matches(',')), unquoted(&after[..end].replace(['[', ']'], " ")));
            rest = after[end..].trim_start_matches(',');
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

/// Reads YAML as OpenCV, ROS and common libraries write it: lists and maps in one line or over several, in any nesting, lists of items
/// `- number`, comments and tags. Anchors and block scalars are not read.
fn yaml(text: &str) -> Result<Vec<Entry>> {
    let mut all: Vec<Entry> = Vec::new();
    // Part of the entry to which items `- …` in the next lines belong.
    let mut items = String::new();
    let mut lines = (1..).zip(text.lines());
    while let Some((line, raw)) = lines.next() {
        let text = without_comment(raw).trim_end();
        let plain = text.trim_start();
        if plain.is_empty() || ["%", "---", "..."].iter().any(|mark| plain.starts_with(mark)) {
            continue;
        }
        if let Some(item) = item(plain) {
            if let Some(entry) = all.last_mut().filter(|_| items == "data") {
                entry.add(&whole(item, line, &mut lines)?.replace(['[', ']'], " "));
            }
            continue;
        }
        if plain.starts_with(['[', '{']) {
            if let Some(entry) = all.last_mut().filter(|_| items == "data") {
                entry.give(&whole(plain, line, &mut lines)?);
            }
            continue;
        }
        let first = plain.len() == text.len();
        let Some((key, value)) = plain.split_once(':') else {
            if first {
                return Err(Error::input(format!("line {line} is not `key: value`")).help(FORMS));
            }
            continue;
        };
        let value = whole(untagged(value), line, &mut lines)?;
        let key = unquoted(key);
        if first {
            all.push(Entry::new(key, line));
        }
        let Some(entry) = all.last_mut() else { continue };
        let part = if first { "data" } else { key };
        part.clone_into(&mut items);
        if first {
            entry.give(&value);
        } else if value.starts_with('[') {
            entry.set(part, &value.replace(['[', ']'], " "));
        } else if !value.is_empty() || part != "data" {
            entry.set(part, unquoted(&value));
        }
    }
    Ok(all)
}

/// Removes a comment: `#` at the start or after white space.
fn without_comment(line: &str) -> &str {
    let starts = |(at, _): &(usize, &str)| *at == 0 || line[..*at].ends_with([' ', '\t']);
    line.match_indices('#').find(starts).map_or(line, |(at, _)| &line[..at])
}

/// Returns the rest of an item of a list, also of a list in a list; `None` for other lines, such as `-1.5`.
fn item(plain: &str) -> Option<&str> {
    let rest = plain.strip_prefix('-').filter(|rest| rest.is_empty() || rest.starts_with([' ', '\t']))?.trim();
    Some(item(rest).unwrap_or(rest))
}

/// Removes a tag such as `!!opencv-matrix`.
fn untagged(value: &str) -> &str {
    let value = value.trim();
    if value.starts_with('!') { value.split_once([' ', '\t']).map_or("", |(_, after)| after.trim()) } else { value }
}

/// Removes white space and quotation marks.
fn unquoted(text: &str) -> &str {
    text.trim().trim_matches(['"', '\''])
}

/// Returns a value with the following lines, if it is a list or a map that they close.
fn whole<'a>(start: &str, line: usize, lines: &mut impl Iterator<Item = (usize, &'a str)>) -> Result<String> {
    let mut value = start.to_owned();
    if !value.starts_with(['[', '{']) {
        return Ok(value);
    }
    let opened = |text: &str| text.matches(['[', '{']).count();
    let closed = |text: &str| text.matches([']', '}']).count();
    let (mut open, mut shut) = (opened(&value), closed(&value));
    while open > shut {
        let Some((_, next)) = lines.next() else {
            let what = format!("line {line}: the list has no `]`, or the map no `}}`");
            return Err(Error::input(what).help("the file was cut: write it again"));
        };
        let next = without_comment(next).trim();
        (open, shut) = (open + opened(next), shut + closed(next));
        value.push(' ');
        value.push_str(next);
    }
    Ok(value)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: YAML writers write the same matrix in many ways. Expected: all are read; what is not read is refused with its reason.
    /// Source: YAML 1.2; files of OpenCV, ROS, Kalibr and Python.
    #[test]
    fn matrices_are_read_as_yaml_writers_write_them() {
        let expected = [8.5, 0.0, 3.0, 0.0, -9e1, 2.0, 0.0, 0.0, 1.0];
        for text in [
            "%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 8.5, 0., 3., 0., -9e1, 2.,\n       0., 0., 1. ]\n",
            "K: {rows: 3, cols: 3, data: [8.5, 0, 3, 0, -90, 2, 0, 0, 1]}  # one line\n",
            "K: !!opencv-matrix {rows: 3, cols: 3, dt: d,\n  data: [8.5, 0, 3, 0, -90, 2, 0, 0, 1]}\n",
            "'K': [[8.5, 0, 3], [0, -90, 2], [0, 0, 1]]\n",
            "K: [[8.5, 0, 3],\n  [0, -90, 2], # the second row\n  [0, 0, 1]]\n",
            "K:\n- [8.5, 0, 3]\n- [0, -90, 2]\n- [0, 0, 1]\n",
            "K:\n- - 8.5\n  - 0\n  - 3\n- - 0\n  - -90\n  - 2\n- - 0\n  - 0\n  - 1\n",
            "K:\n\trows: 3\n\tcols: 3\n\tdata:\n\t- 8.5\n\t- 0\n\t- 3\n\t- 0\n\t- -90\n\t- 2\n\t- 0\n\t- 0\n\t- 1\n",
            "K:\n  {rows: 3, cols: 3, data: [8.5, 0, 3, 0, -90, 2, 0, 0, 1]}\n",
            "K:\n  data:\n    [8.5, 0, 3, 0, -90, 2, 0, 0, 1]\n  rows: 3\n",
        ] {
            let all = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert_eq!((all.len(), all[0].key.as_str()), (1, "K"), "{text}");
            assert_eq!(all[0].matrix().unwrap_or_else(|e| panic!("{text}: {e}")), expected, "{text}");
        }
        for (text, words) in [
            ("K: {rows: 3, cols: 3, data: [1, 2]}\n", "2 numbers, not 3 × 3"),
            ("K: [[1, x]]\n", "contains `x`"),
            ("K: *other\n", "anchor"),
            ("K: 3\n", "has no data"),
        ] {
            let error = read(text).unwrap()[0].matrix().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
        assert!(read("K: {data: [1, 2\n").unwrap_err().to_string().contains("has no `]`"));
        assert_eq!(read("roi: {x_offset: 3, y_offset: 4}\n").unwrap()[0].named("y_offset").unwrap(), Some(4.0));
    }
}
