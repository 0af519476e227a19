//! What is under way of a field before its first sample: a line on a terminal; a log gets one now and then where the work has several parts.

use furrow::scene::assemble::BuildProgress;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two looks at it.
pub(crate) const EVERY: Duration = Duration::from_millis(100);
/// Between two lines of a log.
pub(crate) const LOGGED: Duration = Duration::from_secs(30);

/// A line that goes with it.
pub(crate) struct Line {
    progress: Arc<BuildProgress>,
    bar: ProgressBar,
    /// When the log's last line was written; `None` where no log is wanted.
    log: Option<Mutex<Option<Instant>>>,
}

impl Line {
    /// Begins it; it stays empty where nobody looks.
    pub(crate) fn begin(quiet: bool) -> Self {
        let progress = Arc::<BuildProgress>::default();
        let terminal = std::io::stderr().is_terminal();
        let bar = if terminal && !quiet { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        bar.set_style(style("{spinner} {msg}{growing}  {elapsed} gone", &progress, |_| true));
        if !bar.is_hidden() {
            bar.enable_steady_tick(EVERY);
        }
        let log = (!quiet && !terminal).then(|| Mutex::new(None));
        Self { progress, bar, log }
    }

    /// Says what work is under way, fields that grow for it among it; in a log at once, and then as often as it has lines.
    pub(crate) fn say(&self, work: &str) {
        self.bar.set_message(format!("{work}  "));
        let Some(log) = &self.log else { return };
        let mut last = log.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= LOGGED) {
            *last = Some(Instant::now());
            furrow::tell!("{work}");
        }
    }

    /// What it shows; fields are to tell it.
    pub(crate) fn progress(&self) -> &Arc<BuildProgress> {
        &self.progress
    }

    /// Takes it away while something else is written.
    pub(crate) fn pause(&self, write: impl FnOnce()) {
        self.bar.suspend(write);
    }

    /// Takes it away.
    pub(crate) fn end(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar's style, which shows what is under way at `{growing}` of its template, as long as that is wanted.
pub(crate) fn style(
    template: &str,
    progress: &Arc<BuildProgress>,
    wanted: impl Fn(&ProgressState) -> bool + Clone + Send + Sync + 'static,
) -> ProgressStyle {
    let progress = Arc::clone(progress);
    let growing = move |state: &ProgressState, out: &mut dyn fmt::Write| {
        if wanted(state) {
            // It is written to memory.
            let _ = write!(out, "{progress}");
        }
    };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.with_key("growing", growing)
}
