//! Symbolic links inside a dataset's folder: nothing is written or removed at their targets.
//!
//! Rationale: datasets come from other people, and a folder in one may be a link to one of the user's own folders.
//! Expected: each such link is refused with exit code 2 by every command that reads or writes the dataset; a link that
//! appears later is an error at the moment of writing; the target folder keeps every byte. Links to the dataset's own
//! folder, and links that the user made on purpose, change nothing.

use crate::common::dataset::{fail, make_plants, path, same, succeed, tree, verb};
use crate::common::program::{PLANT, scratch, trace};
use furrow_base::Result;
use furrow_dataset::check::verify;
use furrow_dataset::check::verify::Rerender;
use furrow_dataset::make::finish;
use furrow_dataset::make::generate::generate;
use furrow_dataset::{Callbacks, Set, Work};
use furrow_job::Threads;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A folder of the user, and a link to it inside a dataset.
struct Linked<'a> {
    victim: &'a Path,
    link: PathBuf,
    /// Whether the victim is the dataset's own folder, moved away from the link's path.
    moved: bool,
}

impl<'a> Linked<'a> {
    /// Replaces a folder of the dataset by a link to that folder, which becomes the victim, so that nothing but the
    /// link is wrong. If the folder does not exist, the victim is a new folder with one file.
    fn at(data: &Path, name: &str, victim: &'a Path) -> Self {
        let link = data.join(name);
        let moved = link.is_dir();
        if moved {
            fs::rename(&link, victim).unwrap();
        } else {
            fs::create_dir(victim).unwrap();
        }
        fs::write(victim.join("mine.txt"), "the user's").unwrap();
        symlink(victim, &link).unwrap();
        Self { victim, link, moved }
    }

    /// Runs an action that must leave the victim unchanged.
    fn keeps(&self, what: impl FnOnce()) {
        let before = tree(self.victim);
        what();
        same(&tree(self.victim), &before);
        assert!(self.link.is_symlink(), "{}", self.link.display());
    }

    /// Restores the dataset.
    fn undo(self) {
        fs::remove_file(&self.link).unwrap();
        fs::remove_file(self.victim.join("mine.txt")).unwrap();
        if self.moved {
            fs::rename(self.victim, &self.link).unwrap();
        } else {
            fs::remove_dir(self.victim).unwrap();
        }
    }
}

fn refused(command: Command, name: &str) {
    let message = fail(command, 2);
    assert!(message.contains("symbolic link") && message.contains(&format!("/{name}: ")), "{message}");
    assert!(message.contains("replace it with the folder"), "{message}");
}

#[test]
fn a_folder_of_a_dataset_that_is_a_link_is_refused() {
    let (_keep, around) = scratch();
    let (data, victim) = (around.join("data"), around.join("victim"));
    succeed(make_plants(&data, 2, &[]));
    let whole = tree(&data);
    let names = ["images", "images/000001", "seals", "ledger", "packs", "pushed", "scene", "scene/species"];
    for name in names.into_iter().chain(["imagefolder", "imagefolder/train", "imagefolder/train/images"]) {
        let linked = Linked::at(&data, name, &victim);
        linked.keeps(|| {
            refused(verb("verify", &data, &[]), name);
            refused(verb("render", &data, &[]), name);
            refused(verb("finish", &data, &[]), name);
            refused(verb("finish", &data, &["--format", "phenobench"]), name);
            refused(make_plants(&data, 3, &[]), name);
        });
        linked.undo();
        same(&tree(&data), &whole);
    }
    // Folders that the dataset has not created yet.
    let linked = Linked::at(&data, "phenobench", &victim);
    linked.keeps(|| refused(verb("finish", &data, &["--format", "phenobench"]), "phenobench"));
    linked.undo();
    let linked = Linked::at(&data, "jobs", &victim);
    linked.keeps(|| refused(verb("emit", &data, &["--scheduler", "parallel", "--shards", "2"]), "jobs"));
    linked.undo();
    same(&tree(&data), &whole);
    succeed(verb("verify", &data, &[]));
}

