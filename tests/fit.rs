//! Training: the loss falls, progress is logged, and interruptions change nothing.
//!
//! Rationale: a training runs overnight and is judged by its final weights; a kill that changes them, or a file of
//! another training used by mistake, would falsify every table of results. Expected: equal bytes of
//! `weights.safetensors` whether the run is stopped, killed or undisturbed, with any number of loading threads; one
//! clear error with exit code 2 if a run cannot be resumed. Source: the output of `train fit --help`.

use crate::common::python::{ask, python};
use crate::common::training::wait_for_steps;
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::classes::Classes;
use furrow_output::{ImageData, write_png};
use furrow_train::data::{Augment, Band, BatchSettings, Loader, Normalization, Pick, Selection, Shape, Store};
use furrow_train::fit::{Plan, settings};
use furrow_train::run::{self, Results, TrainedModel};
use furrow_train::table::Experiment;
use std::borrow::Cow;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

const W: u32 = 64;
const H: u32 = 48;

/// Builds a set of images of brown ground with large green discs (crop) and small discs of almost the same green
/// (weeds).
fn set(folder: &Path, images: u64) -> PathBuf {
    set_with(folder, images, |_| true)
}

/// Builds a set in which only the images selected by number have labels.
fn set_with(folder: &Path, images: u64, labelled: impl Fn(u64) -> bool) -> PathBuf {
    let (photos, masks, out) = (folder.join("images"), folder.join("masks"), folder.join("set"));
    for k in 0..images {
        let mut stream = Stream::of(5, k, Purpose::Test, 0);
        let mut draw = |radius: f32| (stream.range32(0.0, W as f32), stream.range32(0.0, H as f32), radius);
        let discs = [draw(11.0), draw(9.0), draw(3.0), draw(2.5), draw(3.0)];
        let class = |x: u32, y: u32| {
            let inside = |(cx, cy, r): &(f32, f32, f32)| (x as f32 - cx).hypot(y as f32 - cy) < *r;
            discs.iter().find(|d| inside(d)).map_or(0, |d| if d.2 > 5.0 { 1 } else { 2 })
        };
        let labels: Vec<u8> = (0..W * H).map(|i| class(i % W, i / W)).collect();
        let mut noise = |v: u8| (f32::from(v) + stream.range32(-12.0, 12.0)) as u8;
        let colors = [[120, 95, 70], [70, 150, 50], [80, 150, 45]];
        let rgb: Vec<[u8; 3]> = labels.iter().map(|c| colors[usize::from(*c)].map(&mut noise)).collect();
        let name = format!("{k:03}.png");
        write_png(&photos.join(&name), W, H, &ImageData::Rgb(&rgb), "").unwrap();
        let labels = if labelled(k) { labels } else { vec![255; labels.len()] };
        write_png(&masks.join(&name), W, H, &ImageData::Gray(&labels), "").unwrap();
    }
    let path = |p: &Path| p.to_str().unwrap().to_owned();
    let made = Command::new(env!("CARGO_BIN_EXE_trace"))
        .args(["dataset", "import", "--format", "masks", "--images", &path(&photos), "--masks", &path(&masks)])
        .args(["--out", &path(&out)])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    out
}

fn train(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.args(arguments.split_whitespace()).stdin(Stdio::null());
    command
}

/// Returns a fast `train fit` command on the set: one thread, single precision.
fn fit(set: &Path, out: &Path, more: &str) -> Command {
    let (set, out) = (set.display(), out.display());
    train(&format!("fit --set {set}@all --out {out} --size {W}x{H} --threads 1 --precision f32 --batch 4 {more}"))
}

