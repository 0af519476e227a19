//! One process with a time limit, which ends with its children when the run is stopped.

use super::stop::{Stop, interrupted};
use furrow_base::{Error, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Polling interval for a running process, and for a stop.
pub(super) const EVERY: Duration = Duration::from_millis(20);

/// When a process is ended.
pub(super) struct Limits<'a> {
    /// Time limit; `None` for no limit.
    pub(super) timeout: Option<Duration>,
    /// Whether the run is stopped.
    pub(super) stop: Stop<'a>,
}

/// How a process ended.
pub(super) struct Ended {
    /// Its failure, as the rest of a sentence; `None` for success.
    pub(super) failure: Option<String>,
    pub(super) timed_out: bool,
    /// End of its output.
    pub(super) output: String,
}

/// Number of bytes at the end of a process's output that are kept.
const MOST_OUTPUT: u64 = 1 << 20;

/// Runs a process with this standard input until it ends or exceeds the time limit. If the run is stopped, ends the
/// process and its children and returns an error.
pub(super) fn run(command: &mut Command, input: &[u8], limits: &Limits<'_>) -> Result<Ended> {
    // Input and output are files, because a full pipe would block one of both sides. They have no name.
    let file = || tempfile::tempfile().map_err(Error::io(&std::env::temp_dir()));
    let (mut asked, mut captured) = (file()?, file()?);
    let shared = |file: &File| file.try_clone().map_err(Error::io(&std::env::temp_dir()));
    asked.write_all(input).and_then(|()| asked.rewind()).map_err(Error::io(&std::env::temp_dir()))?;
    command.stdin(asked).stdout(shared(&captured)?).stderr(shared(&captured)?);
    // A separate process group, so that child processes can be ended with the command.
    let program = command.get_program().to_owned();
    let mut child = command.process_group(0).spawn().map_err(Error::io(Path::new(&program)))?;
    let begin = Instant::now();
    let mut timed_out = false;
    let ended = loop {
        if let Some(ended) = child.try_wait().map_err(Error::io(Path::new(&program)))? {
            break Some(ended);
        }
        if limits.stop.now.load(Ordering::Relaxed) {
            end(&mut child);
            return Err(interrupted());
        }
        timed_out = limits.timeout.is_some_and(|timeout| begin.elapsed() > timeout);
        if timed_out {
            end(&mut child);
            break None;
        }
        std::thread::sleep(EVERY);
    };
    let mut text = Vec::new();
    let length = captured.stream_position().unwrap_or(0);
    let _ = captured.seek(SeekFrom::Start(length.saturating_sub(MOST_OUTPUT)));
    let _ = captured.take(MOST_OUTPUT).read_to_end(&mut text);
    let failure = match ended {
        None => Some(format!("took longer than {} s", limits.timeout.unwrap_or_default().as_secs())),
        Some(ended) if ended.success() => None,
        Some(ended) => Some(format!("ended with {}", ended.code().map_or("a signal".into(), |code| code.to_string()))),
    };
    Ok(Ended { failure, timed_out, output: String::from_utf8_lossy(&text).into_owned() })
}

/// Time between SIGTERM and SIGKILL for a command that is ended.
const GRACE: Duration = Duration::from_secs(2);

/// Ends a command and its child processes with SIGTERM, and with SIGKILL after [`GRACE`].
fn end(child: &mut Child) {
    let group = child.id();
    // Returns true if the process group still had a process to receive the signal.
    let send = |signal: &str| {
        let words = format!("kill -s {signal} -- -{group}");
        Command::new("sh").arg("-c").arg(words).stderr(Stdio::null()).status().is_ok_and(|ended| ended.success())
    };
    send("TERM");
    let until = Instant::now() + GRACE;
    // The shell may have ended before its child processes; signal 0 only tests whether any process is left.
    while Instant::now() < until && { matches!(child.try_wait(), Ok(None)) || send("0") } {
        std::thread::sleep(EVERY);
    }
    send("KILL");
    let _ = child.wait();
}
