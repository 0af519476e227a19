//! What the README promises: its page parses, its commands are those that are run, its files are there.
//!
//! Rationale: a README is the first program that a newcomer runs. Expected: nothing in it is stale. Source: the README.

use furrow::ron_file::RonFile;
use furrow::scene::desc::FieldDesc;
use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The text of the code blocks of one language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let open = format!("```{language}\n");
    text.split(&open).skip(1).map(|b| b.split("```").next().unwrap_or_default().to_owned()).collect()
}

/// Most words of a paragraph, or of an item of a list, that people read with ease.
const MOST_WORDS: usize = 80;

/// Paragraphs and items of lists, without code blocks, tables, headings and pictures.
fn paragraphs(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect::<Vec<_>>().join("\n\n");
    let mut all = vec![String::new()];
    for line in prose.lines() {
        let skip = line.is_empty() || line == ">" || ["|", "#", "!"].iter().any(|start| line.starts_with(start));
        if skip || line.starts_with("- ") {
            all.push(String::new());
        }
        if let (false, Some(last)) = (skip, all.last_mut()) {
            last.push(' ');
            last.push_str(line);
        }
    }
    all.retain(|paragraph| !paragraph.is_empty());
    all
}

#[test]
fn paragraphs_are_short() {
    for file in ["README.md", "docs/results.md", "docs/glossary.md"] {
        let all = paragraphs(&read(file));
        assert!(!all.is_empty());
        for paragraph in all {
            let words = paragraph.split_whitespace().count();
            assert!(words <= MOST_WORDS, "{file}: a paragraph of {words} words:{paragraph}");
        }
    }
    // The test must be able to fail.
    let long = format!("one\n\n{}\n- an item\n", "word ".repeat(90));
    let words: Vec<usize> = paragraphs(&long).iter().map(|p| p.split_whitespace().count()).collect();
    assert_eq!(words, [1, 90, 3]);
}

/// Expected: who searches README or docs for a standard term of rendering or training finds it.
#[test]
fn standard_terms_are_found() {
    let text = ["README.md", "docs/glossary.md", "docs/results.md"].map(read).join("\n").to_lowercase();
    for term in [
        "russian roulette",
        "loss",
        "training set",
        "validation",
        "normalization",
        "environment map",
        "ambient occlusion",
        "class weights",
        "threshold",
        "oversampling",
        "checksum",
        "prediction",
        "trainer",
    ] {
        assert!(text.contains(term), "nobody finds `{term}`");
    }
}

#[test]
fn the_page_in_the_readme_is_a_page() {
    let pages = blocks(&read("README.md"), "ron");
    assert!(!pages.is_empty());
    for page in pages {
        let page = RonFile { path: "scenes/readme.ron".into(), text: page };
        let desc: FieldDesc = page.parse().unwrap_or_else(|e| panic!("{e}"));
        let species = desc.crops.iter().map(|c| &c.species).chain(desc.weeds.iter().map(|w| &w.species));
        for file in species {
            page.need_file(file).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

#[test]
fn the_test_command_is_the_one_that_is_run() {
    let readme = read("README.md");
    let run = read(".ci/run");
    let command = blocks(&readme, "sh").into_iter().find(|b| b.contains("cargo test")).unwrap();
    assert_eq!(command.trim().lines().count(), 1);
    assert_eq!(run.trim().lines().last().unwrap(), command.trim());
}

#[test]
fn files_that_the_readme_names_are_there() {
    let readme = read("README.md");
    let mut checked = 0;
    for name in readme.split('`').skip(1).step_by(2) {
        let path = Path::new(name);
        let ours =
            ["scenes/", "src/", "tests/", "textures/", ".ci/", "LICENSE", "docs/"].iter().any(|f| name.starts_with(f));
        if ours && !name.contains("/x.rs") && !name.contains("/x.ron") && !name.contains(' ') {
            assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(path).exists(), "README.md names {name}");
            checked += 1;
        }
    }
    assert!(checked > 8, "{checked}");
}
