//! Flags that have another name since version 0.1: the old ones are read, with a warning, for one more version.

use furrow::ron_file::Keyword;
use furrow::train::table::RENAMED;
use std::ffi::OsString;

/// Warns about each old name in a command line.
pub(crate) fn warn(arguments: impl Iterator<Item = OsString>) {
    for warning in warnings(arguments.filter_map(|argument| argument.into_string().ok())) {
        furrow::tell!("warning: {warning}");
    }
}

fn warnings(arguments: impl Iterator<Item = String>) -> Vec<String> {
    let mut warnings = Vec::new();
    let words = |old: &str, new: &str| format!("{old} is called {new} now; the next version reads only that");
    let mut flag = String::new();
    for argument in arguments {
        let (name, value) = match (argument.strip_prefix("--"), argument.split_once('=')) {
            (Some(_), Some((name, value))) => (Some(name), Some(value)),
            (Some(_), None) => (Some(argument.as_str()), None),
            (None, _) => (None, Some(argument.as_str())),
        };
        if let Some(name) = name {
            let field = name.trim_start_matches('-').replace('-', "_");
            if let Some(renamed) = RENAMED.iter().find(|r| r.keyword == Keyword::Field && r.old == field) {
                warnings.push(words(name, &format!("--{}", renamed.new.replace('_', "-"))));
            }
            flag = field;
        }
        let stands = |keyword| matches!(keyword, Keyword::Text(fields) if fields.contains(&flag.as_str()));
        if let Some(renamed) = RENAMED.iter().find(|r| Some(r.old) == value && stands(r.keyword)) {
            warnings.push(words(&format!("class weights `{}`", renamed.old), &format!("`{}`", renamed.new)));
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_flags_and_values_are_told_with_their_new_names() {
        let told = |line: &str| warnings(line.split(' ').map(str::to_owned));
        let old = told("fit --set d --watch-every 5 --balance fading --window=64x48");
        assert_eq!(old.len(), 4, "{old:?}");
        assert!(old[0].starts_with("--watch-every is called --validate-every now"), "{old:?}");
        assert!(old[2].contains("class weights `fading` is called `annealed` now"), "{old:?}");
        assert_eq!(told("fit --validate-every 5 --class-weights annealed --out root"), Vec::<String>::new());
    }
}
