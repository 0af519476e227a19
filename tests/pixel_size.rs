//! Ground sampling distance: images are resized to the pixel size that a network was trained on, and crops to requested
//! pixel sizes.
//!
//! Rationale: to a network, a plant twice as large in pixels is a different plant, and a wrong factor causes no error
//! message.
//!
//! Expected: a run records the pixel size that follows from its camera's geometry. For images with pixels twice as
//! large, `predict` and `eval` give the results of images at twice the size. Crops are scaled by the pixel size of
//! their own image; images without a recorded pixel size are refused if it is needed. Source: `tests/ref/small.ron`,
//! and the output of `train fit --help` and `train predict --help`.

use crate::common::dataset::{fail, path, succeed};
use crate::common::program::{names, small_text, trace};
use crate::common::training::{SET, SIZE, learnt, pictures, stirred};
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::classes::Classes;
use furrow_output::ImageData;
use furrow_train::data::{
    Augment, AugmentScale, Band, Batch, BatchSettings, Crop, Ground, Loader, Normalization, Pick, Selection, Shape,
    Store,
};
use furrow_train::deploy::input_images::Prediction;
use furrow_train::fit::hyper::NormalizationMode;
use furrow_train::measure::Report;
use furrow_train::net::Network;
use furrow_train::run::{self, TrainedModel};
use furrow_train::table::Experiment;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

fn train(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.args(arguments).args(["--precision", "f32", "--threads", "1"]);
    command
}

/// Writes a network whose predictions contain all classes into a folder.
fn network(folder: &Path) -> TrainedModel {
    let network = stirred(&learnt(Network::BasicSegnet, "rgb", NormalizationMode::Image), 5);
    network.write(&folder.join("run")).unwrap();
    network
}

#[test]
fn pictures_are_brought_to_the_pixels_that_a_network_was_trained_on() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let trained = network(folder);
    let mm = trained.card.pixel_mm.unwrap();
    // 0.45 m above the ground, 6° from the vertical, 40° across 64 pixels.
    let expected = 450.0 / 6f64.to_radians().cos() * 2.0 * 20f64.to_radians().tan() / 64.0;
    assert!((mm / expected - 1.0).abs() < 0.005, "{mm} mm, by geometry {expected}");

    let (run, some) = (folder.join("run"), format!("{}@0..3", path(&SET)));
    let twice = (2.0 * mm).to_string();
    let predict =
        |out: &Path, more: &[&str]| train(&[&["predict", path(&run), &some, "--out", path(out)][..], more].concat());
    let masks = |out: &Path| -> Vec<Vec<u8>> {
        let is_png = |name: &str| Path::new(name).extension().is_some_and(|ending| ending == "png");
        let is_mask = |name: &&String| is_png(name) && !name.contains("overlay");
        names(out).iter().filter(is_mask).map(|name| furrow_output::read_indexed(&out.join(name)).unwrap().2).collect()
    };
    let out = |name: &str| folder.join(name);
    succeed(predict(&out("twice"), &["--pixel-mm", &twice]));
    // 64 × 48 pixels become 128 × 96.
    succeed(predict(&out("long"), &["--resize", "128"]));
    succeed(predict(&out("same"), &[]));
    assert_eq!(masks(&out("twice")).len(), 3);
    assert!(masks(&out("twice")) == masks(&out("long")), "images with pixels twice as large are not enlarged by two");
    assert!(masks(&out("twice")) != masks(&out("same")), "the pixel size has no effect");

    let recorded = |name: &str| -> Prediction { run::read_json(&out(name).join("prediction.json")).unwrap() };
    assert_eq!((recorded("twice").pixel_mm, recorded("twice").resize.as_str()), (Some(2.0 * mm), "× 2.000"));
    assert_eq!((recorded("same").pixel_mm, recorded("same").resize.as_str()), (None, "stretch"));
    let message = fail(predict(&out("twice"), &["--pixel-mm", &(2.000001 * mm).to_string()]), 2);
    assert!(message.contains("this folder holds predictions at other sizes"), "{message}");

    let eval = |name: &str, more: &[&str]| -> (Report, String) {
        let out = out(name);
        succeed(train(&[&["eval", path(&run), "--set", &some, "--out", path(&out)][..], more].concat()));
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        (run::read_json(&out.join("report.json")).unwrap(), page)
    };
    let (by_pixels, page) = eval("eval-twice", &["--pixel-mm", &twice]);
    assert_eq!(by_pixels.scores, eval("eval-long", &["--resize", "128"]).0.scores);
    assert_ne!(by_pixels.scores, eval("eval-same", &[]).0.scores);
    assert!(page.contains("size × 2.000"), "the report does not contain the factor");

    for (value, words) in [
        ("0", "an image is scaled by 0.02 to 50"),
        ("-1", "an image is scaled by"),
        ("nan", "an image is scaled by"),
        ("9000", "the network was trained on pixels of 5.1"),
    ] {
        let message = fail(predict(&out("none"), &[&format!("--pixel-mm={value}")]), 2);
        assert!(message.contains(words), "{value}: {message}");
    }
    let message = fail(predict(&out("none"), &["--pixel-mm", "2", "--resize", "64"]), 2);
    assert!(message.contains("cannot be used with"), "{message}");
    let mut without_size = trained;
    without_size.card.pixel_mm = None;
    without_size.write(&run).unwrap();
    let message = fail(predict(&out("none"), &["--pixel-mm", "2"]), 2);
    assert!(
        message.contains("training images do not record their ground sampling distance")
            && message.contains("--resize"),
        "{message}"
    );
    assert!(!out("none").exists());
}

