//! Atomic file writing: files are written to a temporary name in the target's folder, flushed, then renamed.
//!
//! Several programs may write into one folder, and one of them may remove the temporary files of killed programs. A
//! temporary file that has disappeared before its rename is therefore not an error; it is written again.
//! [`remove_own_unfinished`] removes those of this process before a signal ends it.

mod live;

pub use live::remove_own_unfinished;

use crate::{Error, Result};
use live::recorded;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::{NamedTempFile, TempPath};

/// Name prefix of unfinished files.
const UNFINISHED: &str = ".furrow-";

/// Time without a change after which an unfinished file belongs to no running program.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// Number of times a file is rewritten after another program has removed its temporary file. A clean-up removes it only
/// once.
const MOST_AGAIN: usize = 32;

/// Returns `true` if a file of this name is unfinished: left by a killed program or about to be renamed by a running
/// one.
pub fn is_unfinished(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// Writes a file to a temporary name in the target's folder, flushes and renames it, so a reader never sees an
/// incomplete file.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    stream_atomically(path, |file| file.write_all(bytes).map_err(Error::io(path)))
}

/// Writes a file in pieces and atomically, as [`write_atomically`] does.
pub fn stream_atomically(path: &Path, write: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<()> {
    let mut file = unfinished(path, write)?;
    for _ in 0..MOST_AGAIN {
        match file.persist(path) {
            Ok(_) => return Ok(()),
            Err(e) if e.error.kind() == ErrorKind::NotFound => file = copied(e.file, path)?,
            Err(e) => return Err(Error::io(path)(e.error)),
        }
    }
    Err(cleared(path))
}

/// Like [`write_atomically`], for a file that `write` creates at the path it is given. That path has the target's file
/// name in a temporary folder next to the target, because some formats store the name.
pub fn place_atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let folder = parent(path);
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let mut builder = tempfile::Builder::new();
    let within = recorded(|| builder.prefix(UNFINISHED).tempdir_in(folder), |within| within.path());
    let within = within.map_err(Error::io(path))?;
    let unfinished = within.path().join(path.file_name().unwrap_or_default());
    write(&unfinished)?;
    File::open(&unfinished).and_then(|file| file.sync_all()).map_err(Error::io(path))?;
    fs::rename(&unfinished, path).map_err(Error::io(path))
}

/// Creates a file exclusively. Returns `false` if it already exists; if several programs create it at once, one of them
/// gets `true`.
pub fn create_atomically(path: &Path, bytes: &[u8]) -> Result<bool> {
    for _ in 0..MOST_AGAIN {
        let file = unfinished(path, |file| file.write_all(bytes).map_err(Error::io(path)))?;
        match file.persist_noclobber(path) {
            Ok(_) => return Ok(true),
            Err(e) if e.error.kind() == ErrorKind::AlreadyExists => return Ok(false),
            Err(e) if e.error.kind() == ErrorKind::NotFound => {}
            Err(e) => return Err(Error::io(path)(e.error)),
        }
    }
    Err(cleared(path))
}

/// Set of files that are replaced together.
///
/// All are complete under temporary names before the first is renamed. If the disk is full, the previous files stay and
/// are never mixed with new ones. If a rename fails, the earlier renames are undone.
#[derive(Default)]
pub struct FileSet {
    waiting: Vec<(TempPath, PathBuf)>,
    /// Indices in `waiting` of the files that are not flushed yet.
    unflushed: Vec<usize>,
}

/// Number of threads that flush files: a disk writes many files at once faster than one after the other.
const FLUSHERS: usize = 16;

impl FileSet {
    /// Adds a file.
    pub fn add(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.add_written(path, |path| unfinished(path, |file| file.write_all(bytes).map_err(Error::io(path))))
    }

    /// Adds one of thousands of files: it is flushed in [`finish`](Self::finish), together with others.
    pub fn add_unflushed(&mut self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.add_streamed(path, |file| file.write_all(bytes).map_err(Error::io(path)))
    }

    /// Adds a file that `write` writes in pieces. It is flushed in [`finish`](Self::finish), together with others.
    pub fn add_streamed(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
    ) -> Result<()> {
        self.add_written(path, |path| unflushed(path, write))?;
        self.unflushed.push(self.waiting.len() - 1);
        Ok(())
    }

    fn add_written(&mut self, path: &Path, write: impl FnOnce(&Path) -> Result<NamedTempFile>) -> Result<()> {
        if path.is_dir() {
            return Err(Error::io(path)(ErrorKind::IsADirectory.into()));
        }
        self.waiting.push((write(path)?.into_temp_path(), path.into()));
        Ok(())
    }

