//! Memory that is kept for the next step.
//!
//! A step needs the same buffers as the one before, some of a hundred megabytes. The C library hands such ones back to the system
//! when they are freed and gets them anew, page by page and zeroed, which takes a tenth to a fifth of a step. It can be told to keep them, but
//! only by the environment that a process begins with: so the process begins once more.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// glibc's words for: no buffer is a mapping of its own; nothing goes back to the system; it is asked for 64 MiB at least. Source:
/// mallopt(3).
const KEPT: [(&str, &str); 3] =
    [("MALLOC_MMAP_MAX_", "0"), ("MALLOC_TRIM_THRESHOLD_", "1099511627776"), ("MALLOC_TOP_PAD_", "67108864")];

/// Replaces the process by itself with memory kept, before it has begun with anything. Does nothing where the environment says
/// already how memory is kept; goes on as it is where it cannot.
pub fn keep() {
    if KEPT.iter().any(|(name, _)| std::env::var_os(name).is_some()) {
        return;
    }
    if let Ok(program) = std::env::current_exe() {
        let _ = Command::new(program).args(std::env::args_os().skip(1)).envs(KEPT).exec();
    }
}