fn succeed(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Runs a command that must exit with `code`; returns its error message.
fn refuse(command: &mut Command, code: i32) -> String {
    let output = command.output().unwrap();
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{words}");
    words
}

fn weights(run: &Path) -> Vec<u8> {
    fs::read(run.join(run::WEIGHTS)).unwrap()
}

fn results(run: &Path) -> Results {
    run::results(run).unwrap().unwrap()
}

#[test]
fn eight_images_are_learnt_by_networks_and_judged_so() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 8);
    // The two kinds of decoder: unpooling, and skip connections. SegNet and the U-Net have the same with many more weights.
    for (network, steps, rate) in [("basic-segnet", 60, "0.003"), ("lite-unet", 100, "0.003")] {
        let out = folder.join(network);
        let more = format!(
            "--network {network} --steps {steps} --rate {rate} --augment none --class-weights none --validate-every 1000"
        );
        succeed(&mut fit(&set, &out, &more));
        let losses = results(&out).history.losses;
        let last = losses[losses.len() - 5..].iter().map(|l| l.loss).sum::<f64>() / 5.0;
        // Predicting only soil costs 0.6 of cross-entropy plus 0.67 of Dice loss for two classes; the rest is edges and
        // the smallest weeds.
        assert!(losses[0].loss > 1.0 && last < 0.35, "{network}: {} to {last}", losses[0].loss);
        succeed(&mut train(&format!("eval {} --set {} --threads 1 --precision f32", out.display(), set.display())));
        let report: furrow_train::measure::Report = run::read_json(&out.join("eval/set/report.json")).unwrap();
        assert!(report.scores.classes[1].iou.unwrap() > 0.6, "{network}: {:?}", report.scores);
        for name in ["report.html", "figure.png", "report.md"] {
            assert!(out.join("eval/set").join(name).is_file(), "{name}");
        }
        assert!(!out.join("checkpoint.safetensors").exists());
    }
}

#[test]
fn a_training_that_is_stopped_or_killed_ends_with_the_same_bytes() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 8);
    for (network, method, more) in [
        ("tiny-unet", "adam", " --crop-size 40x32 --rare-crops 0.5 --class-weights annealed --ema 0.9 --accumulate 2"),
        ("tiny-unet", "sgd", " --normalization fixed --loss entropy --class-weights median"),
    ] {
        let more = format!(
            "--network {network} --steps 24 --optimiser {method} --val {}@0..2 --validate-every 4 --patience 100{more}",
            set.display()
        );
        let whole = folder.join(format!("{method}-whole"));
        succeed(&mut fit(&set, &whole, &more));
        for (name, signal) in [("stopped", "TERM"), ("killed", "KILL")] {
            let out = folder.join(format!("{method}-{name}"));
            let mut stops = 0;
            for steps in [0, 5, 13] {
                let mut child = fit(&set, &out, &more).args(["--loaders", "3"]).stderr(Stdio::null()).spawn().unwrap();
                wait_for_steps(&out, steps, &mut child);
                let _ = Command::new("sh").arg("-c").arg(format!("kill -{signal} {}", child.id())).status();
                let begin = Instant::now();
                let status = child.wait().unwrap();
                assert!(begin.elapsed() < Duration::from_secs(60));
                stops += usize::from(!status.success());
                if signal == "TERM" {
                    // `None`: the signal arrived while the program was still loading and had no handler.
                    assert!([Some(0), Some(75), None].contains(&status.code()), "{status}");
                }
            }
            assert!(stops > 0, "every run finished before it was {name}");
            succeed(&mut fit(&set, &out, &more));
            assert_eq!(weights(&out), weights(&whole), "{method} {name}");
            assert_eq!(results(&out).history, results(&whole).history);
            let log = |run: &Path| fs::read_to_string(run.join("log.csv")).unwrap();
            assert_eq!(log(&out), log(&whole));
            let again = succeed(&mut fit(&set, &out, &more));
            assert!(again.status.success());
            assert_eq!(weights(&out), weights(&whole));
        }
    }
}

/// Expected: whichever write of a training fails (plan, logs, checkpoints or weights), exit code 1 and one error; the
/// same command then resumes and ends with the weights of an undisturbed training.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn a_training_whose_disk_fails_ends_with_the_same_bytes() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 4);
    let more = format!("--network tiny-unet --steps 4 --validate-every 2 --val {}@0..1", set.display());
    let begin = |out: &Path| fit(&set, out, &more);
    let whole = folder.join("whole");
    let undisturbed = crate::common::faults::run(begin(&whole), &whole, 0, false);
    assert!(undisturbed.output.status.success(), "{}", undisturbed.printed());
    for at in crate::common::faults::moments(undisturbed.changes, 9) {
        let out = folder.join(format!("at-{at}"));
        let ended = crate::common::faults::run(begin(&out), &out, at, at % 2 == 0);
        let message = ended.printed();
        // If an old file cannot be hard-linked under a second name, it is replaced nevertheless.
        if ended.failed != "link" || !ended.output.status.success() {
            assert_eq!(ended.output.status.code(), Some(1), "change {at}, {}: {message}", ended.failed);
            assert!(
                message.contains("error: ") && message.contains(" help: "),
                "change {at}, {}: {message}",
                ended.failed
            );
            succeed(&mut fit(&set, &out, &more));
        }
        assert_eq!(weights(&out), weights(&whole), "change {at}");
        assert_eq!(results(&out).history, results(&whole).history);
        let hidden =
            fs::read_dir(&out).unwrap().filter(|e| e.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
        assert_eq!(hidden.count(), 0, "change {at}");
    }
}

