//! Self-training: photographs without labels improve a network on photographs like them.
//!
//! Rationale: a network that reinforces its own errors gets worse unnoticed, and one that reads the labels of its test
//! images proves nothing.
//!
//! Expected: for images under another light than the training images, a higher IoU after self-training on other images
//! of that light; the same weights whatever labels are stored beside the photographs, and whether the run is
//! interrupted or not; one clear error for invalid arguments. Source: the construction of the images, and the output of
//! `train adapt --help`.

use crate::common::training::wait_for_steps;
use furrow_base::sampling::{Purpose, Stream};
use furrow_output::{ImageData, write_png};
use furrow_train::measure::Report;
use furrow_train::run::{self, Results};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

const SIZE: (u32, u32) = (64, 48);

/// Colours of soil, large plants and small plants: a field in daylight, and the same under a warm lamp through haze.
const DAY: [[u8; 3]; 3] = [[120, 95, 70], [70, 150, 50], [80, 150, 45]];
const LAMP: [[u8; 3]; 3] = [[150, 135, 95], [112, 145, 72], [122, 148, 70]];

/// Builds a set of images of soil with large discs (crop) and small discs (weeds). Without labels, every pixel of the
/// masks is 255.
fn set(folder: &Path, colors: [[u8; 3]; 3], first: u64, labelled: bool) -> PathBuf {
    let (photos, masks, out) = (folder.join("images"), folder.join("masks"), folder.join("set"));
    let (w, h) = SIZE;
    for k in first..first + 8 {
        let mut stream = Stream::of(6, k, Purpose::Test, 0);
        let mut draw = |radius: f32| (stream.range32(0.0, w as f32), stream.range32(0.0, h as f32), radius);
        let discs = [draw(11.0), draw(9.0), draw(3.0), draw(2.5), draw(3.0)];
        let class = |x: u32, y: u32| {
            let inside = |(cx, cy, r): &(f32, f32, f32)| (x as f32 - cx).hypot(y as f32 - cy) < *r;
            discs.iter().find(|d| inside(d)).map_or(0, |d| if d.2 > 5.0 { 1 } else { 2 })
        };
        let labels: Vec<u8> = (0..w * h).map(|i| class(i % w, i / w)).collect();
        let mut noise = |v: u8| (f32::from(v) + stream.range32(-12.0, 12.0)) as u8;
        let rgb: Vec<[u8; 3]> = labels.iter().map(|c| colors[usize::from(*c)].map(&mut noise)).collect();
        let name = format!("{k:03}.png");
        write_png(&photos.join(&name), w, h, &ImageData::Rgb(&rgb), "").unwrap();
        let labels = if labelled { labels } else { vec![255; labels.len()] };
        write_png(&masks.join(&name), w, h, &ImageData::Gray(&labels), "").unwrap();
    }
    let import = ["dataset", "import", "--format", "masks"].map(Into::into);
    let named = [("--images", &photos), ("--masks", &masks), ("--out", &out)];
    let named = named.iter().flat_map(|(flag, path)| [flag.into(), path.as_os_str().to_owned()]);
    let made = Command::new(env!("CARGO_BIN_EXE_trace")).args(import.into_iter().chain(named)).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    out
}

fn train(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.args(arguments.split_whitespace()).args(["--threads", "1", "--precision", "f32"]).stdin(Stdio::null());
    command
}

fn succeed(arguments: &str) {
    let output = train(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A network trained on eight daylight images, whose dataset is in `day` beside it. Kept until the next run.
static TRAINED: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("adapt");
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    let (set, out) = (set(&folder.join("day"), DAY, 0, true), folder.join("run"));
    let how = "--network tiny-unet --size 64x48 --steps 300 --rate 0.005 --augment flip,crop --normalization image";
    succeed(&format!("fit --set {}@all --out {} {how} --batch 4", set.display(), out.display()));
    out
});

/// Evaluates a run on a set and returns the mean IoU of the classes.
fn score(run: &Path, set: &Path) -> f64 {
    succeed(&format!("eval {} --set {}@all", run.display(), set.display()));
    let report: Report = run::read_json(&run.join("eval/set/report.json")).unwrap();
    report.scores.mean_iou.unwrap()
}

fn weights(run: &Path) -> Vec<u8> {
    fs::read(run.join(run::WEIGHTS)).unwrap()
}

