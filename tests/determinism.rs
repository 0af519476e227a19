//! The same scene file, seed and index give the same bits, with any number of threads and in every run.
//!
//! Rationale: a dataset that cannot be reproduced cannot be trusted, shared as a recipe, or resumed. Expected: films,
//! labels, meshes and files are bit-identical with one, two and seven threads and from run to run; another index or
//! seed gives another field; an entry added at the end of a scene file's list does not change earlier ones; an
//! interrupted run leaves no files. Source: none needed, equality is exact.
//!
//! `tests/ref/labels.sha256` holds the hash of the small scene's label map. After an intended change to plants, soil,
//! scattering or labels, inspect `target/test-failures/golden-labels/`, then update it:
//! `FURROW_BLESS=1 cargo test --features system-tests --test system determinism::`.

use crate::common::pictures;
use crate::common::program::{self, FILES, SMALL, bits, field, hash, names, run, scratch, shoot, small_text, trace};
use furrow_field::assemble::Options;
use furrow_output::{read_gray16, read_indexed};
use furrow_render::render::{self, LabelMap};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Encodes class, plant and leaf of each pixel as one number.
fn numbers(map: &LabelMap) -> Vec<u32> {
    map.tags.iter().map(|t| t.plant << 16 | u32::from(t.leaf) << 2 | t.class as u32).collect()
}

#[test]
fn film_and_labels_are_the_same_bits_at_any_number_of_threads() {
    let options = Options { width: Some(48), ..Options::default() };
    let all: Vec<_> = [1, 2, 7, 7]
        .into_iter()
        .map(|threads| {
            let grown = render::pool(threads).unwrap().install(|| field(&small_text(), &options));
            let (film, labels) = shoot(&grown, 4, threads);
            let meshes: Vec<_> = grown.scene.parts.into_iter().map(|p| (p.mesh, p.tag)).collect();
            (threads, bits(&film), labels, meshes)
        })
        .collect();
    let (_, film, labels, meshes) = &all[0];
    assert!(film.iter().any(|b| *b != 0) && labels.tags.iter().any(|t| t.leaf > 0));
    for (threads, other_film, other_labels, other_meshes) in &all[1..] {
        assert!(meshes == other_meshes, "{threads} threads give other meshes");
        pictures::same(&format!("labels-{threads}-threads"), 48, &numbers(other_labels), &numbers(labels));
        let per_pixel = film.len() / labels.parts.len();
        let mean = |film: &[u32]| film.chunks(per_pixel).map(|p| p[1]).collect::<Vec<_>>();
        pictures::same(&format!("film-{threads}-threads"), 48, &mean(other_film), &mean(film));
        assert!(film == other_film, "{threads} threads: a channel differs");
    }
}

/// Expected: byte equality, and no other file. A crop, and labels at another number of samples, are tested here too,
/// because each run builds the field again.
#[test]
fn files_are_the_same_bytes_at_any_number_of_threads() {
    let (_keep, out) = scratch();
    let at = |name: &str| out.join(name);
    let common = ["--width", "64", "--spp", "2"];
    for (name, threads) in [("one", "1"), ("two", "2"), ("again", "2")] {
        let output = run(&at(name), &[&common[..], &["--threads", threads]].concat());
        assert_eq!(names(&at(name)), FILES, "unexpected files");
        let mut listed: Vec<String> = String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect();
        listed.sort();
        let written: Vec<String> = FILES.iter().map(|f| at(name).join(f).display().to_string()).collect();
        assert_eq!(listed, written, "stdout must list the written files");
    }
    let bytes = |name: &str, file: &str| std::fs::read(at(name).join(file)).unwrap();
    for file in FILES {
        assert!(bytes("one", file) == bytes("two", file), "{file} differs between one and two threads");
        assert!(bytes("two", file) == bytes("again", file), "{file} differs from run to run");
    }
    run(&at("more"), &["--width", "64", "--spp", "5"]);
    for file in ["plants.png", "leaves.png"] {
        let read = |name: &str| read_gray16(&at(name).join(file)).unwrap();
        assert_eq!(read("one"), read("more"), "{file} depends on the number of samples");
    }
    assert_eq!(
        read_indexed(&at("one").join("semantics.png")).unwrap(),
        read_indexed(&at("more").join("semantics.png")).unwrap()
    );
    assert!(bytes("one", "rgb.png") != bytes("more", "rgb.png"), "more samples should change the image");
}

