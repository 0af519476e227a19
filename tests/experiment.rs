//! Experiments: valid experiment files, their results, and reuse of finished work. Mock callbacks replace the networks,
//! so no libtorch is needed; `tests/table.rs` runs the program itself.
//!
//! Rationale: an experiment takes hours on several machines that stop and start. Expected: invalid experiment files are
//! refused with the position of the fault before anything is written; the files are the same for any order of work and
//! any interruptions; table figures are means of the runs' figures. Source: Di Cicco et al. 2017 for the contents of
//! the tables; equality is exact.

use crate::common::dataset::{make, same, succeed, tree};
use furrow_base::error::Kind;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_dataset::make::generate::Shard;
use furrow_dataset::model::classes::Classes;
use furrow_train::baseline::files;
use furrow_train::data::{Normalization, Pick, Resize, Selection, Shape, Store};
use furrow_train::fit::checkpoint::History;
use furrow_train::fit::{Hyperparameters, Plan};
use furrow_train::measure::{Evaluation, Prediction, Report};
use furrow_train::net;
use furrow_train::refine::Refine;
use furrow_train::run::{self, Identity, ModelCard, Results, TrainedModel};
use furrow_train::table::{self, BoundExperiment, Callbacks, Experiment, Predictor, RealSet, TableOptions, WorkPart};
use furrow_train::weights::{self, Array};
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock};
use tempfile::TempDir;

/// Eight labelled images, rendered once.
fn frames() -> &'static Path {
    static FRAMES: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let made = FRAMES.get_or_init(|| {
        let (keep, folder) = crate::common::program::scratch();
        succeed(make(&folder, 8, &[]));
        (keep, folder)
    });
    &made.1
}

const PAGE: &str = r#"Experiment(
    networks: ["basic-segnet", "unet"],
    baselines: ["exg"],
    seeds: [1, 2],
    hyperparameters: (size: (48, 36), steps: 10, batch: 2),
    sets: {
        "frames": Real(about: "eight frames"),
        "small": Scene(file: "tests/ref/small.ron", count: 6, size: (48, 36), spp: 1),
    },
    train: [
        (name: "Few", from: [(set: "frames", images: "0..2")]),
        (name: "More", from: [(set: "frames", images: "0..3", repeat: 2)], validation: [(set: "frames", images: "3..4")]),
    ],
    test: [(name: "Test A", set: "frames", images: "4..6"), (name: "Test B", set: "frames", images: "6..8")],
    scales: {"less": (hyperparameters: (steps: 5), seeds: [7])},
)"#;

fn page(text: &str) -> RonFile {
    // Relative paths start at the experiment file's folder, here the repository.
    RonFile { path: "experiment.ron".into(), text: text.into() }
}

/// Mock networks: a run with an odd seed predicts soil everywhere, one with an even seed predicts the truth.
#[derive(Default)]
struct Players {
    /// Calls so far, as text.
    calls: RefCell<Vec<String>>,
    /// Warnings so far.
    warned: Mutex<Vec<String>>,
    /// Number of calls after which the next one is interrupted.
    patience: Cell<Option<usize>>,
}

/// Number of trainable parameters of a plan's network, as its model card must state.
fn trainable(plan: &Plan) -> usize {
    let all = net::parameters(plan.network, plan.shape.bands.len(), plan.classes.len());
    all.iter().filter(|p| p.role.is_trainable()).map(net::Parameter::len).sum()
}

impl Players {
    fn call(&self, words: String) -> Result<()> {
        if let Some(left) = self.patience.get() {
            self.patience.set(left.checked_sub(1));
            if left == 0 {
                return Err(Error::interrupted());
            }
        }
        self.calls.borrow_mut().push(words);
        Ok(())
    }