#[test]
fn seeds_decide_and_their_runs_lie_beside_each_other() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 4);
    let more = "--network tiny-unet --steps 3";
    succeed(&mut fit(&set, &folder.join("both"), &format!("{more} --seed 1,2")));
    succeed(&mut fit(&set, &folder.join("two"), &format!("{more} --seed 2")));
    assert_eq!(weights(&folder.join("both/seed-2")), weights(&folder.join("two")));
    assert_ne!(weights(&folder.join("both/seed-1")), weights(&folder.join("two")));
    succeed(&mut fit(&set, &folder.join("on"), &format!("{more} --seed 2 --init {}", folder.join("two").display())));
    assert_ne!(weights(&folder.join("on")), weights(&folder.join("two")));
    // A time budget that is too short ends the training early.
    succeed(&mut fit(&set, &folder.join("short"), "--network tiny-unet --steps 100000 --time 1s"));
    let short = results(&folder.join("short"));
    assert!(short.ended == "time" && short.steps < 100_000, "{short:?}");
}

#[test]
fn what_cannot_be_continued_is_reported() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 4);
    let out = folder.join("run");
    let more = "--network basic-segnet --steps 200 --validate-every 2";
    let mut child = fit(&set, &out, more).stderr(Stdio::null()).spawn().unwrap();
    let checkpoint = out.join("checkpoint.safetensors");
    let begin = Instant::now();
    while !checkpoint.exists() {
        assert!(begin.elapsed() < Duration::from_secs(120));
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let error = refuse(&mut fit(&set, &out, "--network basic-segnet --steps 100 --validate-every 2"), 2);
    assert!(
        error.contains("this folder contains another training") && error.contains("steps is 200 there and 100 here"),
        "{error}"
    );
    let error = refuse(&mut train(&format!("eval {} --set {}", out.display(), set.display())), 2);
    assert!(error.contains("this training is not complete"), "{error}");
    let good = fs::read(&checkpoint).unwrap();
    let mut bad = good.clone();
    let middle = bad.len() / 2;
    bad[middle] ^= 1;
    for bytes in [&bad[..], &good[..1000], b""] {
        fs::write(&checkpoint, bytes).unwrap();
        let error = refuse(&mut fit(&set, &out, more), 2);
        assert!(
            error.contains("checkpoint.safetensors") && error.contains("damaged") && error.contains("delete the file"),
            "{error}"
        );
        assert_eq!(fs::read(&checkpoint).unwrap(), bytes, "a refused file must not be changed");
    }
    let error = refuse(&mut train(&format!("eval {} --set {}", folder.join("none").display(), set.display())), 2);
    assert!(error.contains("no trained network"), "{error}");
    let error = refuse(fit(&set, &folder.join("a"), "").args(["--classes", "soil; galium=Galium aparine"]), 2);
    assert!(error.contains("Galium aparine") && error.contains("none"), "{error}");
    let error = refuse(fit(&set, &folder.join("a"), "").args(["--classes", "soil; stone; plant=crop,weed"]), 2);
    assert!(error.contains("need parts.png"), "{error}");
    let error = refuse(&mut fit(&set, &folder.join("b"), "--bands rgbn"), 2);
    assert!(error.contains("no band `nir`"), "{error}");
    let error = refuse(&mut fit(&set, &folder.join("c"), &format!("--val {}@3..9", set.display())), 2);
    assert!(error.contains("the set has 4 images"), "{error}");
    let error = refuse(&mut fit(&folder.join("nowhere"), &folder.join("d"), ""), 2);
    assert!(error.contains("this is no dataset"), "{error}");
    let error = refuse(&mut fit(&set, &folder.join("e"), &format!("--crop-size {}x{H}", W + 1)), 2);
    assert!(error.contains("--crop-size: a crop of 65 × 48 pixels is larger than the images"), "{error}");
    let error = refuse(&mut fit(&set, &folder.join("f"), "--crop-size 32x32 --rare-crops 2"), 2);
    assert!(error.contains("--rare-crops") && error.contains("write a fraction from 0 to 1"), "{error}");
    for name in ["a", "b", "c", "d", "e", "f"] {
        assert!(!folder.join(name).exists(), "{name} was created");
    }
}

