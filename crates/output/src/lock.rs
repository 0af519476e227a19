//! Lock file: one process holds it at a time, and the system releases it when that process ends for any reason.
//!
//! The holder removes the file's name before it releases the lock. A process that opened the file earlier may then lock
//! a file without a name, which excludes no one, so it opens the file of that name again.

use furrow_base::{Error, Result};
use std::fs::{self, File, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Polling interval for a lock held by another process.
const EVERY: Duration = Duration::from_millis(50);

/// Lock held by this process until the value is dropped, which removes the file.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// `None` if the file system does not support locks.
    held: Option<File>,
}

impl Lock {
    /// Waits for the lock in this file and creates its folder if it is missing. `waits` is called once if another
    /// process holds the lock. Returns `None` if `stop` returned `true` first. If the file system does not support
    /// locks, it returns at once.
    ///
    /// # Errors
    /// Returns an error if the file cannot be created.
    pub fn wait(path: &Path, waits: impl FnOnce(), stop: impl Fn() -> bool) -> Result<Option<Self>> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(Error::io(folder))?;
        let lock = |held: Option<File>| Ok(Some(Self { path: path.into(), held }));
        let open = || File::options().create(true).truncate(false).read(true).write(true).open(path);
        let mut waits = Some(waits);
        loop {
            let file = open().map_err(Error::io(path))?;
            match file.try_lock() {
                Ok(()) if is_named(&file, path) => return lock(Some(file)),
                Ok(()) => continue,
                Err(TryLockError::Error(_)) => return lock(None),
                Err(TryLockError::WouldBlock) => {}
            }
            if stop() {
                return Ok(None);
            }
            if let Some(waits) = waits.take() {
                waits();
            }
            std::thread::sleep(EVERY);
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // First the name, then the lock, which is released with the open file. A file that stays is reused by the next
        // process.
        if self.held.is_some() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Returns `true` if an open file still has this name; the previous holder may have removed the name.
fn is_named(file: &File, path: &Path) -> bool {
    let id = |about: fs::Metadata| (about.dev(), about.ino());
    file.metadata().ok().map(id).is_some_and(|own| fs::metadata(path).ok().map(id) == Some(own))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Rationale: the name is removed while others wait for it. Expected: of many threads that take one lock
    /// repeatedly, no two hold it at once, and no file is left. Source: none, this is the definition of a lock.
    #[test]
    fn one_holds_it_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.lock");
        let (inside, taken) = (AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..8 {
                        let lock = Lock::wait(&path, || (), || false).unwrap().unwrap();
                        assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                        std::thread::sleep(Duration::from_millis(1));
                        inside.fetch_sub(1, Ordering::SeqCst);
                        taken.fetch_add(1, Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert_eq!((taken.into_inner(), path.exists()), (32, false));
    }

    /// Expected: a file left by a killed process is taken; a caller whose `stop` returns `true` gets nothing, and
    /// `waits` is not called.
    #[test]
    fn a_file_without_a_holder_is_taken_and_one_with_a_holder_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("b.lock");
        fs::write(&path, "").unwrap();
        let held = Lock::wait(&path, || panic!("nobody holds it"), || false).unwrap().unwrap();
        assert!(Lock::wait(&path, || panic!("it is to stop"), || true).unwrap().is_none());
        assert!(path.exists());
        drop(held);
        assert!(!path.exists());
        assert!(Lock::wait(&path.join("c"), || (), || false).is_ok());
        assert!(Lock::wait(folder.path(), || (), || false).is_err());
    }
}