    /// Adds a file with the same content as `to`, which was added before or exists already. It becomes a hard link, so
    /// that the content is stored once; on a file system without hard links it is written again.
    pub fn add_equal(&mut self, to: &Path, path: &Path, bytes: &[u8]) -> Result<()> {
        let folder = parent(path);
        fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let there = self.waiting.iter().find(|(_, target)| target == to).map_or(to, |(there, _)| there.as_ref());
        let mut builder = tempfile::Builder::new();
        let link = || builder.prefix(UNFINISHED).make_in(folder, |name| fs::hard_link(there, name));
        match recorded(link, |link| link.path()) {
            Ok(link) => self.waiting.push((link.into_temp_path(), path.into())),
            Err(_) => self.add(path, bytes)?,
        }
        Ok(())
    }

    /// Renames all files and returns their paths in the order in which they were added. Returns `None` if another
    /// program removed a temporary file; then all must be added again.
    pub fn finish(self) -> Result<Option<Vec<PathBuf>>> {
        if !self.flush()? {
            return Ok(None);
        }
        let mut done: Vec<Replaced> = Vec::new();
        for (temporary, path) in self.waiting {
            let name = temporary.to_path_buf();
            let replaced = Replaced::keep(path);
            if let Err(e) = temporary.persist(&replaced.path) {
                let failed = match e.error.kind() {
                    ErrorKind::NotFound => Ok(None),
                    _ => Err(Error::io(&replaced.path)(e.error)),
                };
                done.into_iter().rev().for_each(Replaced::undo);
                return failed;
            }
            // If both are names of the same file, POSIX rename leaves both.
            let _ = fs::remove_file(name);
            done.push(replaced);
        }
        Ok(Some(done.into_iter().map(|replaced| replaced.path).collect()))
    }

    /// Flushes the files that are not flushed yet. Returns `false` if another program removed one of them.
    fn flush(&self) -> Result<bool> {
        let flush = |&k: &usize| {
            let (temporary, path) = &self.waiting[k];
            let flushed = File::open(temporary).and_then(|file| file.sync_all());
            unless_gone(flushed).map(|there| there.is_some()).map_err(Error::io(path))
        };
        let flush_some = |some: &[usize]| {
            let there = some.iter().map(flush).collect::<Result<Vec<bool>>>()?;
            Ok::<bool, Error>(there.into_iter().all(|there| there))
        };
        let share = self.unflushed.len().div_ceil(FLUSHERS).max(1);
        std::thread::scope(|scope| {
            let chunks = self.unflushed.chunks(share);
            let flushers: Vec<_> = chunks.map(|some| scope.spawn(move || flush_some(some))).collect();
            let mut all = true;
            for flusher in flushers {
                all &= flusher.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
            }
            Ok(all)
        })
    }
}

/// Replaced file, with a second name of the old content until the whole set is renamed.
struct Replaced {
    path: PathBuf,
    was_there: bool,
    old: Option<TempPath>,
}

impl Replaced {
    /// Keeps the current content of this path under a temporary name, if the file system supports hard links.
    fn keep(path: PathBuf) -> Self {
        let was_there = fs::symlink_metadata(&path).is_ok();
        let mut builder = tempfile::Builder::new();
        let mut link = || builder.prefix(UNFINISHED).make_in(parent(&path), |name| fs::hard_link(&path, name));
        let old = was_there.then(|| recorded(&mut link, |old| old.path()).ok()).flatten();
        Self { old: old.map(tempfile::NamedTempFile::into_temp_path), was_there, path }
    }

    /// Restores the old content, if the disk allows it.
    fn undo(self) {
        match self.old {
            Some(old) => {
                // If both are names of the same file, POSIX rename leaves both. If restoring fails, the complete new
                // file stays.
                let name = old.to_path_buf();
                if old.persist(&self.path).is_ok() {
                    let _ = fs::remove_file(name);
                }
            }
            None if !self.was_there => drop(fs::remove_file(&self.path)),
            None => {}
        }
    }
}

/// Writes a set of files as [`FileSet`] does and returns their paths. `add` adds the files; it is called again if
/// another program removes temporary files.
pub fn write_together(folder: &Path, add: impl Fn(&mut FileSet) -> Result<()>) -> Result<Vec<PathBuf>> {
    for _ in 0..MOST_AGAIN {
        let mut files = FileSet::default();
        add(&mut files)?;
        if let Some(paths) = files.finish()? {
            return Ok(paths);
        }
    }
    Err(cleared(folder))
}