#[test]
fn weights_of_other_classes_and_damaged_ones_are_refused() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 4);
    let (three, two) = (folder.join("three"), folder.join("two"));
    succeed(&mut fit(&set, &three, "--network tiny-unet --steps 1"));
    succeed(fit(&set, &two, "--network tiny-unet --steps 1").args(["--classes", "soil; plant=crop,weed"]));
    assert_eq!(TrainedModel::open(&two).unwrap().card.classes.names(), ["soil", "plant"]);
    let kept = folder.join("kept.safetensors");
    fs::copy(three.join(run::WEIGHTS), &kept).unwrap();
    fs::copy(two.join(run::WEIGHTS), three.join(run::WEIGHTS)).unwrap();
    let eval = |run: &Path| train(&format!("eval {} --set {} --threads 1", run.display(), set.display()));
    let error = refuse(&mut eval(&three), 1);
    assert!(error.contains("not the weights that model.json"), "{error}");
    let error = refuse(
        &mut fit(&set, &folder.join("on"), &format!("--network tiny-unet --steps 1 --init {}", two.display())),
        2,
    );
    assert!(
        error.contains("not those of tiny-unet with 3 bands and 3 classes") && error.contains("head.conv"),
        "{error}"
    );
    // No file is left that would block the corrected command.
    assert!(!folder.join("on").exists());
    for (other, stated) in [
        ("--network segnet", "--network tiny-unet"),
        ("--network tiny-unet --normalization fixed", "--normalization band"),
    ] {
        let other = format!("{other} --steps 1 --init {}", three.display());
        fs::copy(&kept, three.join(run::WEIGHTS)).unwrap();
        let error = refuse(&mut fit(&set, &folder.join("on"), &other), 2);
        assert!(error.contains("cannot start from a run with") && error.contains(stated), "{error}");
    }
    // Model cards that would exhaust memory, divide by zero or name files elsewhere.
    let card = two.join(run::MODEL);
    let text = fs::read_to_string(&card).unwrap();
    let forged = [
        ("width", "\"width\": 64", "\"width\": 1000000000", "networks do not support 1000000000"),
        ("height", "\"height\": 48", "\"height\": 0", "networks do not support"),
        ("side", "\"height\": 48", "\"height\": 16", "networks do not support 64 × 16"),
        ("bands", "\"green\"", "\"red\"", "are not valid bands"),
        ("classes", "\"name\": \"plant\"", "\"name\": \"soil\"", "each class needs a name of its own"),
        ("labels", "\"crop\",", "\"soil\",", "a label belongs to one class alone"),
        ("network", "\"tiny-unet\"", "\"segnet\"", "parameters: this network"),
        (
            "normalisation",
            "\"normalisation\": \"band\"",
            "\"normalisation\": {\"fixed\": {\"mean\": [0.5], \"sd\": [0.1]}}",
            "is not one of 3 bands",
        ),
        ("no pixel", "\"weights\":", "\"pixel_mm\": 0.0, \"weights\":", "pixels is not 0.001 to 10000 mm"),
        ("large pixel", "\"weights\":", "\"pixel_mm\": 1e9, \"weights\":", "pixels is not 0.001 to 10000 mm"),
        ("vast pixel", "\"weights\":", "\"pixel_mm\": 1e308, \"weights\":", "pixels is not 0.001 to 10000 mm"),
        ("resize", "\"weights\":", "\"resize\": {\"scale\": 0.0}, \"weights\":", "not by 0"),
        ("sides", "\"weights\":", "\"resize\": {\"long_sides\": [1000000000]}, \"weights\":", "long sides are 1 to 8"),
        ("refine", "\"weights\":", "\"refine\": \"all\", \"weights\":", "there is no refinement `all`"),
        (
            "weights",
            "\"weights.safetensors\"",
            "\"../w.safetensors\"",
            "names `../w.safetensors`, which does not lie in it",
        ),
    ];
    for (what, good, bad, words) in forged {
        let compact = |s: &str| s.replace(": ", ":");
        let changed =
            if text.contains(good) { text.replace(good, bad) } else { text.replace(&compact(good), &compact(bad)) };
        assert_ne!(changed, text, "{what}: {text}");
        fs::write(&card, changed).unwrap();
        let error = refuse(&mut eval(&two), 2);
        assert!(error.contains(words), "{what}: {error}");
    }
    fs::write(&card, &text).unwrap();
    // Weights that no training writes, with matching checksums.
    let sound = TrainedModel::open(&two).unwrap();
    for (end, value, words) in [
        (".weight", f32::NAN, "contains values that are not finite"),
        (".running_var", -1.0, "contains variances below 0"),
    ] {
        let mut model = sound.clone();
        model.values.iter_mut().find(|array| array.name.ends_with(end)).unwrap().values[0] = value;
        model.card.weights_sha256 = furrow_train::weights::hash(&model.values);
        model.write(&two).unwrap();
        let error = refuse(&mut eval(&two), 2);
        assert!(error.contains("weights.safetensors") && error.contains(words), "{error}");
    }
    sound.write(&two).unwrap();
    let path = two.join(run::WEIGHTS);
    let mut bytes = fs::read(&path).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 64;
    fs::write(&path, &bytes).unwrap();
    let error = refuse(&mut eval(&two), 1);
    assert!(error.contains("weights.safetensors") && error.contains("damaged"), "{error}");
}

