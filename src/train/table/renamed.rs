//! Fields of experiment files that have another name since version 0.1: both are read, for one more version.

use crate::ron_file::RonFile;
use crate::train::fit::class_weights::ClassWeights;
use crate::train::fit::settings;

/// Fields besides those of the hyper-parameters: old, then new.
const FIELDS: [(&str, &str); 3] = [("learn", "hyperparameters"), ("watch", "validation"), ("margin_px", "dilate_px")];

/// The old name of a field, where it had another.
pub(super) fn old_name(field: &str) -> Option<&'static str> {
    let all = FIELDS.iter().chain(&settings::RENAMED);
    all.into_iter().find(|(_, new)| *new == field).map(|(old, _)| *old)
}

/// Warnings about the old names that an experiment file uses, each once, with its first line and the new name.
///
/// ```
/// use furrow::{ron_file::RonFile, train::table::renamed};
/// let page = RonFile::of("Experiment(\n    learn: (balance: \"fading\"), // watch: []\n)");
/// let warnings = renamed(&page);
/// assert!(warnings[0].starts_with("page.ron:2: `learn` is called `hyperparameters` now"));
/// assert_eq!(warnings.len(), 3);
/// ```
pub fn renamed(page: &RonFile) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut warn = |line: usize, old: &str, new: &str| {
        let place = format!("{}:{line}", page.path.display());
        warnings.push(format!("{place}: `{old}` is called `{new}` now; the next version reads only that"));
    };
    let mut seen: Vec<&str> = Vec::new();
    let mut field = "";
    for Token { line, text, kind } in tokens(&page.text) {
        let known = match kind {
            Kind::Field => {
                field = text;
                FIELDS.iter().chain(&settings::RENAMED).find(|(old, _)| *old == text)
            }
            Kind::Text if ["balance", "class_weights"].contains(&field) => {
                ClassWeights::RENAMED.iter().find(|(old, _)| *old == text)
            }
            Kind::Text => None,
        };
        if let Some((old, new)) = known
            && !seen.contains(old)
        {
            seen.push(old);
            warn(line, old, new);
        }
    }
    warnings
}

/// What a token of an experiment file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A name before a colon.
    Field,
    /// Text in quotes.
    Text,
}

/// A name or a text, with its line from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Token<'a> {
    line: usize,
    text: &'a str,
    kind: Kind,
}

/// Fields and texts in their order, without comments.
fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let line = 1 + text[..at].matches('\n').count();
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        at += if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if c == '"' {
            let end = rest[1..].find('"').map_or(rest.len(), |end| end + 1);
            tokens.push(Token { line, text: &rest[1..end.max(1)], kind: Kind::Text });
            (end + 1).min(rest.len())
        } else if is_name(c) {
            let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
            if rest[end..].trim_start().starts_with(':') {
                tokens.push(Token { line, text: &rest[..end], kind: Kind::Field });
            }
            end
        } else {
            c.len_utf8()
        };
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_are_found_where_they_are_fields_and_nowhere_else() {
        let found = |text: &str| renamed(&RonFile::of(text));
        let text = "Experiment(\n /* rare: 1 */ hyperparameters: (rare_crops: 0.5, class_weights: \"sqrt\"),\n sets: {\"watch\": Real(about: \"window: 3\")})";
        assert_eq!(found(text), Vec::<String>::new());
        let old =
            found("Experiment(\n learn: (window: (64, 48), rare: 0.5,\n balance: \"root\"), train: [(watch: [])])");
        let expected = ["learn", "window", "rare", "balance", "root", "watch"];
        assert_eq!(old.len(), expected.len(), "{old:?}");
        assert!(
            old.iter().zip(expected).all(|(words, name)| words.contains(&format!("`{name}` is called"))),
            "{old:?}"
        );
        assert!(old[3].starts_with("page.ron:3: ") && old[3].contains("`class_weights` now"), "{old:?}");
        assert_eq!((old_name("crop_size"), old_name("steps")), (Some("window"), None));
    }
}
