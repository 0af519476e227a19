//! Temporary names that this process has in use, so that they can be removed before a signal ends it.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, TryLockError};
use std::time::Duration;

/// Names that may exist. Renamed and removed ones stay listed until there are many.
struct Live {
    names: BTreeSet<PathBuf>,
    /// Number of names above which the list is freed of files that no longer exist.
    most: usize,
}

/// Number of names that are kept without a look at the disk.
const FEW: usize = 1024;

static LIVE: Mutex<Live> = Mutex::new(Live { names: BTreeSet::new(), most: FEW });

/// Number of times, and the time between them, that [`remove_own_unfinished`] waits for a file that is being created.
const WAITS: (u32, Duration) = (50, Duration::from_millis(10));

/// Creates a temporary file or folder, whose path `name` returns, and records it.
pub(super) fn recorded<T>(create: impl FnOnce() -> io::Result<T>, name: impl FnOnce(&T) -> &Path) -> io::Result<T> {
    // The lock is held while the file is created, so that none appears after the others were removed.
    let mut live = LIVE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let created = create()?;
    live.names.insert(name(&created).to_path_buf());
    if live.names.len() > live.most {
        live.names.retain(|name| name.symlink_metadata().is_ok());
        live.most = FEW.max(2 * live.names.len());
    }
    Ok(created)
}

/// Removes the unfinished files of this process, which is about to end. The process cannot create any others: threads
/// that try to wait for ever.
pub fn remove_own_unfinished() {
    let Some(live) = waited() else { return };
    for name in &live.names {
        let _ = fs::remove_file(name).or_else(|_| fs::remove_dir_all(name));
    }
    std::mem::forget(live);
}

/// Waits for the lock for a bounded time: a file system that does not answer must not keep the process from ending.
fn waited() -> Option<MutexGuard<'static, Live>> {
    for _ in 0..WAITS.0 {
        match LIVE.try_lock() {
            Ok(live) => return Some(live),
            Err(TryLockError::Poisoned(live)) => return Some(live.into_inner()),
            Err(TryLockError::WouldBlock) => std::thread::sleep(WAITS.1),
        }
    }
    None
}