#[test]
fn batches_do_not_depend_on_threads_or_on_where_a_training_goes_on() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 5);
    let shape = Shape { bands: Band::RGB.to_vec(), width: 40, height: 32 };
    let store = |memory| {
        let all = Selection { repeat: 2, ..Selection::of(&set) };
        Arc::new(Store::open(&[all], Pick::All, 1, &Classes::default(), &shape, false, memory).unwrap())
    };
    let (seed, batch, crop_size) = (3, 3, (32, 24));
    let (augment, normalization) = (Augment::default(), Normalization::Image);
    let order = BatchSettings { seed, batch, crop_size, rare: 0.5, augment, pixels: None, naming: None, normalization };
    let batches = |memory, from, threads| -> Vec<_> {
        Loader::start(&store(memory), &order, from, 12, threads).unwrap().map(|b| b.unwrap()).collect()
    };
    let plain = batches(1 << 30, 0, 1);
    assert_eq!(plain.len(), 12);
    assert!(plain.iter().all(|b| b.pixels.len() == 3 * 32 * 24 * 3 && b.labels.len() == 3 * 32 * 24));
    assert_eq!(plain, batches(0, 0, 4));
    assert_eq!(plain[7..], batches(1 << 30, 7, 3));
    assert_ne!(plain[0], plain[1]);
}

/// Rationale: several threads load images, and in the first epoch none is cached. Expected: with a memory budget of
/// exactly all images, all are cached, however many threads read the same image at the same time. Source: the sizes of
/// the images.
#[test]
fn threads_that_read_the_same_image_at_once_do_not_shrink_the_cache() {
    let scratch = tempfile::tempdir().unwrap();
    let set = set(scratch.path(), 6);
    let shape = Shape { bands: Band::RGB.to_vec(), width: W, height: H };
    let store =
        |memory| Store::open(&[Selection::of(&set)], Pick::All, 1, &Classes::default(), &shape, false, memory).unwrap();
    let all: u64 = (0..6).map(|place| store(0).get(place).unwrap().bytes()).sum();
    let store = store(all);
    let barrier = std::sync::Barrier::new(16);
    std::thread::scope(|scope| {
        for _ in 0..16 {
            scope.spawn(|| {
                for place in 0..3 {
                    barrier.wait();
                    drop(store.get(place).unwrap());
                }
            });
        }
    });
    for _ in 0..2 {
        (0..6).for_each(|place| drop(store.get(place).unwrap()));
    }
    let kept = (0..6).filter(|place| matches!(store.get(*place).unwrap(), Cow::Borrowed(_))).count();
    assert_eq!(kept, 6, "images in memory");
}

/// Rationale: a crop may contain no labelled pixel. Expected: such a batch has no loss, so it does not enter the loss
/// curve, not even as 0; the others do. Source: the cross-entropy of an untrained network, which is far from 0.
#[test]
fn a_batch_without_labels_has_no_loss() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set_with(folder, 4, |k| k < 2);
    let out = folder.join("run");
    let set_all = set.display();
    let out_path = out.display();
    succeed(&mut train(&format!(
        "fit --set {set_all}@all --out {out_path} --size {W}x{H} --threads 1 --precision f32 --batch 1 --steps 12 --network tiny-unet"
    )));
    let losses = results(&out).history.losses;
    assert_eq!(losses.len(), 6, "{losses:?}");
    assert!(losses.iter().all(|l| l.loss > 0.1), "{losses:?}");
    assert!(out.join("report.html").is_file());
}

