//! The documentation as its readers and the tests see it: pages, code blocks, commands.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The pages whose blocks are run one after another.
pub const RUN: [&str; 6] = [
    "guide/first-picture.md",
    "guide/your-own-field.md",
    "guide/species.md",
    "guide/textures.md",
    "guide/models.md",
    "guide/datasets.md",
];

/// The repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a file, by its path in the repository.
pub fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// All pages of the book, by their paths in the repository, in order; `SUMMARY.md` is none of them.
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
    /// Its language: `sh`, `ron`, `text` …
    pub language: String,
    /// What stands behind the language.
    pub note: String,
    /// Its text.
    pub text: String,
}

/// The fenced code blocks of a page, in order.
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

/// The page without its code blocks, which leave an empty line.
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

/// What stands in backticks in a page's prose.
pub fn quoted(text: &str) -> Vec<String> {
    let prose = prose(text);
    prose.lines().flat_map(|line| line.split('`').skip(1).step_by(2)).map(str::to_owned).collect()
}

/// Targets of the links and pictures of a page, without those that stand in backticks.
pub fn links(text: &str) -> Vec<String> {
    let mut all = Vec::new();
    let plain: Vec<String> =
        prose(text).lines().map(|line| line.split('`').step_by(2).collect::<Vec<_>>().join("·")).collect();
    // A link's words may go over a line's end.
    let mut rest = plain.join("\n");
    while let Some(at) = rest.find("](") {
        rest.drain(..at + 2);
        let end = rest.find(')').expect("a link ends");
        all.push(rest[..end].to_owned());
    }
    all
}

/// Anchors of a page's headings, as GitHub and mdBook make them.
pub fn anchors(text: &str) -> Vec<String> {
    let heading = |line: &str| {
        let words = line.trim_start_matches('#').trim().to_lowercase();
        let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>()
    };
    prose(text).lines().filter(|line| line.starts_with('#')).map(heading).collect()
}

/// The commands of a `sh` block: lines that end in `\` go on in the next.
pub fn commands(block: &Block) -> Vec<String> {
    let joined = block.text.replace("\\\n", " ");
    joined.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect()
}

/// The program that a command begins with, where it is one of ours.
pub fn program(command: &str) -> Option<&'static str> {
    let first = command.split_whitespace().next().unwrap_or_default();
    ["trace", "train"].into_iter().find(|name| first == *name || first == format!("target/release/{name}"))
}

/// Runs a line of shell in a folder, with our programs on the path.
pub fn shell(line: &str, folder: &Path) -> Output {
    let programs = Path::new(env!("CARGO_BIN_EXE_trace")).parent().expect("a folder");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs.to_path_buf()).chain(std::env::split_paths(&path)));
    let mut command = Command::new("sh");
    command.arg("-c").arg(line).current_dir(folder).env("PATH", path.expect("a path"));
    command.output().expect("a shell")
}
