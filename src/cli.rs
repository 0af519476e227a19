//! What the command lines share: how an error looks, how a crop is written.

use crate::Error;
use crate::geometry::Window;
use std::process::ExitCode;

/// Prints an error to stderr and returns its exit code: 1 failed, 2 misused, 75 stopped cleanly.
pub fn fail(error: &Error) -> ExitCode {
    eprintln!("error: {error}");
    ExitCode::from(error.exit_code())
}

/// Parses `x,y`.
pub fn pixel(text: &str) -> Result<(u32, u32), String> {
    match numbers(text)?.as_slice() {
        [x, y] => Ok((*x, *y)),
        _ => Err("write it as x,y".into()),
    }
}

/// Parses `x,y,width,height`.
pub fn crop(text: &str) -> Result<Window, String> {
    match numbers(text)?.as_slice() {
        [x, y, w, h] if *w > 0 && *h > 0 => {
            let end = |a: u32, b: u32| a.checked_add(b).ok_or("the crop is too large");
            Ok(Window { x0: *x, y0: *y, x1: end(*x, *w)?, y1: end(*y, *h)? })
        }
        [_, _, _, _] => Err("the crop is empty".into()),
        _ => Err("write it as x,y,width,height".into()),
    }
}

fn numbers(text: &str) -> Result<Vec<u32>, String> {
    text.split(',').map(|t| t.trim().parse().map_err(|_| format!("`{t}` is not a pixel number"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_are_checked() {
        assert_eq!(crop("1, 2,3,4").unwrap(), Window { x0: 1, y0: 2, x1: 4, y1: 6 });
        for bad in ["1,2,3", "1,2,0,4", "a,2,3,4", "4294967295,0,2,2", "-1,0,2,2"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        assert_eq!(pixel("7,9"), Ok((7, 9)));
        assert!(pixel("7").is_err());
    }
}