/// Expected: the crop of each image in an epoch is scaled by its own pixel size. Source: [`Augment::apply`] with each
/// size.
#[test]
fn crops_are_scaled_by_the_pixels_of_their_own_image() {
    let (image, size) = (SIZE, (32, 32));
    let shape = Shape { bands: Band::RGB.to_vec(), width: image.0, height: image.1 };
    let all = Selection { pick: Some(Pick::All), ..Selection::of(SET.as_path()) };
    let store = Store::open(&[all], Pick::All, 1, &Classes::default(), &shape, false, 1 << 28).unwrap();
    let store = Arc::new(store);
    let recorded = store.pixel_sizes_mm().unwrap();
    assert!(recorded.len() == 8 && recorded.iter().all(|mm| (mm - recorded[0]).abs() < 1e-9), "{recorded:?}");

    let (range_mm, sizes) = ((1.0, 2.0), (0..8).map(|k| 1.0 + 0.25 * f64::from(k)).collect::<Vec<_>>());
    let pixels = AugmentScale::PixelMm(range_mm.0, range_mm.1).of(|| Ok(sizes.clone())).unwrap();
    let augment = Augment { scale: true, ..Augment::NONE };
    let normalization = Normalization::Image;
    let order = BatchSettings {
        seed: 3,
        batch: 4,
        crop_size: size,
        rare: 0.0,
        augment,
        pixels,
        naming: None,
        normalization: normalization.clone(),
    };
    let batches: Vec<Batch> = Loader::start(&store, &order, 0, 2, 1).unwrap().collect::<Result<_, _>>().unwrap();
    let mut seen: Vec<usize> = Vec::new();
    for (place, found) in batches.iter().flat_map(|batch| batch.pixels.chunks_exact(32 * 32 * 3)).enumerate() {
        let expected = |k: usize| {
            let crop = Crop { image, size, rare: 0.0, ground: Some(Ground { pixel_mm: sizes[k], range_mm }) };
            let mut stream = Stream::of(3, place as u64, Purpose::Training, 2);
            augment.apply(&store.get(k).unwrap(), &crop, &[true; 3], &normalization, &mut stream).pixels
        };
        seen.extend((0..8).filter(|k| expected(*k) == found));
    }
    seen.sort_unstable();
    assert_eq!(seen, (0..8).collect::<Vec<_>>());
}

/// Imports synthetic images with soil labels: a dataset without camera records.
fn imported(folder: &Path) -> PathBuf {
    let (photos, masks, out) = (folder.join("photos"), folder.join("masks"), folder.join("imported"));
    let (w, h) = SIZE;
    for k in 0..2 {
        let (name, pixels) = (format!("{k}.png"), pictures(1, SIZE, 3, k));
        furrow_output::write_png(&photos.join(&name), w, h, &ImageData::Rgb(pixels.as_chunks().0), "").unwrap();
        furrow_output::write_png(&masks.join(&name), w, h, &ImageData::Gray(&vec![0; (w * h) as usize]), "").unwrap();
    }
    let mut import = trace(&["dataset", "import", "--format", "masks", "--images", path(&photos)]);
    import.args(["--masks", path(&masks), "--out", path(&out)]);
    succeed(import);
    out
}

