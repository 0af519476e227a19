//! Runs the guide like a reader: writes its files and executes its commands in order, each page in its own folder.
//!
//! Rationale: newcomers copy the commands of the guide, so any failure there is a fault of the program. Expected: every
//! block of the pages in [`book::RUN`] works, and the files that a page names exist afterwards. Source: the pages.
//! Commands run in a reduced form, see [`SMALLER`] and [`reduced`]; CONTRIBUTING.md documents this.

use crate::common::book::{self, blocks, commands, program, quoted, read, root, shell};
use std::fs;
use std::path::Path;

/// Options whose values are replaced, so that a page takes seconds.
const SMALLER: [(&str, &str); 9] = [
    ("--width", "64"),
    ("--height", "48"),
    ("--spp", "1"),
    ("--max-spp", "2"),
    ("--count", "2"),
    ("--size", "64"),
    ("--rerender", "1"),
    ("--crop", "8,8,16,16"),
    ("--pixel", "32,24"),
];

/// Returns the reduced form of a command: values of [`SMALLER`] are replaced, and a rendering command without width or
/// samples gets them.
fn reduced(command: &str) -> String {
    let mut words: Vec<&str> = Vec::new();
    for word in command.split_whitespace() {
        let before = words.last().copied().unwrap_or_default();
        words.push(SMALLER.iter().find(|(option, _)| *option == before).map_or(word, |(_, value)| *value));
    }
    let (scene, export) = (words.contains(&"--scene"), words.contains(&"export"));
    let catalogue = words.contains(&"catalogue");
    if scene && !words.contains(&"--width") {
        words.extend(["--width", "64"]);
    }
    let samples = ["--spp", "--target-error", "--time", "--labels-only"].iter().any(|option| words.contains(option));
    if ((scene && !export) || catalogue) && !samples {
        words.extend(["--spp", "1"]);
    }
    if catalogue && !words.contains(&"--size") {
        words.extend(["--size", "64"]);
    }
    words.join(" ")
}

/// Runs a page in a folder that contains links to the scene files and textures.
fn run(page: &str) {
    let keep = tempfile::tempdir().expect("a folder");
    let folder = keep.path();
    for shared in ["scenes", "textures"] {
        std::os::unix::fs::symlink(root().join(shared), folder.join(shared)).expect("a link");
    }
    let text = read(&format!("docs/{page}"));
    let mut called = 0;
    for block in blocks(&text) {
        if let ("ron" | "csv", Some(path)) = (block.language.as_str(), block.note.strip_prefix("file=")) {
            let path = folder.join(path);
            assert!(
                path.parent().is_some_and(Path::is_dir),
                "{page}: no command has created the folder of {}",
                path.display()
            );
            fs::write(&path, block.text).expect("a file");
        } else if block.language == "sh" {
            for command in commands(&block) {
                let command = if program(&command).is_some() { reduced(&command) } else { command };
                let output = shell(&command, folder);
                let words = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{page}: {command}: {words}");
                called += 1;
            }
        }
    }
    assert!(called > 0, "{page} runs no command");
    for name in quoted(&text).into_iter().filter(|name| name.starts_with("out/") || name.starts_with("data/")) {
        assert!(folder.join(&name).exists(), "{page} names {name}, which does not exist");
    }
}

#[test]
fn first_picture() {
    run(book::RUN[0]);
}

#[test]
fn your_own_field() {
    run(book::RUN[1]);
}

#[test]
fn own_species() {
    run(book::RUN[2]);
}

#[test]
fn own_textures() {
    run(book::RUN[3]);
}

#[test]
fn models() {
    run(book::RUN[4]);
}

#[test]
fn datasets() {
    run(book::RUN[5]);
}

#[test]
fn commands_are_made_smaller_and_nothing_else() {
    for (command, small) in [
        ("trace --scene a.ron --spp 64", "trace --scene a.ron --spp 1 --width 64"),
        ("trace --scene a.ron --width 480 --target-error 0.05", "trace --scene a.ron --width 64 --target-error 0.05"),
        ("trace export --scene a.ron --format gltf", "trace export --scene a.ron --format gltf --width 64"),
        ("trace dataset finish data/d --format yolo", "trace dataset finish data/d --format yolo"),
        ("trace dataset verify data/d --rerender 5", "trace dataset verify data/d --rerender 1"),
        ("trace catalogue --size 160", "trace catalogue --size 64 --spp 1"),
    ] {
        assert_eq!(reduced(command), small);
    }
}
