//! Which files a scene file names, and when one of them is saved.
//!
//! Folders are watched, not files: many editors write a new file and rename it over the old one.

use super::session::Session;
use furrow::ron_file::RonFile;
use furrow::{Error, Result};
use notify::event::{AccessKind, AccessMode, ModifyKind};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// A save is many events; this long after the last of them it is over.
const QUIET: Duration = Duration::from_millis(25);

/// How often files are looked at of which no event has come.
const GLANCE: Duration = Duration::from_secs(1);

/// How coarse the times are that file systems write.
const COARSE: Duration = Duration::from_secs(2);

/// Most files that are looked into for the names of others.
const MOST: usize = 4096;

/// What is watched, shared by the threads that follow and look.
#[derive(Default)]
struct Followed {
    /// The files, as they were before they were read, or when they were looked at last.
    stamps: BTreeMap<PathBuf, Stamp>,
    /// Whether whatever is saved beside them counts too.
    beside: bool,
}

/// The files that are watched.
pub(super) struct Files {
    watcher: RecommendedWatcher,
    folders: BTreeSet<PathBuf>,
    /// What was read for the last picture, and what the last error was about: more than scene files say, since models name files too.
    read: BTreeSet<PathBuf>,
    followed: Arc<Mutex<Followed>>,
}

/// Begins to watch: nothing at first. The session is told when a watched file is saved.
pub(super) fn watch(session: Arc<Session>) -> Result<Files> {
    let failed = |e: notify::Error| {
        Error::failed(format!("cannot watch for changes of files: {e}"))
            .help("fs.inotify.max_user_instances and max_user_watches of sysctl are the limits")
    };
    let followed: Arc<Mutex<Followed>> = Arc::default();
    let (known, looked_at, (send, receive)) = (followed.clone(), followed.clone(), channel());
    let told = move |event: notify::Result<Event>| {
        let Ok(event) = event else { return };
        let known = known.lock().unwrap_or_else(PoisonError::into_inner);
        let counts = |path| known.beside || known.stamps.contains_key(path);
        if writes(event.kind) && (event.need_rescan() || event.paths.iter().any(counts)) {
            let _ = send.send(());
        }
    };
    let watcher = notify::recommended_watcher(told).map_err(failed)?;
    std::thread::Builder::new()
        .name("files".into())
        .spawn(move || wait(&receive, &session, &looked_at))
        .map_err(Error::no_thread)?;
    Ok(Files { watcher, folders: BTreeSet::new(), read: BTreeSet::new(), followed })
}

/// Tells the session of every burst of events, once. Where no events come, as on network file systems or from a folder that was removed and made
/// anew, the files' times and sizes tell.
fn wait(events: &Receiver<()>, session: &Session, followed: &Mutex<Followed>) {
    loop {
        let mut changed = match events.recv_timeout(GLANCE) {
            Ok(()) => true,
            Err(RecvTimeoutError::Timeout) => false,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        if changed {
            // A burst ends when nothing has come for a while.
            while events.recv_timeout(QUIET).is_ok() {}
        }
        let held = || followed.lock().unwrap_or_else(PoisonError::into_inner);
        // Looked at without the lock, which who reads the files needs.
        let all: Vec<PathBuf> = held().stamps.keys().cloned().collect();
        let now: Vec<(PathBuf, Stamp)> = all.into_iter().map(|path| (path.clone(), stamp(&path))).collect();
        for (path, now) in now {
            if let Some(before) = held().stamps.get_mut(&path) {
                changed |= *before != now;
                *before = now;
            }
        }
        if changed {
            session.reload();
        }
    }
}

/// When a file was written last, and how long it is; `None` where there is none.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let about = path.metadata().ok()?;
    Some((about.modified().ok()?, about.len()))
}

/// Whether an event may have changed what a file holds.
fn writes(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        EventKind::Modify(ModifyKind::Metadata(_)) => false,
        _ => true,
    }
}

