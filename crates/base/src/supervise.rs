//! Supervision of worker threads: a panic becomes an error, so that a run ends with a message instead of waiting for a
//! result that never arrives.

use crate::{Error, Result};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs `work` and returns its result, or an error if it panics. What `work` changed before a panic may be incomplete
/// and must not be used afterwards.
pub fn supervised<T>(work: impl FnOnce() -> T) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| panicked(panic.as_ref()))
}

/// Returns the message of a panic; `None` if its payload is not text.
pub fn message(panic: &(dyn Any + Send)) -> Option<&str> {
    panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str))
}

/// Returns the error for a panic. The location of the panic was printed by the panic hook.
fn panicked(panic: &(dyn Any + Send)) -> Error {
    let words = message(panic).unwrap_or("no message");
    Error::failed(format!("the program failed: {words} (a bug; please report it)"))
        .help("report the command and all lines that it printed; the same command continues with what is missing")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Kind;

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        let number = 7;
        for error in [
            supervised(|| -> u32 { panic!("no plant {number}") }).unwrap_err(),
            supervised(|| -> u32 { std::panic::panic_any("no plant 7") }).unwrap_err(),
        ] {
            assert_eq!((error.kind(), error.exit_code()), (Kind::Io, 1));
            assert_eq!(error.message(), "the program failed: no plant 7 (a bug; please report it)");
            assert!(error.advice().is_some() && !error.is_of_one_field());
        }
        let silent = supervised(|| -> u32 { std::panic::panic_any(7) }).unwrap_err();
        assert!(silent.message().starts_with("the program failed: no message"), "{silent}");
        assert_eq!(supervised(|| number).unwrap(), 7);
    }
}
