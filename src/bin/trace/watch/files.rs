//! Files named by a scene file, and notification when one of them is saved.
//!
//! Folders are watched instead of files, because many editors write a new file and rename it over the old one.

use super::session::Session;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use notify::event::{AccessKind, AccessMode, ModifyKind};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// A save causes many events; it is over this long after the last one.
const QUIET: Duration = Duration::from_millis(25);

/// Polling interval for changes without an event.
const GLANCE: Duration = Duration::from_secs(1);

/// Resolution of modification times in file systems.
const COARSE: Duration = Duration::from_secs(2);

/// Maximum number of files searched for the names of others.
const MOST: usize = 4096;

/// Watched files, shared by the threads that receive events and poll.
#[derive(Default)]
struct WatchedFiles {
    /// The files, with their stamps before they were read, or at the last poll.
    stamps: BTreeMap<PathBuf, Stamp>,
    /// `true` if any file saved in the same folders counts too.
    beside: bool,
}

/// The watched files.
pub(super) struct Files {
    watcher: RecommendedWatcher,
    folders: BTreeSet<PathBuf>,
    /// Files read for the last image, and the file of the last error: more than scene files name, because models name
    /// files too.
    read: BTreeSet<PathBuf>,
    followed: Arc<Mutex<WatchedFiles>>,
}

/// Starts watching, initially nothing. The session is notified when a watched file is saved.
pub(super) fn watch(session: Arc<Session>) -> Result<Files> {
    let failed = |e: notify::Error| {
        Error::failed(format!("cannot watch for changes of files: {e}"))
            .help("raise fs.inotify.max_user_instances or fs.inotify.max_user_watches with sysctl")
    };
    let followed: Arc<Mutex<WatchedFiles>> = Arc::default();
    let (known, looked_at, (send, receive)) = (followed.clone(), followed.clone(), channel());
    let on_event = move |event: notify::Result<Event>| {
        let Ok(event) = event else { return };
        let known = known.lock().unwrap_or_else(PoisonError::into_inner);
        let counts = |path| known.beside || known.stamps.contains_key(path);
        if writes(event.kind) && (event.need_rescan() || event.paths.iter().any(counts)) {
            let _ = send.send(());
        }
    };
    let watcher = notify::recommended_watcher(on_event).map_err(failed)?;
    std::thread::Builder::new()
        .name("files".into())
        .spawn(move || wait(&receive, &session, &looked_at))
        .map_err(Error::no_thread)?;
    Ok(Files { watcher, folders: BTreeSet::new(), read: BTreeSet::new(), followed })
}

/// Notifies the session once per burst of events. Changes without events, as on network file systems or in a folder
/// that was deleted and recreated, are detected by modification time and size.
fn wait(events: &Receiver<()>, session: &Session, followed: &Mutex<WatchedFiles>) {
    loop {
        let mut changed = match events.recv_timeout(GLANCE) {
            Ok(()) => true,
            Err(RecvTimeoutError::Timeout) => false,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        if changed {
            // A burst ends with a pause.
            while events.recv_timeout(QUIET).is_ok() {}
        }
        let held = || followed.lock().unwrap_or_else(PoisonError::into_inner);
        // Polled without holding the lock, which the thread that reads the files needs.
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

/// Modification time and size of a file; `None` if it does not exist.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let about = path.metadata().ok()?;
    Some((about.modified().ok()?, about.len()))
}

/// Returns `true` if an event may have changed the content of a file.
fn writes(kind: EventKind) -> bool {
    match kind {
        EventKind::Access(access) => access == AccessKind::Close(AccessMode::Write),
        EventKind::Modify(ModifyKind::Metadata(_)) => false,
        _ => true,
    }
}

impl Files {
    /// Watches a scene file, the files it names and those read for the last image. Must be called before they are read,
    /// so that later changes are noticed.
    pub(super) fn expect(&mut self, scene: &Path) {
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        self.follow(&all, false);
    }

    /// Also watches the files that were read, and forgets those no longer read. Returns `true` if a file not named
    /// before may have been written since `begin`, when reading started.
    pub(super) fn keep(&mut self, scene: &Path, read: &[PathBuf], begin: SystemTime) -> bool {
        self.read = read.iter().cloned().collect();
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        let new = self.follow(&all, false);
        new.into_iter().flatten().any(|(written, _)| written + COARSE >= begin)
    }

    /// After an error, watches the same files, the file of the error, and everything saved in the same folders: the
    /// missing or faulty file may be named in a file that only the model loader reads.
    pub(super) fn fail(&mut self, scene: &Path, about: Option<&Path>) {
        self.read.extend(about.map(Path::to_owned));
        let mut all = named(scene);
        all.extend(self.read.iter().cloned());
        self.follow(&all, true);
    }

    /// Watches these files. Returns the stamps of those not watched before.
    fn follow(&mut self, files: &BTreeSet<PathBuf>, beside: bool) -> Vec<Stamp> {
        let mut paths = BTreeSet::new();
        for file in files {
            let name = file.file_name().map(PathBuf::from).unwrap_or_default();
            let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            // A link can be replaced in its own folder, or its target can be written.
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
            // Watch again even if already watched: the folder may have been deleted and recreated.
            match self.watcher.watch(&folder, RecursiveMode::NonRecursive) {
                Ok(()) => drop(watched.insert(folder)),
                Err(e) if self.folders.contains(&folder) => drop(e),
                Err(e) => furrow_cli::message!("warning: changes in {} cannot be detected: {e}", folder.display()),
            }
        }
        self.folders = watched;
        new
    }
}

/// Returns a RON file and all files named in it, existing or not, recursively.
fn named(scene: &Path) -> BTreeSet<PathBuf> {
    let mut all = BTreeSet::from([scene.to_path_buf()]);
    let mut left = vec![scene.to_path_buf()];
    while let Some(path) = left.pop() {
        let Ok(file) = RonFile::read(&path) else { continue };
        file.replace_quoted(|text| {
            // Keys and names are quoted too; strings without a file extension are not files.
            let full = file.resolve(text);
            if full.extension().is_some() && all.len() < MOST && all.insert(full.clone()) {
                if full.extension().is_some_and(|e| e == "ron") {
                    left.push(full);
                } else {
                    // A leaf's height map is next to its image.
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
