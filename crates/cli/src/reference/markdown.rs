//! Writes a reference as a Markdown page of the documentation.

use super::section::{Entry, Section};
use super::walk::Reference;
use std::fmt::Write;

impl Reference {
    /// Returns the page with all sections. The output is deterministic.
    pub fn markdown(&self, command: &str) -> String {
        let mut page = format!(
            "# {}\n\nThis page is generated from the program's types: `{command} explain {}` shows the same in the terminal.\n",
            self.title, self.root
        );
        page.push_str(
            "A *distribution* is one of `Uniform(a, b)`, `Normal(mean: a, sd: b)`, `LogNormal(median: a, sigma: b)`, `Choice([a, b])` and \
             `Weighted([(a, weight), (b, weight)])`, drawn for every field. Numbers without one are the same in all fields.\n",
        );
        for section in &self.sections {
            self.write(&mut page, section);
        }
        page
    }

    fn write(&self, page: &mut String, section: &Section) {
        let title = if section.path.is_empty() { self.opening } else { &section.path };
        let title = if title.is_empty() { self.root } else { title };
        let _ = write!(page, "\n## {title}\n\n");
        if !section.words.is_empty() {
            let _ = write!(page, "{}\n\n", section.words);
        }
        if !section.also.is_empty() {
            let _ = write!(page, "Also: {}.\n\n", code(&section.also));
        }
        if section.entries.is_empty() {
            return;
        }
        if section.entries[0].variant {
            page.push_str("| variant | meaning | example |\n|---|---|---|\n");
            for entry in &section.entries {
                let _ = writeln!(page, "| {} | {} | `{}` |", name(entry), cell(entry), bars(&entry.example));
            }
            return;
        }
        page.push_str("| field | takes | default | meaning | example |\n|---|---|---|---|---|\n");
        for entry in &section.entries {
            let default = match &entry.default {
                None => "required".into(),
                Some(words) if ["none", "those of its fields"].contains(&words.as_str()) => words.clone(),
                Some(value) => format!("`{}`", bars(value)),
            };
            let (takes, words) = (takes(entry), cell(entry));
            let _ = writeln!(page, "| {} | {takes} | {default} | {words} | `{}` |", name(entry), bars(&entry.example));
        }
    }
}

/// Returns the kind of value that an entry takes, with its range and unit.
pub(super) fn takes(entry: &Entry) -> String {
    let mut all = entry.kind.clone();
    if !entry.range.is_empty() {
        all = format!("{all}, {}", entry.range);
    }
    if !entry.unit.is_empty() {
        all = format!("{all}; {}", entry.unit);
    }
    all
}

/// Returns an entry's name in Markdown, linked to the section that describes it, if there is one.
fn name(entry: &Entry) -> String {
    match &entry.section {
        Some(path) => format!("[`{}`](#{})", entry.name, anchor(path)),
        None => format!("`{}`", entry.name),
    }
}

/// Returns GitHub's anchor of a heading: lower case, without dots.
fn anchor(path: &str) -> String {
    path.to_lowercase().replace('.', "")
}

fn cell(entry: &Entry) -> String {
    bars(&entry.words.replace("\n\n", " "))
}

fn bars(text: &str) -> String {
    text.replace('|', "\\|")
}

fn code(paths: &[String]) -> String {
    paths.iter().map(|path| format!("`{path}`")).collect::<Vec<_>>().join(", ")
}
