//! Warnings about a model: contents of its file that are passed over.

/// Largest number of names in one warning.
const MOST_NAMES: usize = 3;

/// Warnings in the order of the file, each with the names of the materials or parts that it concerns.
#[derive(Debug, Default)]
pub(super) struct Notes(Vec<(String, Vec<String>)>);

impl Notes {
    /// Adds a warning that concerns the whole file.
    pub(super) fn add(&mut self, what: impl Into<String>) {
        self.names(what.into());
    }

    /// Adds a warning about `name`. Warnings of the same words are joined.
    pub(super) fn about(&mut self, what: impl Into<String>, name: &str) {
        let names = self.names(what.into());
        if !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }

    fn names(&mut self, what: String) -> &mut Vec<String> {
        let place = self.0.iter().position(|(known, _)| *known == what).unwrap_or_else(|| {
            self.0.push((what, Vec::new()));
            self.0.len() - 1
        });
        &mut self.0[place].1
    }

    /// Returns the warnings as sentences without a full stop.
    pub(super) fn words(self) -> Vec<String> {
        self.0.into_iter().map(|(what, names)| if names.is_empty() { what } else { named(&what, &names) }).collect()
    }
}

fn named(what: &str, names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    let more = match names.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    format!("{what}: {}{more}", quoted.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_warnings_are_joined() {
        let mut notes = Notes::default();
        notes.about("no coordinates", "a");
        notes.add("passed over: 1 light");
        for name in ["b", "a", "c", "d", "e"] {
            notes.about("no coordinates", name);
        }
        assert_eq!(notes.words(), ["no coordinates: `a`, `b`, `c` and 2 more", "passed over: 1 light"]);
    }
}
