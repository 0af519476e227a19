//! Job files for clusters, executed for real: Slurm with a power cut, GNU parallel and xargs; Kubernetes files are
//! checked against their schema.
//!
//! Rationale: schedulers interrupt, stop and restart jobs in ways that their manuals do not document. Expected: however
//! a dataset is split, stopped and resumed, its bytes equal those of one run on one machine, and the exit code gives
//! the scheduler the correct signal. Source: none needed, equality is exact; the Kubernetes schema is that of PyPI's
//! kubernetes-validate.

use crate::common::dataset::{fail, made, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, trace};
use crate::common::python::python;
use std::collections::{BTreeMap, HashMap};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::{Arc, LazyLock, Mutex, OnceLock};
use std::time::{Duration, Instant};

mod scratch;

/// Samples per pixel.
const SPP: &str = "12";

/// Plans a dataset of `count` images, each taking a third of a second.
fn plan(folder: &Path, count: u64) {
    plan_with(folder, count, &[]);
}

/// Plans a dataset of `count` images with further arguments.
fn plan_with(folder: &Path, count: u64, more: &[&str]) {
    let count = count.to_string();
    let order = ["dataset", "plan", "--scene", SMALL, "--width", "96", "--count", &count, "--out", path(folder)];
    let spp = if more.contains(&"--spp") { &[][..] } else { &["--spp", SPP] };
    succeed(trace(&[&order[..], spp, more].concat()));
}

/// Writes the job files of a dataset and returns their folder.
fn emit(folder: &Path, engine: &str, shards: u64, more: &[&str]) -> PathBuf {
    succeed(verb(
        "emit",
        folder,
        &[&["--scheduler", engine, "--shards", &shards.to_string(), "--cpus", "1"], more].concat(),
    ));
    folder.join("jobs")
}

/// Reads the files of a dataset, except its job files and the records of pushed files.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    tree(folder).into_iter().filter(|(name, _)| !name.starts_with("jobs/") && !name.starts_with("pushed/")).collect()
}

/// Returns the files of the same dataset made by a single run.
fn whole(count: u64) -> BTreeMap<String, Vec<u8>> {
    whole_with(count, &[])
}

type Files = BTreeMap<String, Vec<u8>>;

/// Returns the files of the dataset made by a single run with further arguments, rendered once for all tests that ask for it.
fn whole_with(count: u64, more: &[&str]) -> Files {
    static ALL: LazyLock<Mutex<HashMap<String, Arc<OnceLock<Files>>>>> = LazyLock::new(Mutex::default);
    let one = ALL.lock().expect("no test panics here").entry(format!("{count} {more:?}")).or_default().clone();
    let make = || {
        let (_keep, folder) = scratch();
        plan_with(&folder, count, more);
        succeed(verb("render", &folder, &["--quiet"]));
        succeed(verb("finish", &folder, &["--quiet"]));
        files(&folder)
    };
    one.get_or_init(make).clone()
}

/// Returns whether programs are installed. Prints a note if not; with `FURROW_REQUIRE_PEERS=1` it panics instead.
fn installed(programs: &[&str], package: &str) -> bool {
    let there = |p: &&str| {
        Command::new("sh").arg("-c").arg(format!("command -v {p}")).output().is_ok_and(|o| o.status.success())
    };
    let lacking: Vec<_> = programs.iter().filter(|p| !there(p)).collect();
    if lacking.is_empty() {
        return true;
    }
    let words = format!("{lacking:?} not found: apt-get install {package}");
    assert!(std::env::var_os("FURROW_REQUIRE_PEERS").is_none_or(|v| v != "1"), "{words}");
    eprintln!("skipped: {words}");
    false
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("sh").arg("-c").arg(format!("kill -{signal} {}", child.id())).status().unwrap();
    assert!(sent.success());
}

