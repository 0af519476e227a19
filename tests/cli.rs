//! The command-line program as users see it: flags, streams, exit codes.
//!
//! Rationale: the program is called by people, who guess, and by scripts, which cannot. Expected: results on stdout,
//! messages on stderr, and for errors the user can fix exit code 2, a clear message and no output files.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Scene file that renders in a fraction of a second.
const PAGE: &str = r"Field(
    camera: Pinhole(size: (48, 36), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5)),
    lights: [Constant(radiance: (1, 1, 1, 1))],
    plants: [(species: SPECIES, growth: Bbch(14))],
)";

/// Creates a folder with `page.ron`; output goes into it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let species = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/species/sugar_beet.ron");
    let page = PAGE.replace("SPECIES", &format!("{:?}", species.to_str().unwrap()));
    std::fs::write(folder.path().join("page.ron"), page).unwrap();
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trace")).current_dir(folder).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Runs a misuse and returns its error message; checks that it exits with 2, prints nothing on stdout and writes
/// nothing.
fn refused(args: &[&str]) -> String {
    let folder = folder();
    let done = run(folder.path(), args);
    assert_eq!(done.status.code(), Some(2), "{args:?}: {}", text(&done.stderr));
    assert!(done.stdout.is_empty(), "{args:?}");
    assert!(!folder.path().join("out").exists(), "{args:?}");
    text(&done.stderr)
}

#[test]
fn help_teaches() {
    let folder = folder();
    let done = run(folder.path(), &["--help"]);
    assert!(done.status.success());
    let help = text(&done.stdout);
    for word in
        ["--scene", "--spp", "--pixel", "Examples:", "scenes/field.ron", "semantics.png", "Exit codes", "texture"]
    {
        assert!(help.contains(word), "no {word} in\n{help}");
    }
}

/// Rationale: a script or scheduler sees only the exit code. Expected: 2 if the command, a file or the machine must
/// change, 1 if the disk failed or a dataset is damaged; `tests/signals.rs` covers 75.
#[test]
fn the_exit_code_follows_the_kind_of_failure() {
    let small = ["--width", "16", "--spp", "1", "--quiet"];
    let of = |what: &str, folder: &Path, args: &[&str], code: i32, words: &str| {
        let done = Command::new(env!("CARGO_BIN_EXE_trace"))
            .current_dir(folder)
            .env("OIDN_DIR", folder)
            .args(args)
            .args(small)
            .output()
            .unwrap();
        let message = text(&done.stderr);
        assert_eq!(done.status.code(), Some(code), "{what}: {message}");
        assert!(message.contains(words), "{what}: {message}");
    };
    let folder = folder();
    let at = folder.path();
    let page = ["--scene", "page.ron", "--out", "out"];
    of("misuse", at, &["--scene", "page.ron", "--pixel", "99,99"], 2, "is outside the image");
    std::fs::write(at.join("bad.ron"), "Field(").unwrap();
    of("input", at, &["--scene", "bad.ron"], 2, "bad.ron:1:");
    of("input that is not there", at, &["--scene", "none.ron"], 2, "there is no such");
    of("missing", at, &[&page[..], &["--denoise"]].concat(), 2, "needs Open Image Denoise");
    std::fs::create_dir_all(at.join("out/semantics.png/full")).unwrap();
    of("io", at, &page, 1, "semantics.png: ");
    of("a dataset", at, &["dataset", "--scene", "page.ron", "--out", "data", "--count", "1"], 0, "");
    std::fs::write(at.join("data/images/000000/rgb.png"), "x").unwrap();
    let verify = Command::new(env!("CARGO_BIN_EXE_trace")).current_dir(at).args(["dataset", "verify", "data"]).output();
    let verify = verify.unwrap();
    assert_eq!(verify.status.code(), Some(1), "damaged: {}", text(&verify.stderr));
}

