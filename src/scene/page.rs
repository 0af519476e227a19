//! Pages: RON files, read with errors that show their place.

use crate::error::PageError;
use crate::sampling::fault::{Fault, locate, offset_of};
use crate::{Error, Result};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Largest page that is read, bytes: a page is written by hand.
const LARGEST: u64 = 4 << 20;

/// A page's text and where it lies.
#[derive(Clone, Debug)]
pub struct Page {
    /// The file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl Page {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        let size = std::fs::metadata(path).map_err(Error::io(path))?.len();
        if size > LARGEST {
            return Err(Error::Scene(format!("{}: {size} bytes is too large for a page", path.display())));
        }
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let text = String::from_utf8(bytes).map_err(|_| {
            Error::Scene(format!("{}: it is not text (UTF-8), so it is not a RON page", path.display()))
        })?;
        Ok(Self { path: path.into(), text })
    }

    /// A page that lies nowhere, for tests and tools; its paths are relative to the working directory.
    pub fn of(text: &str) -> Self {
        Self { path: "page.ron".into(), text: text.to_owned() }
    }

    /// Reads the page as `T`.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T> {
        use ron::extensions::Extensions;
        let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        options.from_str(&self.text).map_err(|e| self.fault(&locate(&self.text, &e)))
    }

    /// A path written in the page, relative to the page's folder.
    pub fn resolve(&self, path: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }

    /// An error about a text that stands in quotes in the page; about the first line where it stands nowhere.
    pub fn about(&self, literal: &str, message: impl Into<String>, help: impl Into<String>) -> Error {
        let quoted = format!("\"{literal}\"");
        let (start, len) = self.text.find(&quoted).map_or((0, 1), |at| (at, quoted.len()));
        let (message, help) = (message.into(), help.into());
        self.fault(&Fault { raw_len: self.text.len(), start, end: start + len, message, help })
    }

    /// Checks that a file named in the page is there.
    pub fn need_file(&self, path: &str) -> Result<PathBuf> {
        let full = self.resolve(path);
        if full.is_file() {
            return Ok(full);
        }
        let folder = full.parent().unwrap_or(Path::new("")).display().to_string();
        Err(self.about(
            path,
            format!("there is no file `{path}`"),
            format!("paths are relative to the page: looked in {folder}"),
        ))
    }

    fn fault(&self, fault: &Fault) -> Error {
        let text = &self.text;
        let mut start = fault.start.min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        // What is missing at the end of a line is shown there, not on an empty line below.
        if fault.start == fault.end && text[start..].trim().is_empty() {
            start = text.trim_end().len();
        }
        let line = text[..start].matches('\n').count() + 1;
        let line_start = offset_of(text, line, 1);
        let line_text = text[line_start..].lines().next().unwrap_or("");
        let column = text[line_start..start].chars().count() + 1;
        let end = fault.end.clamp(start, line_start + line_text.len()).max(start);
        let width = text.get(start..end).map_or(1, |t| t.trim_end().chars().count()).max(1);
        PageError {
            path: self.path.clone(),
            line,
            column,
            width,
            text: line_text.to_owned(),
            message: fault.message.clone(),
            help: fault.help.clone(),
        }
        .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::vary::{Positive, Vary};
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Sun {
        elevation_deg: Vary<Positive>,
        azimuth_deg: f64,
    }

    fn message(text: &str) -> String {
        Page::of(text).parse::<Sun>().unwrap_err().to_string()
    }

    #[test]
    fn an_unknown_field_is_shown_with_its_place_and_a_way_out() {
        let m = message("Sun(\n  elevation_deg: 45, azimut_deg: 10,\n)");
        assert_eq!(
            m,
            "page.ron:2:22: unknown field `azimut_deg` in Sun\n   2 |   elevation_deg: 45, azimut_deg: 10,\n     |                      ^^^^^^^^^^\n help: did you mean `azimuth_deg`? fields are elevation_deg, azimuth_deg"
        );
    }

    #[test]
    fn an_impossible_value_is_underlined() {
        let m = message("Sun(elevation_deg: Uniform(-3, 2), azimuth_deg: 1)");
        assert!(m.contains("page.ron:1:20: the lower end -3 is out of range"), "{m}");
        assert!(m.contains("^^^^^^^^^^^^^^"), "{m}");
        let m = message("Sun(elevation_deg: Unifrom(1, 2), azimuth_deg: 1)");
        assert!(m.contains("page.ron:1:20") && m.contains("did you mean `Uniform`"), "{m}");
    }
}