    fn fit(&self, plan: &Plan, folder: &Path) -> Result<Results> {
        let open = |s: &[Selection]| Store::open(s, Pick::All, plan.seed, &plan.classes, &plan.shape, false, 0);
        let identity = Identity::of(plan, &open(&plan.train)?, &open(&plan.val)?)?;
        identity.claim(folder)?;
        self.call(format!("fit {} {} {}", plan.network.name(), plan.train[0].repeat, plan.seed))?;
        let values = vec![Array { name: "seed".into(), shape: vec![1], values: vec![plan.seed as f32] }];
        let card = ModelCard {
            furrow: "test".into(),
            network: plan.network,
            parameters: trainable(plan),
            input: plan.shape.clone(),
            normalization: Normalization::Image,
            resize: Resize::default(),
            refine: Refine::default(),
            pixel_mm: None,
            classes: plan.classes.clone(),
            crops: Vec::new(),
            species: Vec::new(),
            plants: false,
            weights: run::WEIGHTS.into(),
            weights_sha256: weights::hash(&values),
            plan_sha256: identity.hash()?,
        };
        TrainedModel { card, values }.write(folder)?;
        let results = Results {
            steps: plan.hyper.steps,
            best_step: None,
            ended: "steps".into(),
            history: History::default(),
            seconds: 60.0,
            images_per_second: 3.0,
        };
        run::write_json(&folder.join(run::RESULT), &results)?;
        Ok(results)
    }

    fn evaluate(&self, predictor: &Predictor<'_>, on: &Selection) -> Result<Report> {
        let trained = match predictor {
            Predictor::Network(trained, ..) => trained,
            Predictor::Baseline(baseline, shape) => {
                return files::evaluate(baseline, on, shape, &AtomicBool::new(false), &mut |_, _| Ok(()));
            }
        };
        let seed = trained.values[0].values[0];
        self.call(format!(
            "evaluate {} {seed} {} {:?}",
            trained.card.network.name(),
            trained.card.plan_sha256,
            on.pick
        ))?;
        let shape: &Shape = &trained.card.input;
        let store = Store::open(std::slice::from_ref(on), Pick::All, 0, &Classes::default(), shape, false, 0)?;
        let mut evaluation = Evaluation::new(Classes::default().names());
        for place in 0..store.len() {
            let example = store.get(place)?;
            let predicted: Vec<u8> = example.labels.iter().map(|l| if seed % 2.0 == 0.0 { *l } else { 0 }).collect();
            evaluation.add(&Prediction {
                name: &example.name,
                width: shape.width,
                height: shape.height,
                truth: &example.labels,
                predicted: &predicted,
                plants: None,
                separated: None,
                seconds: Some(0.5),
            })?;
        }
        Ok(evaluation.finish())
    }

    fn run(&self, text: &str, out: &Path, shard: Shard, only: Option<WorkPart>) -> Result<Vec<PathBuf>> {
        self.run_page(&page(text), out, shard, only)
    }

    fn run_page(&self, page: &RonFile, out: &Path, shard: Shard, only: Option<WorkPart>) -> Result<Vec<PathBuf>> {
        let experiment = Experiment::of(page, None)?;
        let real = [RealSet { name: "frames".into(), folder: frames().into() }];
        let bound = BoundExperiment::new(experiment, &real, &[], out)?;
        let order = TableOptions {
            bound: &bound,
            out,
            page: &page.text,
            shard,
            only,
            seconds: None,
            threads: 1,
            precision: "f32",
        };
        let warned = &self.warned;
        table::run(
            &order,
            &Callbacks {
                fit: &|plan, folder| self.fit(plan, folder),
                page: &|folder| furrow_output::write_atomically(&folder.join(table::PAGE), b"a page"),
                evaluate: &|predictor, on, _| self.evaluate(predictor, on),
                training: &|_, _| (),
                message: &|_| (),
                warn: &|words| warned.lock().expect("no panic").push(words.into()),
                stop: &Arc::default(),
            },
        )
    }

    fn took(&self) -> Vec<String> {
        std::mem::take(&mut self.calls.borrow_mut())
    }
}

/// Runs the experiment to its end in a temporary folder, which is deleted when the returned value is dropped.
fn whole(text: &str) -> (TempDir, PathBuf) {
    let (keep, out) = crate::common::program::scratch();
    Players::default().run(text, &out, Shard::ALL, None).unwrap();
    (keep, out)
}

/// Reads all files except those with clock times and locks.
fn files(out: &Path) -> std::collections::BTreeMap<String, Vec<u8>> {
    let clock = |name: &str| name.contains("/time/") || name.starts_with("times.") || name.contains("plan.json");
    tree(out).into_iter().filter(|(name, _)| !clock(name)).collect()
}

