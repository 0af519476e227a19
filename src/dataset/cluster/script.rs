//! Templates with names between @ signs, filled in, and words that survive a shell.

use crate::dataset::File;
use crate::{Error, Result};
use std::path::Path;

/// A path as it may stand in a script, comments included.
pub(super) fn plain(path: &Path) -> Result<String> {
    path.to_str().filter(|p| !p.contains(char::is_control)).map(str::to_owned).ok_or_else(|| {
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
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A template with its names filled in.
pub(super) fn fill(path: &str, template: &str, names: &[(&str, String)]) -> File {
    let text = names.iter().fold(template.to_owned(), |text, (name, value)| text.replace(&format!("@{name}@"), value));
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

    #[test]
    fn names_are_what_every_scheduler_takes() {
        assert_eq!(name("/data/Synthetic D"), "furrow-synthetic-d");
        assert_eq!(name("/data/..."), "furrow");
        assert!(name(&"x".repeat(300)).len() < 50);
    }
}
