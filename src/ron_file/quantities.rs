//! The numbers of a RON text, fixed or drawn, and where they stand: what a program may show as sliders, and replace alone.

use super::num::{DISTRIBUTIONS, name_of};
use super::place::{members, place};
use super::vary::Distribution;
use std::ops::Range;

/// Most brackets that are looked into, one in another.
const DEEPEST: usize = 32;

/// What stands where a number may stand.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; `whole` where it is written without a point.
    Fixed {
        /// The number.
        number: f64,
        /// Whether it is written without a point and without an exponent.
        whole: bool,
    },
    /// A distribution.
    Drawn(Distribution),
}

/// A number or a distribution in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The fields and items that lead to it: `crops[0].rows.spacing_m`.
    pub path: String,
    /// Its bytes in the text.
    pub at: Range<usize>,
    /// What it is.
    pub value: Value,
}

/// Every number and every distribution of numbers in a text, in their order. Of a text that does not parse, those that can be reached.
///
/// ```
/// use furrow::ron_file::quantities;
/// let text = "Field(seed: 7, crops: [(growth: AgeDays(Uniform(18, 28)))])";
/// let all = quantities(text);
/// assert_eq!((all[1].path.as_str(), &text[all[1].at.clone()]), ("crops[0].growth.AgeDays", "Uniform(18, 28)"));
/// ```
pub fn quantities(text: &str) -> Vec<Quantity> {
    let mut all = Vec::new();
    gather(text, &place(text, &[]), String::new(), DEEPEST, &mut all);
    all
}

/// Adds those of the value at `whole`, to which `path` leads.
fn gather(text: &str, whole: &Range<usize>, path: String, depth: usize, all: &mut Vec<Quantity>) {
    let raw = &text[whole.clone()];
    let name = name_of(raw);
    if let Some(value) = value(raw, name) {
        all.push(Quantity { path, at: whole.clone(), value });
        return;
    }
    if depth == 0 || name.is_some_and(|name| DISTRIBUTIONS.contains(&name)) {
        return;
    }
    let inner = members(text, whole);
    let alone = inner.len() == 1;
    for (number, (key, at)) in inner.into_iter().enumerate() {
        let dot = if path.is_empty() { "" } else { "." };
        let path = match (key, name) {
            (Some(key), _) => format!("{path}{dot}{}", key.trim_matches('"')),
            // A variant that holds one value: `AgeDays(20)`.
            (None, Some(name)) if alone => format!("{path}{dot}{name}"),
            (None, _) => format!("{path}[{number}]"),
        };
        gather(text, &at, path, depth - 1, all);
    }
}

/// What a raw text says, where it is a number or a distribution of numbers.
fn value(raw: &str, name: Option<&str>) -> Option<Value> {
    match name {
        Some(name) if DISTRIBUTIONS.contains(&name) => ron::from_str(raw).ok().map(Value::Drawn),
        Some(_) => None,
        None => {
            let number: f64 = raw.parse().ok().filter(|x: &f64| x.is_finite())?;
            Some(Value::Fixed { number, whole: raw.bytes().all(|b| b.is_ascii_digit() || b"+-".contains(&b)) })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TEXT: &str = r#"// Field(a: 1)
Field(
    seed: 7, /* 8 */
    camera: JaiAd130(height_m: Normal(mean: 0.85, sd: 0.03)),
    soil: (layers: [(albedo: "1.png", height_mm: (-4, 8.5))], colors: [Loess]),
    crops: [(species: Choice(["a", "b"]), growth: Either([Bbch(12), AgeDays(Uniform(2, 3))]))],
)"#;

    #[test]
    fn numbers_and_distributions_are_found_with_their_paths() {
        let found: Vec<(String, &str)> = quantities(TEXT).into_iter().map(|q| (q.path, &TEXT[q.at])).collect();
        let expected = [
            ("seed", "7"),
            ("camera.height_m", "Normal(mean: 0.85, sd: 0.03)"),
            ("soil.layers[0].height_mm[0]", "-4"),
            ("soil.layers[0].height_mm[1]", "8.5"),
            ("crops[0].growth.Either[0].Bbch", "12"),
            ("crops[0].growth.Either[1].AgeDays", "Uniform(2, 3)"),
        ];
        let expected: Vec<(String, &str)> = expected.into_iter().map(|(path, raw)| (path.to_owned(), raw)).collect();
        assert_eq!(found, expected);
    }

    proptest! {
        #[test]
        fn any_text_is_read(text in "[ -~\n\"()\\[\\]{},:#r/*é0-9]{0,80}") {
            prop_assert!(quantities(&text).into_iter().all(|q| text.get(q.at).is_some()));
        }
    }
}
