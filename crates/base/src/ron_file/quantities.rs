//! Numbers of a RON text, fixed or sampled, with their positions, for programs that show them as sliders or replace
//! them individually.

use super::num::{DISTRIBUTIONS, name_of};
use super::place::{members, place};
use super::schema::{self, Limits};
use super::vary::Distribution;
use schemars::JsonSchema;
use std::ops::Range;

/// Maximum bracket nesting that is searched.
const DEEPEST: usize = 32;

/// A number or a distribution.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A fixed number.
    Fixed {
        /// The number.
        number: f64,
        /// `true` if it is written without a decimal point and without an exponent.
        whole: bool,
    },
    /// A distribution.
    Drawn(Distribution),
}

/// A number or a distribution in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Path of fields and items that leads to it: `crops[0].rows.spacing_m`.
    pub path: String,
    /// Byte range in the text.
    pub at: Range<usize>,
    /// Its value.
    pub value: Value,
    /// Names of the fields and variants that lead to it, as in the schema; places in lists and tuples as `#0`.
    names: Vec<String>,
}

/// Returns the limits of each number of `T`'s file, or of the values of each distribution; `None` for numbers without
/// limits.
pub fn limits<T: JsonSchema>(all: &[Quantity]) -> Vec<Option<Limits>> {
    let root = schema::root::<T>();
    all.iter().map(|quantity| schema::limits(&root, &quantity.names)).collect()
}

/// Returns every number and every distribution of numbers in a text, in order. If the text does not parse, returns
/// those that can be reached.
///
/// ```
/// use furrow_base::ron_file::quantities;
/// let text = "Field(seed: 7, crops: [(growth: AgeDays(Uniform(18, 28)))])";
/// let all = quantities(text);
/// assert_eq!((all[1].path.as_str(), &text[all[1].at.clone()]), ("crops[0].growth.AgeDays", "Uniform(18, 28)"));
/// ```
pub fn quantities(text: &str) -> Vec<Quantity> {
    let mut all = Vec::new();
    gather(text, &place(text, &[]), (String::new(), &[]), DEEPEST, &mut all);
    all
}

/// Collects the quantities of the value at `whole`, which has the path `path` and these names on it.
fn gather(text: &str, whole: &Range<usize>, (path, names): (String, &[String]), depth: usize, all: &mut Vec<Quantity>) {
    let raw = &text[whole.clone()];
    let name = name_of(raw);
    if let Some(value) = value(raw, name) {
        all.push(Quantity { path, at: whole.clone(), value, names: names.to_vec() });
        return;
    }
    if depth == 0 || name.is_some_and(|name| DISTRIBUTIONS.contains(&name)) {
        return;
    }
    let inner = members(text, whole);
    let alone = inner.len() == 1;
    for (number, (key, at)) in inner.into_iter().enumerate() {
        let dot = if path.is_empty() { "" } else { "." };
        let step = match key {
            Some(key) => (!key.starts_with('"')).then(|| key.to_owned()),
            None => Some(schema::item(number)),
        };
        let names: Vec<String> = names.iter().cloned().chain(name.map(str::to_owned)).chain(step).collect();
        let path = match (key, name) {
            (Some(key), _) => format!("{path}{dot}{}", key.trim_matches('"')),
            // A variant with a single value: `AgeDays(20)`.
            (None, Some(name)) if alone => format!("{path}{dot}{name}"),
            (None, _) => format!("{path}[{number}]"),
        };
        gather(text, &at, (path, &names), depth - 1, all);
    }
}

/// Parses a raw text as a number or a distribution of numbers.
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
    use super::super::bound::{Fraction, Positive, Signed};
    use super::super::{Num, Vary};
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

    /// Expected: the limits of the type, behind lists, options and variants; none where the type has no number.
    #[test]
    fn numbers_have_the_limits_of_their_type() {
        #[derive(JsonSchema)]
        #[allow(dead_code)]
        struct Page {
            share: Num<Fraction>,
            parts: Vec<Part>,
            name: String,
            place: (Num<Fraction>, Vary<Signed<90>>),
        }
        #[derive(JsonSchema)]
        #[allow(dead_code)]
        enum Part {
            Flat { size: Option<Vary<Positive<20>>> },
            Aged(Vary<Signed<90>>),
        }
        let text = "Page(share: 0.5, parts: [Flat(size: Uniform(1, 2)), Aged(3)], name: 4, place: (0, 2, 9))";
        let found = limits::<Page>(&quantities(text));
        let limits = |min, max, above_min| Some(Limits { min, max, above_min });
        let (share, angle) = (limits(0.0, 1.0, false), limits(-90.0, 90.0, false));
        assert_eq!(found, [share, limits(0.0, 20.0, true), angle, None, share, angle, None]);
    }

    proptest! {
        #[test]
        fn any_text_is_read(text in "[ -~\n\"()\\[\\]{},:#r/*é0-9]{0,80}") {
            prop_assert!(quantities(&text).into_iter().all(|q| text.get(q.at).is_some()));
        }
    }
}