/// Returns the number in a column of the first table row that starts with these words.
fn number(out: &Path, table: &str, begin: &[&str], column: &str) -> f64 {
    let text = std::fs::read_to_string(out.join(format!("{table}.csv"))).unwrap();
    let mut lines = text.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    let at =
        heads.iter().position(|h| *h == column).unwrap_or_else(|| panic!("column {column} is not among {heads:?}"));
    let row = lines.find(|l| l.starts_with(begin)).unwrap_or_else(|| panic!("row {begin:?} is not in {text}"));
    row[at].parse().unwrap_or(f64::NAN)
}

#[test]
fn tables_hold_means_of_the_seeds_and_how_far_they_stray() {
    let (_keep, out) = whole(PAGE);
    let soil = number(&out, "runs", &["unet", "Few", "1", "10", "", "Test A"], "GA");
    assert!(soil > 20.0 && soil < 99.9, "{soil}: the images must be neither all soil nor without soil");
    let close = |table: &str, column: &str, expected: f64| {
        let found = number(&out, table, &["unet", "Few"], column);
        assert!((found - expected).abs() < 1e-9, "{column}: {found}, not {expected}");
    };
    close("table-1", "Test A GA", f64::midpoint(soil, 100.0));
    close("table-1", "runs", 2.0);
    close("table-3", "Test A vegetation", 50.0);
    // Standard deviation of 0 and 100, with n − 1.
    close("table-3", "Test A vegetation ±", 50.0 * 2.0_f64.sqrt());
    close("table-2", "Test B R", 50.0);
    // A prediction of soil alone contains no plants, so its precision is undefined, and only the other seed counts.
    close("table-2", "Test A P", 100.0);
    assert_eq!(number(&out, "times", &["unet"], "Test A: seconds an image"), 0.5);
    assert_eq!(number(&out, "times", &["unet"], "minutes of a training"), 1.0);
    // Colour baselines are trained on these images without a seed.
    assert!(number(&out, "table-3", &["exg", "Few"], "Test A vegetation") > 20.0);
    assert!(number(&out, "table-3", &["exg", "Few"], "Test A vegetation ±").is_nan());
    assert_eq!(number(&out, "table-1", &["exg", "More"], "runs"), 1.0);
}

#[test]
fn interrupted_before_every_step_it_ends_with_the_same_files() {
    let (_keep, expected) = whole(PAGE);
    let (_keep, out) = crate::common::program::scratch();
    let players = Players::default();
    let mut sittings = 0;
    loop {
        players.patience.set(Some(1));
        match players.run(PAGE, &out, Shard::ALL, None) {
            Err(e) if e.kind() == Kind::Interrupted => sittings += 1,
            other => {
                other.unwrap();
                break;
            }
        }
        assert!(sittings < 100, "no end");
    }
    // 8 trainings and 16 evaluations, one per run of the experiment; the last run completes it.
    assert_eq!((sittings, players.took().len()), (23, 24));
    same(&files(&out), &files(&expected));
}

#[test]
fn shards_of_rows_make_the_whole_in_any_order() {
    let (_keep, expected) = whole(PAGE);
    let (_keep, out) = crate::common::program::scratch();
    let players = Players::default();
    let mut all = Vec::new();
    for number in [2, 0, 1] {
        players.run(PAGE, &out, Shard { number, of: 3 }, None).unwrap();
        all.extend(players.took());
        if number == 2 {
            // Results that other shards have not produced yet are shown as unknown.
            assert!(number_is_missing(&out));
        }
    }
    let calls = all.len();
    all.sort();
    all.dedup();
    assert_eq!((calls, all.len()), (24, 24), "each training and evaluation must run once");
    same(&files(&out), &files(&expected));
}

fn number_is_missing(out: &Path) -> bool {
    std::fs::read_to_string(out.join("table-1.md")).unwrap().contains('–')
}

#[test]
fn what_is_there_is_not_made_again_and_a_page_may_get_longer() {
    let (_keep, out) = whole(PAGE);
    let before = files(&out);
    let players = Players::default();
    players.run(PAGE, &out, Shard::ALL, None).unwrap();
    assert!(players.took().is_empty());
    same(&files(&out), &before);
    let longer = PAGE.replace("seeds: [1, 2]", "seeds: [1, 2, 4]");
    players.run(&longer, &out, Shard::ALL, None).unwrap();
    let took = players.took();
    assert_eq!(took.len(), 4 + 8, "{took:?}");
    assert!(took.iter().all(|c| c.contains('4')), "{took:?}");
}

