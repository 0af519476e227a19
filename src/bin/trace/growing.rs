//! Progress display while a field is built, before its first sample: one line on a terminal, or an occasional line in a
//! log.

#![cfg_attr(not(feature = "datasets"), allow(dead_code, reason = "only datasets log their steps"))]

use furrow_field::assemble::BuildProgress;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Refresh interval on a terminal.
pub(crate) const EVERY: Duration = Duration::from_millis(100);
/// Minimum interval between lines of a log.
pub(crate) const LOGGED: Duration = Duration::from_secs(30);

/// A progress line.
pub(crate) struct Line {
    progress: Arc<BuildProgress>,
    bar: ProgressBar,
    /// Time of the last line in the log; `None` if no log is written.
    log: Option<Mutex<Option<Instant>>>,
}

impl Line {
    /// Starts the display; it stays hidden with `quiet` or without a terminal.
    pub(crate) fn begin(quiet: bool) -> Self {
        let progress = Arc::<BuildProgress>::default();
        let terminal = std::io::stderr().is_terminal();
        let bar = if terminal && !quiet { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        bar.set_style(style("{spinner} {msg}{growing}  {elapsed} elapsed", &progress, |_| true));
        if !bar.is_hidden() {
            bar.enable_steady_tick(EVERY);
        }
        let log = (!quiet && !terminal).then(|| Mutex::new(None));
        Self { progress, bar, log }
    }

    /// Shows the current step, together with fields being built for it. A log gets its first line at once, later ones
    /// at intervals of [`LOGGED`].
    pub(crate) fn say(&self, work: &str) {
        self.show(work);
        let Some(log) = &self.log else { return };
        let mut last = log.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= LOGGED) {
            *last = Some(Instant::now());
            furrow_cli::message!("{work}");
        }
    }

    /// Shows the current step on a terminal only.
    pub(crate) fn show(&self, work: &str) {
        self.bar.set_message(format!("{work}  "));
    }

    /// Returns the build progress that is displayed, for fields to update.
    pub(crate) fn progress(&self) -> &Arc<BuildProgress> {
        &self.progress
    }

    /// Hides the line while something else is written.
    pub(crate) fn pause(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }

    /// Removes the line.
    pub(crate) fn end(&self) {
        self.bar.finish_and_clear();
    }
}

/// Style of a bar that shows the build progress at `{growing}` in its template, while `wanted` returns `true`.
pub(crate) fn style(
    template: &str,
    progress: &Arc<BuildProgress>,
    wanted: impl Fn(&ProgressState) -> bool + Clone + Send + Sync + 'static,
) -> ProgressStyle {
    let progress = Arc::clone(progress);
    let growing = move |state: &ProgressState, out: &mut dyn fmt::Write| {
        if wanted(state) {
            // Writing to memory cannot fail.
            let _ = write!(out, "{progress}");
        }
    };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.with_key("growing", growing)
}