#[test]
fn links_to_a_dataset_and_the_users_own_change_nothing() {
    let (_keep, around) = scratch();
    let (data, name, mine) = (around.join("data"), around.join("name"), around.join("mine"));
    fs::create_dir_all(&data).unwrap();
    symlink(&data, &name).unwrap();
    succeed(make_plants(&name, 2, &[]));
    let whole = tree(&data);
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("page.html"), "the user's").unwrap();
    symlink(&mine, data.join("notes")).unwrap();
    // A file that is a link is replaced.
    fs::remove_file(data.join("report.html")).unwrap();
    symlink(mine.join("page.html"), data.join("report.html")).unwrap();
    succeed(verb("finish", &name, &[]));
    succeed(verb("verify", &name, &["--rerender", "1"]));
    assert!(!data.join("report.html").is_symlink());
    assert_eq!(fs::read_to_string(mine.join("page.html")).unwrap(), "the user's");
    fs::remove_file(data.join("notes")).unwrap();
    same(&tree(&data), &whole);
}

/// Renders the missing images of an open dataset.
fn render(set: &Set) -> Result<()> {
    let never = Arc::default();
    generate(
        set,
        &Work::default(),
        &Callbacks { begin: &|_| (), warn: &|_| (), done: &|_| (), soon: &never, now: &never },
    )
}

fn fails<T: std::fmt::Debug>(done: Result<T>, name: &str) {
    let message = done.expect_err(name).to_string();
    assert!(message.contains("symbolic link"), "{name}: {message}");
}

/// Expected: a link that appears after the dataset was opened is an error if anything would be written or removed
/// behind it.
#[test]
fn a_link_that_appears_later_is_not_followed() {
    let (_keep, around) = scratch();
    let (data, victim) = (around.join("data"), around.join("victim"));
    succeed(make_plants(&data, 2, &[]));
    for name in ["images", "images/000001", "seals", "ledger", "imagefolder", "imagefolder/train"] {
        fs::remove_file(data.join("seals/000001.json")).unwrap();
        let set = Set::open(&data).unwrap();
        let linked = Linked::at(&data, name, &victim);
        linked.keeps(|| fails(render(&set), name));
        linked.undo();
        succeed(verb("render", &data, &["--quiet"]));
        succeed(verb("finish", &data, &["--quiet"]));
    }
    let set = Set::open(&data).unwrap();
    let linked = Linked::at(&data, "imagefolder/train", &victim);
    linked.keeps(|| fails(finish::finish(&set, None), "finish"));
    linked.undo();
    let linked = Linked::at(&data, "images/000001", &victim);
    let (threads, never) = (Threads::new(1).unwrap(), AtomicBool::new(false));
    linked.keeps(|| {
        let found = verify::verify(&set, &Rerender::default(), &threads, &|_| (), &never).unwrap();
        assert!(found.missing == [1] && !found.faults.is_empty(), "{found:?}");
    });
    linked.undo();
}

/// Expected: image folders whose contents are in an archive are removed only inside the dataset.
#[test]
fn nothing_is_cleared_away_behind_a_link() {
    let (_keep, around) = scratch();
    let (data, victim) = (around.join("data"), around.join("victim"));
    let mut make = trace(&["dataset", "--scene", PLANT, "--quiet", "--width", "48", "--spp", "1", "--count", "4"]);
    make.args(["--pack", "2", "--split", "1,0,0", "--out", path(&data)]);
    succeed(make);
    let set = Set::open(&data).unwrap();
    let _ = fs::remove_dir(data.join("images"));
    fs::create_dir_all(around.join("own/000000")).unwrap();
    fs::write(around.join("own/000000/mine.txt"), "the user's").unwrap();
    let whole = tree(&around.join("own"));
    symlink(around.join("own"), data.join("images")).unwrap();
    fails(render(&set), "images");
    // The records are no longer readable.
    assert!(finish::finish(&set, None).is_err());
    for remove in [None, Some("seals/train-000000.json"), Some("packs/train-000000.tar")] {
        if let Some(name) = remove {
            fs::remove_file(data.join(name)).unwrap();
        }
        fails(render(&set), "images");
        refused(verb("render", &data, &[]), "images");
        refused(verb("finish", &data, &[]), "images");
        refused(verb("verify", &data, &[]), "images");
    }
    same(&tree(&around.join("own")), &whole);
    fs::remove_file(data.join("images")).unwrap();
    for name in ["packs", "seals"] {
        let linked = Linked::at(&data, name, &victim);
        linked.keeps(|| {
            fails(render(&set), name);
            refused(verb("render", &data, &[]), name);
        });
        linked.undo();
    }
}
