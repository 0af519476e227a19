//! README, CONTRIBUTING and the book in `docs/`: pages parse, links lead somewhere, commands and files exist.
//!
//! Rationale: newcomers start with the commands of the README, and a page that names a removed flag or test misleads.
//! Expected: nothing in them is outdated. Source: the pages; the rules are in CONTRIBUTING.md. `tests/guide.rs` runs
//! the guide.

use crate::common::book::{self, anchors, blocks, commands, links, pages, program, prose, quoted, read, root, shell};
use crate::common::program::SMALL;
use furrow_base::ron_file::RonFile;
use furrow_field::desc::{FieldDesc, ModelDesc};
use furrow_field::horizon::HorizonDesc;
use furrow_field::shipped;
use furrow_grow::soil::SoilDesc;
use furrow_optics::light::LightDesc;
use furrow_optics::sensor::{CameraDesc, LidarDesc, SensorDesc};
use furrow_render::material::LeafDesc;
use std::collections::BTreeSet;

/// Pages that the program generates from its own types and command line; links to them are valid before they exist.
const GENERATED: [&str; 6] = ["scene", "species", "texture", "experiment", "trace", "train"];

/// Returns whether a path is that of a generated page.
fn generated(path: &str) -> bool {
    GENERATED.iter().any(|name| path == format!("docs/reference/{name}.md"))
}

/// Returns whether people wrote a page; the rules for prose do not apply to generated pages.
fn written_by_people(path: &str) -> bool {
    !generated(path)
}

/// Returns the paths of README, CONTRIBUTING and all pages of the book.
fn documents() -> Vec<String> {
    ["README.md", "CONTRIBUTING.md"].map(String::from).into_iter().chain(pages()).collect()
}

/// Maximum number of words in a paragraph or list item.
const MOST_WORDS: usize = 80;

