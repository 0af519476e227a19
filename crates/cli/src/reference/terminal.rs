//! Text output of `explain`: the tree of all paths, a section, or one field.

use super::markdown::takes;
use super::section::{Entry, Section};
use super::walk::{Reference, joined};
use std::fmt::Write;

impl Reference {
    /// Returns every path, one per line, with the first sentence of its description.
    pub fn tree(&self) -> String {
        let mut out = String::new();
        self.branch(&mut out, self.sections.first(), 0, &mut Vec::new());
        out
    }

    fn branch<'a>(&'a self, out: &mut String, section: Option<&'a Section>, depth: usize, above: &mut Vec<&'a str>) {
        let Some(section) = section.filter(|section| !above.contains(&section.path.as_str())) else { return };
        above.push(&section.path);
        for entry in &section.entries {
            let label = format!("{:indent$}{}", "", entry.name, indent = 2 * depth);
            let _ = writeln!(out, "{label:<34} {}", sentence(&entry.words));
            // A type that occurs at several paths is expanded only at the first.
            let own = entry.section.as_deref().filter(|path| *path == joined(&section.path, &entry.name));
            self.branch(out, own.and_then(|path| self.section(path)), depth + 1, above);
        }
        above.pop();
    }

    /// Returns the text of a section, or of one entry of it.
    pub fn explain(&self, section: &Section, entry: Option<&Entry>) -> String {
        let path = entry.map_or(section.path.clone(), |e| joined(&section.path, &e.name));
        let title = if path.is_empty() { format!("{} (…)", self.opening) } else { path };
        let words = entry.map_or_else(|| whole(section), one);
        format!("{title}\n{words}")
    }
}

/// Returns the text of one field or variant.
fn one(entry: &Entry) -> String {
    let mut out = format!("{}\n\n", entry.words);
    if !entry.kind.is_empty() {
        let _ = writeln!(out, "  takes    {}", takes(entry));
    }
    match &entry.default {
        None => out.push_str("  default  none: it must be given\n"),
        Some(value) if !value.is_empty() => {
            let _ = writeln!(out, "  default  {value}");
        }
        Some(_) => {}
    }
    let _ = writeln!(out, "  example  {}", entry.example);
    out
}

/// Returns the text of a section with all its fields or variants.
fn whole(section: &Section) -> String {
    let mut out = if section.words.is_empty() { String::new() } else { format!("{}\n", section.words) };
    for entry in &section.entries {
        let _ = write!(out, "\n  {}\n", entry.name);
        if !entry.words.is_empty() {
            let _ = writeln!(out, "      {}", entry.words.replace("\n\n", " "));
        }
        let default = match &entry.default {
            None => "; required".to_owned(),
            Some(value) if !value.is_empty() => format!("; default {value}"),
            Some(_) => String::new(),
        };
        if entry.variant {
            let _ = writeln!(out, "      example: {}", entry.example);
        } else {
            let _ = writeln!(out, "      {}{default}", takes(entry));
        }
    }
    out
}

/// Returns the first sentence, or its part before a colon.
fn sentence(words: &str) -> &str {
    let end = words.find(". ").or_else(|| words.find(".\n")).map_or(words.len(), |i| i + 1);
    let end = words.find(": ").filter(|i| *i < end).unwrap_or(end);
    words[..end].trim_end_matches(['.', ':'])
}