/// Expected: the plan contains the scale range only if one is requested. Datasets without recorded pixel sizes, an
/// invalid range, and a range without the scale augmentation are refused and leave no folder. A range of a single size
/// and an encoder that is never trained cause warnings. Experiment files accept the same values.
#[test]
fn a_range_of_pixel_sizes_is_asked_for_and_refused_with_words() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let fit = |set: &Path, out: &str, more: &[&str]| {
        let set = format!("{}@0..2", path(set));
        let how = ["--network", "basic-segnet", "--size", "64x48", "--steps", "2", "--batch", "2"];
        let out = folder.join(out);
        train(&[&["fit", "--set", &set, "--out", path(&out)][..], &how, more].concat())
    };
    let plan = |out: &str| -> serde_json::Value { run::read_json(&folder.join(out).join(run::PLAN)).unwrap() };
    let message = |output: &std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let plain = succeed(fit(&SET, "plain", &[]));
    assert!(
        plan("plain")["plan"].get("augment_scale").is_none() && !message(&plain).contains("warning"),
        "{}",
        message(&plain)
    );
    let auto = succeed(fit(&SET, "auto", &["--augment-scale", "auto", "--freeze", "2"]));
    assert_eq!(plan("auto")["plan"]["augment_scale"], "auto");
    assert!(
        message(&auto).contains("warning: --augment-scale auto: all crops have pixels of 5.1"),
        "{}",
        message(&auto)
    );
    assert!(message(&auto).contains("warning: the encoder keeps its random weights"), "{}", message(&auto));
    let range = succeed(fit(&SET, "range", &["--augment-scale", "3..8"]));
    assert_eq!(plan("range")["plan"]["augment_scale"]["pixel_mm"], serde_json::json!([3.0, 8.0]));
    assert!(!message(&range).contains("warning"), "{}", message(&range));
    let weights = |out: &str| std::fs::read(folder.join(out).join(run::WEIGHTS)).unwrap();
    assert!(weights("range") != weights("plain"), "the range has no effect");

    let imported = imported(folder);
    for (set, more, words) in [
        (&imported, vec!["--augment-scale", "auto"], "image 000000 does not record its pixel size on the ground"),
        (&imported, vec!["--augment-scale", "3..8"], "leave this option out for them"),
        (
            &*SET,
            vec!["--augment-scale", "8..3"],
            "write relative, auto, or a range of millimetres a pixel such as 0.3..2",
        ),
        (
            &*SET,
            vec!["--augment-scale", "auto", "--augment", "flip"],
            "`scale` is not among the augmentations, which are flip",
        ),
    ] {
        let message = fail(fit(set, "refused", &more), 2);
        assert!(message.contains(words) && message.contains("--augment-scale"), "{more:?}: {message}");
        assert!(!folder.join("refused").exists(), "{more:?} has left a folder");
    }
    succeed(fit(&imported, "imported-run", &[]));

    let file = |scale: &str| {
        let text = r#"Experiment(networks: ["unet"], sets: {"a": Real()}, train: [(name: "A", from: [(set: "a", images: "0..4")])],
            test: [(name: "T", set: "a", images: "5..6")], hyperparameters: (augment_scale: "SCALE"))"#;
        Experiment::of(&RonFile::of(&text.replace("SCALE", scale)), None)
    };
    assert_eq!(file("0.3..2").unwrap().plan.hyper.augment_scale, AugmentScale::PixelMm(0.3, 2.0));
    let words = file("2..0.3").unwrap_err().to_string();
    assert!(words.contains("there is no scale `2..0.3`"), "{words}");
}

/// An experiment on `frames`, bound to `set`, and on a scene; it takes at most seconds because nothing is rendered.
fn table(file: &Path, set: &Path, out: &Path, more: &[&str]) -> Command {
    let real = format!("frames={}", path(set));
    train(&[&["table", path(file), "--real", &real, "--out", path(out)][..], more].concat())
}

