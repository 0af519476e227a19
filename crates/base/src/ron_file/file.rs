//! A RON file: its text, its deserialization, and errors that point into it.

use super::fault::{Fault, NAME_EXPECTED, locate, plain};
use super::place::{Step, fields_around, lacks, mismatch, offset_of, path_at, place, quoted, too_deep, value_end};
use super::schema::{self, Name};
use super::suggest::nearest;
use crate::error::{Kind, Place, Span};
use crate::input::{self, Refusal};
use crate::{Error, Result};
use ron::error::SpannedError;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Maximum file size in bytes. Such files are written by hand.
const LARGEST: u64 = 4 << 20;

/// Longest value in bytes that is underlined as a whole.
const MOST_UNDERLINED: usize = 48;

/// Largest number of brackets around a value. The parser's own limit does not count the brackets of `Some`.
const MOST_NESTED: usize = 100;

/// Text and path of a RON file.
#[derive(Clone, Debug)]
pub struct RonFile {
    /// The file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl RonFile {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_as(path, ".ron")
    }

    /// Like [`Self::read`] for other text files, such as a CSV table named in a RON file. `ending` is the file
    /// extension shown in errors.
    pub fn read_as(path: &Path, ending: &str) -> Result<Self> {
        let refuse = |what: &str, help: &str| Err(Error::input(what).help(help).in_file(path));
        let bytes = match input::read(path, LARGEST) {
            Ok(bytes) => bytes,
            Err(Refusal::Folder) => {
                return refuse("this is a folder", &format!("name a file in it that ends in {ending}"));
            }
            Err(Refusal::NotRegular) => {
                return refuse(
                    "this is a pipe, a socket or a device, not a file",
                    &format!("write the text to a file that ends in {ending}, and name that"),
                );
            }
            Err(Refusal::TooLarge(_)) => {
                let help = format!("such files are text of at most 4 MiB that ends in {ending}");
                return refuse("this file is too large", &help);
            }
            Err(other) => return Err(other.into_error(path)),
        };
        if let Some(encoding) = input::wide(&bytes) {
            return refuse(&format!("this is {encoding} text, not UTF-8"), "save the file as UTF-8");
        }
        // Some editors write a byte order mark at the start of a file.
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        if bytes.contains(&0) {
            return refuse("this is not a text file", &format!("name a text file that ends in {ending}"));
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Self { path: path.into(), text: text.to_owned() }),
            Err(e) => {
                let at = e.valid_up_to();
                let file = Self { path: path.into(), text: String::from_utf8_lossy(bytes).into_owned() };
                let message = format!("byte {:#04x} is not UTF-8 text", bytes[at]);
                let help = "save the file as UTF-8".to_owned();
                Err(file.fault(&Fault { raw_len: file.text.len(), start: at, end: at + 1, message, help }))
            }
        }
    }

    /// Wraps a text that is not on disk, for tests and tools. Its paths are relative to the working directory.
    pub fn of(text: &str) -> Self {
        Self { path: "page.ron".into(), text: text.to_owned() }
    }

    /// Checks only that the text is valid RON, not what it contains.
    pub fn check_syntax(&self) -> Result<()> {
        self.parse::<Box<ron::value::RawValue>>().map(drop)
    }

    /// Returns `true` if the text is one value, without anything before or behind it.
    pub(super) fn is_value(&self) -> bool {
        value_end(&self.text, 0) == self.text.len() && mismatch(&self.text).is_none() && self.check_syntax().is_ok()
    }

    /// Builds an error about a byte range of the text.
    pub fn about_bytes(
        &self,
        at: std::ops::Range<usize>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        let (message, help) = (message.into(), help.into());
        self.fault(&Fault { raw_len: self.text.len(), start: at.start, end: at.end, message, help }).lasting()
    }

    /// Deserializes the text as `T`.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        if self.text.trim().is_empty() {
            let help = "a file starts with a name and a bracket, such as `Field(` in scenes/field.ron".to_owned();
            return Err(self
                .fault(&Fault { raw_len: 0, start: 0, end: 0, message: "this file is empty".to_owned(), help })
                .lasting());
        }
        self.check_depth()?;
        options().from_str(&self.text).map_err(|e| self.refused(&e, |_, _| Vec::new(), |path| (path.len(), Vec::new())))
    }

    /// Like [`Self::parse`] for types with a schema: all fields missing from one struct are reported at once.
    pub fn parse_all<T: DeserializeOwned + JsonSchema>(&self) -> Result<T> {
        if self.text.trim().is_empty() {
            return self.parse();
        }
        self.check_depth()?;
        options().from_str(&self.text).map_err(|e| self.refused(&e, schema::required::<T>, schema::known::<T>))
    }

    /// Returns an error if brackets are nested so deeply that parsing them, or explaining what is wrong, takes long.
    fn check_depth(&self) -> Result<()> {
        let Some(at) = too_deep(&self.text, MOST_NESTED) else { return Ok(()) };
        let error = Error::input("brackets are nested too deeply").help("no file needs a hundred of them");
        Err(error.at(self.place_of(at, at + 1)).lasting())
    }

    /// Converts a parser error. `required` returns the required fields of a struct, given its name and a missing field.
    /// `known` returns how many steps of a path exist, and the names allowed at its end.
    fn refused(
        &self,
        error: &SpannedError,
        required: impl Fn(&str, &str) -> Vec<String>,
        known: impl Fn(&[&str]) -> (usize, Vec<Name>),
    ) -> Error {
        let fault = locate(&self.text, error);
        let path = path_at(&self.text, fault.start);
        let (depth, names) = known(&path);
        let exists = |error: Error| error.see(more(&path[..depth]));
        let help = decimal_comma(&self.text, &fault, &known).or_else(|| named_value(&self.text, &fault, &names));
        let fault = Fault { help: help.unwrap_or(fault.help.clone()), ..fault };
        let fault = unopened(&self.text, error).unwrap_or(fault);
        let ron::Error::MissingStructField { field, outer: Some(outer) } = &error.code else {
            return exists(self.fault(&fault).lasting());
        };
        let there = fields_around(&self.text, fault.start);
        let mut missing = required(outer, field);
        missing.retain(|name| !there.contains(&name.as_str()));
        if missing.len() < 2 {
            return exists(self.fault(&fault).lasting());
        }
        let list = |each: fn(&String) -> String| missing.iter().map(each).collect::<Vec<_>>().join(", ");
        let message = format!("fields {} of {} are missing", list(|name| format!("`{name}`")), plain(outer));
        let help = format!("add `{}` before this bracket closes", list(|name| format!("{name}: …")));
        exists(self.fault(&Fault { message, help, ..fault }).lasting())
    }

    /// Serializes `value` as the text of a RON file.
    pub fn print<T: Serialize>(value: &T) -> Result<String> {
        let pretty = ron::ser::PrettyConfig::new().struct_names(true).compact_arrays(true);
        options()
            .to_string_pretty(value, pretty)
            .map_err(|e| Error::failed(format!("this cannot be written as RON: {e}")))
    }

    /// Resolves a path written in the file, relative to the file's folder.
    pub fn resolve(&self, path: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// Builds an error about a quoted string of the file, outside comments; about the first line if the string does not
    /// occur.
    pub fn about(&self, literal: &str, message: impl Into<String>, help: impl Into<String>) -> Error {
        let found =
            quoted(&self.text).into_iter().find(|at| unquoted(&self.text[at.clone()]).as_deref() == Some(literal));
        let at = found.unwrap_or(0..1);
        let (message, help) = (message.into(), help.into());
        self.fault(&Fault { raw_len: self.text.len(), start: at.start, end: at.end, message, help }).lasting()
    }

    /// Replaces quoted strings outside comments. `with` receives the content of each string and returns its
    /// replacement, or `None` to keep it. Returns `None` if nothing changed.
    pub fn replace_quoted(&self, mut with: impl FnMut(&str) -> Option<String>) -> Option<String> {
        let mut text = self.text.clone();
        // From the end, so that earlier byte offsets stay valid.
        for at in quoted(&self.text).into_iter().rev() {
            if let Some(new) = unquoted(&self.text[at.clone()]).and_then(|old| with(&old)) {
                text.replace_range(at, &ron::ser::to_string(&new).unwrap_or_else(|_| format!("{new:?}")));
            }
        }
        (text != self.text).then_some(text)
    }

    /// Inserts a default explicitly: adds `field: value` (`value` is RON) to the value of the file's field `parent`.
    /// Returns `None` if `parent` is missing or already has such a field.
    pub fn written_out(&self, parent: &str, field: &str, value: &str) -> Option<String> {
        let at = lacks(&self.text, parent, field)?;
        let (before, after) = self.text.split_at(at);
        Some(format!("{before}{field}: {value}, {after}"))
    }

    /// Locates an error at the value that `path` leads to. Only input errors without a place are changed; all others
    /// are returned as they are.
    pub fn blame(&self, path: &[Step<'_>], error: Error) -> Error {
        if error.kind() != Kind::Input || error.place().is_some() {
            return error;
        }
        let mut at = place(&self.text, path);
        // For a long value underline only its name or opening bracket.
        let value = &self.text[at.clone()];
        if value.len() > MOST_UNDERLINED || value.contains('\n') {
            at.end = at.start + value.find(['(', '[', '{']).map_or(value.len(), |i| i.max(1));
        }
        let (message, help) = (error.message().to_owned(), error.advice().unwrap_or_default().to_owned());
        self.fault(&Fault { raw_len: self.text.len(), start: at.start, end: at.end, message, help })
    }

    /// Checks that a file named in this one exists, and returns its resolved path.
    pub fn need_file(&self, path: &str) -> Result<PathBuf> {
        let full = self.resolve(path);
        if full.is_file() {
            return Ok(full);
        }
        if full.exists() {
            let what = if full.is_dir() { "a folder" } else { "a pipe, a socket or a device" };
            return Err(self.about(path, format!("`{path}` is {what}, not a file"), "name a file"));
        }
        if full.is_symlink() {
            let help = "let the link lead to a file, or name the file itself";
            return Err(self.about(path, format!("`{path}` is a symbolic link that leads to no file"), help));
        }
        let folder = named(full.parent().unwrap_or(Path::new("")));
        let name = full.file_name().unwrap_or_default().to_string_lossy();
        let mut files: Vec<String> = std::fs::read_dir(&folder)
            .map(|entries| entries.filter_map(|e| e.ok()?.file_name().into_string().ok()).collect())
            .unwrap_or_default();
        files.sort();
        let near = nearest(&files, &name).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
        let help =
            format!("{near}a path counts from the folder of the file that names it: looked in {}", folder.display());
        Err(self.about(path, format!("there is no file `{path}`"), help))
    }

    fn fault(&self, fault: &Fault) -> Error {
        let place = self.place_of(fault.start, fault.end);
        let located = Error::input(fault.message.as_str()).help(fault.help.as_str()).at(place);
        located.see(more(&path_at(&self.text, fault.start)))
    }

    /// Place of a byte range in the file. If it spans several lines, only the first one is used.
    pub(super) fn place_of(&self, from: usize, to: usize) -> Place {
        let text = &self.text;
        let mut start = from.min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        // A fault at the end of the text is shown after the last character, not on an empty line below.
        if from == to && text[start..].trim().is_empty() {
            start = text.trim_end().len();
        }
        let line = text[..start].matches('\n').count() + 1;
        let line_start = offset_of(text, line, 1);
        let line_text = text[line_start..].lines().next().unwrap_or("");
        let column = text[line_start..start].chars().count() + 1;
        let end = to.clamp(start, line_start + line_text.len()).max(start);
        let width = text.get(start..end).map_or(1, |t| t.trim_end().chars().count()).max(1);
        let span = Some(Span { line, column, width, text: line_text.to_owned() });
        Place { file: self.path.clone(), span }
    }
}

/// Command that explains the fields at a path; `None` for files without reference pages.
fn more(path: &[&str]) -> Option<String> {
    let (root, rest) = path.split_first()?;
    let (program, mut steps) = match *root {
        "Field" => ("trace", Vec::new()),
        "Species" => ("trace", vec!["species"]),
        "Leaf" | "Soil" => ("trace", vec!["texture", root]),
        "Experiment" => ("train", vec!["experiment"]),
        _ => return None,
    };
    steps.extend(rest);
    Some(format!("{program} explain {}", steps.join(".")).trim_end().to_owned())
}

/// Content of a quoted string.
fn unquoted(text: &str) -> Option<String> {
    ron::from_str(text).ok()
}

/// Normalises a folder for display: resolves `..`, and shows an empty path as `.`.
fn named(folder: &Path) -> PathBuf {
    let short = input::tidy(folder);
    if short.as_os_str().is_empty() { ".".into() } else { short }
}

/// Help if the name around a value is missing: `growth: 18`.
fn named_value(text: &str, fault: &Fault, names: &[Name]) -> Option<String> {
    if fault.message != NAME_EXPECTED || names.is_empty() {
        return None;
    }
    let value = text.get(fault.start..fault.end).filter(|value| value.parse::<f64>().is_ok());
    let form = |name: &&Name| value.map(|value| format!("{}({value})", name.name));
    let forms: Vec<String> = names.iter().filter(|name| name.takes_number).filter_map(|name| form(&name)).collect();
    let all = names.iter().map(|name| name.name.as_str()).collect::<Vec<_>>().join(", ");
    let begin = if forms.is_empty() { String::new() } else { format!("write {}; ", forms.join(" or ")) };
    Some(format!("{begin}names that can stand here are {all}"))
}

/// Fault if the brackets after a name are missing: `camera: Phone`.
fn unopened(text: &str, error: &SpannedError) -> Option<Fault> {
    if !matches!(error.code, ron::Error::ExpectedStructLike | ron::Error::ExpectedNamedStructLike(_)) {
        return None;
    }
    let before = text[..offset_of(text, error.span.start.line, error.span.start.col)].trim_end();
    let name = before.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(before);
    name.starts_with(char::is_uppercase).then(|| Fault {
        raw_len: text.len(),
        start: before.len() - name.len(),
        end: before.len(),
        message: format!("{name} has no brackets"),
        help: format!("write {name}(), with the fields that differ from their defaults in the brackets"),
    })
}

/// Help for a decimal comma (0,85) where a single number is expected. The comma ends the number, which then is out of
/// range or is followed by something that is not a field.
fn decimal_comma(text: &str, fault: &Fault, known: impl Fn(&[&str]) -> (usize, Vec<Name>)) -> Option<String> {
    let is_number = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit());
    let (before, at, after) = (text.get(..fault.start)?, text.get(fault.start..fault.end)?, text.get(fault.end..)?);
    if !is_number(at) {
        return None;
    }
    let digit = |c: char| c.is_ascii_digit();
    let (begin, whole, part) = match (before.strip_suffix(','), after.strip_prefix(',')) {
        (_, Some(rest)) if rest.starts_with(digit) => {
            (before.len(), at, &rest[..rest.find(|c| !digit(c)).unwrap_or(rest.len())])
        }
        (Some(rest), _) if rest.ends_with(digit) => {
            let whole = rest.rsplit(|c| !digit(c)).next().unwrap_or(rest);
            (rest.len() - whole.len(), whole, at)
        }
        _ => return None,
    };
    one_belongs(text, begin, known).then(|| format!("decimals are written with a point: {whole}.{part}"))
}

