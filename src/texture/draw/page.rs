//! Reads a recipe, with errors at their place.

use super::Recipe;
use crate::error::{Error, PageError, Result};
use crate::sampling::vary::{Fault, offset_of};
use std::path::Path;

/// Reads a recipe from a page.
pub fn read(path: &Path) -> Result<Recipe> {
    let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
    // `Leaf(size: …)`, `notch: 0.05`: a page needs neither doubled parentheses nor `Some`.
    let options = ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::UNWRAP_VARIANT_NEWTYPES)
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&text).map_err(|e| {
        let end = offset_of(&text, e.span.end.line, e.span.end.col);
        let (start, end, message) = match Fault::parse(&e.code.to_string()) {
            // The parser stands behind the value when the value is refused.
            Some(fault) => {
                let value = end.saturating_sub(fault.raw_len);
                (value + fault.start, value + fault.end, fault.message)
            }
            None => (offset_of(&text, e.span.start.line, e.span.start.col), end, e.code.to_string()),
        };
        place(path, &text, start, end, message).into()
    })
}

fn place(path: &Path, text: &str, start: usize, end: usize, message: String) -> PageError {
    let before = text.get(..start).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    let line_text = text[line_start..].lines().next().unwrap_or("");
    let column = before[line_start..].chars().count() + 1;
    let marked = text.get(start..end).map_or(1, |t| t.lines().next().unwrap_or("").trim_end().chars().count());
    PageError {
        path: path.to_path_buf(),
        line: before.matches('\n').count() + 1,
        column,
        width: marked.max(1),
        text: line_text.to_owned(),
        message,
        help: String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_number_is_shown_at_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.ron");
        std::fs::write(&path, "Soil(\n    seed: 1, size: 64,\n    period_mm: -5,\n)").unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("x.ron:3:16: -5 is out of range"), "{message}");
        assert!(message.ends_with("^^"), "{message}");
        std::fs::write(&path, "Soil(\n    sead: 1,\n)").unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("x.ron:2:") && message.contains("sead"), "{message}");
        std::fs::write(&path, "Soil(seed: 1").unwrap();
        assert!(matches!(read(&path), Err(Error::Page(_))));
    }
}