/// Waits up to five minutes until a condition holds; machines may be busy.
fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < Duration::from_secs(300), "not {what} within five minutes");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn end(child: &mut Child) -> ExitStatus {
    let mut status = None;
    until("ended", || {
        status = child.try_wait().unwrap();
        status.is_some()
    });
    status.unwrap()
}

fn sealed(folder: &Path) -> usize {
    std::fs::read_dir(folder.join("seals"))
        .map_or(0, |d| d.filter(|e| !e.as_ref().unwrap().file_name().to_string_lossy().starts_with('.')).count())
}

#[test]
fn job_files_are_complete_and_can_be_read_by_bash() {
    let (_keep, folder) = scratch();
    let folder = folder.join("it's a \"set\"");
    plan(&folder, 9);
    let mut seen = 0;
    for engine in ["slurm", "kubernetes", "parallel"] {
        let jobs = folder.join("jobs").join(engine);
        emit(&folder, engine, 3, &["--out", path(&jobs)]);
        for entry in std::fs::read_dir(&jobs).unwrap() {
            let file = entry.unwrap().path();
            let text = std::fs::read_to_string(&file).unwrap();
            let open = text
                .split('@')
                .skip(1)
                .find(|w| !w.is_empty() && w.chars().all(|c| c.is_ascii_uppercase() || c == '_'));
            assert_eq!(open, None, "{}", file.display());
            seen += 1;
            if file.extension().is_some_and(|e| e != "yaml") {
                let read = Command::new("bash").arg("-n").arg(&file).output().unwrap();
                assert!(read.status.success(), "{}: {}", file.display(), String::from_utf8_lossy(&read.stderr));
            }
        }
    }
    assert_eq!(seen, 7);
    let slurm = std::fs::read_to_string(folder.join("jobs/slurm/render.sbatch")).unwrap();
    for words in ["#SBATCH --array=0-2\n", "#SBATCH --time=04:00:00\n", "#SBATCH --signal=B:USR1@300\n", "\nshards=3\n"]
    {
        assert!(slurm.contains(words), "no {words:?} in\n{slurm}");
    }
}

/// Rationale: the name of a folder may contain a placeholder of the template. Expected: the script uses the folder's
/// name literally wherever it occurs.
#[test]
fn a_folder_named_as_a_place_of_the_template_stays_a_name() {
    let (_keep, folder) = scratch();
    for name in ["@TRACE@", "it's @DIR_QUOTED@ $(exit 9)", "@SHARDS@"] {
        let folder = folder.join(name);
        plan(&folder, 2);
        for (engine, file) in [("slurm", "render.sbatch"), ("parallel", "render.sh")] {
            let jobs = folder.join("jobs").join(engine);
            emit(&folder, engine, 2, &["--out", path(&jobs), "--program", "/a b/@DIR@/trace"]);
            let text = std::fs::read_to_string(jobs.join(file)).unwrap();
            let lines =
                text.lines().filter(|l| l.starts_with("trace=") || l.starts_with("dir=") || l.starts_with("shards="));
            let script = lines.collect::<Vec<_>>().join("\n") + "\nprintf '%s\\n' \"$trace\" \"$dir\" \"$shards\"";
            let message = Command::new("bash").args(["-c", &script]).output().unwrap();
            let message = String::from_utf8(message.stdout).unwrap();
            assert_eq!(message, format!("/a b/@DIR@/trace\n{}\n2\n", path(&folder)));
        }
    }
}

#[test]
fn edited_job_files_are_never_overwritten() {
    let (_keep, folder) = scratch();
    plan(&folder, 4);
    let jobs = emit(&folder, "slurm", 2, &[]);
    // Repeating the command changes nothing.
    emit(&folder, "slurm", 2, &[]);
    let file = jobs.join("finish.sbatch");
    let edited = std::fs::read_to_string(&file).unwrap().replace("##SBATCH --partition=…", "#SBATCH --partition=night");
    std::fs::write(&file, &edited).unwrap();
    let before = tree(&folder);
    let message = fail(verb("emit", &folder, &["--scheduler", "slurm", "--shards", "3"]), 2);
    assert!(message.contains("edited") && message.contains("--out"), "{message}");
    same(&tree(&folder), &before);
    let elsewhere = jobs.join("other");
    emit(&folder, "slurm", 3, &["--out", path(&elsewhere)]);
    assert!(elsewhere.join("render.sbatch").is_file());
}

