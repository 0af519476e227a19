//! JSON schema of numbers in files: their bound in words, and whether a distribution is allowed.

use super::bound::Bound;
use super::num::Num;
use super::vary::{Pick, Vary};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::Value;
use std::borrow::Cow;

/// Schema key for the kind of a value: [`FIXED`], [`DRAWN`] or [`PICKED`].
pub const KIND: &str = "x-kind";

/// Schema key for a number's bound in words, from [`Bound::words`].
pub const RANGE: &str = "x-range";

/// Schema key for the effective default, as RON, of an optional field without a default of its own.
pub const DEFAULT: &str = "x-default";

/// Kind of a number that is the same in every field.
pub const FIXED: &str = "number";

/// Kind of a number that may be a distribution, sampled for every field.
pub const DRAWN: &str = "number or distribution";

/// Kind of a value that may be a choice of several.
pub const PICKED: &str = "value or choice";

/// Returns the required fields of the struct or variant of `T`'s file that is called `name` and has the field
/// `missing`.
pub(super) fn required<T: JsonSchema>(name: &str, missing: &str) -> Vec<String> {
    fn look(schema: &Value, key: Option<&str>, name: &str, missing: &str) -> Option<Vec<String>> {
        match schema {
            Value::Object(fields) => {
                let title = fields.get("title").and_then(Value::as_str);
                let all = fields.get("required").and_then(Value::as_array);
                if let Some(all) = all.filter(|all| key.or(title) == Some(name) && all.iter().any(|n| n == missing)) {
                    return Some(all.iter().filter_map(Value::as_str).map(str::to_owned).collect());
                }
                fields.iter().find_map(|(key, inner)| look(inner, Some(key), name, missing))
            }
            Value::Array(items) => items.iter().find_map(|inner| look(inner, None, name, missing)),
            _ => None,
        }
    }
    look(&root::<T>(), None, name, missing).unwrap_or_default()
}

/// Returns how many of the names on a path into `T`'s file exist, counting the file's own name, and the names allowed
/// at its end. Names inside a number are not checked.
pub(super) fn known<T: JsonSchema>(path: &[&str]) -> (usize, Vec<Name>) {
    let root = root::<T>();
    match at_end(&root, path) {
        Ok(at) if at.get(KIND).is_some() => (path.len(), Vec::new()),
        Ok(at) => (path.len(), names(&root, at)),
        Err(depth) => (depth, Vec::new()),
    }
}

/// Returns the schema of `T`'s file.
pub(super) fn root<T: JsonSchema>() -> Value {
    SchemaGenerator::default().into_root_schema_for::<T>().to_value()
}

/// Range of valid values of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// `true` if the smallest value itself is not allowed.
    pub above_min: bool,
}

/// Returns the limits of the number at the end of a path; `None` if there is none.
pub(super) fn limits(root: &Value, path: &[String]) -> Option<Limits> {
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    let at = at_end(root, &path).ok()?;
    let number = |key: &str| at.get(key).and_then(Value::as_f64);
    let (lowest, above) = (number("minimum"), number("exclusiveMinimum"));
    Some(Limits { min: lowest.or(above)?, max: number("maximum")?, above_min: lowest.is_none() })
}

/// Returns the step of a path to an item of a list or a tuple, which no name can be.
pub(super) fn item(place: usize) -> String {
    format!("#{place}")
}

/// Returns the schema at the end of a path, or of the number there; otherwise the number of names on the path that exist.
fn at_end<'a>(root: &'a Value, path: &[&str]) -> Result<&'a Value, usize> {
    let mut at = resolved(root, root);
    for (k, step) in path.iter().enumerate() {
        if at.get(KIND).is_some() {
            break;
        }
        if let Some(place) = step.strip_prefix('#') {
            // Lists are resolved to their items already; a variant's only value has no schema of its own.
            let items = at.get("prefixItems").and_then(Value::as_array);
            if let Some(inner) = place.parse().ok().and_then(|place: usize| items?.get(place)) {
                at = resolved(root, inner);
            }
            continue;
        }
        match within(at, step) {
            Some(inner) => at = resolved(root, inner),
            // The file's own name, or the name in front of a struct's fields.
            None if k == 0 || step.starts_with(char::is_uppercase) && at.get("properties").is_some() => {}
            None => return Err(k),
        }
    }
    Ok(at)
}

/// Returns `true` if `T`'s file has a string at the end of a path that exists.
pub(super) fn is_text<T: JsonSchema>(path: &[&str]) -> bool {
    at_end(&root::<T>(), path).is_ok_and(|at| match at.get("type") {
        Some(Value::String(one)) => one == "string",
        Some(Value::Array(several)) => several.iter().any(|one| one == "string"),
        _ => false,
    })
}

/// A name allowed at a place, and whether it takes a number in brackets.
pub(super) struct Name {
    pub(super) name: String,
    pub(super) takes_number: bool,
}

/// Returns the schema that a reference or an option leads to; `None` for any other.
pub(super) fn referenced<'a>(root: &'a Value, schema: &'a Value) -> Option<&'a Value> {
    let path = schema.get("$ref").and_then(Value::as_str);
    if path == Some("#") {
        return Some(root);
    }
    let reference = path.and_then(|path| path.strip_prefix("#/$defs/"));
    let some = schema.get("anyOf").and_then(Value::as_array);
    reference
        .and_then(|name| root.get("$defs")?.get(name))
        .or_else(|| some?.iter().find(|of| of.get("type") != Some(&"null".into())))
}

/// Follows references, options, lists and tables to the inner schema.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let inner = referenced(root, schema)
        .or_else(|| schema.get("items").filter(|of| of.is_object()))
        .or_else(|| schema.get("additionalProperties").filter(|of| of.is_object()));
    inner.map_or(schema, |inner| resolved(root, inner))
}

/// Returns the schema of a field's value or of a variant's content, whichever `at` has under this name.
pub(super) fn within<'a>(at: &'a Value, step: &str) -> Option<&'a Value> {
    let field = at.get("properties").and_then(|fields| fields.get(step));
    let inside = || variants(at).find_map(|variant| variant.get("properties")?.get(step));
    let bare = || variants(at).find(|variant| variant.get("const").is_some_and(|name| name == step));
    field.or_else(inside).or_else(bare)
}

fn variants(at: &Value) -> impl Iterator<Item = &Value> {
    at.get("oneOf").and_then(Value::as_array).into_iter().flatten()
}

fn names(root: &Value, at: &Value) -> Vec<Name> {
    let mut all = Vec::new();
    for variant in variants(at) {
        if let Some(name) = variant.get("const").and_then(Value::as_str) {
            all.push(Name { name: name.into(), takes_number: false });
        }
        for (name, inner) in variant.get("properties").and_then(Value::as_object).into_iter().flatten() {
            all.push(Name { name: name.clone(), takes_number: resolved(root, inner).get(KIND).is_some() });
        }
    }
    all
}

macro_rules! numbers {
    ($($name:ident => $kind:expr,)*) => {$(
        impl<B: Bound> JsonSchema for $name<B> {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                let low = if B::ABOVE_MIN { "exclusiveMinimum" } else { "minimum" };
                let mut schema = json_schema!({
                    "type": "number", "maximum": B::MAX, "x-kind": $kind, "x-range": B::words()
                });
                schema.insert(low.to_owned(), B::MIN.into());
                schema
            }
        }
    )*};
}

numbers! {
    Num => FIXED,
    Vary => DRAWN,
}

impl<T: JsonSchema> JsonSchema for Pick<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Pick".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = T::json_schema(generator);
        schema.insert(KIND.to_owned(), PICKED.into());
        schema
    }
}