#[test]
fn another_index_or_seed_is_another_field() {
    let options = |seed, index| Options { seed, index, width: Some(32), ..Options::default() };
    let meshes = |o: &Options| field(&small_text(), o).scene.parts.into_iter().map(|p| p.mesh).collect::<Vec<_>>();
    let first = meshes(&options(None, 0));
    assert!(first == meshes(&options(Some(3), 0)), "passing the scene file's own seed should change nothing");
    let second = meshes(&options(None, 1));
    let seeded = meshes(&options(Some(4), 0));
    assert!(first != second && first != seeded && second != seeded, "fields repeat");
    let sample_seed = |o: &Options| field(&small_text(), o).sample_seed();
    assert_ne!(sample_seed(&options(None, 0)), sample_seed(&options(None, 1)), "every image must have its own noise");
}

#[test]
fn a_species_added_at_the_end_moves_no_plant_before_it() {
    let text = small_text();
    let weeds = text.find("weeds: [").unwrap();
    let end = weeds + text[weeds..].find("],\n").unwrap();
    let galium = "(species: \"scenes/species/galium.ron\", growth: AgeDays(8), spread: (per_m2: 150))";
    let more = format!("{}, {galium}{}", &text[..end], &text[end..]);
    // Individually placed plants come after all weeds: leave them out of both fields.
    let without = |t: &str| format!("{})", &t[..t.find("plants: [").unwrap()]);
    let options = Options { width: Some(32), ..Options::default() };
    let (before, after) = (field(&without(&text), &options), field(&without(&more), &options));
    assert!(after.plants.len() > before.plants.len() + 3, "{} and {}", after.plants.len(), before.plants.len());
    assert_eq!(before.plants[..], after.plants[..before.plants.len()]);
    let organs = |f: &furrow_field::Field| {
        let last = before.plants.last().map_or(0, |p| p.number);
        let old = f.scene.parts.iter().filter(|p| (1..=last).contains(&p.tag.plant));
        old.map(|p| (p.tag, p.mesh.clone())).collect::<Vec<_>>()
    };
    assert!(organs(&before) == organs(&after), "a mesh of an earlier plant has changed");
}

#[test]
fn the_small_pages_label_map_is_the_one_on_record() {
    let path = Path::new("tests/ref/labels.sha256");
    let grown = field(&small_text(), &Options::default());
    let (_, labels) = shoot(&grown, 1, 2);
    let now = numbers(&labels);
    let text = format!("{}\n", hash(now.iter().copied()));
    if std::env::var_os("FURROW_BLESS").is_some_and(|v| v == "1") {
        furrow_output::write_atomically(path, text.as_bytes()).unwrap();
        return;
    }
    let recorded = std::fs::read_to_string(path).unwrap_or_default();
    if recorded != text {
        let seen = pictures::keep("golden-labels", labels.window.width(), &now, &now);
        panic!(
            "the label map of {SMALL} has changed; if it should have, look at it in {seen} and renew its hash with \
             FURROW_BLESS=1 cargo test --features system-tests --test system determinism::"
        );
    }
}

/// Sends a signal to a process started by this test.
#[cfg(unix)]
fn interrupt(process: u32, signal: &str) {
    let done = Command::new("kill").args([signal, &process.to_string()]).status().expect("kill");
    assert!(done.success());
}

/// Rationale: users and batch schedulers stop long jobs; schedulers send SIGTERM. Expected: exit code 75 soon, whatever
/// the number of samples per pixel, and neither a file nor a temporary file.
#[cfg(unix)]
#[test]
fn an_interrupted_render_leaves_nothing() {
    for signal in ["-INT", "-TERM"] {
        let (keep, out) = scratch();
        let mut command =
            trace(&["--scene", SMALL, "--spp", "65536", "--threads", "2", "--out", out.to_str().unwrap()]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // The program reports that the field is built, then renders for minutes.
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.contains("plants"), "{line}");
        std::thread::sleep(std::time::Duration::from_millis(200));
        interrupt(child.id(), signal);
        let asked = std::time::Instant::now();
        let output = child.wait_with_output().unwrap();
        assert!(asked.elapsed().as_secs() < 30, "{signal}: batch schedulers kill after half a minute");
        assert_eq!(output.status.code(), Some(75), "{signal}");
        assert!(output.stdout.is_empty(), "stdout must not list files that do not exist");
        assert_eq!(names(&out), Vec::<String>::new());
        assert_eq!(names(keep.path()), Vec::<String>::new(), "the output folder must not exist");
    }
    assert!(program::names(Path::new("out/small")).is_empty(), "the default folder must not be used");
}