/// Writes a complete file to a temporary name in the target's folder and flushes it.
fn unfinished(path: &Path, write: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<NamedTempFile> {
    let file = unflushed(path, write)?;
    file.as_file().sync_all().map_err(Error::io(path))?;
    Ok(file)
}

/// Writes a complete file to a temporary name in the target's folder.
fn unflushed(path: &Path, write: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<NamedTempFile> {
    let mut buffer = io::BufWriter::with_capacity(1 << 16, temporary(path)?);
    write(&mut buffer)?;
    buffer.into_inner().map_err(|e| Error::io(path)(e.into_error()))
}

fn temporary(path: &Path) -> Result<NamedTempFile> {
    let folder = parent(path);
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Permissions of any other new file: the umask applies.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    recorded(|| builder.tempfile_in(folder), |file| file.path()).map_err(Error::io(path))
}

/// Copies an unfinished file to another temporary name; its content is accessible while it is open.
fn copied(mut from: NamedTempFile, path: &Path) -> Result<NamedTempFile> {
    let mut to = temporary(path)?;
    let from = from.as_file_mut();
    from.rewind().and_then(|()| io::copy(from, to.as_file_mut())).map_err(Error::io(path))?;
    to.as_file().sync_all().map_err(Error::io(path))?;
    Ok(to)
}

fn cleared(path: &Path) -> Error {
    Error::failed("another program keeps removing the temporary files in this folder").in_file(path)
}

/// Returns the folder of a file.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes the unfinished files of killed programs from a folder and its subfolders.
pub fn remove_unfinished(folder: &Path) -> Result<()> {
    let mut todo = vec![folder.to_path_buf()];
    while let Some(folder) = todo.pop() {
        todo.extend(remove_unfinished_in(&folder)?);
    }
    Ok(())
}

/// Removes unfinished files from this folder only; returns its subfolders.
pub fn remove_unfinished_in(folder: &Path) -> Result<Vec<PathBuf>> {
    remove_older(folder, Duration::ZERO)
}

/// Removes the unfinished files of killed programs from a folder that other programs may be writing into: those that were
/// not changed for a day.
pub fn remove_abandoned_in(folder: &Path) -> Result<()> {
    remove_older(folder, ABANDONED).map(drop)
}

/// Removes unfinished files of at least this age from a folder; returns its subfolders.
fn remove_older(folder: &Path, age: Duration) -> Result<Vec<PathBuf>> {
    let is_young = |about: &fs::Metadata| {
        let changed = about.modified().ok().and_then(|changed| changed.elapsed().ok());
        !age.is_zero() && changed.is_none_or(|changed| changed < age)
    };
    let mut within = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io(folder))? {
        let entry = entry.map_err(Error::io(folder))?;
        let path = entry.path();
        let unfinished = is_unfinished(&entry.file_name());
        if unfinished && unless_gone(entry.metadata()).map_err(Error::io(&path))?.is_none_or(|about| is_young(&about)) {
            continue;
        }
        let Some(kind) = unless_gone(entry.file_type()).map_err(Error::io(&path))? else { continue };
        let removed = match (kind.is_dir(), unfinished) {
            (true, true) => unless_gone(fs::remove_dir_all(&path)),
            (false, true) => unless_gone(fs::remove_file(&path)),
            (true, false) => {
                within.push(path);
                continue;
            }
            (false, false) => continue,
        };
        removed.map_err(Error::io(&path))?;
    }
    Ok(within)
}

/// Returns `None` if the file no longer exists because its writer renamed it or another program removed it.
fn unless_gone<T>(done: io::Result<T>) -> io::Result<Option<T>> {
    match done {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        other => other.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut all: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        all.sort();
        all
    }

    /// Expected: a file that was changed a minute ago stays, one of last week goes, and files with other names stay.
    #[test]
    fn files_without_a_writer_are_removed_after_a_day() {
        let folder = tempfile::tempdir().unwrap();
        for (name, age_s) in [(".furrow-new", 60), (".furrow-old", 7 * 86400), ("kept", 7 * 86400)] {
            let file = File::create(folder.path().join(name)).unwrap();
            file.set_modified(std::time::SystemTime::now() - Duration::from_secs(age_s)).unwrap();
        }
        remove_abandoned_in(folder.path()).unwrap();
        assert_eq!(names(folder.path()), [".furrow-new", "kept"]);
        remove_unfinished_in(folder.path()).unwrap();
        assert_eq!(names(folder.path()), ["kept"]);
    }

    #[test]
    fn a_file_whose_temporary_name_is_cleared_away_appears_all_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b");
        stream_atomically(&path, |file| {
            file.write_all(&vec![7; 100_000]).unwrap();
            remove_unfinished(folder.path()).unwrap();
            Ok(())
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), vec![7; 100_000]);
        let times = std::cell::Cell::new(0);
        let (first, second) = (folder.path().join("c"), folder.path().join("d"));
        let paths = write_together(folder.path(), |files| {
            files.add(&first, b"one")?;
            files.add_equal(&first, &second, b"one")?;
            times.set(times.get() + 1);
            if times.get() == 1 { remove_unfinished(folder.path()) } else { Ok(()) }
        });
        assert_eq!(paths.unwrap(), [first.clone(), second.clone()]);
        assert_eq!((fs::read(first).unwrap(), fs::read(second).unwrap()), (b"one".to_vec(), b"one".to_vec()));
        assert_eq!(names(folder.path()), ["a", "c", "d"]);
        assert_eq!(times.get(), 2);
    }

    /// Expected: if one of several files cannot be written, none is replaced and no temporary file remains.
    #[test]
    fn files_that_belong_together_are_replaced_together() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
        let write = |text: &[u8], last: &Path| {
            write_together(folder.path(), |files| {
                files.add(&a, text)?;
                files.add(&b, text)?;
                files.add(last, text)
            })
        };
        write(b"old", &c).unwrap();
        fs::remove_file(&c).unwrap();
        fs::create_dir(&c).unwrap();
        // One target is a folder; the folder of the other cannot be created because a file has its name.
        for last in [c.clone(), a.join("x")] {
            assert_eq!(write(b"new", &last).unwrap_err().exit_code(), 1);
            assert_eq!((fs::read(&a).unwrap(), fs::read(&b).unwrap()), (b"old".to_vec(), b"old".to_vec()));
            assert_eq!(names(folder.path()), ["a", "b", "c"]);
        }
    }

    /// Expected: if a folder takes one target's name after all files were written, the files renamed before it are
    /// restored and new ones are removed.
    #[test]
    fn files_renamed_before_one_that_cannot_be_are_put_back() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
        fs::write(&a, "old").unwrap();
        let mut files = FileSet::default();
        for path in [&a, &b, &c] {
            files.add(path, b"new").unwrap();
        }
        fs::create_dir(&c).unwrap();
        assert_eq!(files.finish().unwrap_err().exit_code(), 1);
        assert_eq!(fs::read(&a).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a", "c"]);
    }

    #[test]
    fn two_names_of_one_file_leave_nothing_beside_them() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let mut files = FileSet::default();
        files.add(&a, b"x").unwrap();
        files.add_equal(&a, &b, b"x").unwrap();
        // Another program has given the same file its second name.
        let there = files.waiting[0].0.to_path_buf();
        fs::hard_link(&there, &b).unwrap();
        assert_eq!(files.finish().unwrap().unwrap(), [a, b]);
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[test]
    fn what_must_be_new_is_made_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert!(create_atomically(&path, b"mine").unwrap());
        assert!(!create_atomically(&path, b"theirs").unwrap());
        assert_eq!(fs::read(&path).unwrap(), b"mine");
        assert_eq!(names(folder.path()), ["a"]);
    }

    /// Expected: files that are flushed together appear in the order of their addition; if one of them was cleared away,
    /// none appears.
    #[test]
    fn files_that_are_flushed_together_appear_together() {
        let folder = tempfile::tempdir().unwrap();
        let paths: Vec<PathBuf> = (0..50).map(|k| folder.path().join(format!("{k:02}"))).collect();
        let add = || {
            let mut files = FileSet::default();
            for path in &paths {
                files.add_unflushed(path, path.as_os_str().as_encoded_bytes()).unwrap();
            }
            files
        };
        let files = add();
        remove_unfinished(folder.path()).unwrap();
        assert_eq!(files.finish().unwrap(), None);
        assert_eq!(names(folder.path()), [""; 0]);
        assert_eq!(add().finish().unwrap().unwrap(), paths);
        assert!(paths.iter().all(|path| fs::read(path).unwrap() == path.as_os_str().as_encoded_bytes()));
    }
}
