//! Keywords that were renamed: for one version the old name is read as well, with a warning that tells the new one.
//!
//! A renamed keyword gets a row in [`RENAMED`] and `#[serde(alias = "…")]` on its field or variant, both of which go in the version
//! after. A test holds the aliases of the sources to the table.

use super::place::{Word, offset_of, words};

/// Where a keyword stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keyword {
    /// Before a colon: the name of a field.
    Field,
    /// Elsewhere: the name of a value.
    Value,
    /// In quotes, as the value of one of these fields.
    Text(&'static [&'static str]),
}

/// One renamed keyword.
#[derive(Clone, Copy, Debug)]
pub struct Renamed {
    /// Where it stands.
    pub keyword: Keyword,
    /// What it was called. No other keyword of any RON file, standing there, has this name.
    pub old: &'static str,
    /// What it is called now.
    pub new: &'static str,
}

impl Renamed {
    /// A renamed field.
    pub const fn field(old: &'static str, new: &'static str) -> Self {
        Self { keyword: Keyword::Field, old, new }
    }
}

/// All renamed keywords of scene and species files that are still read; experiment files have a table of their own, since some of its
/// words are fields of these.
pub const RENAMED: &[Renamed] = &[
    Renamed { keyword: Keyword::Value, old: "Environment", new: "EnvironmentMap" },
    Renamed::field("skins", "materials"),
    Renamed::field("skin", "material"),
    Renamed::field("stalk_skin", "stalk_material"),
    Renamed::field("hypocotyl_skin", "hypocotyl_material"),
    Renamed::field("stem_skin", "stem_material"),
];

/// What a field of this name is called now.
pub(super) fn now(name: &str) -> &str {
    RENAMED.iter().find(|r| r.keyword == Keyword::Field && r.old == name).map_or(name, |r| r.new)
}

/// Whether a name is an old one, of fields or of values.
pub(super) fn is_old(keyword: Keyword, name: &str) -> bool {
    RENAMED.iter().any(|r| r.keyword == keyword && r.old == name)
}

/// A warning for each old name of a table in a file's text, where it first stands, in their order; `file` is what the file is called.
pub(super) fn warnings(file: &str, text: &str, table: &[Renamed]) -> Vec<String> {
    let mut field = "";
    let mut seen: Vec<&str> = Vec::new();
    let told = |word: Word| {
        let name = &text[word.at.clone()];
        if word.colon && !word.quoted {
            field = name;
        }
        let stands = |keyword: Keyword| match keyword {
            Keyword::Field => word.colon && !word.quoted,
            Keyword::Value => !word.colon && !word.quoted,
            Keyword::Text(fields) => word.quoted && fields.contains(&field),
        };
        let Renamed { old, new, .. } = table.iter().find(|r| r.old == name && stands(r.keyword))?;
        if seen.contains(old) {
            return None;
        }
        seen.push(*old);
        let line = text[..word.at.start].matches('\n').count() + 1;
        let column = text[offset_of(text, line, 1)..word.at.start].chars().count() + 1;
        Some(format!(
            "{file}:{line}:{column}: `{old}` is now called `{new}`: write `{new}`; the next version no longer reads `{old}`"
        ))
    };
    words(text).into_iter().filter_map(told).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn old_names_are_told_with_their_place_and_nothing_else_is() {
        let text = "(lights: [ // Environment\n  Environment(file: \"Environment(\"), EnvironmentMap(file: \"b\"),\n], Environment: 3)";
        assert_eq!(
            warnings("field.ron", text, RENAMED),
            [
                "field.ron:2:3: `Environment` is now called `EnvironmentMap`: write `EnvironmentMap`; the next version no longer reads `Environment`"
            ]
        );
    }

    /// Every alias of the sources is in the table and warns, and every row of the table has its alias. Aliases of experiment files are in
    /// theirs: `crate::train::table`.
    #[test]
    fn the_table_and_the_aliases_are_the_same() {
        fn read(folder: &Path, found: &mut Vec<String>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.ends_with("src/train") {
                    continue;
                }
                if path.is_dir() {
                    read(&path, found);
                } else if path.extension().is_some_and(|e| e == "rs") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    let lines = text.lines().map(str::trim).filter(|line| line.starts_with("#[serde("));
                    for line in lines {
                        let aliases = line.split("alias = \"").skip(1);
                        found.extend(aliases.map(|rest| rest.split('"').next().unwrap().to_owned()));
                    }
                }
            }
        }
        let mut found = Vec::new();
        read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
        found.sort();
        found.dedup();
        let mut listed: Vec<&str> = RENAMED.iter().map(|r| r.old).collect();
        listed.sort_unstable();
        assert_eq!(found, listed);
    }
}