impl Files {
    /// Watches a scene file, the files that it names and those that were read for the last picture, from now on: a change after this is
    /// seen. Call it before they are read.
    pub(super) fn expect(&mut self, scene: &Path) {
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        self.follow(&all, false);
    }

    /// Watches what was read as well, and forgets what is read no more. Whether one of the files that nothing had named before may have been
    /// written since `begin`, when the reading began.
    pub(super) fn keep(&mut self, scene: &Path, read: &[PathBuf], begin: SystemTime) -> bool {
        self.read = read.iter().cloned().collect();
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        let new = self.follow(&all, false);
        new.into_iter().flatten().any(|(written, _)| written + COARSE >= begin)
    }

    /// Watches, after an error, what was watched, what the error is about, and whatever is saved beside them: what is wrong or missing may be
    /// named where only a reader of models looks.
    pub(super) fn fail(&mut self, scene: &Path, about: Option<&Path>) {
        self.read.extend(about.map(Path::to_owned));
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        self.follow(&all, true);
    }

    /// Watches these files; the stamps of those that were not watched before.
    fn follow(&mut self, files: &BTreeSet<PathBuf>, beside: bool) -> Vec<Stamp> {
        let mut paths = BTreeSet::new();
        for file in files {
            let name = file.file_name().map(PathBuf::from).unwrap_or_default();
            let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            // A link is replaced in its own folder, and written through to where it leads.
            paths.extend(folder.canonicalize().ok().map(|folder| folder.join(name)));
            paths.extend(file.canonicalize().ok());
        }
        let folders: BTreeSet<PathBuf> = paths.iter().filter_map(|p| p.parent().map(Path::to_owned)).collect();
        let mut new = Vec::new();
        {
            let mut followed = self.followed.lock().unwrap_or_else(PoisonError::into_inner);
            let before = std::mem::take(&mut followed.stamps);
            followed.beside = beside;
            followed.stamps = paths
                .into_iter()
                .map(|path| {
                    let known = before.get(&path).copied().unwrap_or_else(|| {
                        let now = stamp(&path);
                        new.push(now);
                        now
                    });
                    (path, known)
                })
                .collect();
        }
        for gone in self.folders.difference(&folders) {
            let _ = self.watcher.unwatch(gone);
        }
        let mut watched = BTreeSet::new();
        for folder in folders {
            // Asked again where it is watched already: it may have been removed and made anew.
            match self.watcher.watch(&folder, RecursiveMode::NonRecursive) {
                Ok(()) => drop(watched.insert(folder)),
                Err(e) if self.folders.contains(&folder) => drop(e),
                Err(e) => furrow::tell!("warning: changes in {} are not seen: {e}", folder.display()),
            }
        }
        self.folders = watched;
        new
    }
}

/// A RON file and every file that its text names, there or not, with those that they name.
fn named(scene: &Path) -> BTreeSet<PathBuf> {
    let mut all = BTreeSet::from([scene.to_path_buf()]);
    let mut left = vec![scene.to_path_buf()];
    while let Some(path) = left.pop() {
        let Ok(file) = RonFile::read(&path) else { continue };
        file.replace_quoted(|text| {
            // Keys and names stand in quotes too: what has no ending is no file.
            let full = file.resolve(text);
            if full.extension().is_some() && all.len() < MOST && all.insert(full.clone()) {
                if full.extension().is_some_and(|e| e == "ron") {
                    left.push(full);
                } else {
                    // A leaf's relief lies beside it.
                    all.insert(full.with_extension("height.png"));
                }
            }
            None
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_named_is_found_whether_or_not_it_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.ron"), r#"Field(species: "b.ron", key: "leaf", gone: "c.png") // "d.png""#).unwrap();
        std::fs::write(at("b.ron"), r#"Species(texture: "e.png", back: "a.ron")"#).unwrap();
        let found = named(&at("a.ron"));
        for name in ["a.ron", "b.ron", "c.png", "e.png", "e.height.png"] {
            assert!(found.contains(&at(name)), "{name} in {found:?}");
        }
        assert!(!found.contains(&at("d.png")) && !found.contains(&at("leaf")), "{found:?}");
    }
}
