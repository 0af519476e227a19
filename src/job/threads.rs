//! The worker threads.

use crate::{Result, render};
use std::sync::{Arc, OnceLock};

/// Worker threads whose floating-point arithmetic flushes denormals as the ray tracing kernels do. Clones share the threads.
#[derive(Clone, Debug)]
pub struct Threads(Arc<rayon::ThreadPool>);

impl Threads {
    /// So many threads; 0 for [`Threads::all`]. An [`Error`](crate::Error) where the system refuses to start them.
    pub fn new(count: usize) -> Result<Self> {
        if count == 0 { Self::all() } else { Ok(Self(Arc::new(render::pool(count)?))) }
    }

    /// One thread on each core, the same ones for the whole process.
    pub fn all() -> Result<Self> {
        static ALL: OnceLock<Threads> = OnceLock::new();
        if let Some(all) = ALL.get() {
            return Ok(all.clone());
        }
        let fresh = Self(Arc::new(render::pool(0)?));
        Ok(ALL.get_or_init(|| fresh).clone())
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.current_num_threads()
    }

    /// Runs work in these threads. Inside work that they run already, it runs at once.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.0.install(work)
    }
}