#[test]
fn a_page_whose_trainings_have_changed_is_refused_before_any_work() {
    let (_keep, out) = crate::common::program::scratch();
    let players = Players::default();
    players.run(PAGE, &out, Shard { number: 7, of: 10 }, None).unwrap();
    players.took();
    let other = PAGE.replace("steps: 10", "steps: 12");
    let error = players.run(&other, &out, Shard::ALL, None).unwrap_err();
    assert!(error.to_string().contains("steps is 10 there and 12 here"), "{error}");
    assert_eq!(error.exit_code(), 2);
    assert!(players.took().is_empty());
}

#[test]
fn unusable_evaluations_are_reported_and_repeated() {
    let (_keep, out) = whole(PAGE);
    let before = files(&out);
    let file = out.join("runs/unet/few/seed-2/eval/test-a.json");
    let baseline = out.join("runs/exg/few/baseline.json");
    let players = Players::default();
    let spoil = |path: &Path, from: &str, to: &str| {
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{from}");
        std::fs::write(path, text.replace(from, to)).unwrap();
    };
    let spoils: [(&dyn Fn(), &str, usize); 4] = [
        (&|| std::fs::write(&file, "{\"of\":").unwrap(), "cannot be read", 1),
        (&|| spoil(&file, "\"weights\": \"", "\"weights\": \"0"), "other weights", 1),
        (&|| spoil(&file, "\"Range\"", "\"Random\""), "cannot be read", 1),
        (&|| std::fs::write(&baseline, "nonsense").unwrap(), "cannot be read", 0),
    ];
    for (spoil, words, judged) in spoils {
        spoil();
        players.run(PAGE, &out, Shard::ALL, None).unwrap();
        let warned = std::mem::take(&mut *players.warned.lock().expect("no panic")).join("\n");
        assert!(warned.contains(words) && warned.contains("made again"), "{warned}");
        assert_eq!(players.took().len(), judged);
        same(&files(&out), &before);
    }
    // With `WorkPart::Tables`, nothing is computed again; the faulty result is left out.
    std::fs::write(&file, "").unwrap();
    players.run(PAGE, &out, Shard::ALL, Some(WorkPart::Tables)).unwrap();
    assert!(std::mem::take(&mut *players.warned.lock().expect("no panic")).join("\n").contains("leave it out"));
    assert_eq!(number(&out, "table-1", &["unet", "Few"], "runs"), 1.0);
    // Only the other seed's result, whose predictions are wrong.
    assert!(
        number(&out, "table-1", &["unet", "Few"], "Test A GA") < number(&out, "table-1", &["unet", "Few"], "Test B GA")
    );
    // Other test images: existing evaluations used different images.
    let other = PAGE.replace("4..6", "5..6");
    players.run(&other, &out, Shard::ALL, None).unwrap();
    assert!(
        std::mem::take(&mut *players.warned.lock().expect("no panic"))
            .iter()
            .filter(|w| w.contains("other images"))
            .count()
            >= 8
    );
    assert_eq!(players.took().len(), 8);
}

#[test]
fn a_damaged_training_is_an_error_that_says_what_to_do() {
    let (_keep, out) = whole(PAGE);
    let file = out.join("runs/unet/few/seed-2/result.json");
    std::fs::write(&file, "{").unwrap();
    let players = Players::default();
    let error = players.run(PAGE, &out, Shard::ALL, None).unwrap_err().to_string();
    assert!(error.contains("unet/few/seed-2/result.json") && error.contains("delete it"), "{error}");
    std::fs::remove_file(&file).unwrap();
    players.run(PAGE, &out, Shard::ALL, None).unwrap();
    assert_eq!(players.took(), ["fit unet 1 2"]);
}

#[test]
fn nothing_is_evaluated_on_what_it_was_trained_on() {
    for (from, to) in [("4..6", "1..6"), ("4..6", "2..6"), ("4..6", "all"), ("4..6", "3..4"), ("0..2", "random:8")] {
        let (_keep, out) = crate::common::program::scratch();
        let error = Players::default().run(&PAGE.replace(from, to), &out, Shard::ALL, None).unwrap_err();
        assert!(error.to_string().contains("in the training or validation set"), "{from} → {to}: {error}");
        assert_eq!(error.exit_code(), 2);
        assert!(!out.join("runs").exists());
    }
}