/// Rationale: rendering a dataset takes hours, and only the training after it would refuse it. Expected: a training set
/// without recorded pixel sizes is refused at the `augment_scale` that applies to it (its own, the scale's or the
/// experiment's), with exit code 2 and before anything is written, in a dry run as in a real run. Test images may lack
/// pixel sizes, and `relative` needs none. Source: none.
#[test]
fn unscalable_crops_are_reported_before_anything_is_rendered() {
    let scratch = tempfile::tempdir().unwrap();
    let (folder, out) = (scratch.path(), scratch.path().join("out"));
    let imported = imported(folder);
    let scene = |name: &str, pitch_deg: &str| {
        let text = small_text().replace("pitch_deg: 6", &format!("pitch_deg: {pitch_deg}"));
        std::fs::write(folder.join(name), text).unwrap();
    };
    scene("down.ron", "6");
    scene("level.ron", "100");
    let text = r#"Experiment(
    networks: ["unet"],
    sets: {"frames": Real(), "scene": Scene(file: "SCENE", count: 10, size: (48, 36))},
    train: [(name: "Rendered", from: [(set: "scene", images: "PICK")]), (name: "Real", from: [(set: "frames", images: "0..1")] OWN)],
    test: [(name: "T", set: "frames", images: "1..2")],
    hyperparameters: (size: (64, 48) ALL),
    scales: {"less": (hyperparameters: (steps: 2 LESS))},
)"#;
    let file = folder.join("experiment.ron");
    let write = |filled: &[(&str, &str)]| {
        let usual = [("SCENE", "down.ron"), ("PICK", "train"), (" OWN", ""), (" ALL", ""), (" LESS", "")];
        let all = filled.iter().chain(&usual);
        let text = all.fold(text.to_owned(), |text, (word, value)| text.replace(word, value));
        std::fs::write(&file, text).unwrap();
    };
    let auto = r#", augment_scale: "auto""#;
    let own = r#", hyperparameters: (augment_scale: "3..8")"#;
    let no_image = "no image of the set `frames` records its ground sampling distance";
    let folders = folder.join("photos-and-masks");
    std::fs::create_dir_all(&folders).unwrap();
    std::fs::rename(folder.join("photos"), folders.join("images")).unwrap();
    std::fs::rename(folder.join("masks"), folders.join("labels")).unwrap();
    for (filled, set, line, words) in [
        (vec![(" ALL", auto)], &imported, 6, "`Real` cannot be trained with \"auto\": image 000000 of the set"),
        (vec![(" ALL", auto)], &folders, 6, no_image),
        (vec![(" ALL", auto), (" OWN", own)], &folders, 4, "`Real` cannot be trained with \"3..8\": no image"),
        (vec![(" LESS", auto)], &folders, 7, no_image),
        (vec![(" ALL", auto), ("SCENE", "level.ron")], &*SET, 6, "image 000000 of the set `scene` does not record"),
        (vec![(" ALL", auto), ("SCENE", "level.ron"), ("PICK", "4..6")], &*SET, 6, "image 000004 of the set"),
        (vec![(" ALL", auto), ("SCENE", "level.ron"), ("PICK", "random:2")], &*SET, 6, "of the set `scene` does not"),
    ] {
        write(&filled);
        let scale: &[&str] = if line == 7 { &["--scale", "less"] } else { &[] };
        for more in [&["--dry-run"][..], &[]] {
            let message = fail(table(&file, set, &out, &[more, scale].concat()), 2);
            assert!(
                message.contains(&format!("experiment.ron:{line}:")) && message.contains(words),
                "{filled:?}: {message}"
            );
            assert!(!out.exists(), "{filled:?}");
        }
    }
    for (filled, set) in [
        (vec![], &folders),
        (vec![(" LESS", auto)], &folders),
        (vec![(" ALL", auto), (" OWN", r#", hyperparameters: (augment_scale: "relative")"#)], &folders),
        (vec![(" ALL", auto)], &*SET),
    ] {
        write(&filled);
        succeed(table(&file, set, &out, &["--dry-run"]));
        assert!(!out.exists(), "{filled:?}");
    }
}
