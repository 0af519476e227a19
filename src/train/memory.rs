//! Memory that is kept for the next step, and threads that wait without work.
//!
//! A step needs the same buffers as the one before, some of a hundred megabytes. The C library hands such ones back to the system
//! when they are freed and gets them anew, page by page and zeroed, which takes a tenth to a fifth of a step. It can be told to keep them, but
//! only by the environment that a process begins with: so the process begins once more.
//!
//! The same holds for OpenMP's threads, which libtorch computes with. Between two pieces of work they spin, each on a core of its own,
//! and where another program needs that core a training beside it takes five times as long; so they are told to sleep instead.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// glibc's words for: no buffer is a mapping of its own; nothing goes back to the system; it is asked for 64 MiB at least. Source:
/// mallopt(3).
const KEPT: [(&str, &str); 3] =
    [("MALLOC_MMAP_MAX_", "0"), ("MALLOC_TRIM_THRESHOLD_", "1099511627776"), ("MALLOC_TOP_PAD_", "67108864")];

/// OpenMP's word for threads that sleep while they wait. Source: OpenMP 5.0, §6.7.
const PASSIVE: (&str, &str) = ("OMP_WAIT_POLICY", "passive");

/// Replaces the process by itself with memory kept and waiting threads asleep, before it has begun with anything. Leaves what the
/// environment says of either; goes on as it is where it cannot.
pub fn keep() {
    let given = |name: &str| std::env::var_os(name).is_some();
    let mut words: Vec<(&str, &str)> = Vec::new();
    if !KEPT.iter().any(|(name, _)| given(name)) {
        words.extend(KEPT);
    }
    if !given(PASSIVE.0) {
        words.push(PASSIVE);
    }
    if words.is_empty() {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        let _ = Command::new(program).args(std::env::args_os().skip(1)).envs(words).exec();
    }
}
