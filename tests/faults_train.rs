//! Training and its follow-up commands with failing disks, files of other users, jumping clocks and closed output
//! streams.
//!
//! Rationale: networks are trained overnight on shared disks, under schedulers that close streams. Expected: exit code
//! 1 and one error with a help line, no partial file under a final name, and the same command then produces the bytes
//! of an undisturbed run; messages that cannot be printed change neither files nor exit codes. Source: none needed,
//! equality is exact.

use crate::common::dataset::{fail, path, same, succeed, tree};
use crate::common::faults::{self, Tree, as_nobody, each_is_gone_on_from, misdate, open_to_all};
use crate::common::program::scratch;
use crate::common::training;
use furrow_dataset::model::recipe::{self, Recipe};
use furrow_train::deploy::input_images::{self, Prediction};
use furrow_train::fit::checkpoint::{self, Checkpoint};
use furrow_train::fit::hyper::NormalizationMode;
use furrow_train::fit::log;
use furrow_train::net::Network;
use furrow_train::run::{self, TrainedModel};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

static SET: LazyLock<PathBuf> = LazyLock::new(|| training::set("faults-set"));

/// Folder of a trained network.
static RUN: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults-run");
    if folder.exists() {
        fs::remove_dir_all(&folder).expect("an old folder");
    }
    training::learn(Network::BasicSegnet, "rgb", NormalizationMode::Image, &SET, &folder);
    folder
});

/// Returns the command `train` with these arguments, in single precision on one thread.
fn train(verb: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).arg(verb).args(arguments);
    command.args(["--precision", "f32", "--threads", "1"]).stdin(Stdio::null());
    command
}

/// Returns the command-line argument that selects images of the set.
fn images(pick: &str) -> String {
    format!("{}@{pick}", SET.display())
}

fn fit(out: &Path, more: &[&str]) -> Command {
    let (all, some) = (images("all"), images("0..1"));
    let mut command = train("fit", &["--set", &all, "--val", &some, "--out", path(out)]);
    command.args(["--network", "tiny-unet", "--size", "64x48", "--batch", "2", "--steps", "6"]);
    command.args(["--validate-every", "2"]).args(more);
    command
}

fn predict(out: &Path, more: &[&str]) -> Command {
    let mut command = train("predict", &[path(&RUN), &images("0..2"), "--out", path(out)]);
    command.args(more);
    command
}

fn calibrate(out: &Path) -> Command {
    train("calibrate", &[path(&RUN), "--set", &images("all"), "--images", "2", "--out", path(out)])
}

/// Expected: each file is complete or absent.
#[test]
fn a_prediction_that_meets_a_fault_goes_on_to_the_same_bytes() {
    let make = |out: &Path| predict(out, &["--quiet"]);
    each_is_gone_on_from(&make, None, 4, &|there, whole, what| {
        for (name, bytes) in there {
            assert!(whole.get(name) == Some(bytes), "{what}: {name} is not that of an undisturbed run");
        }
    });
}

/// Expected: the weights and their model card are both present or both absent.
#[test]
fn a_calibration_that_meets_a_fault_leaves_nothing() {
    each_is_gone_on_from(&calibrate, None, 2, &|there: &Tree, _, what| {
        assert!(there.is_empty(), "{what}: found {:?}", there.keys());
    });
}

/// Runs a training whose second checkpoint cannot be written, while the first is present.
fn half_trained(out: &Path) {
    let checkpoint = out.join(checkpoint::FILE);
    let ended = faults::run(fit(out, &["--quiet"]), &checkpoint, 2, true);
    assert_eq!(ended.output.status.code(), Some(1), "{}", ended.printed());
    assert_eq!(ended.failed, "rename");
    assert!(checkpoint.is_file() && !out.join(run::RESULT).exists());
}

/// Expected: file times in the past or the future change no weight.
#[test]
fn a_training_goes_on_whatever_the_times_of_its_files() {
    let (_keep, whole) = scratch();
    succeed(fit(&whole, &["--quiet"]));
    let (_keep, out) = scratch();
    half_trained(&out);
    misdate(&out);
    misdate(&SET);
    succeed(fit(&out, &["--quiet"]));
    let weights = |run: &Path| fs::read(run.join(run::WEIGHTS)).expect("weights");
    assert!(weights(&out) == weights(&whole));
    let history = |run: &Path| run::results(run).expect("results").expect("present").history;
    assert_eq!(history(&out), history(&whole));
}

/// Expected: a folder that another user may not write to, or a checkpoint that they may not read, gives one error, and
/// nothing is changed.
#[test]
fn a_training_of_another_user_is_reported() {
    let (_keep, out) = scratch();
    half_trained(&out);
    let Some(mut barred) = as_nobody(&fit(&out, &["--quiet"])) else { return };
    let before = tree(&out);
    let refused = |command: &mut Command, code: i32| {
        let output = command.output().expect("the program");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{message}");
        assert!(message.starts_with("error: ") && message.matches("error: ").count() == 1, "{message}");
        assert!(message.contains("Permission denied") && message.contains("\n help: "), "{message}");
        same(&tree(&out), &before);
        message
    };
    open_to_all(&out, 0o755);
    refused(&mut barred, 2);
    open_to_all(&out, 0o777);
    let checkpoint = out.join(checkpoint::FILE);
    fs::set_permissions(&checkpoint, fs::Permissions::from_mode(0o600)).expect("permissions");
    let message = refused(&mut barred, 1);
    assert!(message.contains(checkpoint::FILE), "{message}");
}

fn full() -> Stdio {
    fs::File::create("/dev/full").expect("Linux").into()
}