/// Returns paragraphs and list items, without code blocks, tables, headings and images.
fn paragraphs(text: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    for line in prose(text).lines() {
        let skip = line.is_empty() || line == ">" || ["|", "#", "!"].iter().any(|start| line.starts_with(start));
        let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
        let item = line.starts_with("- ") || (number.len() < line.len() && number.starts_with(". "));
        if skip || item {
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
    for file in documents().into_iter().filter(|file| written_by_people(file)) {
        let all = paragraphs(&read(&file));
        assert!(!all.is_empty(), "{file}: no paragraphs");
        for paragraph in all {
            let words = paragraph.split_whitespace().count();
            assert!(words <= MOST_WORDS, "{file}: a paragraph of {words} words:{paragraph}");
        }
    }
    // The check must be able to fail.
    let long = format!("one\n\n{}\n- an item\n1. another\n", "word ".repeat(90));
    let words: Vec<usize> = paragraphs(&long).iter().map(|p| p.split_whitespace().count()).collect();
    assert_eq!(words, [1, 90, 3, 2]);
}

/// Expected: the README is one or two screens long, and its images and those of the guide are small files.
#[test]
fn the_readme_is_short_and_pictures_are_small() {
    assert!(read("README.md").lines().count() <= 80);
    let mut pictures = 0;
    for entry in std::fs::read_dir(root().join("docs/guide/pictures")).unwrap() {
        let entry = entry.unwrap();
        let bytes = entry.metadata().unwrap().len();
        assert!(bytes <= 80 * 1024, "{}: {bytes} bytes", entry.path().display());
        pictures += 1;
    }
    assert!(pictures >= 8, "{pictures}");
}

/// Expected: every figure that `docs/figures/make.py` writes is small and embedded in a page with a description, and the
/// figure of the crates names every crate.
#[test]
fn every_figure_is_embedded_and_that_of_the_crates_is_complete() {
    let mut embedded = Vec::new();
    for page in documents() {
        let text = read(&page);
        assert!(!text.contains("![]("), "{page}: an image without a description");
        let folder = page.rsplit_once('/').map_or("", |(folder, _)| folder);
        embedded.extend(links(&text).iter().filter_map(|link| joined(folder, link)));
    }
    let mut figures = 0;
    for entry in std::fs::read_dir(root().join("docs/figures")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "svg") {
            let name = format!("docs/figures/{}", path.file_name().unwrap().to_str().unwrap());
            let bytes = read(&name).len();
            assert!(bytes <= 12 * 1024, "{name}: {bytes} bytes");
            assert!(embedded.contains(&name), "{name} is in no page");
            figures += 1;
        }
    }
    assert!(figures >= 4, "{figures}");
    let figure = read("docs/figures/crates.svg");
    for entry in std::fs::read_dir(root().join("crates")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(figure.contains(&format!(">furrow-{name}<")), "furrow-{name} is missing: run docs/figures/make.py");
    }
}

/// Expected: every page of the book is in the table of contents once, and every entry is a page.
#[test]
fn every_page_is_in_the_summary() {
    let summary = links(&read("docs/SUMMARY.md"));
    for page in pages() {
        let listed = summary.iter().filter(|link| format!("docs/{link}") == page).count();
        assert_eq!(listed, 1, "{page} is listed {listed} times in docs/SUMMARY.md");
    }
    for link in &summary {
        let path = format!("docs/{link}");
        assert!(root().join(&path).is_file() || generated(&path), "docs/SUMMARY.md lists {link}");
    }
}

/// Resolves `..` in a relative link; the result is relative to the repository, `None` if it leads outside.
fn joined(folder: &str, link: &str) -> Option<String> {
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in link.split('/') {
        match part {
            ".." => {
                parts.pop()?;
            }
            "." | "" => {}
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Returns the fault of a page's link; `None` if it leads somewhere.
fn fault(page: &str, text: &str, link: &str) -> Option<String> {
    if link.contains("://") {
        return None;
    }
    let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
    let folder = page.rsplit_once('/').map_or("", |(folder, _)| folder);
    let to = if path.is_empty() { Some(page.to_owned()) } else { joined(folder, path) };
    let Some(to) = to else { return Some("it leaves the repository".into()) };
    if page.starts_with("docs/") && !to.starts_with("docs/") {
        return Some("it leaves the book".into());
    }
    if !root().join(&to).exists() {
        return (!generated(&to)).then(|| format!("{to} does not exist"));
    }
    if anchor.is_empty() {
        return None;
    }
    let known = anchors(&if path.is_empty() { text.to_owned() } else { read(&to) });
    (!known.iter().any(|a| a == anchor)).then(|| format!("{to} has no heading #{anchor}: {known:?}"))
}

#[test]
fn every_link_leads_somewhere() {
    let mut checked = 0;
    for page in documents().into_iter().chain(["CHANGELOG.md".into(), "docs/SUMMARY.md".into()]) {
        let text = read(&page);
        for link in links(&text) {
            let fault = fault(&page, &text, &link);
            assert!(fault.is_none(), "{page}: the link to {link}: {}", fault.unwrap_or_default());
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
    // The check must be able to fail.
    let page = "# One heading\n\n[a](b.md) [b](guide/lessons.md#8-condition) [c](#one-heading) [d](../README.md) [e](#two) [f](../../x)\n";
    let faults: Vec<bool> = links(page).iter().map(|link| fault("docs/glossary.md", page, link).is_some()).collect();
    assert_eq!(faults, [true, false, false, true, true, true]);
}

/// Expected: files that a page names in backticks exist, and so do named test functions.
#[test]
fn files_and_tests_that_pages_name_are_there() {
    let folders = [
        "scenes/",
        "src/",
        "tests/",
        "textures/",
        "benches/",
        "examples/",
        ".ci/",
        ".libtorch/",
        "docs/",
        "crates/",
        "networks/",
        "build/",
        "python/",
    ];
    let mut checked = 0;
    for page in documents() {
        for name in quoted(&read(&page)) {
            let ours = name == "LICENSE" || folders.iter().any(|folder| name.starts_with(folder));
            let pattern = ["/x.rs", "/x.ron", " ", "*", "…"].iter().any(|p| name.contains(p));
            if !ours || pattern || page == "docs/reference/files.md" {
                continue;
            }
            let (path, function) = name.split_once("::").unwrap_or((&name, ""));
            assert!(root().join(path).exists(), "{page} names {name}");
            if !function.is_empty() {
                assert!(read(path).contains(&format!("fn {function}(")), "{page} names {name}");
            }
            checked += 1;
        }
    }
    assert!(checked > 150, "{checked}");
}

/// Rationale: CONTRIBUTING names a patch with other seeds, and every edit of a sampler may outdate it. Expected: it fits
/// the sources.
#[test]
fn the_patch_with_other_seeds_applies() {
    let mut git = std::process::Command::new("git");
    let done = git.args(["apply", "--check", "tests/other_seeds.patch"]).current_dir(root()).output().expect("git");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// Parses a RON block according to its note; returns `None` for a file, which `tests/guide.rs` passes to the program.
fn parsed(note: &str, text: &str) -> Option<furrow_base::Result<()>> {
    let file = RonFile { path: "scenes/page.ron".into(), text: text.into() };
    Some(match note {
        "camera" => file.parse::<CameraDesc>().map(drop),
        "sensor" => file.parse::<SensorDesc>().map(drop),
        "lidar" => file.parse::<LidarDesc>().map(drop),
        "light" => file.parse::<LightDesc>().map(drop),
        "horizon" => file.parse::<HorizonDesc>().map(drop),
        "soil" => file.parse::<SoilDesc>().map(drop),
        "model" => file.parse::<ModelDesc>().map(drop),
        "leaf" => file.parse::<LeafDesc>().map(drop),
        "scenes" => file.parse::<FieldDesc>().and_then(|desc| {
            let mut species = desc.crops.iter().map(|c| &c.species).chain(desc.weeds.iter().map(|w| &w.species));
            species.try_for_each(|name| match shipped::species(name) {
                Ok(Some(_)) => Ok(()),
                _ => file.need_file(name).map(drop),
            })
        }),
        file if file.starts_with("file=") => return None,
        _ => panic!("unknown kind of RON block: {note:?}"),
    })
}

#[test]
fn every_piece_of_ron_is_what_it_says() {
    let mut kinds = std::collections::BTreeSet::new();
    for page in documents().into_iter().filter(|page| written_by_people(page)) {
        for block in blocks(&read(&page)).into_iter().filter(|block| block.language == "ron") {
            if let Some(read) = parsed(&block.note, &block.text) {
                read.unwrap_or_else(|e| panic!("{page}: {e}\n{}", block.text));
            }
            kinds.insert(block.note);
        }
    }
    for kind in ["camera", "sensor", "lidar", "light", "horizon", "soil", "model", "leaf", "scenes"] {
        assert!(kinds.contains(kind), "no page has a block of kind {kind}");
    }
    assert!(
        parsed("camera", "JaiAd130(hight_m: 1)").is_some_and(|read| read.is_err()),
        "the check must be able to fail"
    );
}

/// Expected: the program accepts every command shown on a page: subcommand, flags and values. `--help` is appended to
/// each, so that it is parsed but not run.
#[test]
fn every_command_is_taken_by_its_program() {
    let mut checked = BTreeSet::new();
    for page in documents() {
        for block in blocks(&read(&page)).into_iter().filter(|block| block.language == "sh") {
            for command in commands(&block) {
                // The README passes the arguments of its first line to the program through `cargo run`.
                let command = command
                    .split_once("cargo run --release --no-default-features -- ")
                    .map_or(command.clone(), |(_, rest)| format!("trace {rest}"));
                let Some(program) = program(&command) else { continue };
                if program == "train" && !cfg!(feature = "train") {
                    continue;
                }
                // Only the part before a pipe is ours.
                let own = command.split(" | ").next().unwrap_or_default().replace("target/release/", "");
                if checked.insert(own.clone()) {
                    let output = shell(&format!("{own} --help"), root());
                    let words = String::from_utf8_lossy(&output.stderr);
                    assert!(output.status.success(), "{page}: {command}: {words}");
                }
            }
        }
    }
    assert!(checked.len() > 40, "{checked:?}");
    let wrong = format!("trace --scene {SMALL} --sp 3 --help");
    assert!(!shell(&wrong, root()).status.success(), "the check must be able to fail");
}

#[test]
fn the_test_command_is_the_one_that_is_run() {
    let run = read(".ci/run");
    let command = "bash tests/all.sh";
    assert_eq!(run.trim().lines().last().unwrap(), command);
    assert!(blocks(&read("README.md")).iter().any(|b| b.language == "sh" && b.text.trim() == command));
}

/// Expected: each section of the results names command, commit, seeds, split and machine above its tables; the index
/// states which settings were tuned on which data.
#[test]
fn every_result_says_how_it_was_measured() {
    let index = "docs/results/README.md";
    let mut sections = 0;
    for page in pages().into_iter().filter(|page| page.starts_with("docs/results/") && page != index) {
        for section in read(&page).split("\n## ").skip(1) {
            let title = section.lines().next().unwrap();
            assert!(section.contains("| command | commit | seeds | split | machine |"), "{page}: {title}");
            sections += 1;
        }
    }
    assert!(sections >= 30, "{sections}");
    assert!(read(index).contains("> **What was tuned on what.**"));
}

/// Expected: the table of layers in the documentation equals the one that `tests/architecture.rs` enforces.
#[test]
fn the_layers_are_those_of_the_library() {
    let page = read("docs/ARCHITECTURE.md");
    let library = read("src/lib.rs");
    let rows = |text: &str, start: &str| -> Vec<String> {
        let row = |line: &str| line.strip_prefix(start).map(|row| row.replace(['[', ']'], ""));
        let layer = |row: &String| row.split('|').nth(1).is_some_and(|n| n.trim().parse::<u32>().is_ok());
        text.lines().filter_map(row).filter(layer).collect()
    };
    let (documented, held) = (rows(&page, ""), rows(&library, "//! "));
    assert!(held.len() > 10);
    assert_eq!(documented, held);
}

/// Expected: CONTRIBUTING lists the pages that `tests/guide.rs` runs, and no other page writes files.
#[test]
fn the_pages_that_are_run_are_listed() {
    let listed: Vec<String> =
        quoted(&read("CONTRIBUTING.md")).into_iter().filter(|n| n.starts_with("guide/")).collect();
    assert_eq!(listed, book::RUN);
    for page in pages() {
        let writes = blocks(&read(&page)).iter().any(|block| block.note.starts_with("file="));
        let run = book::RUN.iter().any(|name| page == format!("docs/{name}"));
        assert!(!writes || run, "{page} writes files but is not run");
    }
}