/// Rationale: a default written in several places diverges sooner or later. Expected: every hyper-parameter is a flag
/// whose `--help` shows the default in the code; an experiment file without values has the same defaults. Source:
/// `Plan::default`.
#[test]
fn help_experiment_files_and_code_have_the_same_defaults() {
    let help = String::from_utf8(succeed(&mut train("fit --help")).stdout).unwrap();
    let all = settings::defaults();
    assert!(all.len() >= 16);
    for (field, default) in all {
        let flag = format!("--{} <", field.replace('_', "-"));
        let (_, about) = help.split_once(&flag).unwrap_or_else(|| panic!("no {flag} in\n{help}"));
        let about = about.split("\n      --").next().unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
        // clap quotes defaults that contain spaces.
        let shown = [format!("[default: {default}]"), format!("[default: \"{default}\"]")];
        assert!(shown.iter().any(|default| about.contains(default)), "{field}: {about}");
    }
    let page = RonFile::of(
        r#"Experiment(networks: ["unet"], sets: {"a": Real()}, train: [(name: "A", from: [(set: "a", images: "0..4")])],
            test: [(name: "T", set: "a", images: "5..6")])"#,
    );
    let experiment = Experiment::of(&page, None).unwrap();
    assert_eq!((experiment.plan, experiment.seeds), (Plan::default(), vec![Plan::default().seed]));
}

/// Rationale: users search for standard terms. Expected: each term is in the help of some subcommand.
#[test]
fn help_has_the_words_of_the_field() {
    let verbs = ["", "fit", "eval", "predict", "calibrate", "export", "baseline", "table"];
    let help: String = verbs
        .iter()
        .map(|verb| String::from_utf8(succeed(&mut train(&format!("{verb} --help"))).stdout).unwrap().to_lowercase())
        .collect();
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    for word in [
        "loss",
        "training set",
        "validation set",
        "test set",
        "validation pass",
        "input normalization",
        "class weights",
        "threshold",
        "oversampling",
        "predict",
        "calibrate",
        "learning rate",
        "data augmentation",
        "batch size",
    ] {
        assert!(help.contains(word), "{word}");
    }
}

/// Rationale: a network segments the classes it over-predicts too wide. Expected: calibration increases the mean IoU of
/// the images used for it; `calibrate` and `fit --calibrate` give the same bits; an existing network is not
/// overwritten. Source: the command's help.
#[test]
fn calibrated_a_network_overlaps_better() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 6);
    let (plain, both, even) = (folder.join("plain"), folder.join("both"), folder.join("even"));
    let more = "--network tiny-unet --steps 30 --class-weights median";
    succeed(&mut fit(&set, &plain, more));
    succeed(&mut fit(&set, &both, &format!("{more} --calibrate 6")));
    let calibrate = || {
        let (run, set, out) = (plain.display(), set.display(), even.display());
        train(&format!("calibrate {run} --set {set}@all --images 6 --out {out} --threads 1 --precision f32"))
    };
    succeed(&mut calibrate());
    assert_eq!(TrainedModel::open(&even).unwrap().values, TrainedModel::open(&both).unwrap().values);
    assert_ne!(TrainedModel::open(&even).unwrap().values, TrainedModel::open(&plain).unwrap().values);
    let scores = |run: &Path| {
        let out = folder.join("eval").join(run.file_name().unwrap());
        succeed(&mut train(&format!("eval {} --set {}@all --out {}", run.display(), set.display(), out.display())));
        let report: furrow_train::measure::Report = run::read_json(&out.join("report.json")).unwrap();
        report.scores.mean_iou.unwrap()
    };
    let (before, after) = (scores(&plain), scores(&even));
    assert!(after > before + 0.02, "{before}, then {after}");
    let error = refuse(&mut calibrate(), 2);
    assert!(error.contains("there is a trained model in this folder already"), "{error}");
}