#[test]
fn sets_are_bound_left_out_or_asked_for() {
    let scratch = tempfile::tempdir().unwrap();
    let experiment = |text: &str| Experiment::of(&page(text), None).unwrap();
    let bind = |text: &str, real: &[&str], without: &[&str]| {
        let real: Vec<RealSet> = real.iter().map(|r| RealSet::parse(r).unwrap()).collect();
        let without: Vec<String> = without.iter().map(|w| (*w).to_owned()).collect();
        let bound = BoundExperiment::new(experiment(text), &real, &without, scratch.path())?;
        bound.check().map(|()| bound)
    };
    let here = format!("frames={}", frames().display());
    let both = PAGE.replace("(set: \"frames\", images: \"0..2\")", "(set: \"small\")");
    let bound = bind(&both, &[&here], &[]).unwrap();
    assert_eq!((bound.folder(0), bound.folder(1)), (frames(), scratch.path().join("sets/small").as_path()));
    let bound = bind(&both, &[&here], &["small"]).unwrap();
    assert_eq!((bound.left_out, bound.experiment.train.len()), (vec!["Few".to_owned()], 1));
    let empty = format!("frames={}", scratch.path().display());
    let faults: [(&[&str], &[&str], &str); 8] = [
        (
            &[],
            &[],
            "no folder is given for the images of `frames` (eight frames)\n help: give it with --real frames=DIR",
        ),
        (&["frame=x"], &[], "there is no real set `frame`\n help: did you mean `frames`?"),
        (&["small=x"], &[], "there is no real set `small`"),
        (&[&here, &here], &[], "twice"),
        (&["frames=nowhere"], &[], "there is no such folder"),
        (&[&empty], &[], "this folder holds no labelled images"),
        (&[], &["framse"], "there is no set `framse`\n help: did you mean `frames`?"),
        (&[], &["frames"], "without frames there is no test set left"),
    ];
    for (real, without, words) in faults {
        let error = bind(&both, real, without).unwrap_err();
        assert!(error.to_string().contains(words), "{real:?} {without:?}: {error}");
        assert_eq!(error.exit_code(), 2);
    }
    assert!(RealSet::parse("frames").is_err() && RealSet::parse("=x").is_err());
}