/// Rationale: exit code 1 makes a scheduler repeat a command that can never succeed. Expected: a place in which no file
/// can be created is a misuse for every verb with an output, before any work. Source: the table of `errors.md`.
#[test]
fn outputs_in_places_that_cannot_be_written_are_refused_by_every_verb() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("file"), "").unwrap();
    std::fs::create_dir(at.join("photos")).unwrap();
    let scene = ["--scene", "page.ron", "--out"];
    let verbs: [(&[&str], &str); 12] = [
        (&scene, ""),
        (&["catalogue", "--species", "sugar_beet", "--out"], ""),
        (&[&["export", "--format", "gltf"][..], &scene].concat(), ""),
        (&[&["scan", "--lidar", "Vlp16"][..], &scene].concat(), ""),
        (&["preview", "page.ron", "--out"], "/x.png"),
        (&["leaf", "page.ron", "--out"], "/x.png"),
        (&["compare", "--real", "photos", "--synthetic", "photos", "--out"], ""),
        (&[&["dataset", "--count", "1"][..], &scene].concat(), ""),
        (&[&["dataset", "plan", "--count", "1"][..], &scene].concat(), ""),
        (&[&["sequence", "--days", "8..16/8"][..], &scene].concat(), ""),
        (&[&["ablate", "--count", "1"][..], &scene].concat(), ""),
        (&["init"], ""),
    ];
    for (verb, end) in verbs {
        for out in ["/proc/x", "/dev/null/x", "file"] {
            let out = format!("{out}{end}");
            let done = run(at, &[verb, &[out.as_str()]].concat());
            let message = text(&done.stderr);
            assert_eq!(done.status.code(), Some(2), "{verb:?} {out}: {message}");
            assert!(message.contains("\n help: ") && !message.contains("panicked"), "{verb:?} {out}: {message}");
        }
    }
}

#[test]
fn without_arguments_the_help_is_shown() {
    let message = refused(&[]);
    assert!(message.contains("Usage: trace") && message.contains("Examples:"), "{message}");
}

