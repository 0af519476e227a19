//! Code shared by the command lines: argument parsing, output to stdout and stderr, exit codes, tables, checks of paths and crops,
//! signals.

pub mod signal;

use furrow_base::error::Kind;
use furrow_base::geometry::Window;
use furrow_base::input::shipped;
use furrow_base::math::ToInt;
use furrow_base::ron_file::nearest;
use furrow_base::{Error, Result};
use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Writes a line to stderr like `eprintln!`, but ignores failures: a full disk or a closed pipe must not end hours of work.
#[macro_export]
#[doc(hidden)]
macro_rules! message {
    ($($words:tt)*) => { $crate::cli::print_message(format_args!($($words)*)) };
}

/// Implements [`message!`](crate::message).
pub fn print_message(words: fmt::Arguments<'_>) {
    // One write per line, so that lines of several threads do not interleave.
    let _ = io::stderr().write_all(format!("{}\n", harmless(&words.to_string())).as_bytes());
}

/// Replaces the control characters of a message, except for ends of lines: names from foreign files may contain commands of a terminal.
fn harmless(words: &str) -> String {
    words.replace(|c: char| c.is_control() && c != '\n', "·")
}

/// Parses the command line. Prints help and version (with that of the ray tracing kernels) to stdout, and errors to stderr; in these cases
/// it returns the exit code.
pub fn parse<C: clap::Parser>(kernels: fn() -> Result<String>) -> Result<C, ExitCode> {
    C::try_parse().map_err(|words| {
        let done = if words.kind() == clap::error::ErrorKind::DisplayVersion {
            print(&version(&words.to_string(), kernels))
        } else {
            written(words.print().and_then(|()| io::stdout().flush()))
        };
        match done {
            Err(lost) if !words.use_stderr() => fail(&lost),
            _ => ExitCode::from(words.exit_code().to_u8()),
        }
    })
}

fn version(program: &str, kernels: fn() -> Result<String>) -> String {
    let kernels = kernels().unwrap_or_else(|error| error.message().to_owned());
    format!("{} ({kernels})\n", program.trim_end())
}

/// Prints text to stdout. Returns `false` if the pipe is closed, which is not an error. Any other failure, such as a full disk, is an
/// error.
pub fn print(words: &str) -> Result<bool> {
    let mut out = io::stdout().lock();
    written(out.write_all(words.as_bytes()).and_then(|()| out.flush()))
}

/// Maps the result of writing to stdout: a closed pipe is `false`, any other failure an error.
fn written(done: io::Result<()>) -> Result<bool> {
    match done {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(e) => Err(Error::failed(format!("cannot write to stdout: {e}"))),
    }
}

/// Ends a program: prints the paths that it wrote to stdout, one per line for the next program in a pipe, or an error to stderr.
pub fn end(done: Result<Vec<PathBuf>>) -> ExitCode {
    let outcome = done.and_then(|paths| {
        let lines: String = paths.iter().map(|path| path.display().to_string() + "\n").collect();
        print(&lines).map_err(|e| e.within("the files were written, but their paths are lost"))
    });
    outcome.map_or_else(|e| fail(&e), |_| ExitCode::SUCCESS)
}

/// Parses a duration with its unit, from one second to one year.
pub fn time(text: &str) -> Result<Duration, String> {
    humantime::parse_duration(text)
        .ok()
        .filter(|t| *t >= Duration::from_secs(1) && *t <= Duration::from_secs(366 * 24 * 3600))
        .ok_or_else(|| "write a time of a second or more with its unit, such as 30s, 2m or 1h30m".into())
}

/// [Prints](print()) rows with aligned columns.
pub fn print_rows<const N: usize>(rows: &[[String; N]]) -> Result<bool> {
    print(&columns(rows))
}