/// Returns `true` if the number starting at byte `begin` is a single value: after the colon of a field, or alone in the
/// brackets of a name that takes one number. Elsewhere it is one of several.
fn one_belongs(text: &str, begin: usize, known: impl Fn(&[&str]) -> (usize, Vec<Name>)) -> bool {
    let before = text[..begin].trim_end_matches(['-', '+']).trim_end();
    let Some(name) = before.strip_suffix('(') else { return before.ends_with(':') };
    let path = path_at(text, begin);
    let Some((last, around)) = path.split_last() else { return false };
    name.trim_end().ends_with(last) && known(around).1.iter().any(|name| name.name == *last && name.takes_number)
}

/// RON extensions that allow `notch: 0.05` without `Some` and `Leaf(size: …)` without doubled brackets.
fn options() -> ron::Options {
    use ron::extensions::Extensions;
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME | Extensions::UNWRAP_VARIANT_NEWTYPES)
}

#[cfg(test)]
mod tests {
    use super::super::{bound::Positive, vary::Vary};
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Sun {
        elevation_deg: Vary<Positive<1000>>,
        azimuth_deg: f64,
    }

    fn message(text: &str) -> String {
        RonFile::of(text).parse::<Sun>().unwrap_err().to_string()
    }

    #[test]
    fn an_unknown_field_is_shown_with_its_place_and_a_way_out() {
        let m = message("Sun(\n  elevation_deg: 45, azimut_deg: 10,\n)");
        assert_eq!(
            m,
            "page.ron:2:22: unknown field `azimut_deg` in Sun\n   2 |   elevation_deg: 45, azimut_deg: 10,\n     |                      ^^^^^^^^^^\n help: did you mean `azimuth_deg`? fields are elevation_deg, azimuth_deg"
        );
        let m = RonFile::of("Field(soil: (clods: (max_mm: -1)))").parse::<Sun>().unwrap_err().to_string();
        assert!(!m.contains("see:") || m.contains("trace explain"), "{m}");
    }

