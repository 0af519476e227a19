//! Signal handling: every signal that asks for a stop leads to a clean end with exit code 75.
//!
//! Terminals send INT and HUP; batch systems send USR1 (time is nearly up) and TERM (the node is needed). By default, each would end the
//! process with a code that a scheduler takes for a failure. Until a verb [handles](Signals::catch) them, they end the process immediately
//! with 75; from then on they set a flag. A second INT or TERM always ends the process immediately, because the user does not want to
//! wait. Both remove unfinished files first, which a signal handler cannot do: it only wakes a thread.

use furrow_base::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of a clean stop that can be resumed: `EX_TEMPFAIL`.
#[cfg(unix)]
const STOPPED: i32 = 75;

/// State set by signals.
#[derive(Clone)]
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

    /// Starts the threads that wait for signals, then the handlers that wake them. A handler does all of its work in one action, so a
    /// signal between two registrations has either its default effect or the whole one.
    #[cfg(unix)]
    fn install(&self) -> std::io::Result<()> {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
        self.wait([SIGINT, SIGTERM], true)?;
        self.wait([SIGHUP, SIGUSR1], false)
    }

    /// Waits for signals in a thread. The second one of those that are urgent ends the process even if a verb handles them.
    #[cfg(unix)]
    fn wait(&self, kinds: [i32; 2], urgent: bool) -> std::io::Result<()> {
        use std::io::Read;
        let (mut arrived, sent) = std::os::unix::net::UnixStream::pair()?;
        let state = self.clone();
        let wait = move || {
            let mut count = 0;
            while arrived.read_exact(&mut [0]).is_ok() {
                count += 1;
                // The flags come first: a verb may begin to handle signals at this moment.
                state.urgent.fetch_or(urgent, Ordering::SeqCst);
                state.stop.store(true, Ordering::SeqCst);
                if state.uncaught.load(Ordering::SeqCst) || urgent && count > 1 {
                    furrow_base::atomic_file::remove_own_unfinished();
                    signal_hook::low_level::exit(STOPPED);
                }
            }
        };
        std::thread::Builder::new().name("signals".into()).stack_size(1 << 18).spawn(wait)?;
        for kind in kinds {
            signal_hook::low_level::pipe::register(kind, sent.try_clone()?)?;
        }
        Ok(())
    }

    #[cfg(not(unix))]
    fn install(&self) -> std::io::Result<()> {
        for kind in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register_conditional_shutdown(kind, 75, self.uncaught.clone())?;
            signal_hook::flag::register_conditional_shutdown(kind, 75, self.urgent.clone())?;
            signal_hook::flag::register(kind, self.urgent.clone())?;
            signal_hook::flag::register(kind, self.stop.clone())?;
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

    /// Ends the handling of signals by [`Self::catch`]: they end the process immediately again, for work that looks at no flag.
    ///
    /// # Errors
    /// [`Interrupted`](furrow_base::error::Kind::Interrupted) if a signal arrived before.
    pub fn release(&self) -> Result<()> {
        self.uncaught.store(true, Ordering::SeqCst);
        if self.stop.load(Ordering::SeqCst) {
            return Err(
                Error::stopped("stopped; what is complete was kept").help("run the same command again to continue")
            );
        }
        Ok(())
    }
}