#[test]
fn the_version_is_printed() {
    let done = run(folder().path(), &["--version"]);
    let kernels = furrow_render::accel::version().unwrap();
    assert_eq!(text(&done.stdout), format!("trace {} ({kernels})\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn quiet_leaves_only_paths_on_stdout() {
    let folder = folder();
    let done = run(folder.path(), &["--scene", "page.ron", "--spp", "1", "--quiet"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(done.stderr.is_empty(), "{}", text(&done.stderr));
    let paths = text(&done.stdout);
    let names: Vec<&str> = paths.lines().map(|p| p.strip_prefix("out/page/").unwrap()).collect();
    let all = ["rgb.png", "nir.png", "radiance.exr", "semantics.png", "plants.png", "leaves.png", "overlay.png"];
    assert_eq!(names, all);
    let mut there: Vec<_> =
        std::fs::read_dir(folder.path().join("out/page")).unwrap().map(|f| f.unwrap().file_name()).collect();
    there.sort();
    assert_eq!(there.len(), all.len(), "unexpected files were left behind: {there:?}");
}

/// Rationale: a script that passes `--quiet` must not miss that a plant differs from its file. Expected: the warning that
/// the model's material is missing, by the renderer, the scan and the export.
#[test]
fn quiet_keeps_warnings() {
    let folder = folder();
    let model = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nusemtl bark\nf 1 2 3\n";
    std::fs::write(folder.path().join("model.obj"), model).unwrap();
    let camera =
        "camera: Pinhole(size: (8, 6), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5))";
    let lights = "lights: [Constant(radiance: (1, 1, 1, 1))]";
    let scene = format!("Field({camera}, {lights}, models: [(file: \"model.obj\", class: Weed)])");
    std::fs::write(folder.path().join("model.ron"), scene).unwrap();
    for command in [&["--spp", "1"][..], &["scan", "--lidar", "Vlp16"], &["export", "--format", "gltf"]] {
        let done = run(folder.path(), &[command, &["--scene", "model.ron", "--quiet"]].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        let warnings = text(&done.stderr);
        assert!(warnings.starts_with("warning: model.obj: ") && warnings.contains("`bark`"), "{command:?}: {warnings}");
    }
}

#[test]
fn talk_goes_to_stderr() {
    let folder = folder();
    let done = run(folder.path(), &["--scene", "page.ron", "--spp", "1", "--out", "there/deep"]);
    assert!(done.status.success());
    assert!(text(&done.stderr).contains("1 plant, 20 parts"), "{}", text(&done.stderr));
    assert!(text(&done.stdout).lines().all(|l| folder.path().join(l).is_file()));
    assert!(folder.path().join("there/deep/rgb.png").is_file());
}

#[test]
fn a_pixel_is_explained_in_words() {
    let folder = folder();
    assert!(run(folder.path(), &["--scene", "page.ron", "--spp", "1", "--out", "labels"]).status.success());
    let (width, _, plants) = furrow_output::read_gray16(&folder.path().join("labels/plants.png")).unwrap();
    let at = plants.iter().position(|p| *p == 1).unwrap() as u32;
    let pixel = format!("{},{}", at % width, at / width);
    let done = run(folder.path(), &["--scene", "page.ron", "--spp", "4", "--pixel", &pixel, "--quiet"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let words = text(&done.stdout);
    for word in [format!("pixel {pixel}\n").as_str(), "label: crop plant 1", "sugar beet", "radiance:", "4 samples"] {
        assert!(words.contains(word), "no {word} in\n{words}");
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_crop_is_the_same_pixels_of_a_smaller_image() {
    let folder = folder();
    let render = |out: &str, more: &[&str]| {
        let args = [&["--scene", "page.ron", "--spp", "1", "--quiet", "--out", out], more].concat();
        assert!(run(folder.path(), &args).status.success());
        furrow_output::read_gray16(&folder.path().join(out).join("plants.png")).unwrap()
    };
    let (w, _, whole) = render("whole", &[]);
    let (cw, ch, crop) = render("crop", &["--crop", "20,10,9,7"]);
    assert_eq!((cw, ch), (9, 7));
    for (i, plant) in crop.iter().enumerate() {
        let (x, y) = (20 + i % 9, 10 + i / 9);
        assert_eq!(*plant, whole[y * w as usize + x]);
    }
    assert!(crop.contains(&1));
}

#[test]
fn misuse_is_answered_with_a_way_out() {
    for (args, words) in [
        (&["--scene", "page.ron", "--sp", "3"][..], "--spp"),
        (&["--spp", "3"], "--scene"),
        (&["--scene", "page.ron", "--spp", "0"], "0 is not in 1.."),
        (&["--scene", "page.ron", "--spp", "many"], "--spp"),
        (&["--scene", "page.ron", "--width", "0"], "--width"),
        (&["--scene", "page.ron", "--seed", "-1"], "seed"),
        (&["--scene", "page.ron", "--threads", "9999"], "1024"),
        (&["export", "--scene", "page.ron", "--format", "gltf", "--threads", "9999"], "1024"),
        (&["scan", "--scene", "page.ron", "--threads", "9999"], "1024"),
        (&["dataset", "plan", "--scene", "page.ron", "--count", "1", "--out", "data", "--threads", "9999"], "1024"),
        (&["--scene", "page.ron", "--integrator", "paht"], "path"),
        (&["--scene", "page.ron", "--crop", "1,2,3"], "400,300,200,150"),
        (&["--scene", "page.ron", "--crop", "-1,0,5,5"], "not a pixel number"),
        (&["--scene", "page.ron", "--crop", "0,0,0,5"], "empty"),
        (&["--scene", "page.ron", "--crop", "40,0,20,10"], "past the image of 48 × 36"),
        (&["--scene", "page.ron", "--pixel", "48,0"], "from 0,0 at the top left to 47,35"),
        (&["--scene", "page.ron", "--pixel", "1,1", "--crop", "0,0,5,5"], "cannot be used with"),
        (&["--scene", "page.ron", "--spp", "9", "--time", "5s"], "cannot be used with"),
        (&["--scene", "page.ron", "--spp", "9", "--target-error", "0.1"], "cannot be used with"),
        (&["--scene", "page.ron", "--time", "30"], "30s, 2m or 1h30m"),
        (&["--scene", "page.ron", "--time", "0s"], "a second or more"),
        (&["--scene", "page.ron", "--target-error", "2"], "0.02 for 2 %"),
        (&["--scene", "page.ron", "--max-spp", "9"], "--target-error"),
        (&["--scene", "page.ron", "--max-depth", "0"], "--max-depth"),
        (&["--scene", "page.ron", "--clamp", "0"], "above 0"),
        (&["--scene", "page.ron", "--without", "mis,luck"], "light-sampling, mis, roulette, qmc"),
        (&["--scene", "page.ron", "--without", "mis", "--integrator", "ids"], "--integrator path"),
        (&["--scene", "page.ron", "--denoise", "--integrator", "ids"], "--integrator path"),
        (&["--scene", "page.ron", "--out", "page.ron"], "this is a file"),
        (&["--scene", "page.ron", "--out", "page.ron/deep"], "this is a file"),
        (&["--scene", "pages.ron"], "did you mean ./page.ron?"),
        (&["--scene", "nowhere/field.ron"], "there is none in nowhere; `trace init DIR` creates one"),
        (&["--scene", "."], "folder"),
        (&["texture"], "RECIPES"),
        (&["texture", "page.ron"], "Leaf, Soil"),
        (&["textures", "page.ron"], "texture"),
    ] {
        let message = refused(args);
        assert!(message.starts_with("error: "), "{args:?}: {message}");
        assert!(message.contains(words), "{args:?}: no `{words}` in\n{message}");
    }
}

#[test]
fn a_texture_is_drawn_beside_its_recipe() {
    let folder = tempfile::tempdir().unwrap();
    let recipe = "Leaf(seed: 3, size: 64, length_mm: 30, aspect: 0.6, outline: Power(a: 0.55, b: 1.0), \
                  veins: Pinnate(pairs: 5, angle_deg: 55, midrib: 0.03, fine: 50), pigments: (chlorophyll: 45))";
    std::fs::write(folder.path().join("small.ron"), recipe).unwrap();
    let done = run(folder.path(), &["texture", "small.ron"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let paths = text(&done.stdout);
    assert!(
        paths.lines().any(|l| l == "small.png") && paths.lines().all(|l| folder.path().join(l).is_file()),
        "{paths}"
    );
    let first = std::fs::read(folder.path().join("small.png")).unwrap();
    assert!(run(folder.path(), &["texture", "small.ron"]).status.success());
    assert_eq!(first, std::fs::read(folder.path().join("small.png")).unwrap());
}

/// Rationale: the relief of `x.ron` and the image of `x.height.ron` have the same file name. Expected: recipes with the
/// same output file, and recipes that are invalid, are refused before any texture is generated.
#[test]
fn all_that_textures_are_drawn_to_is_looked_at_first() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for name in ["x.ron", "x.height.ron", "y.png"] {
        std::fs::write(at.join(name), "Soil(seed: 1, size: 32, period_mm: 60, ground: Dirt)").unwrap();
    }
    for (recipes, words) in [
        (["x.ron", "x.height.ron"], "x.height.png: x.ron and x.height.ron would both be written here"),
        (["x.ron", "./x.ron"], "would both be written here"),
        (["x.ron", "y.png"], "y.png: the name of a texture recipe must end in .ron"),
    ] {
        let done = run(at, &["texture", recipes[0], recipes[1]]);
        assert!(done.status.code() == Some(2) && text(&done.stderr).contains(words), "{}", text(&done.stderr));
        assert!(!at.join("x.png").exists(), "{recipes:?}");
    }
}

/// Expected: a sheet, and a page that loads no other files. Repeating the command keeps the sheet; an unknown species
/// is refused.
#[test]
fn a_catalogue_shows_species_and_keeps_what_would_come_out_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/species");
    let catalogue = |species: &str| {
        let rest = ["--size", "64", "--spp", "1", "--species-dir", pages.to_str().unwrap()];
        run(folder.path(), &[&["catalogue", "--species", species], rest.as_slice()].concat())
    };
    let first = catalogue("echinochloa");
    assert!(first.status.success(), "{}", text(&first.stderr));
    assert_eq!(text(&first.stdout), "out/catalogue/echinochloa.png\nout/catalogue/catalogue.html\n");
    let page = std::fs::read_to_string(folder.path().join("out/catalogue/catalogue.html")).unwrap();
    for words in ["ECHCG", "BBCH 22", "data:image/jpeg"] {
        assert!(page.contains(words), "no {words}");
    }
    assert!(!page.contains("://"), "the page loads external resources");
    let sheet = || std::fs::read(folder.path().join("out/catalogue/echinochloa.png")).unwrap();
    let before = sheet();
    for name in ["echinochloa", "ECHCG", "Echinochloa crus-galli", "Hühnerhirse"] {
        assert!(text(&catalogue(name).stderr).contains("kept"), "{name}");
    }
    assert!(sheet() == before);
    let missing = catalogue("echinocloa");
    assert_eq!(missing.status.code(), Some(2));
    assert!(text(&missing.stderr).contains("did you mean"), "{}", text(&missing.stderr));
}

/// Rationale: an unusable output folder must not be discovered after hours of work. Expected: paths that are not
/// folders or not writable are reported before the scene is built.
#[test]
fn an_impossible_folder_is_reported_first() {
    let folder = folder();
    let at = folder.path();
    std::os::unix::fs::symlink("loop", at.join("loop")).unwrap();
    std::os::unix::fs::symlink("nowhere", at.join("dangling")).unwrap();
    for (out, words) in [
        ("loop", "this link leads to no folder"),
        ("dangling/x", "this link leads to no folder"),
        ("page.ron/x", "this is a file"),
        (&"a".repeat(300), "this name is too long"),
        (&"deep/".repeat(1000), "this name is too long"),
    ] {
        let done = run(at, &["--scene", "page.ron", "--spp", "65536", "--out", out]);
        assert!(done.status.code() == Some(2) && text(&done.stderr).contains(words), "{out}: {}", text(&done.stderr));
    }
    // Commands that write a single image report the same errors.
    let long = format!("{}.png", "a".repeat(252));
    for verb in [&["preview", "page.ron", "--spp", "65536"][..], &["leaf", "page.ron"]] {
        let done = run(at, &[verb, &["--out", long.as_str()]].concat());
        let message = text(&done.stderr);
        assert!(done.status.code() == Some(2) && message.contains("this name is too long"), "{verb:?}: {message}");
    }
    std::os::unix::fs::symlink("other.ron", at.join("one.ron")).unwrap();
    std::os::unix::fs::symlink("one.ron", at.join("other.ron")).unwrap();
    let done = run(at, &["--scene", "one.ron", "--out", "out"]);
    let message = text(&done.stderr);
    assert!(done.status.code() == Some(2) && message.contains("a symbolic link that leads to no file"), "{message}");
    let done = run(at, &["--scene", "page.ron", "--spp", "65536", "--out", "/proc/x"]);
    assert_eq!(done.status.code(), Some(2), "{}", text(&done.stderr));
}

fn full() -> Stdio {
    std::fs::File::create("/dev/full").expect("Linux").into()
}

/// Runs a program that prints results on stdout, with stdout on a full disk and with stdout closed.
fn its_answer_is_not_lost_unseen(program: &str, folder: &Path, args: &[&str]) {
    let command = |out: Stdio| Command::new(program).current_dir(folder).args(args).stdout(out).output().unwrap();
    let lost = command(full());
    let message = text(&lost.stderr);
    assert!(lost.status.code() == Some(1) && message.contains("cannot write to stdout"), "{args:?}: {message}");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let unread = command(writer.into());
    let message = text(&unread.stderr);
    assert!(unread.status.code() == Some(0) && !message.contains("stdout"), "{args:?}: {message}");
}

/// Rationale: log disks fill up, and readers of pipes exit. Expected: messages that cannot be written neither end a run
/// nor change its exit code. Lost paths and results are a failure reported on stderr, with the output files present. A
/// reader that closes the pipe is not a failure.
#[test]
fn full_and_closed_streams_end_no_work() {
    let folder = folder();
    let command = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
        command.current_dir(folder.path()).args(["--scene", "page.ron", "--spp", "1"]).args(arguments);
        command
    };
    let files = |name: &str| std::fs::read_dir(folder.path().join(name)).unwrap().count();
    assert_eq!(command(&["--out", "a"]).stderr(full()).output().unwrap().status.code(), Some(0));
    assert_eq!(command(&["--crop", "0,0,99,99"]).stderr(full()).output().unwrap().status.code(), Some(2));
    let lost = command(&["--out", "b"]).stdout(full()).output().unwrap();
    let message = text(&lost.stderr);
    assert!(
        lost.status.code() == Some(1) && message.contains("their paths are lost: cannot write to stdout"),
        "{message}"
    );
    assert_eq!((files("a"), files("b")), (7, 7));
    let mut closed = command(&["--out", "c"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(closed.stdout.take());
    assert_eq!(closed.wait().unwrap().code(), Some(0));
    let order = ["--scene", "page.ron", "--out", "d", "--count", "1", "--spp", "1"];
    assert!(run(folder.path(), &[&["dataset", "plan"][..], &order].concat()).status.success());
    let other = ["--scene", "page.ron", "--out", "e", "--count", "1", "--spp", "1"];
    for args in [
        &["--help"][..],
        &["--version"],
        &["dataset", "status", "--help"],
        &["species"],
        &["cameras"],
        &["soils"],
        &["explain"],
        &["ablate", "--list"],
        &["--scene", "page.ron", "--spp", "1", "--pixel", "9,9", "--quiet"],
        &["dataset", "status", "d"],
        &["dataset", "status", "d", "--json"],
        &["dataset", "status", "d", "--watch"],
        &[&["dataset"][..], &other, &["--dry-run"]].concat(),
        &[&["dataset", "plan"][..], &other, &["--estimate"]].concat(),
        // The name of the flag in the first scripts.
        &[&["dataset", "plan"][..], &other, &["--bill"]].concat(),
    ] {
        its_answer_is_not_lost_unseen(env!("CARGO_BIN_EXE_trace"), folder.path(), args);
    }
    #[cfg(feature = "train")]
    for verb in ["explain", "zoo", "--help", "--version"] {
        its_answer_is_not_lost_unseen(env!("CARGO_BIN_EXE_train"), folder.path(), &[verb]);
    }
}

/// Returns the terminal output of a command that must succeed; `None` if the program `script` is not available.
#[cfg(target_os = "linux")]
fn terminal_output(command: &str) -> Option<String> {
    let program = format!("{} {command}", env!("CARGO_BIN_EXE_trace"));
    let mut script = Command::new("script");
    script.current_dir(env!("CARGO_MANIFEST_DIR")).args(["-qec", &program, "/dev/null"]).stdin(Stdio::null());
    let Ok(done) = script.output() else {
        eprintln!("skipped: no `script` makes a terminal here");
        return None;
    };
    let message = String::from_utf8_lossy(&done.stdout).into_owned();
    assert_eq!(done.status.code(), Some(0), "{command}: {message}");
    Some(message)
}

/// Rationale: building a large field takes a minute, and a program that prints nothing seems to hang. Expected: a
/// terminal shows the current step, for an image and for a dataset, but not with `--quiet`; a progress bar counts
/// images, and is not shown if there are none. Source: `script`, which provides a terminal; without it the test is
/// skipped with a note.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_shows_what_grows() {
    let folder = folder();
    let out = folder.path().join("out").display().to_string();
    let image = format!("--scene scenes/field.ron --width 81 --spp 1 --out {out}/image");
    let dataset = format!("dataset --scene scenes/field.ron --width 81 --spp 1 --count 1 --out {out}/data");
    let quiet = format!("{image} --quiet");
    // In the second dataset run all images already exist.
    let commands = [(&image, true, false), (&quiet, false, false), (&dataset, true, true), (&dataset, true, false)];
    for (command, shown, counted) in commands {
        let Some(message) = terminal_output(command) else { return };
        assert_eq!(message.contains("growing: "), shown, "{command}: {message}");
        assert_eq!(message.contains("of 1 images"), counted, "{command}: {message}");
        assert!(!message.contains("of 0 images"), "{command}: {message}");
    }
}

/// Expected: progress is also shown while a cost estimate builds fields, of a dataset and of a sequence of days; the
/// line names the image being rendered, and is erased before the table is printed.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_shows_the_progress_of_a_cost_estimate() {
    let folder = folder();
    let out = folder.path().join("out").display().to_string();
    let order = |verb: &str, estimate: &str| {
        format!("{verb} --scene scenes/field.ron --width 81 --spp 8 --count 1 --out {out} {estimate}")
    };
    let of_days = "--days 20 --width 81 --spp 8 --format tum --dry-run";
    let days = format!("sequence --scene scenes/field.ron {of_days} --out {out}");
    let commands = [
        (order("dataset", "--dry-run"), true),
        (days, true),
        (order("dataset plan", "--estimate"), true),
        (order("dataset", "--dry-run --quiet"), false),
    ];
    for (command, shown) in commands {
        let Some(message) = terminal_output(&command) else { return };
        assert_eq!(
            message.contains("growing: ") && message.contains("rendering images, 1 of 1"),
            shown,
            "{command}: {message}"
        );
        let table = message.rsplit_once("\u{1b}[2K").map_or(message.as_str(), |(_, after)| after);
        assert!(table.contains("core hours") && !table.contains(" elapsed"), "{command}: {message:?}");
    }
}

/// Rationale: without a window system, as on servers and in containers, the driver's library prints a spurious error.
/// Expected: the program prints the same with and without `XDG_RUNTIME_DIR`, for every engine.
#[cfg(target_os = "linux")]
#[test]
fn no_window_system_is_no_error() {
    let folder = folder();
    let engines: &[&str] = if cfg!(feature = "raster") { &["trace", "raster"] } else { &["trace"] };
    for &engine in engines {
        let message = [None, Some("/tmp")].map(|place| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
            command.current_dir(folder.path()).env_remove("XDG_RUNTIME_DIR");
            command.envs(place.map(|place| ("XDG_RUNTIME_DIR", place)));
            let arguments = ["--scene", "page.ron", "--spp", "1", "--quiet", "--engine", engine, "--out", engine];
            let done = command.args(arguments).output().unwrap();
            assert_eq!(done.status.code(), Some(0), "{engine}: {}", text(&done.stderr));
            text(&done.stderr)
        });
        assert_eq!(message[0], message[1], "{engine}");
        assert!(!message[0].contains("error") && !message[0].contains("XDG_RUNTIME_DIR"), "{engine}: {}", message[0]);
    }
}