/// Rationale: logit adjustment makes a network that misses plants find more, by changing only its biases. Expected: all
/// weights as without the adjustment, except that the biases of plants are higher by τ ln(soil / plants); one error if
/// soil is not the first class or biases are calibrated as well. Source: the rule.
#[test]
fn adjusted_logits_are_other_biases_and_nothing_else() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 4);
    let (plain, adjusted) = (folder.join("plain"), folder.join("adjusted"));
    let more = "--network tiny-unet --steps 3";
    succeed(&mut fit(&set, &plain, more));
    succeed(&mut fit(&set, &adjusted, &format!("{more} --logit-adjustment 0.5")));
    let shape = Shape { bands: Band::RGB.to_vec(), width: W, height: H };
    let selection = Selection::parse(&format!("{}@all", set.display())).unwrap();
    let store = Store::open(&[selection], Pick::All, 1, &Classes::default(), &shape, false, 1 << 30).unwrap();
    let labels: Vec<u8> = (0..4).flat_map(|place| store.get(place).unwrap().labels.clone()).collect();
    let pixels = |classes: std::ops::Range<u8>| labels.iter().filter(|&label| classes.contains(label)).count() as f64;
    let (soil, plants) = (pixels(0..1), pixels(1..3));
    let offset = (0.5 * (soil / plants).ln()) as f32;
    let both = [&plain, &adjusted].map(|run| TrainedModel::open(run).unwrap().values);
    for (before, after) in both[0].iter().zip(&both[1]) {
        if before.name == "head.conv.bias" {
            let moved: Vec<f32> = before.values.iter().zip(&after.values).map(|(a, b)| b - a).collect();
            assert!(moved[0] == 0.0 && moved[1..].iter().all(|m| (m - offset).abs() < 1e-5), "{moved:?} for {offset}");
        } else {
            assert_eq!(before, after);
        }
    }
    for (more, words) in [
        ("--logit-adjustment 0.5 --classes plant=crop,weed;soil", "the first class is not soil"),
        ("--logit-adjustment 0.5 --calibrate 2", "calibration sets the same biases"),
        ("--logit-adjustment 3", "3 is out of range"),
        ("--refine plants --classes plant=crop,weed;soil", "the first class must be soil"),
        ("--refine colour --bands nir", "needs the bands red, green and blue"),
    ] {
        let message = refuse(&mut fit(&set, &folder.join("refused"), more), 2);
        assert!(message.contains(words) && !folder.join("refused").exists(), "{message}");
    }
}

/// Rationale: manual masks are dilated relative to the leaf; a network that is tested on them should learn from
/// rendered labels dilated by the same distance. Expected: with a margin of 2 pixels, soil within 2 pixels of a plant
/// becomes plant; all other labels and the images stay the same. A set with a margin is a different training set.
/// Source: distances to all plant pixels.
#[test]
fn outlines_are_learnt_where_people_draw_them() {
    let scratch = tempfile::tempdir().unwrap();
    let set = set(scratch.path(), 3);
    let shape = Shape { bands: Band::RGB.to_vec(), width: W, height: H };
    let read = |text: &str| {
        let selection = Selection::parse(&format!("{}{text}", set.display())).unwrap();
        let identity = selection.identity(Pick::All, 1).unwrap();
        let store = Store::open(&[selection], Pick::All, 1, &Classes::default(), &shape, false, 1 << 30).unwrap();
        ((0..3).map(|place| store.get(place).unwrap().into_owned()).collect::<Vec<_>>(), identity)
    };
    let ((plain, own), (wide, other)) = (read(""), read("@all+2px"));
    assert_ne!(own.0, other.0);
    assert_eq!(own.1, other.1);
    for (plain, wide) in plain.iter().zip(&wide) {
        assert_eq!(plain.planes, wide.planes);
        let near = |i: usize, reach: f32| {
            let (x, y) = ((i as u32 % W) as f32, (i as u32 / W) as f32);
            let plants = plain.labels.iter().enumerate().filter(|(_, l)| **l > 0);
            plants.map(|(k, _)| (k as u32 % W, k as u32 / W)).any(|(u, v)| (u as f32 - x).hypot(v as f32 - y) <= reach)
        };
        for (i, (before, after)) in plain.labels.iter().zip(&wide.labels).enumerate() {
            let expected = if *before > 0 { before == after } else { (*after > 0) == near(i, 2.5) };
            assert!(expected, "{i}: {before} {after}");
        }
    }
}