/// Formats rows as lines with aligned columns.
pub fn columns<const N: usize>(rows: &[[String; N]]) -> String {
    let widths: [usize; N] =
        std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or_default());
    let line = |row: &[String; N]| {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

/// Prints an error to stderr and returns its exit code: 1 failed, 2 misused, 75 stopped cleanly (without the prefix `error:`).
pub fn fail(error: &Error) -> ExitCode {
    let title = if error.kind() == Kind::Interrupted { "" } else { "error: " };
    crate::message!("{title}{error}");
    ExitCode::from(error.exit_code())
}

/// Parses `x,y`.
pub fn pixel(text: &str) -> Result<(u32, u32), String> {
    match numbers(text)?.as_slice() {
        [x, y] => Ok((*x, *y)),
        _ => Err("write it as x,y such as 648,483".into()),
    }
}

/// Parses `x,y,width,height`.
pub fn crop(text: &str) -> Result<Window, String> {
    match numbers(text)?.as_slice() {
        [x, y, w, h] if *w > 0 && *h > 0 => {
            let end = |a: u32, b: u32| a.checked_add(b).ok_or("the crop is too large");
            Ok(Window { x0: *x, y0: *y, x1: end(*x, *w)?, y1: end(*y, *h)? })
        }
        [_, _, _, _] => Err("the crop is empty: width and height must be above 0".into()),
        _ => Err("write it as x,y,width,height such as 400,300,200,150".into()),
    }
}

/// Checks that files can be written into `folder`, before hours are spent on computing them. Removes what killed programs left there.
pub fn check_folder(folder: &Path) -> Result<()> {
    let help = "give --out a folder; it is created if it does not exist";
    // A dangling link exists but is not a folder.
    let there = folder.ancestors().find(|f| f.symlink_metadata().is_ok()).unwrap_or(Path::new("."));
    match there.metadata() {
        Ok(about) if about.is_dir() => {}
        Ok(_) => {
            return Err(Error::misuse("this is a file, so no files can be written into it").in_file(there).help(help));
        }
        Err(e) => {
            return Err(Error::misuse(format!("this link leads to no folder: {e}")).in_file(there).help(help));
        }
    }
    // File names in the folder will be about as long as this one.
    check_length(&folder.join("semantics.png")).map_err(|e| e.in_file(folder))?;
    // Try it instead of checking permissions: root may write despite them, and no user can write to a read-only file system.
    tempfile::tempfile_in(there).map(drop).map_err(|e| match e.kind() {
        ErrorKind::PermissionDenied
        | ErrorKind::ReadOnlyFilesystem
        | ErrorKind::NotFound
        | ErrorKind::NotADirectory
        | ErrorKind::InvalidInput
        | ErrorKind::Unsupported => {
            Error::misuse(format!("no file can be created in this folder: {e}")).in_file(there).help(WRITABLE)
        }
        // The disk is full or failed: the same command may succeed later.
        _ => Error::io(there)(e),
    })?;
    if there == folder {
        // What cannot be removed is no reason not to write.
        let _ = furrow_base::atomic_file::remove_abandoned_in(folder);
    }
    Ok(())
}

/// Help for a folder that takes no files.
const WRITABLE: &str = "give another --out, or change the permissions of this folder";

/// Checks that the file name is not too long for the file system.
fn check_length(file: &Path) -> Result<()> {
    match file.symlink_metadata() {
        Err(e) if e.kind() == ErrorKind::InvalidFilename => {
            Err(Error::misuse("this name is too long for the file system")
                .in_file(file)
                .help("give --out a shorter name"))
        }
        _ => Ok(()),
    }
}

/// Checks, before any work starts, that a PNG made from `source` can be written at `out`: not over the source itself, and not in place of a
/// folder or a device.
pub fn check_png(out: &Path, source: &Path) -> Result<()> {
    let help = "give --out a file that ends in .png";
    if !out.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Error::misuse("the image must be a PNG").in_file(out).help(help));
    }
    check_file(out)?;
    if let (Ok(a), Ok(b)) = (out.canonicalize(), source.canonicalize())
        && a == b
    {
        return Err(Error::misuse("the image would overwrite the file that it is made from").in_file(out).help(help));
    }
    Ok(())
}