#[test]
fn photographs_without_labels_make_a_network_better_on_others_like_them() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let run = TRAINED.as_path();
    let photos = set(&folder.join("photos"), LAMP, 100, false);
    let labelled = set(&folder.join("labelled"), LAMP, 100, true);
    let test = set(&folder.join("test"), LAMP, 200, true);
    let before = score(run, &test);
    let adapt = |from: &str, out: &Path, steps: u64| {
        format!("adapt {} --images {from} --out {} --steps {steps}", run.display(), out.display())
    };
    let adapted = folder.join("adapted");
    let images = photos.display().to_string();
    succeed(&adapt(&images, &adapted, 40));
    let after = score(&adapted, &test);
    assert!(after > before + 0.05, "{before:.3} before, {after:.3} after");

    // Labels stored beside the photographs are not read, and the folder of the photographs does not matter.
    let sources = [images.clone(), labelled.display().to_string(), folder.join("photos/images").display().to_string()];
    let few = sources.iter().enumerate().map(|(k, from)| {
        let out = folder.join(format!("few-{k}"));
        succeed(&adapt(from, &out, 2));
        weights(&out)
    });
    let few: Vec<Vec<u8>> = few.collect();
    assert!(few.iter().all(|bytes| *bytes == few[0]), "the weights depend on labels or folders");

    // After interruptions, the same command resumes and ends with the same weights.
    let stopped = folder.join("stopped");
    let mut stops = 0;
    for steps in [1, 12] {
        let mut child = train(&adapt(&images, &stopped, 40)).stderr(Stdio::null()).spawn().unwrap();
        wait_for_steps(&stopped, steps, &mut child);
        let _ = Command::new("kill").arg("-TERM").arg(child.id().to_string()).status();
        stops += usize::from(!child.wait().unwrap().success());
    }
    assert!(stops > 0, "every run finished before it could be stopped");
    succeed(&adapt(&images, &stopped, 40));
    assert_eq!(weights(&stopped), weights(&adapted));

    // The report and the plan record that photographs were used.
    let page = fs::read_to_string(adapted.join("report.html")).unwrap();
    assert!(page.contains("8 photographs without labels"), "the report does not mention the photographs");
    let plan = fs::read_to_string(adapted.join(run::PLAN)).unwrap();
    assert!(plan.contains("photos_sha256"), "{plan}");

    // Another folder of photographs is a different training run.
    let others = set(&folder.join("others"), LAMP, 300, false);
    let refused = refuse(&adapt(&others.display().to_string(), &adapted, 40));
    assert!(refused.contains("this folder contains another training"), "{refused}");
}

fn refuse(arguments: &str) -> String {
    let output = train(arguments).output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{words}");
    words
}

#[test]
fn what_cannot_be_adapted_is_reported() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let run = TRAINED.as_path();
    let day = run.with_file_name("day");
    let (run_name, images) = (run.display(), day.join("images"));
    let out = folder.join("out");
    let adapt = |more: &str| refuse(&format!("adapt {run_name} --out {} {more}", out.display()));
    let images = images.display();
    for (more, words) in [
        (format!("--images {images} --keep 1.1"), "--keep"),
        (format!("--images {images} --keep nan"), "--keep"),
        (format!("--images {images} --rate 0"), "rate"),
        (format!("--images {images} --steps 0"), "--steps"),
        (format!("--images {}/none", folder.display()), "none"),
        (format!("--images {}", run.display()), "no image"),
    ] {
        let message = adapt(&more);
        assert!(message.contains(words), "{more}: {message}");
        assert!(!out.exists(), "{more} has left a folder");
    }
    // Weights without a plan: the user must name the training set.
    let alone = folder.join("alone");
    fs::create_dir(&alone).unwrap();
    for file in [run::WEIGHTS, run::MODEL] {
        fs::copy(run.join(file), alone.join(file)).unwrap();
    }
    let message = refuse(&format!("adapt {} --images {images} --out {}", alone.display(), out.display()));
    assert!(message.contains("--set DIR"), "{message}");
    let set = day.join("set");
    let (alone, set, out) = (alone.display(), set.display(), out.display());
    succeed(&format!("adapt {alone} --images {images} --set {set}@all --out {out} --steps 2"));
}

/// Rationale: users who have labels for some photographs want to see whether self-training helps while it runs.
/// Expected: with a validation set, the log has its loss and IoU and the event file has its images; the validation
/// images decide which weights are kept, and do not affect the training.
#[test]
fn a_validation_set_is_logged_and_not_learnt_from() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let run = TRAINED.as_path();
    let (photos, val) = (set(&folder.join("photos"), LAMP, 100, false), set(&folder.join("val"), LAMP, 200, true));
    let adapt = |name: &str, more: &str| -> Results {
        let out = folder.join(name);
        let (images, from) = (photos.display(), run.display());
        succeed(&format!("adapt {from} --images {images} --out {} --steps 5 {more}", out.display()));
        run::results(&out).unwrap().unwrap()
    };
    let without = adapt("without", "");
    let with = adapt("with", &format!("--val {}@all", val.display()));
    assert!(without.history.validation.is_empty() && without.best_step.is_none());
    let [pass] = with.history.validation.as_slice() else { panic!("{:?}", with.history.validation) };
    assert!(pass.step == 5 && pass.iou.len() == 3 && pass.miou > 0.0 && pass.loss.is_some(), "{pass:?}");
    assert_eq!(with.best_step, Some(5));
    assert_eq!(with.history.losses, without.history.losses);
    // The arrays follow the header, which contains the plan: eight bytes of header length, then the header.
    let arrays = |name: &str| {
        let bytes = weights(&folder.join(name));
        let head = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
        bytes[8 + head..].to_vec()
    };
    assert!(arrays("with") == arrays("without"), "a validation set changes the weights");
    let log = fs::read_to_string(folder.join("with/log.csv")).unwrap();
    let cells: Vec<&str> = log.lines().last().unwrap().split(',').collect();
    assert!(cells.len() == 8 && cells[0] == "5" && cells.iter().all(|cell| !cell.is_empty()), "{log}");
    let picture = b"photograph, truth, prediction";
    let has_picture = |name: &str| {
        let events = fs::read(folder.join(name).join("training.tfevents")).unwrap();
        events.windows(picture.len()).any(|bytes| bytes == picture)
    };
    assert!(has_picture("with") && !has_picture("without"));
}