/// Expected: the faulty text is underlined in its line, with a message that describes the fault and the remedy.
#[test]
fn mistakes_in_a_page_are_shown_where_they_are() {
    let frames = "(set: \"frames\", images: \"0..2\")";
    let faults = [
        ("networks:", "network:", "network", "unknown field `network`", "did you mean `networks`?"),
        ("\"unet\"", "\"unett\"", "\"unett\"", "there is no network `unett`", "did you mean `unet`?"),
        ("\"unet\"", "\"basic-segnet\"", "\"basic-segnet\"", "the network `basic-segnet` is given twice", "keep one"),
        ("[\"basic-segnet\", \"unet\"]", "[]", "[]", "there is no network", "give at least one"),
        ("\"exg\"", "\"exgreen\"", "\"exgreen\"", "there is no baseline `exgreen`", "exg-size"),
        ("[1, 2]", "[]", "[]", "there is no seed", "such as [1]"),
        ("[1, 2]", "[1, 2, 1]", "1", "the seed 1 is given twice", "keep one"),
        ("steps: 10", "stepps: 10", "stepps", "unknown field `stepps` in Hyperparameters", "did you mean `steps`?"),
        ("steps: 10", "steps: 0", "0", "0 is out of range", "above 0"),
        ("batch: 2", "batch: 5000", "5000", "5000 is out of range", "from 1 to 1024"),
        ("(48, 36), steps", "(48, 16), steps", "(48, 16)", "48 × 16 pixels", "from 32 to 8192"),
        ("batch: 2", "optimiser: \"adm\"", "\"adm\"", "there is no optimiser `adm`", "sgd or adam"),
        ("batch: 2", "augment: \"flip,spin\"", "\"flip,spin\"", "there is no augmentation `spin`", "rotate"),
        ("batch: 2", "rate: -1", "-1", "-1 is out of range", "above 0"),
        (
            "batch: 2",
            "classes: \"soil; plant=crop,weed\"",
            "[\"exg\"]",
            "baselines support only soil, crop and weed",
            "leave",
        ),
        (
            "\"frames\": Real",
            "\"fra/mes\": Real",
            "Real(about: \"eight frames\")",
            "`fra/mes` is not a valid name",
            "letters",
        ),
        ("\"small\":", "\"frames\":", "Scene", "the set `frames` is given twice", "of its own"),
        (
            "tests/ref/small.ron",
            "tests/ref/smal.ron",
            "\"tests/ref/smal.ron\"",
            "there is no file",
            "did you mean `small.ron`?",
        ),
        ("count: 6", "count: 0", "0", "0 images cannot be rendered", "from 1"),
        ("spp: 1)", "spp: 0)", "0", "0 samples", "from 1"),
        ("Scene(", "Scen(", "Scen", "unknown name `Scen`", "Scene"),
        ("count: 6,", "count: 6, edit: \"rastr\",", "\"rastr\"", "there is no edit `rastr`", "did you mean `raster`?"),
        ("count: 6,", "count: 6, split: (0, 0, 0),", "(0, 0, 0)", "these are not valid shares", "train,val,test"),
        ("name: \"More\"", "name: \"few!\"", "\"few!\"", "there is another `few!`", "of its own"),
        ("name: \"More\"", "name: \"?\"", "\"?\"", "no letter and no digit", "letters"),
        (
            "steps: 10",
            "crop_size: (8, 8), steps: 10",
            "(8, 8)",
            "networks do not support 8 × 8 pixels",
            "sides from 32",
        ),
        ("steps: 10", "rare_crops: 1.5, steps: 10", "1.5", "1.5 is out of range", "from 0 to 1"),
        (
            "from: [(set: \"frames\", images: \"0..2\")]",
            "from: []",
            "[]",
            "the training set has no images",
            "give a dataset",
        ),
        (frames, "(set: \"frame\")", "\"frame\"", "there is no set `frame`", "did you mean `frames`?"),
        ("\"0..2\"", "\"2..0\"", "\"2..0\"", "`2..0` picks no images", "0..10"),
        ("\"0..2\"", "\"most\"", "\"most\"", "`most` picks no images", "train"),
        (frames, "(set: \"small\", images: \"0..7\")", "\"0..7\"", "`small` has 6 images", "fewer"),
        ("repeat: 2", "repeat: 0", "0", "out of training", "1 or more"),
        ("(name: \"Few\",", "(name: \"Few\", hyperparameters: (steps: 0),", "0", "0 is out of range", "above 0"),
        (
            "(name: \"Few\",",
            "(name: \"Few\", hyperparameters: (size: (64, 48)),",
            "(64, 48)",
            "`size` cannot differ between training sets",
            "`hyperparameters` of the experiment",
        ),
        ("repeat: 2", "dilate_px: -17", "-17", "cannot be dilated by -17 pixels", "from -16 to 16"),
        (
            "set: \"frames\", images: \"6..8\"",
            "set: \"jai\"",
            "\"jai\"",
            "there is no set `jai`",
            "sets are frames, small",
        ),
        ("name: \"Test B\"", "name: \"test-a\"", "\"test-a\"", "there is another `test-a`", "of its own"),
        ("steps: 5", "steps: 0", "0", "0 is out of range", "above 0"),
        (
            "steps: 10",
            "crop_size: (64, 36), steps: 10",
            "(64, 36)",
            "a crop of 64 × 36 pixels is larger",
            "a smaller crop",
        ),
        (
            "steps: 10",
            "crop_size: (48, 37), steps: 10",
            "(48, 37)",
            "a crop of 48 × 37 pixels is larger",
            "a smaller crop",
        ),
        ("batch: 2", "class_weights: \"much\"", "\"much\"", "there are no class weights `much`", "annealed"),
        ("batch: 2", "pretrained: \"none.safetensors\"", "\"none.safetensors\"", "`none.safetensors`", ""),
        ("seeds: [7]", "seeds: []", "[]", "there is no seed", "such as [1]"),
    ];
    for (from, to, underlined, what, help) in faults {
        let at = PAGE.find(from).unwrap_or_else(|| panic!("{from}"));
        let error = Experiment::of(&page(&PAGE.replacen(from, to, 1)), None).expect_err(to);
        let place = error.place().and_then(|place| place.span.as_ref());
        let place = place.unwrap_or_else(|| panic!("{to}: without a place: {error}"));
        let under: String = place.text.chars().skip(place.column - 1).take(place.width).collect();
        assert_eq!(under, underlined, "{error}");
        if underlined != "[\"exg\"]" {
            assert_eq!(place.line, PAGE[..at].matches('\n').count() + 1, "{error}");
        }
        let advice = error.advice().unwrap_or_default();
        assert!(error.message().contains(what) && advice.contains(help), "{to}: {what} | {help}\n{error}");
        assert_eq!(error.exit_code(), 2);
    }
    for list in ["train", "test"] {
        let at = PAGE.find(&format!("    {list}: [")).unwrap();
        let end = if list == "train" { PAGE.find("    test:").unwrap() } else { PAGE.find("    scales:").unwrap() };
        let text = format!("{}    {list}: [],\n{}", &PAGE[..at], &PAGE[end..]);
        let words = Experiment::of(&page(&text), None).unwrap_err().to_string();
        assert!(words.contains(&format!("there is no {}", if list == "train" { "training set" } else { "test set" })));
    }
}

