//! Rendering on a GPU without a window system.
//!
//! Mesa's Vulkan driver looks for a window system even for offscreen rendering, and the library it uses prints an error
//! on stderr if `XDG_RUNTIME_DIR` is not set, as on servers and in containers. The variable must be set before the
//! process starts, so the process restarts itself with a folder that contains no window system.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// Environment variable with the folder of the window system's sockets.
const FOLDER: &str = "XDG_RUNTIME_DIR";

/// If the variable is not set, replaces the process by itself with the variable set. If that fails, continues
/// unchanged.
pub(crate) fn need_none() {
    if std::env::var_os(FOLDER).is_none()
        && let Ok(program) = std::env::current_exe()
    {
        let _ = Command::new(program).args(std::env::args_os().skip(1)).env(FOLDER, std::env::temp_dir()).exec();
    }
}
