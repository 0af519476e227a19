//! Process-wide settings of the C library and OpenMP: keep freed memory for the next step, and let idle threads sleep.
//!
//! Each training step needs the same buffers as the step before, some of them a hundred megabytes. glibc returns such buffers to
//! the system when they are freed and maps them again, page by page and zeroed, which takes a tenth to a fifth of a step. Only
//! environment variables that are set when a process starts make glibc keep them, so the process restarts itself with them.
//!
//! The same holds for the OpenMP threads that libtorch uses. Between two pieces of work they spin, each on its own core. If
//! another program needs that core, training takes five times as long; so `OMP_WAIT_POLICY` lets them sleep instead.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// glibc variables: no buffer is a separate mapping, no freed memory is returned to the system, and the heap grows by at least
/// 64 MiB. Source: mallopt(3).
const KEPT: [(&str, &str); 3] =
    [("MALLOC_MMAP_MAX_", "0"), ("MALLOC_TRIM_THRESHOLD_", "1099511627776"), ("MALLOC_TOP_PAD_", "67108864")];

/// OpenMP variable: waiting threads sleep. Source: OpenMP 5.0, §6.7.
const PASSIVE: (&str, &str) = ("OMP_WAIT_POLICY", "passive");

/// Replaces the process by itself with these environment variables; call it before any other work. If the user has set a variable of
/// glibc or of OpenMP, that group is not changed. If the process cannot be replaced, it continues without them.
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