    /// Rationale: `Some(` escapes the parser's limit, and a file of a megabyte took 12 s. Expected: the bracket beyond the
    /// limit is refused, whatever encloses it; a hundred brackets are read.
    #[test]
    fn deep_brackets_are_refused() {
        for open in ["Some(", "(", "[", "{", "Uniform(", "/* ( */ \"(\", ("] {
            let text = format!("Sun(azimuth_deg: {}", open.repeat(200_000));
            assert!(message(&text).contains("brackets are nested too deeply"), "{open}");
        }
        let deep = |n: usize| format!("{}1{}", "Some(".repeat(n), ")".repeat(n));
        assert!(RonFile::of(&deep(100)).check_syntax().is_ok());
        assert!(
            RonFile::of(&deep(101)).check_syntax().unwrap_err().to_string().starts_with("page.ron:1:505: brackets")
        );
    }

    #[test]
    fn an_impossible_value_is_underlined() {
        let m = message("Sun(elevation_deg: Uniform(-3, 2), azimuth_deg: 1)");
        assert!(m.contains("page.ron:1:28: the lower end -3 is out of range"), "{m}");
        assert!(m.contains(" ^^\n") || m.ends_with(" ^^"), "{m}");
        let m = message("Sun(elevation_deg: Unifrom(1, 2), azimuth_deg: 1)");
        assert!(m.contains("page.ron:1:20") && m.contains("did you mean `Uniform`"), "{m}");
    }