#[test]
fn orders_that_make_no_sense_are_refused() {
    let (_keep, folder) = scratch();
    plan(&folder, 4);
    for (more, words) in [
        (&["--scheduler", "slurm", "--shards", "5"][..], "some would be empty"),
        (&["--scheduler", "slurm", "--shards", "0"], "1.."),
        (&["--scheduler", "slurm", "--shards", "2", "--time", "5m"], "--grace 300"),
        (&["--scheduler", "slurm", "--shards", "2", "--time", "soon"], "30s, 2m or 1h30m"),
        (&["--scheduler", "slurm", "--shards", "2", "--time", "300s 900ms"], "--grace 300"),
        (&["--scheduler", "pbs", "--shards", "2"], "slurm, kubernetes, parallel"),
        (
            &["--scheduler", "kubernetes", "--shards", "2", "--claim", "a\nevil: b"],
            "--claim \"a\\nevil: b\" is not a volume claim name",
        ),
        (&["--scheduler", "kubernetes", "--shards", "2", "--image", "a b"], "not a container image name"),
        (&["--scheduler", "slurm", "--shards", "2", "--mail", "a b"], "--mail \"a b\" is not an address"),
        (&["--scheduler", "slurm", "--shards", "2", "--on-failure", " "], "--on-failure \" \" is not a command"),
        (&["--scheduler", "parallel", "--shards", "2", "--mail", "a@b"], "--mail is for slurm"),
        (&["--scheduler", "kubernetes", "--shards", "2", "--on-failure", "x"], "--on-failure is for slurm"),
        (&["--scheduler", "parallel", "--shards", "2", "--max-running", "1"], "JOBS=N"),
    ] {
        let message = fail(verb("emit", &folder, more), 2);
        assert!(message.contains(words), "{more:?}: no `{words}` in\n{message}");
    }
    assert!(!folder.join("jobs").exists());
    let message = fail(verb("emit", folder.parent().unwrap(), &["--scheduler", "slurm", "--shards", "2"]), 2);
    assert!(message.contains("dataset.json"), "{message}");
}

