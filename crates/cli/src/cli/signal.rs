//! Signal handling: every signal that asks for a stop leads to a clean end with exit code 75.
//!
//! Terminals send INT and HUP; batch systems send USR1 (time is nearly up) and TERM (the node is needed). By default, each would end the
//! process with a code that a scheduler takes for a failure. Until a verb [handles](Signals::catch) them, they end the process immediately
//! with 75, which loses nothing because nothing has been written; from then on they set a flag. A second INT or TERM always ends the
//! process immediately, because the user does not want to wait.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a clean stop that can be resumed: `EX_TEMPFAIL`.
const STOPPED: i32 = 75;

/// Signals that end the process immediately when they arrive a second time.
const URGENT: [i32; 2] = [SIGINT, SIGTERM];

#[cfg(unix)]
const PATIENT: [i32; 2] = [signal_hook::consts::SIGHUP, signal_hook::consts::SIGUSR1];
#[cfg(not(unix))]
const PATIENT: [i32; 0] = [];

/// State set by signals.
pub struct Signals {
    stop: Arc<AtomicBool>,
    urgent: Arc<AtomicBool>,
    uncaught: Arc<AtomicBool>,
}

impl Signals {
    /// Installs handlers for INT, TERM, HUP and USR1. Must be the first action of the program: earlier signals have their default effect.
    pub fn watch() -> Self {
        let signals = Self { stop: Arc::default(), urgent: Arc::default(), uncaught: Arc::new(AtomicBool::new(true)) };
        if let Err(e) = signals.install() {
            crate::message!("warning: cannot watch for signals: {e}");
        }
        signals
    }

    /// Registers the actions. They run in the order of registration: the one that ends the process comes before the one that sets the flag,
    /// so the first signal only sets the flag.
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
            flag::register_conditional_shutdown(signal, STOPPED, self.uncaught.clone())?;
            flag::register(signal, self.stop.clone())?;
        }
        Ok(())
    }

    /// Returns the flag that signals set from now on instead of ending the process.
    pub fn catch(&self) -> &Arc<AtomicBool> {
        self.uncaught.store(false, Ordering::SeqCst);
        &self.stop
    }

    /// Returns two flags that signals set from now on instead of ending the process: every signal sets the first; only INT and TERM set
    /// the second, which means not to wait for the current work to finish.
    pub fn catch_graceful(&self) -> (&Arc<AtomicBool>, &Arc<AtomicBool>) {
        (self.catch(), &self.urgent)
    }
}