    /// Rationale: `0,85` is one number to users with a decimal comma, and two numbers to everybody else. Expected: the
    /// help suggests a decimal point where a single number is expected, after a colon or alone in a name's brackets,
    /// but not in a pair, a list or a distribution of two numbers.
    #[test]
    fn a_decimal_comma_is_reported_where_one_number_belongs() {
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[allow(dead_code)]
        struct Sheet {
            side: Option<Vary<Positive<1000>>>,
            size: Option<(Vary<Positive<1000>>, Vary<Positive<1000>>)>,
            all: Option<Vec<Vary<Positive<1000>>>>,
            step: Option<Pace>,
        }
        #[derive(Debug, Deserialize, JsonSchema)]
        #[allow(dead_code)]
        enum Pace {
            Even(Vary<Positive<1000>>),
            Each(Vec<Vary<Positive<1000>>>),
            Both(Vary<Positive<1000>>, Vary<Positive<1000>>),
        }
        let stated = |text: &str| RonFile::of(text).parse_all::<Sheet>().unwrap_err().to_string();
        for (text, words) in [
            ("Sheet(side: 0,85)", "decimals are written with a point: 0.85"),
            ("Sheet(side: 3,85)", "decimals are written with a point: 3.85"),
        ] {
            assert!(stated(text).contains(words), "{}", stated(text));
        }
        for text in [
            "Sheet(size: (0,0))",
            "Sheet(size: (64,0))",
            "Sheet(all: [0,5])",
            "Sheet(side: Uniform(0,5))",
            "Sheet(side: Choice([0,5]))",
            "Sheet(step: Each([0,5]))",
            "Sheet(step: Both(0,5))",
        ] {
            let words = stated(text);
            assert!(words.contains("out of range") && !words.contains("with a point"), "{words}");
        }
    }

