//! Sums of the warnings of an import: what was left out, turned or could not be trusted.
//!
//! A warning that begins with a number counts something in an image; such warnings are added if their other words are
//! equal. Any other warning counts its images.

use std::collections::BTreeMap;

/// Splits a warning into its number, if it begins with one, and the other words.
fn parts(warning: &str) -> (Option<u64>, &str) {
    let counted = warning.split_once(' ').and_then(|(number, words)| Some((number.parse().ok()?, words)));
    counted.map_or((None, warning), |(number, words)| (Some(number), words))
}

fn words((number, words): (Option<u64>, &str)) -> String {
    number.map_or_else(|| words.to_owned(), |number| format!("{number} {words}"))
}

/// Adds the warnings of one image that count the same, in the order of their first occurrence.
pub(crate) fn summed(warnings: &[String]) -> Vec<String> {
    let mut all: Vec<(Option<u64>, &str)> = Vec::new();
    for (number, words) in warnings.iter().map(|warning| parts(warning)) {
        match all.iter_mut().find(|(sum, known)| *known == words && sum.is_some() == number.is_some()) {
            Some((sum, _)) => *sum = sum.zip(number).map(|(a, b)| a + b),
            None => all.push((number, words)),
        }
    }
    all.into_iter().map(words).collect()
}

/// Sums over many images.
#[derive(Debug, Default)]
pub(crate) struct Totals {
    /// Number of images and sum by the words of the warnings.
    all: BTreeMap<String, (u64, Option<u64>)>,
}

impl Totals {
    /// Adds the warnings of an image.
    pub(crate) fn add(&mut self, warnings: &[String]) {
        for (number, words) in warnings.iter().map(|warning| parts(warning)) {
            let (images, sum) = self.all.entry(words.to_owned()).or_default();
            *images += 1;
            *sum = number.map(|number| number + sum.unwrap_or(0)).or(*sum);
        }
    }

    /// Returns one line for each kind of warning: `3 images: 120 pixels of …`.
    pub(crate) fn lines(&self) -> Vec<String> {
        let line = |(text, (images, sum)): (&String, &(u64, Option<u64>))| {
            let what = if *images == 1 { "image" } else { "images" };
            format!("{images} {what}: {}", words((*sum, text)))
        };
        self.all.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_counts_the_same_is_added() {
        let warnings = ["2 pixels are lost", "turned", "3 pixels are lost", "turned"].map(String::from);
        assert_eq!(summed(&warnings), ["5 pixels are lost", "turned"]);
        let mut totals = Totals::default();
        totals.add(&summed(&warnings));
        totals.add(&["1 pixels are lost".into()]);
        assert_eq!(totals.lines(), ["2 images: 6 pixels are lost", "1 image: turned"]);
    }
}
