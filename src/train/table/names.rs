//! Names: of folders, and of what was probably meant.

use crate::ron_file::choose;

/// A name for folders and files: lower case, with `-` for all that is neither letter nor digit.
///
/// ```
/// use furrow::train::table::slug;
/// assert_eq!(slug("Real-Augmented (D + 10)"), "real-augmented-d-10");
/// ```
pub fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    words.map(str::to_lowercase).collect::<Vec<_>>().join("-")
}

/// Words about a name that is not known, and what could stand there.
pub(super) fn unknown(what: &str, known: &[&str], found: &str) -> (String, String) {
    (format!("there is no {what} `{found}`"), choose(&format!("{what}s"), known, found))
}
