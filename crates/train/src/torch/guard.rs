//! Failures of libtorch as errors. The functions of tch without a `Result` panic when libtorch fails, in an operation or
//! because memory ends.

use furrow_base::supervise::message;
use furrow_base::{Error, Result};
use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

/// Message of the panics of tch, up to the message of libtorch. Source: tch 0.24, where such a function is `f_….unwrap()`.
const UNWRAPPED: &str = "called `Result::unwrap()` on an `Err` value: Torch(\"";

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs work that calls libtorch. A panic of tch becomes an error; any other panic continues.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    silence();
    let outer = GUARDED.replace(true);
    // Restores the mode of gradients, which a panic inside `tch::no_grad` leaves off.
    let mode = tch::no_grad_guard();
    // What the work has changed is dropped or, in the case of files, only replaced when complete.
    let done = panic::catch_unwind(AssertUnwindSafe(|| tch::with_grad(work)));
    drop(mode);
    GUARDED.set(outer);
    done.unwrap_or_else(|panic| match printed(panic.as_ref()) {
        Some(words) => Err(failure(words)),
        None => panic::resume_unwind(panic),
    })
}

/// Makes panics of tch inside [`guarded`] print nothing, because they become errors.
fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !GUARDED.get() || printed(info.payload()).is_none() {
                usual(info);
            }
        }));
    });
}

/// Returns the message of libtorch in a panic of tch; `None` for other panics.
fn printed(panic: &(dyn Any + Send)) -> Option<&str> {
    message(panic)?.strip_prefix(UNWRAPPED)
}

/// Returns the error for a message of libtorch as Rust's `Debug` prints it, without its stack trace.
fn failure(words: &str) -> Error {
    let first = words.split("\\n").next().unwrap_or_default().trim_end_matches("\")").replace("\\\"", "\"");
    let error = Error::failed(format!("libtorch: {first}"));
    if first.contains("memory") {
        return error.help("make the images or the batch smaller, or free memory");
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;
    use tch::{Device, Kind, Tensor};

    /// Expected: exit code 1, one line without a stack trace, and other panics unchanged.
    #[test]
    fn failures_of_libtorch_are_errors() {
        let huge = guarded(|| Ok(Tensor::zeros([1 << 50], (Kind::Float, Device::Cpu)).size()));
        let error = huge.unwrap_err();
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().starts_with("libtorch: ") && error.message().lines().count() == 1, "{error}");
        assert!(error.message().contains("memory") && error.advice().is_some(), "{error}");
        let shapes = guarded(|| Ok(Tensor::from_slice(&[1.0, 2.0]).view([3]).size()));
        assert!(shapes.unwrap_err().message().contains("shape '[3]' is invalid"));
        assert_eq!(guarded(|| Ok(5)).unwrap(), 5);
        let other = panic::catch_unwind(|| guarded(|| -> Result<()> { panic!("another reason") }));
        assert_eq!(other.unwrap_err().downcast_ref::<&str>(), Some(&"another reason"));
    }
}
