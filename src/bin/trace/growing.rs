//! What is under way of a field before its first sample: a line on a terminal, nothing in a log.

use furrow::scene::assemble::BuildProgress;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::sync::Arc;
use std::time::Duration;

/// Between two looks at it.
pub(crate) const EVERY: Duration = Duration::from_millis(100);

/// A line that goes with it.
pub(crate) struct Line {
    progress: Arc<BuildProgress>,
    bar: ProgressBar,
}

impl Line {
    /// Begins it; it stays empty where nobody looks.
    pub(crate) fn begin(quiet: bool) -> Self {
        Self::begin_among(quiet, "")
    }

    /// The same where fields grow among other work, which it names while none does.
    pub(crate) fn begin_among(quiet: bool, work: &'static str) -> Self {
        let progress = Arc::<BuildProgress>::default();
        let seen = !quiet && std::io::stderr().is_terminal();
        let bar = if seen { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        bar.set_style(style("{spinner} {growing}  {elapsed} gone", &progress, work, |_| true));
        if !bar.is_hidden() {
            bar.enable_steady_tick(EVERY);
        }
        Self { progress, bar }
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

/// A bar's style, which shows what is under way at `{growing}` of its template, as long as that is wanted; `otherwise` where no field grows.
pub(crate) fn style(
    template: &str,
    progress: &Arc<BuildProgress>,
    otherwise: &'static str,
    wanted: impl Fn(&ProgressState) -> bool + Clone + Send + Sync + 'static,
) -> ProgressStyle {
    let progress = Arc::clone(progress);
    let growing = move |state: &ProgressState, out: &mut dyn fmt::Write| {
        if wanted(state) {
            let words = progress.to_string();
            // It is written to memory.
            let _ = out.write_str(if words.is_empty() { otherwise } else { &words });
        }
    };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.with_key("growing", growing)
}