#[test]
fn kubernetes_jobs_follow_the_schema() {
    let Some(python) = python("import kubernetes_validate, yaml") else { return };
    let (_keep, folder) = scratch();
    let folder = folder.join("It's $(a) \"set\": #1");
    plan(&folder, 9);
    let jobs = emit(&folder, "kubernetes", 3, &["--image", "registry.example/furrow:1", "--claim", "fields"]);
    let check = "
import sys, yaml, kubernetes_validate
for name in ('render', 'finish'):
    job = yaml.safe_load(open(f'{sys.argv[1]}/{name}.yaml'))
    for version in ('1.29', kubernetes_validate.latest_version()):
        kubernetes_validate.validate(job, version, strict=True)
spec = yaml.safe_load(open(f'{sys.argv[1]}/render.yaml'))['spec']
trace = spec['template']['spec']['containers'][0]
assert spec['completions'] == 3 and spec['completionMode'] == 'Indexed'
assert trace['command'][:3] == ['trace', 'dataset', 'render'], trace
assert trace['command'][3] == '/data/It\\'s $$(a) \"set\": #1', trace
assert trace['command'][4:] == ['--shard', '$(SHARD)/3', '--threads', '1'], trace
wrong = dict(spec, completionMode=7)
try:
    kubernetes_validate.validate(dict(apiVersion='batch/v1', kind='Job', spec=wrong), '1.29', strict=True)
except kubernetes_validate.ValidationError:
    sys.exit(0)
sys.exit('the schema refuses nothing')
";
    let done = Command::new(python).args(["-c", check, path(&jobs)]).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// Runs a shard's job script as Slurm would, with a fake `scontrol` that logs its arguments to the file `asked`.
fn task(jobs: &Path, number: u64) -> Command {
    let tools = jobs.join("tools");
    std::fs::create_dir_all(&tools).unwrap();
    let scontrol = tools.join("scontrol");
    std::fs::write(&scontrol, "#!/bin/sh\necho \"$@\" >> \"$(dirname \"$0\")/asked\"\n").unwrap();
    std::fs::set_permissions(&scontrol, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let mut command = Command::new("bash");
    command
        .arg(jobs.join("render.sbatch"))
        .env("PATH", format!("{}:{}", tools.display(), std::env::var("PATH").unwrap()))
        .envs([("SLURM_ARRAY_JOB_ID", "7"), ("SLURM_CPUS_PER_TASK", "1")])
        .env("SLURM_ARRAY_TASK_ID", number.to_string())
        .stdout(std::fs::File::create(jobs.join("tools/log")).unwrap())
        .stderr(Stdio::null());
    command
}

#[test]
fn a_slurm_task_exits_as_its_scheduler_expects() {
    let (_keep, folder) = scratch();
    plan(&folder, 32);
    let jobs = emit(&folder, "slurm", 2, &[]);
    let asked = || std::fs::read_to_string(jobs.join("tools/asked")).unwrap_or_default();
    // Time limit: the image in progress is finished, and only this task is requeued.
    let mut child = task(&jobs, 1).spawn().unwrap();
    until("sealed", || sealed(&folder) > 0);
    send("USR1", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(asked(), "requeue 7_1\n");
    let so_far = sealed(&folder);
    assert!((1..16).contains(&so_far), "{so_far}");
    // Cancelled: not requeued. The signal is sent twice, as by a scheduler that signals both script and program.
    let mut child = task(&jobs, 1).spawn().unwrap();
    until("sealed", || sealed(&folder) > so_far);
    send("TERM", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(asked(), "requeue 7_1\n");
    // A second signal while it finishes: the time limit counts, so the task is requeued.
    let mut child = task(&jobs, 0).spawn().unwrap();
    until("sealed", || sealed(&folder) > so_far + 1);
    send("USR1", &child);
    // A shell that receives two signals at almost the same time may handle only the later one; schedulers leave half a
    // minute between them.
    until("received USR1", || std::fs::read_to_string(jobs.join("tools/log")).unwrap().contains("received USR1"));
    send("TERM", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(asked(), "requeue 7_1\nrequeue 7_0\n");
    // A task without progress is not restarted forever.
    let mut child = task(&jobs, 0).env("SLURM_RESTART_COUNT", "100").spawn().unwrap();
    let before = sealed(&folder);
    until("sealed", || sealed(&folder) > before);
    send("USR1", &child);
    assert_eq!(end(&mut child).code(), Some(75));
    assert_eq!(asked().lines().count(), 2);
    // Uninterrupted, the task succeeds and renders only its own images.
    assert_eq!(task(&jobs, 1).status().unwrap().code(), Some(0));
    let odd = (0..16).all(|k| folder.join(format!("seals/{:06}.json", 2 * k + 1)).is_file());
    assert!(odd && made(&folder).len() >= 16);
    // Invalid input is never retried.
    std::fs::remove_file(folder.join("dataset.json")).unwrap();
    assert_eq!(task(&jobs, 1).status().unwrap().code(), Some(2));
    assert_eq!(asked().lines().count(), 2);
}

#[test]
fn the_job_that_finishes_says_which_shards_lack_images() {
    let (_keep, folder) = scratch();
    plan(&folder, 6);
    let told = folder.with_file_name("told.txt");
    let command = format!("echo \"it's $FURROW_DATASET: $FURROW_CODE\" >> {}", path(&told));
    let alerts = ["--max-running", "2", "--mail", "night@example.org", "--on-failure", &command];
    let jobs = emit(&folder, "slurm", 3, &[&["--rerender", "1"][..], &alerts].concat());
    let [render, end] =
        ["render.sbatch", "finish.sbatch"].map(|name| std::fs::read_to_string(jobs.join(name)).unwrap());
    assert!(render.contains("\n#SBATCH --array=0-2%2\n"), "{render}");
    assert!(render.contains("\n#SBATCH --mail-user=night@example.org\n#SBATCH --mail-type=FAIL\n"), "{render}");
    assert!(end.contains("\n#SBATCH --mail-user=night@example.org\n#SBATCH --mail-type=END,FAIL\n"), "{end}");
    let finish = || {
        let mut command = Command::new("bash");
        command.arg(jobs.join("finish.sbatch")).env("SLURM_CPUS_PER_TASK", "1");
        command
    };
    assert_eq!(task(&jobs, 1).status().unwrap().code(), Some(0));
    let message = fail(finish(), 1);
    assert!(message.contains("4 of 6 images are missing: 0,2-3,5") && message.contains("--array=0,2"), "{message}");
    let said = format!("it's {}: 1\n", path(&std::path::absolute(&folder).unwrap()));
    assert_eq!(std::fs::read_to_string(&told).unwrap(), said);
    for number in [0, 2] {
        assert_eq!(task(&jobs, number).status().unwrap().code(), Some(0));
    }
    let done = succeed(finish());
    assert_eq!(std::fs::read_to_string(&told).unwrap(), said, "the command ran although nothing failed");
    let message = String::from_utf8_lossy(&done.stderr);
    assert!(message.contains("6 of 6 images checked, 1 rendered again and the same; 0 faults"), "{message}");
    same(&files(&folder), &whole(6));
}

#[test]
fn the_kubernetes_script_finishes_when_the_shards_have_ended_and_reports_how() {
    let (_keep, folder) = scratch();
    plan(&folder, 4);
    let jobs = emit(&folder, "kubernetes", 2, &[]);
    let kubectl = jobs.join("kubectl");
    // Prints the job states chosen by the test, and logs its arguments.
    let script = "#!/bin/sh\necho \"$1 $2 $3\" >> asked\ncase \"$1 $3\" in\n'get '*-finish) echo \"$FINISH\" ;;\nget*) echo Failed ;;\nesac\n";
    std::fs::write(&kubectl, script).unwrap();
    std::fs::set_permissions(&kubectl, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    for (finish, code) in [("Complete", Some(0)), ("Failed", Some(1))] {
        let _ = std::fs::remove_file(jobs.join("asked"));
        let mut command = Command::new("bash");
        command.arg(jobs.join("submit.sh")).env("FINISH", finish);
        command.env("PATH", format!("{}:{}", jobs.display(), std::env::var("PATH").unwrap()));
        assert_eq!(command.output().unwrap().status.code(), code, "{finish}");
        let asked = std::fs::read_to_string(jobs.join("asked")).unwrap();
        let applied: Vec<&str> = asked.lines().filter_map(|l| l.strip_prefix("apply -f ")).collect();
        assert_eq!(applied, ["render.yaml", "finish.yaml"], "{asked}");
        assert!(asked.starts_with("delete job"), "{asked}");
    }
}

/// A Slurm cluster of two nodes on this machine; it shuts down when dropped.
struct Slurm(PathBuf);

impl Slurm {
    fn up(folder: &Path) -> Self {
        let slurm = Self(folder.join("slurm"));
        let up = slurm.script("up", &["2", "1"]);
        assert!(up.status.success(), "{}", String::from_utf8_lossy(&up.stderr));
        slurm
    }

    fn script(&self, verb: &str, more: &[&str]) -> Output {
        // Concurrent runs use separate port ranges, below the ephemeral ports of the system.
        let port = 20000 + std::process::id() % 60 * 200;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cluster/mini-slurm.sh");
        let mut command = Command::new("bash");
        command.arg(script).arg(verb).arg(&self.0).args(more).env("MINI_SLURM_PORT", port.to_string());
        command.stdin(Stdio::null()).output().unwrap()
    }

    /// Returns a command configured for this cluster.
    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(arguments).env("SLURM_CONF", self.0.join("slurm.conf")).stdin(Stdio::null());
        command
    }

    /// Runs a command that must succeed, and returns its standard output.
    fn say(&self, program: &str, arguments: &[&str]) -> String {
        let done = self.command(program, arguments).output().unwrap();
        assert!(done.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    }

    /// Waits until no job is left. Slurm takes half a minute to declare a node lost.
    fn idle(&self) {
        until("without jobs", || self.say("squeue", &["--noheader"]).is_empty());
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        self.script("down", &[]);
    }
}

/// Reads all logs of a dataset's jobs.
fn logs(jobs: &Path) -> String {
    let mut paths: Vec<_> = std::fs::read_dir(jobs.join("logs")).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let text = |p: &PathBuf| format!("--- {}\n{}", p.display(), std::fs::read_to_string(p).unwrap());
    paths.iter().map(text).collect()
}

/// Archives of three images: seven for training, one for each other split.
const PACKS: [&str; 2] = ["--pack", "3"];

#[test]
fn slurm_makes_the_same_dataset_although_a_node_loses_power_and_a_task_its_time() {
    const COUNT: u64 = 24;
    if !installed(&["slurmctld", "slurmd", "munged", "sbatch", "ss"], "slurm-wlm munge iproute2") {
        return;
    }
    let (_keep, folder) = scratch();
    let folder = folder.join("a set");
    // Longer renders, so that a task's images are not finished before the time-limit signal.
    let order = [&PACKS[..], &["--spp", "32"]].concat();
    plan_with(&folder, COUNT, &order);
    let elsewhere = folder.with_file_name("it's elsewhere");
    std::fs::create_dir_all(&elsewhere).unwrap();
    let push = format!("cp -r {{dir}}/. \"{}\"/", path(&elsewhere));
    let check = format!("cd {{dir}} && find . -type f -exec cmp {{}} \"{}\"/{{}} \\;", path(&elsewhere));
    let pushing = ["--push", &push, "--push-check", &check];
    let hours = ["--memory", "1", "--time", "10m", "--grace", "1m", "--rerender", "1"];
    let jobs = emit(&folder, "slurm", 4, &[&hours[..], &pushing].concat());
    let slurm = Slurm::up(folder.parent().unwrap());
    slurm.say("bash", &[path(&jobs.join("submit.sh"))]);
    // Wait until both nodes are at work.
    let running = |node: &str| {
        slurm
            .say("squeue", &["--noheader", "--states=R", "--array", "--format=%i %N"])
            .lines()
            .find_map(|l| l.strip_suffix(&format!(" {node}")).map(str::to_owned))
    };
    until("at work", || running("node1").is_some() && running("node2").is_some() && sealed(&folder) > 1);
    let hasty = running("node1").unwrap();
    // One node loses power; the other node's task receives the time-limit signal. scancel repeats the signal until
    // the task has ended, and then reports that there is none.
    let lost = slurm.script("node-kill", &["node2"]);
    assert!(lost.status.success(), "{}", String::from_utf8_lossy(&lost.stderr));
    let mut canceller = slurm.command("scancel", &["--signal=USR1", "--batch", &hasty]).spawn().unwrap();
    slurm.idle();
    canceller.wait().unwrap();
    let logs = logs(&jobs) + &String::from_utf8_lossy(&lost.stdout);
    assert!(logs.contains("ended with 75"), "no task was interrupted:\n{logs}");
    assert!(logs.matches("start 2").count() >= 2, "two tasks must have been restarted:\n{logs}");
    assert!(logs.contains("24 of 24 images checked, 1 rendered again and the same; 0 faults"), "{logs}");
    let expected = whole_with(COUNT, &order);
    assert!(expected.keys().filter(|name| name.starts_with("packs/")).count() == 9);
    same(&files(&folder), &expected);
    same(&files(&elsewhere), &expected);
    succeed(verb("verify", &elsewhere, &["--quiet"]));
}

/// Returns a folder with the programs that the script needs, without GNU parallel.
fn without_parallel(folder: &Path) -> PathBuf {
    let tools = folder.join("tools");
    std::fs::create_dir_all(&tools).unwrap();
    for name in ["bash", "env", "seq", "xargs", "grep", "nproc", "ps", "setsid", "sleep"] {
        let found = Command::new("sh").arg("-c").arg(format!("command -v {name}")).output().unwrap();
        let found = String::from_utf8(found.stdout).unwrap();
        std::os::unix::fs::symlink(found.trim(), tools.join(name)).unwrap();
    }
    tools
}

/// Stops the script with these signals while it renders, restarts it, and compares the dataset.
fn stop_and_go(signals: &[&str], search: Option<&Path>) {
    // Enough that some are left when a busy machine delivers the signal.
    const COUNT: u64 = 24;
    let expected = whole(COUNT);
    for signal in signals {
        let (_keep, folder) = scratch();
        let folder = folder.join("a set");
        plan(&folder, COUNT);
        let jobs = emit(&folder, "parallel", 4, &["--rerender", "1"]);
        let script = || {
            let mut command = Command::new("bash");
            command
                .arg(jobs.join("render.sh"))
                .env("JOBS", "2")
                .stdin(Stdio::null())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped());
            if let Some(search) = search {
                command.env("PATH", search);
            }
            command
        };
        let mut child = script().spawn().unwrap();
        until("sealed", || sealed(&folder) > 1);
        send(signal, &child);
        let status = end(&mut child);
        assert_eq!((status.code(), status.signal()), (Some(75), None), "{signal}");
        // No process of it continues to run.
        let so_far = sealed(&folder);
        assert!(so_far < COUNT as usize, "{signal}: all images were finished before it stopped");
        std::thread::sleep(Duration::from_secs(1));
        assert_eq!(sealed(&folder), so_far, "{signal}");
        let done = script().output().unwrap();
        let words = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(0), "{signal}: {words}");
        assert!(words.contains("24 of 24 images checked, 1 rendered again and the same; 0 faults"), "{words}");
        same(&files(&folder), &expected);
        // Invalid input is an error, not an interruption.
        std::fs::write(folder.join("dataset.json"), "{}").unwrap();
        let code = script().output().unwrap().status.code();
        assert!(code.is_some_and(|c| c != 0 && c != 75), "{code:?}");
    }
}

#[test]
fn gnu_parallel_stops_cleanly_and_goes_on() {
    if installed(&["parallel"], "parallel") {
        stop_and_go(&["USR1", "TERM"], None);
    }
}

#[test]
fn xargs_does_the_same_where_gnu_parallel_is_not_installed() {
    let (_keep, folder) = scratch();
    let tools = without_parallel(&folder);
    assert!(!tools.join("parallel").exists());
    // The signal handlers are those of the script, whichever program it starts.
    stop_and_go(&["TERM"], Some(&tools));
}

#[test]
fn a_dataset_made_in_one_go_has_the_same_bytes() {
    // `whole` equals the output of `trace dataset`, so the tests above hold for that command too.
    let (_keep, folder) = scratch();
    let mut command = trace(&["dataset", "--scene", SMALL, "--width", "96", "--spp", SPP, "--count", "4", "--quiet"]);
    command.args(["--out", path(&folder)]);
    succeed(command);
    same(&tree(&folder), &whole(4));
}
