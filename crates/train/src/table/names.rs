//! Folder names, and suggestions for misspelt names.

use furrow_base::ron_file::choose;

/// Returns a name for folders and files: lower case, with `-` for each run of other characters than letters and digits.
///
/// ```
/// use furrow_train::table::slug;
/// assert_eq!(slug("Real-Augmented (D + 10)"), "real-augmented-d-10");
/// ```
pub fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    words.map(str::to_lowercase).collect::<Vec<_>>().join("-")
}

/// Returns the message and the help for an unknown name; the help suggests known ones.
pub(super) fn unknown(what: &str, known: &[&str], found: &str) -> (String, String) {
    (format!("there is no {what} `{found}`"), choose(&format!("{what}s"), known, found))
}
