//! A graphics card without a window system.
//!
//! Mesa's Vulkan driver asks for a window system whatever it draws, and the library that it asks prints an error on stderr where
//! `XDG_RUNTIME_DIR` is not set, as on servers and in containers. Nothing is shown on a window here. The variable must be there when the
//! process begins: so the process begins once more, with a folder in which no window system is.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// The variable that names the folder of the window system's sockets.
const FOLDER: &str = "XDG_RUNTIME_DIR";

/// Replaces the process by itself with the variable set, where it is not; goes on as it is where that cannot be.
pub(crate) fn need_none() {
    if std::env::var_os(FOLDER).is_none()
        && let Ok(program) = std::env::current_exe()
    {
        let _ = Command::new(program).args(std::env::args_os().skip(1)).env(FOLDER, std::env::temp_dir()).exec();
    }
}