#[test]
fn a_scale_changes_what_it_names_and_nothing_else() {
    let at = |scale: Option<&str>| Experiment::of(&page(PAGE), scale);
    let (plain, less) = (at(None).unwrap(), at(Some("less")).unwrap());
    assert_eq!((less.plan.hyper.steps, less.seeds.as_slice()), (5, &[7][..]));
    let hyper = Hyperparameters { steps: 10, ..less.plan.hyper.clone() };
    assert!(less.train.iter().all(|t| t.plan == less.plan));
    let plan = Plan { hyper, ..less.plan.clone() };
    let back = Experiment { plan, seeds: vec![1, 2], scale: None, train: plain.train.clone(), ..less };
    assert_eq!(back, plain);
    let error = at(Some("les")).unwrap_err();
    assert!(error.to_string().contains("no scale `les`\n help: did you mean `less`?"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let paper = Path::new("scenes/experiments/paper.ron");
    let (small, large) = (Experiment::read(paper, None).unwrap(), Experiment::read(paper, Some("paper")).unwrap());
    let images = |e: &Experiment| match &e.sets[0].1 {
        table::Source::Scene { count, size, .. } => (*count, *size),
        other => unreachable!("synthetic A is rendered, not {other:?}"),
    };
    assert_eq!(images(&large), (1300, (480, 360)));
    assert!(images(&small).0 < 1300 && large.plan.hyper.steps > small.plan.hyper.steps);
    let images = |e: &Experiment| e.train.iter().map(|t| (t.from.clone(), t.validation.clone())).collect::<Vec<_>>();
    assert_eq!((images(&large), &large.test), (images(&small), &small.test));
}

/// Expected: hyper-parameters given for a training set apply only to its rows, and override those of the scale.
#[test]
fn a_training_set_may_be_learnt_from_in_its_own_way() {
    let own = PAGE.replace("(name: \"Few\",", "(name: \"Few\", hyperparameters: (batch: 1, rate: 0.25),");
    for (scale, steps) in [(None, 10), (Some("less"), 5)] {
        let experiment = Experiment::of(&page(&own), scale).unwrap();
        let [few, more] = [0, 1].map(|i| experiment.train[i].plan.hyper.clone());
        assert_eq!((few.batch, few.rate, few.steps), (1, 0.25, steps));
        assert_eq!(more, experiment.plan.hyper);
        assert_eq!((more.batch, more.steps), (2, steps));
    }
    let (_keep, out) = whole(&own);
    let plan = |train: &str| -> Identity {
        run::read_json(&out.join(format!("runs/unet/{train}/seed-1")).join(run::PLAN)).unwrap()
    };
    assert_eq!((plan("few").plan.hyper.batch, plan("more").plan.hyper.batch), (1, 2));
}

#[test]
fn our_pages_are_understood_at_both_scales() {
    let mut pages = 0;
    for entry in std::fs::read_dir("scenes/experiments").expect("a folder") {
        let path = entry.expect("an entry").path();
        for scale in [None, Some("paper")] {
            let experiment = Experiment::read(&path, scale).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let (width, height) = experiment.plan.crop_size();
            assert!(width <= experiment.plan.shape.width && height <= experiment.plan.shape.height);
        }
        pages += 1;
    }
    assert!(pages >= 2);
}

/// Two datasets of the same fields, the second without the sky; rendered once.
fn variants() -> &'static Path {
    static VARIANTS: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let made = VARIANTS.get_or_init(|| {
        let (keep, folder) = crate::common::program::scratch();
        let page =
            ["ablate", "--scene", crate::common::program::SMALL, "--only", "no-sky", "--count", "6", "--width", "48"];
        let more = ["--spp", "1", "--split", "4,0,2", "--quiet", "--out", crate::common::dataset::path(&folder)];
        succeed(crate::common::program::trace(&[&page[..], &more].concat()));
        (keep, folder)
    });
    &made.1
}

/// The experiment file that was written beside the datasets, with a smaller network and fewer seeds.
fn written() -> RonFile {
    let mut page = RonFile::read(&variants().join("ablation.ron")).unwrap();
    page.text = page.text.replace("\"unet\"", "\"basic-segnet\"").replace("[1, 2, 3]", "[1, 2]");
    page
}

#[test]
fn what_ablate_writes_is_an_experiment_on_its_datasets() {
    let page = written();
    let experiment = Experiment::of(&page, Some("glance")).unwrap();
    let names: Vec<&str> = experiment.train.iter().map(|t| t.name.as_str()).collect();
    assert_eq!(names, ["full", "no-sky"]);
    assert_eq!(experiment.against.as_deref(), Some("full"));
    assert_eq!(experiment.test.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(), ["Rendered", "real"]);
    let fault = |from: &str, to: &str| {
        let page = RonFile { path: page.path.clone(), text: page.text.replace(from, to) };
        Experiment::of(&page, None).unwrap_err().to_string()
    };
    let printed = fault("path: \"no-sky\"", "path: \"no-skye\"");
    assert!(printed.contains("there is no dataset in `no-skye`") && printed.contains('^'), "{printed}");
    let printed = fault("against: \"full\"", "against: \"fulll\"");
    assert!(printed.contains("no training set `fulll`") && printed.contains("did you mean `full`?"), "{printed}");
}

#[test]
fn changes_are_reported_by_seed_with_their_spread() {
    let (_keep, out) = crate::common::program::scratch();
    let page = written();
    let page = RonFile { path: page.path.clone(), text: page.text.replace("\"real\"", "\"frames\"") };
    Players::default().run_page(&page, &out, Shard::ALL, None).unwrap();
    let table = |column: &str| number(&out, "against", &["basic-segnet", "no-sky"], column);
    assert_eq!((table("Rendered vegetation"), table("Rendered vegetation ±"), table("seeds")), (0.0, 0.0, 2.0));
    assert!(table("times full") > 0.0 && table("FLIP") > 0.01 && table("CIEDE2000") > 0.1);
    // The mock predictions depend only on the seed: soil for seed 1, the truth for seed 2. Now the training set with
    // the edit also gives soil for seed 2.
    let eval = |set: &str, seed: u32| out.join(format!("runs/basic-segnet/{set}/seed-{seed}/eval/rendered.json"));
    let read = |path: &Path| -> serde_json::Value { serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap() };
    let teach = |set: &str, seed: u32, from: u32| {
        let mut judgement = read(&eval(set, seed));
        judgement["report"] = read(&eval(set, from))["report"].clone();
        std::fs::write(eval(set, seed), serde_json::to_vec(&judgement).unwrap()).unwrap();
        Players::default().run_page(&page, &out, Shard::ALL, Some(WorkPart::Tables)).unwrap();
        let text = std::fs::read_to_string(out.join("against.csv")).unwrap();
        text.lines().nth(1).unwrap().split(',').filter(|cell| *cell == "yes").count()
    };
    assert_eq!(teach("no-sky", 2, 1), 0, "0 and -100 have a mean of -50 and a spread of 71");
    assert!((table("Rendered vegetation") + 50.0).abs() < 1e-9);
    assert!((table("Rendered vegetation ±") - 50.0 * 2.0_f64.sqrt()).abs() < 1e-9);
    assert!(teach("full", 1, 2) > 0, "-100 and -100 have no spread");
    assert_eq!((table("Rendered vegetation"), table("Rendered vegetation ±")), (-100.0, 0.0));
    let html = std::fs::read_to_string(out.join("results.html")).unwrap();
    assert!(html.contains("Change of I/U against full") && html.contains("no-sky: sun and lamps only"));
    assert_eq!(html.matches("data:image/jpeg").count(), 1);
}