/// Rationale: users who train overnight want to see in the first hour whether the network learns. Expected: log rows
/// are written while the training runs; after interruptions, kills and restarts both logs contain each step once;
/// TensorBoard's own reader finds the same numbers, and the validation images. Source: PyPI's tensorboard 2.20.0,
/// `tests/train/check_events.py`.
#[test]
fn logs_grow_while_it_trains_and_tensorboard_reads_them() {
    let scratch = tempfile::tempdir().unwrap();
    let set = set(scratch.path(), 6);
    let out = scratch.path().join("run");
    let more =
        format!("--network basic-segnet --steps 40 --patience 99 --val {}@0..2 --validate-every 4", set.display());
    let mut child = fit(&set, &out, &more).stderr(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    let rows = || fs::read_to_string(out.join("log.csv")).unwrap_or_default().lines().count();
    while rows() < 5 {
        assert!(begin.elapsed() < Duration::from_secs(120));
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(!out.join(run::RESULT).exists());
    let _ = Command::new("sh").arg("-c").arg(format!("kill -INT {}", child.id())).status();
    child.wait().unwrap();
    // A report of the results so far.
    let losses = scratch.path().join("losses");
    let mut report = Command::new(env!("CARGO_BIN_EXE_train"));
    succeed(report.arg("report").arg(&out).arg("--out").arg(&losses));
    let page = fs::read_to_string(losses.join("losses.html")).unwrap();
    assert!(page.contains("not done") && page.contains("cross-entropy + soft Dice loss"), "{page}");
    // Resumed and killed half a second later, possibly in the middle of a record; then resumed to the end. The file
    // only grows.
    let events = out.join("training.tfevents");
    let before = fs::read(&events).unwrap();
    let mut child = fit(&set, &out, &more).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    child.kill().unwrap();
    child.wait().unwrap();
    let mut torn = fs::OpenOptions::new().append(true).open(&events).unwrap();
    torn.write_all(&[40, 0, 0]).unwrap();
    succeed(&mut fit(&set, &out, &more));
    assert_eq!(rows(), 1 + 40);
    assert!(fs::read(&events).unwrap().starts_with(&before), "existing records must stay, for programs that read them");
    if let Some(python) = python("import tensorboard, PIL") {
        ask(&python, "train/check_events.py", &[out.to_str().unwrap()]);
    }
}

/// Rationale: returning freed buffers to the operating system costs 10–20 % of a training step. Expected: the training
/// runs with environment variables that keep them, unless the user sets the C library's memory options. Source:
/// proc(5), mallopt(3).
#[test]
fn a_training_keeps_its_memory() {
    let scratch = tempfile::tempdir().unwrap();
    let set = set(scratch.path(), 4);
    let environment = |name: &str, own: &[(&str, &str)]| {
        let out = scratch.path().join(name);
        let mut command = fit(&set, &out, "--network tiny-unet --steps 2000 --validate-every 1");
        let mut child = command.envs(own.iter().copied()).stderr(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        while !out.join("checkpoint.safetensors").exists() {
            assert!(begin.elapsed() < Duration::from_secs(120));
            std::thread::sleep(Duration::from_millis(20));
        }
        let environment = fs::read(format!("/proc/{}/environ", child.id())).unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        String::from_utf8(environment).unwrap()
    };
    let kept = environment("kept", &[("OMP_WAIT_POLICY", "active")]);
    assert!(kept.contains("MALLOC_MMAP_MAX_=0\0") && kept.contains("OMP_WAIT_POLICY=active\0"), "{kept}");
    let usual = environment("usual", &[("MALLOC_TOP_PAD_", "131072")]);
    assert!(!usual.contains("MALLOC_MMAP_MAX_") && usual.contains("OMP_WAIT_POLICY="), "{usual}");
}

#[test]
fn the_size_of_green_regions_is_a_baseline_of_its_own() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let set = set(folder, 6);
    let mean = |kind: &str| {
        let out = folder.join(kind);
        let set = set.display();
        succeed(&mut train(&format!(
            "baseline {kind} --from {set}@0..4 --set {set}@4..6 --size {W}x{H} --out {}",
            out.display()
        )));
        let report: furrow_train::measure::Report = run::read_json(&out.join("report.json")).unwrap();
        report.scores
    };
    let (colour, size) = (mean("exg"), mean("exg-size"));
    assert_eq!(colour.classes[2].iou, Some(0.0));
    assert!(size.classes[2].iou.unwrap() > 0.5 && size.mean_iou > colour.mean_iou, "{size:?}");
    assert!(size.vegetation.iou.unwrap() > 0.9);
}
