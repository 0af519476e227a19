//! How far a dataset is: a bar on a terminal, a line now and then in a log.

use crate::growing;
use furrow::dataset::time_left::TimeLeft;
use furrow::scene::assemble::BuildProgress;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Images done, images per hour, time left.
pub(crate) struct Progress {
    begin: Instant,
    total: AtomicU64,
    done: AtomicU64,
    /// Drawn as soon as it is known how many there are.
    bar: ProgressBar,
    /// Whether somebody looks at the bar.
    seen: bool,
    /// What tells the time left, where images take different times; at their mean rate otherwise.
    time_left: Option<Arc<TimeLeft>>,
    /// When the log's last line was written; `None` where no log is wanted.
    log: Option<Mutex<Instant>>,
}

impl Progress {
    /// Begins to count; `begin` is when the work began.
    pub(crate) fn new(begin: Instant, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = ProgressBar::hidden();
        let style = ProgressStyle::with_template("{bar:40} {pos} of {len} images  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let log = (!quiet && !terminal).then(|| Mutex::new(Instant::now()));
        let (total, done) = (AtomicU64::new(0), AtomicU64::new(0));
        Self { begin, total, done, bar, seen: terminal && !quiet, time_left: None, log }
    }

    /// The same of rendered fields: until the first image is done, the bar says what is under way.
    pub(crate) fn of_fields(
        begin: Instant,
        quiet: bool,
        growing: &Arc<BuildProgress>,
        time_left: &Arc<TimeLeft>,
    ) -> Self {
        let progress = Self { time_left: Some(Arc::clone(time_left)), ..Self::new(begin, quiet) };
        let template = "{bar:40} {pos} of {len} images  {growing}  {msg}";
        progress.bar.set_style(growing::style(template, growing, |state| state.pos() == 0));
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
        if self.seen && total > 0 {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(growing::EVERY);
        }
    }

    /// One more is done.
    pub(crate) fn add(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.set_message(self.rate(done));
        self.bar.inc(1);
        let Some(log) = &self.log else { return };
        let mut last = log.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if last.elapsed() >= growing::LOGGED {
            *last = Instant::now();
            furrow::tell!("{done} of {} images; {}", self.total.load(Ordering::Relaxed), self.rate(done));
        }
    }

    fn rate(&self, done: u64) -> String {
        let seconds = self.begin.elapsed().as_secs_f64();
        let at_this_rate = || {
            let left = self.total.load(Ordering::Relaxed).saturating_sub(done) as f64;
            Duration::from_secs_f64(left * seconds / done.max(1) as f64)
        };
        let left = self.time_left.as_deref().and_then(TimeLeft::left).unwrap_or_else(at_this_rate);
        format!("{:.0} images an hour, {} left", 3600.0 * done as f64 / seconds.max(1e-9), HumanDuration(left))
    }

    /// Ends the bar; returns how many images were done, and images per hour.
    pub(crate) fn finish(&self) -> (u64, f64) {
        self.bar.finish_and_clear();
        let done = self.done.load(Ordering::Relaxed);
        (done, 3600.0 * done as f64 / self.begin.elapsed().as_secs_f64().max(1e-9))
    }
}
