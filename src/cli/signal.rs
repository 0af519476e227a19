//! Signals: a clean end is exit code 75, whoever asks for it.
//!
//! Terminals send INT and HUP, batch systems USR1 (time is nearly up) and TERM (the node is wanted). By default each would
//! end the process with a code that a scheduler takes for a failure. Until a verb [heeds](Signals::heed) them they end it at
//! once with 75, which loses nothing where nothing has been written; from then on they raise a flag. INT and TERM, raised
//! twice, end the process at once in any case: whoever asks again does not want to wait.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stopped cleanly, go on later: `EX_TEMPFAIL`.
const STOPPED: i32 = 75;

/// The signals that ask once more by coming again.
const URGENT: [i32; 2] = [SIGINT, SIGTERM];

#[cfg(unix)]
const PATIENT: [i32; 2] = [signal_hook::consts::SIGHUP, signal_hook::consts::SIGUSR1];
#[cfg(not(unix))]
const PATIENT: [i32; 0] = [];

/// What signals have asked for.
pub struct Signals {
    stop: Arc<AtomicBool>,
    urgent: Arc<AtomicBool>,
    unheeded: Arc<AtomicBool>,
}

impl Signals {
    /// Watches for INT, TERM, HUP and USR1. The first thing that the program does: a signal before that ends it its own way.
    pub fn watch() -> Self {
        let signals = Self { stop: Arc::default(), urgent: Arc::default(), unheeded: Arc::new(AtomicBool::new(true)) };
        if let Err(e) = signals.install() {
            crate::tell!("warning: cannot watch for signals: {e}");
        }
        signals
    }

    /// A signal's actions run in the order in which they are registered: what would end the process comes before what raises
    /// the flag, so that the first signal only raises it.
    fn install(&self) -> std::io::Result<()> {
        let asked = Arc::new(AtomicBool::new(false));
        for signal in URGENT {
            flag::register_conditional_shutdown(signal, STOPPED, asked.clone())?;
            flag::register(signal, asked.clone())?;
        }
        for signal in URGENT {
            flag::register(signal, self.urgent.clone())?;
        }
        for signal in URGENT.into_iter().chain(PATIENT) {
            flag::register_conditional_shutdown(signal, STOPPED, self.unheeded.clone())?;
            flag::register(signal, self.stop.clone())?;
        }
        Ok(())
    }

    /// The flag that signals raise from now on instead of ending the process.
    pub fn heed(&self) -> &Arc<AtomicBool> {
        self.unheeded.store(false, Ordering::SeqCst);
        &self.stop
    }

    /// Two flags instead of the end of the process: the first is raised by every signal, the second by INT and TERM alone, which
    /// do not wait for the work in hand.
    pub fn heed_patiently(&self) -> (&Arc<AtomicBool>, &Arc<AtomicBool>) {
        (self.heed(), &self.urgent)
    }
}
