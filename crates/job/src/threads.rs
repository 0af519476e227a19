//! Worker threads.

use furrow_base::Result;
use furrow_render::render;
use std::sync::{Arc, OnceLock};

/// A pool of worker threads that flush denormal floating-point numbers to zero, like the ray tracing kernels. Clones share the threads.
#[derive(Clone, Debug)]
pub struct Threads(Arc<rayon::ThreadPool>);

impl Threads {
    /// Starts `count` threads; 0 means [`Threads::all`]. Returns an [`Error`](furrow_base::Error) if the system cannot start them.
    pub fn new(count: usize) -> Result<Self> {
        if count == 0 { Self::all() } else { Ok(Self(Arc::new(render::pool(count)?))) }
    }

    /// Returns the process-wide pool with one thread per core.
    pub fn all() -> Result<Self> {
        static ALL: OnceLock<Threads> = OnceLock::new();
        if let Some(all) = ALL.get() {
            return Ok(all.clone());
        }
        let fresh = Self(Arc::new(render::pool(0)?));
        Ok(ALL.get_or_init(|| fresh).clone())
    }

    /// Returns the number of threads.
    pub fn count(&self) -> usize {
        self.0.current_num_threads()
    }

    /// Runs `work` in these threads. If the caller is already one of them, it runs directly.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.0.install(work)
    }
}
