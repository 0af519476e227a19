//! How a push is stopped: at once, or before the next transfer.

use furrow_base::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};

/// Flags that stop a push.
#[derive(Clone, Copy, Debug)]
pub struct Stop<'a> {
    /// Set to `true` to begin no other transfer. The unit is pushed again by the next run.
    pub soon: &'a AtomicBool,
    /// Set to `true` to end the current transfer as well.
    pub now: &'a AtomicBool,
}

impl Stop<'_> {
    /// Fails if no other transfer may begin.
    pub(super) fn check(&self) -> Result<()> {
        let is_stopped = self.soon.load(Ordering::Relaxed) || self.now.load(Ordering::Relaxed);
        if is_stopped { Err(interrupted()) } else { Ok(()) }
    }
}

/// Returns the error of a stopped push.
pub(super) fn interrupted() -> Error {
    Error::stopped("stopped before all files were copied").help("the same command copies the rest")
}
