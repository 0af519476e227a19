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

    /// Starts `workers` pools that together have `threads` threads, or one each if that is more.
    pub fn divided(threads: usize, workers: usize) -> Result<Vec<Self>> {
        (0..workers).map(|worker| Self::new(share(threads, workers, worker))).collect()
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

/// Returns the number of threads of one of `workers` workers that share `threads` threads; at least one.
fn share(threads: usize, workers: usize, worker: usize) -> usize {
    (threads / workers + usize::from(worker < threads % workers)).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_shared_out_whole() {
        for (threads, workers) in [(1, 1), (2, 2), (7, 3), (64, 16), (5, 4)] {
            let shares: Vec<usize> = (0..workers).map(|worker| share(threads, workers, worker)).collect();
            assert_eq!(shares.iter().sum::<usize>(), threads);
            assert!(shares.iter().max().unwrap() - shares.iter().min().unwrap() <= 1);
        }
        assert_eq!(share(2, 3, 2), 1);
    }
}
