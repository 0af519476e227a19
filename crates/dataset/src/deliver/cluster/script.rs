//! Templates with names between @ signs, filled in, and words that survive a shell.

use crate::File;
use furrow_base::{Error, Result};
use std::path::Path;

/// A path as it may stand in a script, comments included.
pub(super) fn plain(path: &Path) -> Result<String> {
    // YAML knows two more ends of a line.
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    path.to_str().filter(|p| !p.contains(breaks)).map(str::to_owned).ok_or_else(|| {
        Error::misuse("this path cannot be written into a script")
            .in_file(path)
            .help("use a folder whose name has no control characters and is UTF-8")
    })
}

/// What the files of a dataset are called by: its folder's name in lower-case letters, digits and hyphens, at most 40 of them.
pub(super) fn name(dir: &str) -> String {
    let last = dir.rsplit('/').next().unwrap_or_default().to_lowercase();
    let plain: String = last.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let plain = plain.trim_matches('-');
    if plain.is_empty() { "furrow".into() } else { format!("furrow-{plain}") }
}

/// A word of a shell script, whatever it holds.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A word of a shell script in which `$NAME` and `${NAME}` are what these variables hold, and all else stands for itself. The script ends
/// where one of them is empty or not set.
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

/// The variable whose name stands at the beginning, with or without braces, and what follows it.
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

/// A template with its names filled in, in one pass: what is filled in may hold names between @ signs itself.
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

    #[test]
    fn words_survive_a_shell() {
        for word in ["/a/b.c", "it's here", "", "$(rm) \"x\" \\ `y` *", "@x"] {
            let said = std::process::Command::new("sh").arg("-c").arg(format!("printf %s {}", quoted(word))).output();
            assert_eq!(String::from_utf8(said.unwrap().stdout).unwrap(), word);
        }
    }

    /// Expected: variables are filled in, with spaces in them and whatever stands beside; nothing else of the shell's language is read.
    #[test]
    fn variables_are_the_shells_and_nothing_else() {
        let said = |word: &str| {
            let words = format!("printf %s {}", expanded(word));
            let mut shell = std::process::Command::new("sh");
            let said = shell.arg("-c").arg(words).env("A_1", "x y").env_remove("NONE").output().unwrap();
            (said.status.success(), String::from_utf8(said.stdout).unwrap())
        };
        for (word, expected) in [
            ("$A_1/furrow", "x y/furrow"),
            ("/s/${A_1}b", "/s/x yb"),
            ("$(rm) `y` \"z\" \\ it's * $", "$(rm) `y` \"z\" \\ it's * $"),
            ("${A_1%x} $1 ${} @A@", "${A_1%x} $1 ${} @A@"),
        ] {
            assert_eq!(said(word), (true, expected.to_owned()), "{word}");
        }
        assert_eq!(said("$NONE/furrow"), (false, String::new()));
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