    #[test]
    fn characters_of_several_bytes_stand_before_what_is_wrong() {
        for text in
            ["//\u{fffd}", "é", "Ｆé", "(a: é0,5)", "Sun(elevation_deg: é,5)", "Sun(azimuth_deg: é3.5.5)", "éSun"]
        {
            assert!(message(text).contains("page.ron:1:"), "{text}");
        }
    }

    #[test]
    fn a_quoted_text_is_shown_where_it_counts_not_in_a_comment() {
        let file =
            RonFile::of("Sun( // \"a.png\" once stood here\n  key: \"not a.png\", /* \"a.png\" */ file: \"a.png\",\n)");
        let m = file.about("a.png", "there is none", "").to_string();
        assert!(m.starts_with("page.ron:2:41: there is none"), "{m}");
        assert!(file.about("b.png", "x", "").to_string().starts_with("page.ron:1:1: x"));
    }

    #[test]
    fn quoted_texts_are_replaced_and_nothing_else() {
        let file = RonFile::of(r##"(a: "x", /* "x" */ b: r#"x"#, c: "y\"", d: "xx")"##);
        let new = file.replace_quoted(|old| (old == "x").then(|| "a \"b\" \\".to_owned())).unwrap();
        assert_eq!(new, r#"(a: "a \"b\" \\", /* "x" */ b: "a \"b\" \\", c: "y\"", d: "xx")"#);
        assert_eq!(file.replace_quoted(|_| None), None);
    }
}
