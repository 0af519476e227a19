//! Containment of panics in decoders of foreign files: a damaged file is an error about that file, whatever its
//! decoder does.

use crate::supervise::message;
use crate::{Error, Result};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::Path;
use std::sync::Once;

thread_local! {
    /// Number of calls of [`caught`] that this thread is in.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Decrements [`DEPTH`] when dropped, also by a panic.
struct Inside;

impl Inside {
    fn enter() -> Self {
        DEPTH.set(DEPTH.get() + 1);
        Self
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        DEPTH.set(DEPTH.get() - 1);
    }
}

/// Calls `decode`, which decodes bytes of the file `path`. A panic in it becomes an error that names the file.
pub fn guarded<T>(path: &Path, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    caught(decode).unwrap_or_else(|what| {
        Err(Error::input(what).help("open it in another program and save it again").in_file(path))
    })
}

/// Calls `decode`, which decodes bytes without a file of their own, such as an image embedded in a model. A panic in it
/// becomes an error, whose value is the message. Panics of this thread are not printed; those of threads that `decode`
/// starts are.
pub fn caught<T>(decode: impl FnOnce() -> T) -> Result<T, String> {
    install_hook();
    let inside = Inside::enter();
    // What `decode` has borrowed mutably is dropped by its caller, which returns the error.
    let result = catch_unwind(AssertUnwindSafe(decode));
    drop(inside);
    result.map_err(|panic| {
        let first_line = message(&*panic).and_then(|all| all.lines().next()).unwrap_or("without a message");
        format!("this file is damaged: its decoder failed ({first_line})")
    })
}

/// Installs, once, a panic hook that is silent inside [`caught`] and calls the previous hook elsewhere.
fn install_hook() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        let previous = take_hook();
        set_hook(Box::new(move |panic| {
            if DEPTH.get() == 0 {
                previous(panic);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_a_decoder_is_an_error_about_its_file() {
        let path = Path::new("a.png");
        assert_eq!(guarded(path, || Ok(7)).unwrap(), 7);
        assert_eq!(guarded::<()>(path, || Err(Error::input("too small"))).unwrap_err().message(), "too small");
        let at = vec![1, 2].len();
        let error = guarded(path, || Ok([1, 2][at..][0])).unwrap_err();
        let shown = error.to_string();
        assert!(shown.starts_with("a.png: this file is damaged: its decoder failed (index out of bounds"), "{shown}");
        assert_eq!((error.exit_code(), shown.lines().count()), (2, 2));
    }

    #[test]
    fn the_guard_is_left_by_a_panic_and_may_be_nested() {
        let outer = caught(|| {
            assert!(caught(|| panic!("inner\nsecond line")).is_err_and(|what: String| what.ends_with("(inner)")));
            DEPTH.get()
        });
        assert_eq!((outer, DEPTH.get()), (Ok(1), 0));
    }
}
