//! Method 11: scene files. Every shipped file builds and survives printing and parsing, and every invalid file in
//! `tests/bad` gives exactly the message stored beside it.
//!
//! Rationale: users write scene files by hand, in editors that do not know the format. Expected: a file builds, or its
//! error shows the file, line, column, the faulty characters and a remedy. Source: none; the messages are our own.
//! After a change of messages, `FURROW_BLESS=1 cargo test --features system-tests --test system scene_files::` updates them; review the difference
//! before committing.

use furrow_base::Result;
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_field::assemble::{self, Options};
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_grow::model::{Model, Up};
use furrow_grow::plant::{Stage, grow};
use furrow_optics::texture::draw::Recipe;
use furrow_optics::texture::panorama::Panorama;
use furrow_optics::texture::{ColorSpace, Texture};
use furrow_train::table::{Experiment, ExperimentDesc};
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex};

/// Returns the `.ron` files of a folder and its subfolders, sorted, relative to the repository.
fn pages(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(pages(path.to_str().unwrap()));
        } else if path.extension().is_some_and(|e| e == "ron") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn is_species(path: &Path) -> bool {
    path.components().any(|c| c.as_os_str() == "species")
}

fn is_experiment(path: &Path) -> bool {
    path.components().any(|c| c.as_os_str() == "experiments")
}

fn fields() -> Vec<PathBuf> {
    pages("scenes").into_iter().filter(|p| !is_species(p) && !is_experiment(p)).collect()
}

fn experiments() -> Vec<PathBuf> {
    pages("scenes").into_iter().filter(|p| is_experiment(p)).collect()
}

fn species() -> Vec<PathBuf> {
    pages("scenes").into_iter().filter(|p| is_species(p)).collect()
}

#[test]
fn every_species_page_grows_at_every_stage() {
    assert!(species().len() >= 16, "species files are missing");
    for path in species() {
        let desc = SpeciesDesc::read(&path).unwrap_or_else(|e| panic!("{e}"));
        for stage in &desc.plant.stages {
            let plant = grow(&desc.plant, Stage::Bbch(stage.bbch), &Stream::of(1, 0, Purpose::Test, 0));
            assert!(!plant.organs.is_empty(), "{} BBCH {}", path.display(), stage.bbch);
            for organ in &plant.organs {
                assert_eq!(organ.mesh.fault(), None, "{} BBCH {}", path.display(), stage.bbch);
                assert!(
                    desc.materials.contains_key(&organ.material),
                    "{}: no material {}",
                    path.display(),
                    organ.material
                );
            }
        }
        for texture in desc.textures() {
            assert!(path.parent().unwrap().join(texture).is_file(), "{}: no {texture}", path.display());
        }
    }
}

