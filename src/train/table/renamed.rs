//! Keywords of experiment files that have another name since version 0.1: both are read, for one more version.

use crate::ron_file::{Keyword, Renamed, RonFile, Step, place};

const CLASS_WEIGHTS: Keyword = Keyword::Text(&["balance", "class_weights"]);

/// All renamed keywords of experiment files that are still read; those of hyper-parameters are flags of `train fit` as well, with `-` for `_`.
///
/// ```
/// use furrow::{ron_file::RonFile, train::table::RENAMED};
/// let file = RonFile::of("Experiment(\n    learn: (balance: \"fading\"), // watch: []\n)");
/// let warnings = file.renamed(RENAMED);
/// assert!(warnings[0].starts_with("page.ron:2:5: `learn` is now called `hyperparameters`"));
/// assert_eq!(warnings.len(), 3);
/// ```
pub const RENAMED: &[Renamed] = &[
    Renamed::field("learn", "hyperparameters"),
    Renamed::field("watch", "validation"),
    Renamed::field("page", "file"),
    Renamed::field("margin_px", "dilate_px"),
    Renamed::field("window", "crop_size"),
    Renamed::field("rare", "rare_crops"),
    Renamed::field("balance", "class_weights"),
    Renamed::field("normalise", "normalization"),
    Renamed::field("watch_every", "validate_every"),
    Renamed { keyword: CLASS_WEIGHTS, old: "root", new: "sqrt" },
    Renamed { keyword: CLASS_WEIGHTS, old: "fading", new: "annealed" },
];

/// A place of an experiment file, the steps to it, with the names that the file uses: some fields are read by an old name, too.
pub(super) fn as_written<'a>(page: &RonFile, at: &[Step<'a>]) -> Vec<Step<'a>> {
    let mut written = Vec::new();
    for step in at {
        let old = match step {
            Step::Field(field) => old_name(field).map(Step::Field),
            Step::Item(_) => None,
        };
        let with = |step: Step<'a>| [written.as_slice(), &[step]].concat();
        let found = |path: &[Step<'_>]| place(&page.text, path) != place(&page.text, &written);
        let next = match old.map(&with) {
            Some(path) if !found(&with(*step)) && found(&path) => path,
            _ => with(*step),
        };
        written = next;
    }
    written
}

/// The old name of a field, where it had another.
fn old_name(field: &str) -> Option<&'static str> {
    RENAMED.iter().find(|r| r.keyword == Keyword::Field && r.new == field).map(|r| r.old)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_are_found_where_they_stand_and_nowhere_else() {
        let found = |text: &str| RonFile::of(text).renamed(RENAMED);
        let text = "Experiment(\n /* rare: 1 */ hyperparameters: (rare_crops: 0.5, class_weights: \"sqrt\"),\n sets: {\"watch\": Real(about: \"window: 3\")})";
        assert_eq!(found(text), Vec::<String>::new());
        let old =
            found("Experiment(\n learn: (window: (64, 48), rare: 0.5,\n balance: \"root\"), train: [(watch: [])])");
        let expected = ["learn", "window", "rare", "balance", "root", "watch"];
        assert_eq!(old.len(), expected.len(), "{old:?}");
        assert!(old.iter().zip(expected).all(|(words, name)| words.contains(&format!("`{name}` is now"))), "{old:?}");
        assert!(old[3].starts_with("page.ron:3:2: ") && old[3].contains("called `class_weights`"), "{old:?}");
        assert_eq!((old_name("crop_size"), old_name("steps")), (Some("window"), None));
    }
}
