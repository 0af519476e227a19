//! The documentation pages, their code blocks and their commands, parsed for the tests.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Pages whose code blocks the tests run one after another.
pub const RUN: [&str; 6] = [
    "guide/first-picture.md",
    "guide/your-own-field.md",
    "guide/species.md",
    "guide/textures.md",
    "guide/models.md",
    "guide/datasets.md",
];

/// Root directory of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Reads a text file, given its path in the repository.
pub fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Paths in the repository of all pages of the book except `SUMMARY.md`, sorted.
pub fn pages() -> Vec<String> {
    let mut found = BTreeSet::new();
    collect(&root().join("docs"), &mut found);
    let below = |path: &PathBuf| path.strip_prefix(root()).expect("below").to_str().expect("text").to_owned();
    found.iter().map(below).filter(|path| path != "docs/SUMMARY.md").collect()
}

fn collect(folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|e| e == "md") {
            found.insert(path);
        }
    }
}

/// A fenced code block.
#[derive(Debug)]
pub struct Block {
    /// Language of the block: `sh`, `ron`, `text` …
    pub language: String,
    /// Rest of the info string after the language.
    pub note: String,
    /// Content of the block.
    pub text: String,
}

/// Returns the fenced code blocks of a page, in order.
pub fn blocks(text: &str) -> Vec<Block> {
    let mut all: Vec<Block> = Vec::new();
    let mut within = false;
    for line in text.lines() {
        if let Some(info) = line.strip_prefix("```") {
            if !within {
                let (language, note) = info.split_once(' ').unwrap_or((info, ""));
                all.push(Block { language: language.into(), note: note.trim().into(), text: String::new() });
            }
            within = !within;
        } else if let (true, Some(block)) = (within, all.last_mut()) {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    assert!(!within, "a code block has no end");
    all
}

/// Returns the page without its code blocks; each of their lines becomes an empty line.
pub fn prose(text: &str) -> String {
    let mut within = false;
    let mut kept = String::new();
    for line in text.lines() {
        let fence = line.starts_with("```");
        kept.push_str(if within || fence { "" } else { line });
        kept.push('\n');
        within ^= fence;
    }
    kept
}

/// Returns the inline code spans (text in backticks) of a page's prose.
pub fn quoted(text: &str) -> Vec<String> {
    let prose = prose(text);
    prose.lines().flat_map(|line| line.split('`').skip(1).step_by(2)).map(str::to_owned).collect()
}

/// Returns the targets of a page's links and images, except those inside inline code.
pub fn links(text: &str) -> Vec<String> {
    let mut all = Vec::new();
    let plain: Vec<String> =
        prose(text).lines().map(|line| line.split('`').step_by(2).collect::<Vec<_>>().join("·")).collect();
    // The text of a link may continue on the next line.
    let mut rest = plain.join("\n");
    while let Some(at) = rest.find("](") {
        rest.drain(..at + 2);
        let end = rest.find(')').expect("a link ends");
        all.push(rest[..end].to_owned());
    }
    all
}

/// Returns the anchors of a page's headings, as GitHub and mdBook generate them.
pub fn anchors(text: &str) -> Vec<String> {
    let heading = |line: &str| {
        let words = line.trim_start_matches('#').trim().to_lowercase();
        let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
    };
    prose(text).lines().filter(|line| line.starts_with('#')).map(heading).collect()
}

/// Returns the commands of a `sh` block. A line that ends in `\` continues on the next line.
pub fn commands(block: &Block) -> Vec<String> {
    let joined = block.text.replace("\\\n", " ");
    joined.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect()
}

/// Returns the name of the program a command runs, if it is `trace` or `train`.
pub fn program(command: &str) -> Option<&'static str> {
    let first = command.split_whitespace().next().unwrap_or_default();
    ["trace", "train"].into_iter().find(|name| first == *name || first == format!("target/release/{name}"))
}

/// Runs a shell command line in a folder, with the built programs on `PATH`.
pub fn shell(line: &str, folder: &Path) -> Output {
    let programs = Path::new(env!("CARGO_BIN_EXE_trace")).parent().expect("a folder");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs.to_path_buf()).chain(std::env::split_paths(&path)));
    let mut command = Command::new("sh");
    command.arg("-c").arg(line).current_dir(folder).env("PATH", path.expect("a path"));
    command.output().expect("a shell")
}