#[test]
fn every_experiment_page_reads_at_each_of_its_scales() {
    assert!(!experiments().is_empty(), "experiment files are missing");
    for path in experiments() {
        let page = RonFile::read(&path).unwrap();
        let desc: ExperimentDesc = page.parse().unwrap_or_else(|e| panic!("{e}"));
        for scale in [None].into_iter().chain(desc.scales.names().into_iter().map(Some)) {
            Experiment::of(&page, scale).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

fn survives_printing<T: Debug + PartialEq + Serialize + DeserializeOwned>(path: &Path) {
    let first: T = RonFile::read(path).unwrap().parse().unwrap_or_else(|e| panic!("{e}"));
    is_printed(&first, path);
}

fn is_printed<T: Debug + PartialEq + Serialize + DeserializeOwned>(first: &T, path: &Path) {
    let printed = RonFile::print(first).unwrap();
    let second: T =
        RonFile::of(&printed).parse().unwrap_or_else(|e| panic!("{} printed: {e}\n{printed}", path.display()));
    assert_eq!(*first, second, "{}", path.display());
    assert_eq!(printed, RonFile::print(&second).unwrap(), "{}", path.display());
}

#[test]
fn a_printed_page_reads_the_same() {
    for path in fields() {
        survives_printing::<FieldDesc>(&path);
    }
    for path in species() {
        is_printed(&SpeciesDesc::read(&path).unwrap_or_else(|e| panic!("{e}")), &path);
    }
    for path in experiments() {
        survives_printing::<ExperimentDesc>(&path);
    }
    for path in pages("textures") {
        survives_printing::<Recipe>(&path);
    }
}

#[test]
fn the_papers_four_sets_differ_in_their_weeds_and_seeds_alone() {
    let read = |set: char| -> FieldDesc {
        RonFile::read(Path::new(&format!("scenes/synthetic-{set}.ron")))
            .unwrap()
            .parse()
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let all = ['a', 'b', 'c', 'd'].map(read);
    for (i, page) in all.iter().enumerate() {
        for other in &all[..i] {
            assert!(page.seed != other.seed && page.weeds != other.weeds);
            let alike = FieldDesc { seed: page.seed, weeds: page.weeds.clone(), ..other.clone() };
            assert!(alike == *page, "seed {}: more than weeds and seed differs", page.seed);
        }
    }
    let species = |page: &FieldDesc| page.weeds.iter().map(|w| w.species.clone()).collect::<Vec<_>>();
    assert_eq!(species(&all[1]), ["species/capsella.ron"]);
    assert_eq!(species(&all[2]), ["species/galium.ron"]);
    assert_eq!(species(&all[3]).len(), 5);
}

/// Messages of the invalid files, which several tests look at.
static MESSAGES: LazyLock<Mutex<BTreeMap<PathBuf, String>>> = LazyLock::new(Mutex::default);

/// Returns the error for an invalid file, as the program prints it.
fn message_of(path: &Path) -> String {
    if let Some(known) = MESSAGES.lock().unwrap().get(path) {
        return known.clone();
    }
    let words = fresh_message_of(path);
    MESSAGES.lock().unwrap().insert(path.into(), words.clone());
    words
}

fn fresh_message_of(path: &Path) -> String {
    match assemble::field(path, &Options { width: Some(16), ..Options::default() }) {
        Ok(_) => panic!("{}: it builds", path.display()),
        Err(e) => format!("error: {e}\n").replace('\\', "/"),
    }
}

fn bad() -> Vec<PathBuf> {
    pages("tests/bad").into_iter().filter(|p| p.parent().unwrap().ends_with("bad")).collect()
}

#[test]
fn every_mistake_gets_exactly_the_words_beside_it() {
    let bless = std::env::var_os("FURROW_BLESS").is_some_and(|v| v == "1");
    assert!(bad().len() >= 24, "invalid scene files are missing");
    let mut wrong = Vec::new();
    for path in bad() {
        let (words, beside) = (message_of(&path), path.with_extension("txt"));
        if bless {
            std::fs::write(&beside, &words).unwrap();
        }
        let expected = std::fs::read_to_string(&beside).unwrap_or_default();
        if words != expected {
            wrong.push(format!("{}\n--- expected\n{expected}--- printed\n{words}", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Expected: `trace check` refuses a model without a class, or far away, with the words of a render, and warns of nothing else.
#[test]
fn a_check_refuses_models_as_a_render_does() {
    for name in ["model_without_class", "model_far_away"] {
        let page = Path::new("tests/bad").join(name).with_extension("ron");
        let done = Command::new(env!("CARGO_BIN_EXE_trace")).arg("check").arg(&page).output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{name}");
        let expected = std::fs::read_to_string(page.with_extension("txt")).unwrap();
        assert_eq!(String::from_utf8(done.stderr).unwrap(), expected, "{name}");
    }
}

/// Rationale: a scene file with several mistakes would otherwise take one run for each. Expected: `trace check`, and every
/// command that reads the file, prints all of them with place and help, then their number; exit code 2; nothing is written.
/// The message is stored beside the file like those of single mistakes, and reviewed by hand.
#[test]
fn all_mistakes_of_a_page_are_reported_at_once() {
    let (page, beside) = (Path::new("tests/bad/several/field.ron"), Path::new("tests/bad/several/field.txt"));
    let run = |args: &[&str]| {
        let done = Command::new(env!("CARGO_BIN_EXE_trace")).args(args).output().unwrap();
        assert_eq!((done.status.code(), done.stdout.len()), (Some(2), 0), "{args:?}");
        String::from_utf8(done.stderr).unwrap()
    };
    let words = run(&["check", page.to_str().unwrap()]);
    if std::env::var_os("FURROW_BLESS").is_some_and(|v| v == "1") {
        std::fs::write(beside, &words).unwrap();
    }
    assert_eq!(words, std::fs::read_to_string(beside).unwrap_or_default());
    assert_eq!(words.matches("error: ").count(), words.matches("\n help: ").count(), "{words}");
    assert!(words.ends_with("\n10 mistakes in tests/bad/several/field.ron\n"), "{words}");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let render = run(&["--scene", page.to_str().unwrap(), "--spp", "1", "--out", out.to_str().unwrap()]);
    assert_eq!(render, words);
    assert!(!out.exists());
}

/// Rationale: the search repairs and reads the file again for each mistake, which took minutes for a generated file of a
/// megabyte. Expected: several mistakes of 20 000 weeds, each at its place, in seconds; the number of readings is limited by
/// the length of the file, with a note that there may be more.
#[test]
fn mistakes_of_a_long_page_are_found_soon() {
    let weed = "(species: \"fat-hen\", growth: AgeDays(12), sprad: (per_m2: 0.001))";
    let weeds = vec![weed; 20_000].join(",\n");
    let text = format!("Field(camera: JaiAd130(height_m: 1), lights: [Overcast()], weeds: [\n{weeds}\n])");
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("long.ron");
    std::fs::write(&page, text).unwrap();
    let check = || {
        let done = Command::new(env!("CARGO_BIN_EXE_trace")).arg("check").arg(&page).output().unwrap();
        let words = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{words}");
        words
    };
    let words = check();
    let found = words.matches("unknown field `sprad`").count();
    assert!((6..40).contains(&found) && words.contains("there may be more"), "{words}");
    for k in 0..found {
        assert!(words.contains(&format!("long.ron:{}:43: unknown field", k + 2)), "{words}");
    }
    // A mistake behind one that no other name and no value mends.
    let weed = "(species: \"fat-hen\", growth: AgeDays(12), spread: (per_m2: 0.001))";
    let weeds = vec![weed; 20_000].join(",\n");
    let last = weed.replace("fat-hen", "fat-heen");
    let text =
        format!("Field(bogus: 3, camera: JaiAd130(height_m: 1), lights: [Overcast()], weeds: [\n{weeds},\n{last}\n])");
    std::fs::write(&page, text).unwrap();
    let words = check();
    assert!(
        words.contains("unknown field `bogus`") && words.contains("long.ron:20002:11: no built-in species"),
        "{words}"
    );
}

/// Expected: both missing files of a layer are reported, and the mistake behind them; the repair puts a shipped file in
/// place of each and never reports that one.
#[test]
fn all_missing_files_of_a_layer_are_reported_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("layer.ron");
    let text = "Field(camera: JaiAd130(height_m: 1), lights: [Overcast()], soil: (layers: [\n\
                (albedo: \"no.png\", height: \"neither.png\", size_m: 0.5, height_mm: (-4, 8)),\n]),\n\
                weeds: [(species: \"nothing.ron\", growth: AgeDays(-1), spread: (per_m2: 4))])";
    std::fs::write(&page, text).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_trace")).arg("check").arg(&page).output().unwrap();
    let words = String::from_utf8(done.stderr).unwrap();
    for said in [
        "2:10: there is no file `no.png`",
        "2:28: there is no file `neither.png`",
        "4:19: there is no file `nothing.ron`",
    ] {
        assert!(words.contains(said), "{words}");
    }
    assert!(words.contains("4:50: -1 is out of range") && words.contains("4 mistakes in "), "{words}");
}

/// Expected: a single mistake is printed as before, without a number; a file without mistakes gives exit code 0.
#[test]
fn a_page_with_one_mistake_or_none_is_not_counted() {
    let run = |args: &[&str]| {
        let done = Command::new(env!("CARGO_BIN_EXE_trace")).arg("check").args(args).output().unwrap();
        (done.status.code(), String::from_utf8(done.stderr).unwrap())
    };
    let one = std::fs::read_to_string("tests/bad/unknown_field.txt").unwrap();
    assert_eq!(run(&["tests/bad/unknown_field.ron"]), (Some(2), one));
    assert_eq!(run(&["tests/ref/small.ron"]), (Some(0), "tests/ref/small.ron: no mistakes\n".to_owned()));
    // Mistakes in the file and in assigned values are reported together, each in its own text.
    let (code, words) = run(&["tests/ref/small.ron", "--set", "camera.pose.height_m=-1", "--set", "seed=-1"]);
    assert!(code == Some(2) && words.contains("2 mistakes in tests/ref/small.ron") && words.contains("-1"), "{words}");
}

/// Line, column and underlined characters of a message.
fn pointed_at(words: &str) -> (usize, usize, String) {
    let mut lines = words.lines();
    let head = lines.next().unwrap().strip_prefix("error: tests/bad/").unwrap();
    let mut numbers = head.split(':').skip(1).map(str::parse::<usize>);
    let (line, column) = (numbers.next().unwrap().unwrap(), numbers.next().unwrap().unwrap());
    let (shown, carets) = (lines.next().unwrap(), lines.next().unwrap());
    let from = carets.chars().position(|c| c == '^').unwrap();
    let count = carets.chars().filter(|c| *c == '^').count();
    (line, column, shown.chars().skip(from).take(count).collect())
}

#[test]
fn every_message_points_into_its_page_and_helps() {
    for path in bad() {
        let words = message_of(&path);
        assert!(words.contains("\n help: "), "no help: {words}");
        if path.file_stem().unwrap() == "binary" {
            continue;
        }
        let (line, column, under) = pointed_at(&words);
        // The faulty file may be one that the scene file names.
        let file = words.strip_prefix("error: ").unwrap().split(':').next().unwrap();
        let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
        let there: String =
            text.lines().nth(line - 1).unwrap_or("").chars().skip(column - 1).take(under.chars().count()).collect();
        assert_eq!(under.trim_end(), there.trim_end(), "{words}");
    }
}

#[test]
fn the_caret_is_under_the_right_characters() {
    for (name, line, column, under) in [
        ("tabs_and_umlauts", 3, 46, "lihgts"),
        ("unknown_field", 3, 54, "azimut_deg"),
        ("fraction_above_one", 4, 111, "1.2"),
        ("negative_weight", 2, 55, "-1"),
        ("missing_comma", 3, 5, "lights"),
        ("long_line", 1, 577, "groth"),
        ("text_for_number", 2, 32, "\"0.85\""),
        ("too_many_plants", 6, 85, "(per_m2: 1e8)"),
    ] {
        let words = message_of(Path::new(&format!("tests/bad/{name}.ron")));
        assert_eq!(pointed_at(&words), (line, column, under.to_owned()), "{words}");
    }
}

#[test]
fn the_program_refuses_bad_pages_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for path in bad() {
        let out = folder.path().join("out");
        let done = Command::new(env!("CARGO_BIN_EXE_trace"))
            .args(["--spp", "1", "--width", "16", "--threads", "1", "--scene"])
            .arg(&path)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(2), "{}", path.display());
        assert!(done.stdout.is_empty(), "{}", path.display());
        assert_eq!(String::from_utf8(done.stderr).unwrap(), message_of(&path));
        assert!(!out.exists(), "{}: a folder was created", path.display());
    }
}

/// Checks that reading succeeds or gives an error that a terminal can show.
fn tidy<T>(read: Result<T>) -> Result<(), TestCaseError> {
    let Err(error) = read else { return Ok(()) };
    prop_assert!(error.place().is_some_and(|place| place.span.is_some()), "{error}");
    let words = error.to_string();
    prop_assert!(words.lines().count() <= 5 && words.lines().all(|l| l.chars().count() < 2000), "{words}");
    prop_assert!(words.chars().all(|c| c == '\n' || !c.is_control()), "{words:?}");
    prop_assert!(words.contains('^'), "{words}");
    Ok(())
}

fn read_as_any(text: &str) -> Result<(), TestCaseError> {
    let page = RonFile::of(text);
    tidy(page.parse::<FieldDesc>())?;
    tidy(page.parse::<SpeciesDesc>())?;
    tidy(page.parse::<Recipe>())
}

/// Edits a text once: removes, inserts or duplicates characters.
fn edited(text: &str, (at, len, kind, with): &(prop::sample::Index, usize, u8, String)) -> String {
    let chars: Vec<char> = text.chars().collect();
    let at = at.index(chars.len() + 1);
    let end = (at + len).min(chars.len());
    let middle: String = match kind % 4 {
        0 => String::new(),
        1 => with.clone(),
        2 => chars[at..end].iter().chain(&chars[at..end]).collect(),
        _ => chars[at..end].iter().rev().collect(),
    };
    chars[..at].iter().collect::<String>() + &middle + &chars[end..].iter().collect::<String>()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read_as_any(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn random_page_like_text_never_panics(text in "(Field\\()?[a-z_ (){}\\[\\]:,.0-9\"'#/*\n\t\\\\éＦ-]{0,120}") {
        read_as_any(&text)?;
    }

    #[test]
    fn mutilated_pages_never_panic(
        edits in prop::collection::vec(
            (any::<prop::sample::Index>(), 0_usize..12, any::<u8>(), "[-a-zA-Z0-9(){}\\[\\]:,.\" \n/*\u{1}\u{1b}é]{1,6}"),
            1..4,
        ),
    ) {
        let page = std::fs::read_to_string("scenes/field.ron").unwrap();
        let text = edits.iter().fold(page, |text, edit| edited(&text, edit));
        tidy(RonFile::of(&text).parse::<FieldDesc>())?;
    }
}

/// Rationale: a pipe without a writer, or an endless device, would block the program forever. Expected: every kind of
/// file named by a scene is refused at once if it is not a regular file, with a message that says what it is.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = |name: &str| {
        let path = folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    };
    let (scene, picture, panorama, model) = (pipe("a.ron"), pipe("a.png"), pipe("a.exr"), pipe("a.obj"));
    let zero = std::path::PathBuf::from("/dev/zero");
    let (done, wait) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let words = |error: furrow_base::Error| (error.exit_code(), error.to_string());
        done.send(words(RonFile::read(&scene).unwrap_err())).unwrap();
        done.send(words(RonFile::read(&zero).unwrap_err())).unwrap();
        done.send(words(Texture::load(&picture, ColorSpace::Srgb).unwrap_err())).unwrap();
        done.send(words(Panorama::load(&panorama).unwrap_err())).unwrap();
        done.send(words(Model::load(&model, Up::Z).unwrap_err())).unwrap();
        let text = format!("Field(lights: [EnvironmentMap(file: {panorama:?})])");
        done.send(words(RonFile::of(&text).need_file(panorama.to_str().unwrap()).unwrap_err())).unwrap();
    });
    for k in 0..6 {
        let (code, words) = wait.recv_timeout(std::time::Duration::from_secs(60)).expect("the program waits forever");
        assert!(code == 2 && words.contains("a pipe, a socket or a device, not a file"), "{k}: {code} {words}");
    }
}
