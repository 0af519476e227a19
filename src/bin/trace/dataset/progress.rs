//! Progress of a dataset: a bar on a terminal, or an occasional line in a log.

use crate::growing;
use furrow_base::math::ToFloat;
use furrow_dataset::make::time_left::TimeLeft;
use furrow_field::assemble::BuildProgress;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Number of finished images, images per hour, time left.
pub(crate) struct Progress {
    begin: Instant,
    total: AtomicU64,
    done: AtomicU64,
    /// Shown once the number of images is known.
    bar: ProgressBar,
    /// `true` if the bar is shown.
    seen: bool,
    /// Estimates the time left if images take different times; otherwise the mean rate is used.
    time_left: Option<Arc<TimeLeft>>,
    /// Time of the last line in the log; `None` if no log is written.
    log: Option<Mutex<Instant>>,
}

impl Progress {
    /// Starts counting; `begin` is the start time of the work.
    pub(crate) fn new(begin: Instant, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let bar = ProgressBar::hidden();
        let style = ProgressStyle::with_template("{bar:40} {pos} of {len} images  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let log = (!quiet && !terminal).then(|| Mutex::new(Instant::now()));
        let (total, done) = (AtomicU64::new(0), AtomicU64::new(0));
        Self { begin, total, done, bar, seen: terminal && !quiet, time_left: None, log }
    }

    /// For rendered fields: until the first image is done, the bar shows the build progress.
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

    /// Hides the bar while something else is written.
    pub(crate) fn pause(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }

    /// Sets the expected number of images.
    pub(crate) fn expect(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.bar.set_length(total);
        if self.seen && total > 0 {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(growing::EVERY);
        }
    }

    /// Counts one finished image.
    pub(crate) fn add(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.set_message(self.rate(done));
        self.bar.inc(1);
        let Some(log) = &self.log else { return };
        let mut last = log.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if last.elapsed() >= growing::LOGGED {
            *last = Instant::now();
            furrow_cli::message!("{done} of {} images; {}", self.total.load(Ordering::Relaxed), self.rate(done));
        }
    }

    fn rate(&self, done: u64) -> String {
        let seconds = self.begin.elapsed().as_secs_f64();
        let at_this_rate = || {
            let left = self.total.load(Ordering::Relaxed).saturating_sub(done).to_f64();
            Duration::from_secs_f64(left * seconds / done.max(1).to_f64())
        };
        let left = self.time_left.as_deref().and_then(TimeLeft::left).unwrap_or_else(at_this_rate);
        format!("{:.0} images per hour, {} left", 3600.0 * done.to_f64() / seconds.max(1e-9), HumanDuration(left))
    }

    /// Removes the bar. Returns the number of finished images, and images per hour.
    pub(crate) fn finish(&self) -> (u64, f64) {
        self.bar.finish_and_clear();
        let done = self.done.load(Ordering::Relaxed);
        (done, 3600.0 * done.to_f64() / self.begin.elapsed().as_secs_f64().max(1e-9))
    }
}