/// Checks, before any work starts, that a file can be written: not in place of a folder or a device.
pub fn check_file(out: &Path) -> Result<()> {
    if out.exists() && !out.is_file() {
        let error = Error::misuse("this is not a regular file, so it cannot be overwritten").in_file(out);
        return Err(error.help("give the name of a file"));
    }
    check_length(out)?;
    check_folder(out.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new(".")))
}

/// Checks that a scene file exists. The error lists the scene files that do.
pub fn check_scene(file: &Path) -> Result<()> {
    match shipped::scene_names() {
        Ok(names) => check_ron(file, "scene file", &names),
        // A bare name that may be a built-in scene, but the program's data folder is missing.
        Err(lack) if file.to_str().is_some_and(shipped::is_bare) => check_ron(file, "scene file", &[])
            .map_err(|error| error.help(format!("{}: {}", lack.message(), lack.advice().unwrap_or_default()))),
        Err(_) => check_ron(file, "scene file", &[]),
    }
}

/// Checks that a species file exists. The error lists the species files in its folder.
pub fn check_species(file: &Path) -> Result<()> {
    check_ron(file, "species file", &[])
}

/// Checks that a RON file exists. `what` is its kind for messages, `shipped` are the names of built-in files of that kind.
fn check_ron(file: &Path, what: &str, shipped: &[String]) -> Result<()> {
    if file.exists() {
        return Ok(());
    }
    if file.is_symlink() {
        return Err(Error::input("this is a symbolic link that leads to no file")
            .in_file(file)
            .help("let the link lead to a file, or name the file itself"));
    }
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|e| e.ok()?.file_name().into_string().ok()).collect())
        .unwrap_or_default();
    files.retain(|name| Path::new(name).extension().is_some_and(|e| e == "ron"));
    files.sort();
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let near_shipped = nearest(shipped, &name).filter(|_| file.to_str().is_some_and(shipped::is_bare));
    let help = match (nearest(&files, &name), near_shipped, files.is_empty()) {
        (Some(near), ..) => format!("did you mean {}?", folder.join(near).display()),
        (None, Some(near), _) => format!("did you mean {near}, which ships with the program?"),
        (None, None, false) => format!("{what}s in {} are {}", folder.display(), files.join(", ")),
        (None, None, true) if shipped.is_empty() => format!("there is none in {}", folder.display()),
        (None, None, true) => format!(
            "there is none in {}; `trace init DIR` creates one, and the built-in ones are found by name: {}",
            folder.display(),
            shipped.join(", ")
        ),
    };
    Err(Error::input(format!("there is no such {what}")).in_file(file).help(help))
}

/// Checks that a crop is inside the image.
pub fn check_crop(crop: Window, width: u32, height: u32) -> Result<()> {
    if crop.x1 <= width && crop.y1 <= height {
        return Ok(());
    }
    let Window { x0, y0, x1, y1 } = crop;
    Err(Error::misuse(format!("the crop reaches to pixel {x1},{y1}, past the image of {width} × {height} pixels"))
        .help(format!("x + width may be at most {width}, y + height {height}; the crop starts at {x0},{y0}")))
}

/// Checks that a pixel is inside the image.
pub fn check_pixel((x, y): (u32, u32), width: u32, height: u32) -> Result<()> {
    if x < width && y < height {
        return Ok(());
    }
    Err(Error::misuse(format!("pixel {x},{y} is outside the image of {width} × {height} pixels")).help(format!(
        "pixels count from 0,0 at the top left to {},{}",
        width - 1,
        height - 1
    )))
}

fn numbers(text: &str) -> Result<Vec<u32>, String> {
    text.split(',').map(|t| t.trim().parse().map_err(|_| format!("`{t}` is not a pixel number"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_contain_no_commands_of_a_terminal() {
        assert_eq!(harmless("a: `\u{1b}[2Jleaf\0\r`\nhelp: é"), "a: `·[2Jleaf··`\nhelp: é");
    }

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
