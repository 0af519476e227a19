//! Filling of templates with names between @ signs, and quoting for the shell.

use crate::File;
use furrow_base::{Error, Result};
use std::path::Path;

/// Returns a path for use in a script, including its comments; an error if it has control characters or is not UTF-8.
pub(super) fn plain(path: &Path) -> Result<String> {
    // YAML has two more line breaks, U+2028 and U+2029.
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    path.to_str().filter(|p| !p.contains(breaks)).map(str::to_owned).ok_or_else(|| {
        Error::misuse("this path cannot be written into a script")
            .in_file(path)
            .help("use a folder whose name has no control characters and is UTF-8")
    })
}

/// Returns the name of a dataset's jobs: `furrow-` and up to 40 characters of the folder's name, as lower-case letters,
/// digits and hyphens.
pub(super) fn name(dir: &str) -> String {
    let last = dir.rsplit('/').next().unwrap_or_default().to_lowercase();
    let plain: String = last.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let plain = plain.trim_matches('-');
    if plain.is_empty() { "furrow".into() } else { format!("furrow-{plain}") }
}

/// Quotes a string so that the shell reads it as one word and expands `$NAME` and `${NAME}` in it; everything else is
/// literal. The script fails if a variable is empty or not set.
pub(super) fn expanded(word: &str) -> String {
    let mut out = String::from("\"");
    let mut rest = word;
    while let Some(c) = rest.chars().next() {
        rest = &rest[c.len_utf8()..];
        if c == '$'
            && let Some((name, after)) = variable(rest)
        {
            out.extend(["${", name, ":?}"]);
            rest = after;
            continue;
        }
        if matches!(c, '"' | '\\' | '$' | '`') {
            out.push('\\');
        }
        out.push(c);
    }
    out + "\""
}

/// Splits text that starts with a variable's name, with or without braces, into the name and the rest.
fn variable(text: &str) -> Option<(&str, &str)> {
    let is_name = |name: &str| {
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        plain && !name.is_empty() && !name.starts_with(|c: char| c.is_ascii_digit())
    };
    let parts = match text.strip_prefix('{') {
        Some(braced) => braced.split_once('}')?,
        None => text.split_at(text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len())),
    };
    is_name(parts.0).then_some(parts)
}

/// Fills the names of a template in a single pass; names between @ signs in the values are not replaced.
pub(super) fn fill(path: &str, template: &str, names: &[(&str, String)]) -> File {
    let mut text = String::with_capacity(2 * template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('@') {
        text.push_str(before);
        let value = after.split_once('@').and_then(|(name, after)| {
            let (_, value) = names.iter().find(|(known, _)| *known == name)?;
            Some((value, after))
        });
        rest = if let Some((value, after)) = value {
            text.push_str(value);
            after
        } else {
            text.push('@');
            after
        };
    }
    text.push_str(rest);
    File { path: path.into(), bytes: text.into_bytes() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: variables are expanded, including values with spaces and adjacent text; all other shell syntax is
    /// literal.
    #[test]
    fn variables_are_the_shells_and_nothing_else() {
        let message = |word: &str| {
            let words = format!("printf %s {}", expanded(word));
            let mut shell = std::process::Command::new("sh");
            let message = shell.arg("-c").arg(words).env("A_1", "x y").env_remove("NONE").output().unwrap();
            (message.status.success(), String::from_utf8(message.stdout).unwrap())
        };
        for (word, expected) in [
            ("$A_1/furrow", "x y/furrow"),
            ("/s/${A_1}b", "/s/x yb"),
            ("$(rm) `y` \"z\" \\ it's * $", "$(rm) `y` \"z\" \\ it's * $"),
            ("${A_1%x} $1 ${} @A@", "${A_1%x} $1 ${} @A@"),
        ] {
            assert_eq!(message(word), (true, expected.to_owned()), "{word}");
        }
        assert_eq!(message("$NONE/furrow"), (false, String::new()));
    }

    #[test]
    fn templates_are_filled_in_one_pass() {
        let names = [("A", "@B@".to_owned()), ("B", "it's".to_owned())];
        let filled = fill("x", "@A@ @B@ a@b.c @C@B@ @", &names);
        assert_eq!(String::from_utf8(filled.bytes).unwrap(), "@B@ it's a@b.c @Cit's @");
    }

    #[test]
    fn names_are_what_every_scheduler_takes() {
        assert_eq!(name("/data/Synthetic D"), "furrow-synthetic-d");
        assert_eq!(name("/data/..."), "furrow");
        assert!(name(&"x".repeat(300)).len() < 50);
    }
}
