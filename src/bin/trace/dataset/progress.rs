//! How far a dataset is: a bar on a terminal, a line now and then in a log.

use crate::growing;
use furrow::scene::assemble::BuildProgress;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Between two lines of a log.
const EVERY: Duration = Duration::from_secs(30);

/// Images done, images per hour, time left.
pub(crate) struct Progress {
    begin: Instant,
    total: AtomicU64,
    done: AtomicU64,
    bar: ProgressBar,
    /// When the log's last line was written; `None` where no log is wanted.
    log: Option<Mutex<Instant>>,
}

impl Progress {
    /// Begins to count; `begin` is when the work began.
    pub(crate) fn new(begin: Instant, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = if quiet || !terminal { ProgressBar::hidden() } else { ProgressBar::new(0) };
        let style = ProgressStyle::with_template("{bar:40} {pos} of {len} images  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let log = (!quiet && !terminal).then(|| Mutex::new(Instant::now()));
        Self { begin, total: AtomicU64::new(0), done: AtomicU64::new(0), bar, log }
    }

    /// The same of rendered fields: until the first image is done, the bar says what is under way.
    pub(crate) fn of_fields(begin: Instant, quiet: bool, growing: &Arc<BuildProgress>) -> Self {
        let progress = Self::new(begin, quiet);
        let template = "{bar:40} {pos} of {len} images  {growing}  {msg}";
        growing::show(&progress.bar, template, growing, |state| state.pos() == 0);
        progress
    }

    /// Takes the bar away while something else is written.
    pub(crate) fn pause(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }

    /// So many images are to be done.
    pub(crate) fn expect(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.bar.set_length(total);
        self.bar.tick();
    }

    /// One more is done.
    pub(crate) fn add(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.set_message(self.rate(done));
        self.bar.inc(1);
        let Some(log) = &self.log else { return };
        let mut last = log.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if last.elapsed() >= EVERY {
            *last = Instant::now();
            furrow::tell!("{done} of {} images; {}", self.total.load(Ordering::Relaxed), self.rate(done));
        }
    }

    fn rate(&self, done: u64) -> String {
        let seconds = self.begin.elapsed().as_secs_f64();
        let left = self.total.load(Ordering::Relaxed).saturating_sub(done) as f64 * seconds / done.max(1) as f64;
        format!(
            "{:.0} images an hour, {} left",
            3600.0 * done as f64 / seconds.max(1e-9),
            HumanDuration(Duration::from_secs_f64(left.max(0.0)))
        )
    }

    /// Ends the bar; returns how many images were done, and images per hour.
    pub(crate) fn finish(&self) -> (u64, f64) {
        self.bar.finish_and_clear();
        let done = self.done.load(Ordering::Relaxed);
        (done, 3600.0 * done as f64 / self.begin.elapsed().as_secs_f64().max(1e-9))
    }
}
