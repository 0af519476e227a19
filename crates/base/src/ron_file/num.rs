//! A number that is the same in every field: a distribution is not allowed.

use super::bound::Bound;
use super::fault::{Fault, from_raw, parse_in, whole};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::marker::PhantomData;

/// Names of the distributions.
pub(super) const DISTRIBUTIONS: [&str; 5] = ["Uniform", "Normal", "LogNormal", "Choice", "Weighted"];

/// A fixed number within its bound.
///
/// ```
/// use furrow_base::ron_file::{Num, Positive};
/// assert_eq!(ron::from_str::<Num<Positive<1000>>>("2.5").unwrap().get(), 2.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Num<B: Bound>(f64, PhantomData<B>);

impl<B: Bound> Num<B> {
    /// Builds a number for defaults and tests; `x` must be within the bound.
    pub const fn new(x: f64) -> Self {
        Self(x, PhantomData)
    }

    /// Returns the value.
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Returns `true` for zero, so that a serializer can skip the field where zero is the default.
    pub fn is_zero(&self) -> bool {
        self.0 == 0.0
    }

    /// Returns the value in single precision.
    #[expect(clippy::cast_possible_truncation, reason = "traits have no constant functions yet")]
    pub const fn f32(self) -> f32 {
        self.0 as f32
    }
}

impl<'de, B: Bound> Deserialize<'de> for Num<B> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_raw(deserializer, |raw| match name_of(raw) {
            Some(name) if DISTRIBUTIONS.contains(&name) => Err(whole(
                raw,
                format!("{name} cannot stand here: this number is the same in every field"),
                "write one number",
            )),
            Some(name) => Err(whole(raw, format!("`{name}` is not a number"), "write one number, such as 2 or 0.5")),
            None => number::<B>(raw, "write one number; it is the same in every field").map(Self::new),
        })
    }
}

impl<B: Bound> Serialize for Num<B> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.0)
    }
}

/// Returns the name that a value starts with; `None` for a number, including `inf` and `NaN`.
pub(super) fn name_of(raw: &str) -> Option<&str> {
    let t = raw.trim_start();
    let name = &t[..t.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(t.len())];
    (name.starts_with(|c: char| c.is_alphabetic() || c == '_') && !["inf", "NaN"].contains(&name)).then_some(name)
}

/// Parses one number and checks its bound.
pub(super) fn number<B: Bound>(raw: &str, help: &str) -> Result<f64, Fault> {
    let x: f64 = parse_in(raw)?;
    if B::holds(x) { Ok(x) } else { Err(whole(raw, B::refuse(x), help)) }
}