/// Returns the same command with stderr closed by a shell.
fn mute(inner: &Command) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", "exec \"$0\" \"$@\" 2>&-"]).arg(inner.get_program()).args(inner.get_args());
    command.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    command
}

/// Checks that a command writes the same files when its messages go to a full disk, to a closed pipe, or to a closed
/// stream.
fn makes_the_same(make: &dyn Fn(&Path) -> Command, files: &[&str]) {
    let made = |begin: &dyn Fn(Command) -> Command| {
        let (_keep, out) = scratch();
        let ended = begin(make(&out)).output().expect("the program");
        assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
        let mut made = tree(&out);
        made.retain(|name, _| files.contains(&name.as_str()));
        assert_eq!(made.len(), files.len(), "{:?}", made.keys());
        made
    };
    let heard = made(&|command| command);
    let lost = made(&|mut command| {
        command.stderr(full());
        command
    });
    let unread = made(&|mut command| {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        command.stderr(writer);
        command
    });
    for other in [lost, unread, made(&|command| mute(&command))] {
        same(&other, &heard);
    }
}

/// Expected: the same files and exit code 0 as with open streams; exit code 2 if the command is wrong; if paths on
/// stdout are lost, exit code 1 with the files present.
#[test]
fn full_and_closed_streams_end_no_training_and_no_prediction() {
    makes_the_same(&|out| fit(out, &[]), &[run::WEIGHTS, run::MODEL]);
    makes_the_same(&|out| predict(out, &[]), &["000000.png", "000001.png", "prediction.json"]);
    let (_keep, out) = scratch();
    let mut wrong = predict(&out, &["--band", "nir=nowhere"]);
    assert_eq!(wrong.stderr(full()).output().expect("the program").status.code(), Some(2));
    let lost = predict(&out, &["--quiet"]).stdout(full()).output().expect("the program");
    let message = String::from_utf8_lossy(&lost.stderr);
    assert!(lost.status.code() == Some(1) && message.contains("cannot write to stdout"), "{message}");
    assert!(out.join("000001.png").is_file());
}

/// Reads a file of the program in a folder.
type Read<'a> = &'a dyn Fn(&Path) -> furrow::Result<()>;

/// Rationale: files by which the program recognises a folder may be cut by a full disk or edited by hand, and a folder
/// must not become a dead end. Expected: each is refused with exit code 2, its name and a help; after `train predict`
/// was refused, the help of the message works: the same command with another --out.
#[test]
fn damaged_files_of_the_program_are_refused_with_a_way_out() {
    let (keep, out) = scratch();
    let copied = |from: &Path, file: &str| -> PathBuf {
        let folder = keep.path().join(file.replace('.', "-"));
        fs::create_dir_all(&folder).expect("a folder");
        fs::copy(from.join(file), folder.join(file)).expect("a copy");
        folder
    };
    succeed(predict(&out, &["--quiet"]));
    let partial = keep.path().join("partial");
    half_trained(&partial);
    let identity: run::Identity = run::read_json(&RUN.join(run::PLAN)).expect("a plan");
    let trained = TrainedModel::open(&RUN).expect("a network");
    let pictures = input_images::find(&[images("0..2").into()], &trained.card.input, &[]).expect("images");
    let claim = |folder: &Path| Prediction::claim(folder, &trained.card, None, None, &pictures).map(drop);
    let claim_plan = |folder: &Path| identity.claim(folder);
    let files: [(&Path, &str, Read<'_>); 7] = [
        (&out, input_images::PREDICTION, &claim),
        (&RUN, run::PLAN, &claim_plan),
        (&RUN, run::RESULT, &|folder| run::results(folder).map(drop)),
        (&RUN, run::MODEL, &|folder| TrainedModel::open(folder).map(drop)),
        (&RUN, log::CSV, &|folder| log::read(folder).map(drop)),
        (&partial, checkpoint::FILE, &|folder| Checkpoint::read(folder, "").map(drop)),
        (&SET, recipe::FILE, &|folder| Recipe::read(folder).map(drop)),
    ];
    for (from, file, read) in files {
        let folder = copied(from, file);
        let whole = fs::read(folder.join(file)).expect("bytes");
        for damaged in [&whole[..whole.len() / 2], b"nonsense", b"{\"furrow\": 3, \"plan\": []}", b""] {
            // A log that ends at a row is a log of fewer steps.
            if file == log::CSV && damaged.len() > 100 {
                continue;
            }
            fs::write(folder.join(file), damaged).expect("a file");
            let error = read(&folder).expect_err(file);
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(error.to_string().contains(file) && error.advice().is_some(), "{error}");
        }
    }
    fs::write(out.join(input_images::PREDICTION), "{").expect("a file");
    let before = tree(&out);
    let message = fail(predict(&out, &["--quiet"]), 2);
    assert!(message.contains("repeat the command that wrote it with another --out"), "{message}");
    same(&tree(&out), &before);
    succeed(predict(&keep.path().join("another"), &["--quiet"]));
}

/// Rationale: the dynamic loader prints its own error about a preloaded library that it cannot find. Expected: without
/// CUDA, exit code 2 and only the program's own message.
#[test]
fn missing_cuda_is_our_own_error() {
    let (_keep, out) = scratch();
    let mut command = predict(&out, &["--device", "cuda"]);
    command.env_remove("LD_LIBRARY_PATH").env_remove("LD_PRELOAD");
    let message = fail(command, 2);
    assert!(message.starts_with("error: cuda: there is no libtorch_cuda.so on LD_LIBRARY_PATH"), "{message}");
    assert!(
        message.contains("\n help: ") && !message.contains("ld.so") && !message.contains("LD_PRELOAD"),
        "{message}"
    );
    assert!(!out.exists());
}
