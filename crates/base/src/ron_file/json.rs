//! RON texts as JSON and back, for programs that edit scene files as nested tables.
//!
//! | RON | JSON |
//! |---|---|
//! | `Pinhole(size: (96, 72))` | `{"type": "Pinhole", "size": [96, 72]}` |
//! | `Uniform(1, 2)`, `Bbch(12)` | `{"Uniform": [1, 2]}`, `{"Bbch": 12}` |
//! | `Loess` | `"Loess"` |
//! | `(a: 1)`, `{"a": 1}` | `{"a": 1}` |
//! | `(1, 2)`, `[1, 2]` | `[1, 2]` |
//!
//! JSON does not distinguish tuples from lists, or names from strings: the way back follows the schema of the type. A
//! string in the place of a number or of a variant is taken as RON: `"Uniform(1, 2)"`. Fields may also be the value of
//! the name: `{"Pinhole": {"size": [96, 72]}}`, and a name whose fields all have defaults may stand alone: `"Phone"`.

use super::file::RonFile;
use super::num::{DISTRIBUTIONS, name_of};
use super::place::{members, place};
use super::schema::{self, KIND};
use crate::math::ToInt;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Map, Number, Value};
use std::ops::Range;

/// Key of the name in front of the fields of a struct or a variant.
const NAME: &str = "type";

/// Longest line of a text made from JSON, in characters, unless a single value is longer.
const WIDTH: usize = 120;

/// Returns a RON text as JSON, with the fields in their order. The name at the start of the text is left out. The text
/// must have been parsed before.
pub fn to_json(text: &str) -> String {
    let whole = place(text, &[]);
    let fields = members(text, &whole).into_iter().map(|(key, value)| pair(key.unwrap_or_default(), text, &value));
    format!("{{{}}}", fields.collect::<Vec<_>>().join(", "))
}

fn pair(key: &str, text: &str, value: &Range<usize>) -> String {
    format!("{}: {}", string(key.trim_matches('"')), json(text, value))
}

fn string(text: &str) -> String {
    Value::from(text).to_string()
}

/// Returns the value at `whole` as JSON.
fn json(text: &str, whole: &Range<usize>) -> String {
    let raw = &text[whole.clone()];
    if let Ok(text) = ron::from_str::<String>(raw) {
        return string(&text);
    }
    let name = name_of(raw);
    let Some(open) = raw.find(['(', '[', '{']) else {
        return match name {
            Some("true" | "false") => raw.to_owned(),
            Some("None") => "null".to_owned(),
            Some(name) => string(name),
            None => number(raw),
        };
    };
    let inside = members(text, whole);
    let list = || inside.iter().map(|(_, value)| json(text, value)).collect::<Vec<_>>();
    let named = inside.iter().all(|(key, _)| key.is_some());
    let fields = || inside.iter().map(|(key, value)| pair(key.unwrap_or_default(), text, value));
    match name {
        Some("Some") => list().concat(),
        Some(name) if named => {
            let own = format!("{}: {}", string(NAME), string(name));
            format!("{{{}}}", std::iter::once(own).chain(fields()).collect::<Vec<_>>().join(", "))
        }
        Some(name) => match list().as_slice() {
            [one] => format!("{{{}: {one}}}", string(name)),
            several => format!("{{{}: [{}]}}", string(name), several.join(", ")),
        },
        None if raw[open..].starts_with('[') || !named => format!("[{}]", list().join(", ")),
        None => format!("{{{}}}", fields().collect::<Vec<_>>().join(", ")),
    }
}

/// Returns a number as JSON, also one that only RON accepts, such as `.5` or `1_000`.
fn number(raw: &str) -> String {
    if serde_json::from_str::<Number>(raw).is_ok() {
        return raw.to_owned();
    }
    let value = ron::from_str::<f64>(raw).ok().and_then(Number::from_f64);
    value.map_or_else(|| string(raw), |value| value.to_string())
}

/// Returns the RON text of JSON in the form of [`to_json`], with the name and the schema of `T`. Whatever `T` does not
/// have is written too, so that reading the text reports it.
pub fn from_json<T: JsonSchema>(name: &str, value: &Value) -> String {
    let root = SchemaGenerator::default().into_root_schema_for::<T>().to_value();
    let printer = Printer { root: &root };
    let fields = value.as_object().map(|fields| printer.fields(&root, fields, 0)).unwrap_or_default();
    format!("{}\n", bracketed((&format!("{name}("), ")"), &fields, 0))
}

/// Prints JSON as RON by a schema.
struct Printer<'a> {
    root: &'a Value,
}

impl Printer<'_> {
    /// Returns a value as RON. Values of several lines are indented for nesting at `depth`.
    fn value(&self, schema: &Value, value: &Value, depth: usize) -> String {
        let schema = self.resolved(schema);
        match value {
            Value::Null => "None".to_owned(),
            Value::Bool(_) | Value::Number(_) => value.to_string(),
            Value::String(word) if has_fields(schema, word) => format!("{word}()"),
            Value::String(word) if takes_names(schema) && is_ron(word) => word.clone(),
            Value::String(text) => string(text),
            Value::Array(items) if items.is_empty() && schema.get("properties").is_some() => "()".to_owned(),
            Value::Array(items) => self.list(schema, items, depth),
            Value::Object(fields) => self.object(schema, fields, depth),
        }
    }

    fn object(&self, schema: &Value, fields: &Map<String, Value>, depth: usize) -> String {
        let of = |name: &str| schema::within(schema, name).unwrap_or(&Value::Null);
        if let Some(Value::String(name)) = fields.get(NAME)
            && schema.get("additionalProperties").is_none_or(|of| !of.is_object())
        {
            // A struct may have its own name in front of its fields.
            let own = schema.get("properties").is_some().then_some(schema);
            let mut fields = fields.clone();
            fields.remove(NAME);
            let inside = self.resolved(own.unwrap_or_else(|| of(name)));
            return bracketed((&format!("{name}("), ")"), &self.fields(inside, &fields, depth), depth);
        }
        if let Some(of) = schema.get("additionalProperties").filter(|of| of.is_object()) {
            let pair =
                |(key, value): (&String, &Value)| format!("{}: {}", string(key), self.value(of, value, depth + 1));
            return bracketed(("{", "}"), &fields.iter().map(pair).collect::<Vec<_>>(), depth);
        }
        let mut only = fields.iter();
        match (only.next(), only.next()) {
            (Some((name, Value::Object(inner))), None)
                if has_fields(schema, name) || DISTRIBUTIONS.contains(&name.as_str()) && name != "Uniform" =>
            {
                let of = self.resolved(of(name));
                bracketed((&format!("{name}("), ")"), &self.fields(of, inner, depth), depth)
            }
            (Some((name, value)), None) if name.starts_with(char::is_uppercase) => {
                self.variant(schema, name, value, depth)
            }
            _ => bracketed(("(", ")"), &self.fields(schema, fields, depth), depth),
        }
    }

    /// Prints a name with values in brackets.
    fn variant(&self, schema: &Value, name: &str, value: &Value, depth: usize) -> String {
        let inside = self.resolved(schema::within(schema, name).unwrap_or(&Value::Null));
        let text = match value {
            // The parameters of a distribution; all but those of `Uniform` are one list.
            Value::Array(items) if DISTRIBUTIONS.contains(&name) => {
                let items: Vec<String> = items.iter().map(|item| self.parameter(schema, name, item, depth)).collect();
                let ends = if name == "Uniform" { ("(", ")") } else { ("([", "])") };
                return bracketed((&format!("{name}{}", ends.0), ends.1), &items, depth);
            }
            value => self.value(inside, value, depth),
        };
        // A tuple already has brackets.
        if text.starts_with('(') && is_tuple(inside) { format!("{name}{text}") } else { format!("{name}({text})") }
    }

    /// Prints a value of a distribution: of a pick it has the type of the pick; in `Weighted` it is a pair.
    fn parameter(&self, schema: &Value, name: &str, item: &Value, depth: usize) -> String {
        match item {
            Value::Array(pair) if name == "Weighted" => {
                let pair: Vec<String> = pair.iter().map(|item| self.value(schema, item, depth)).collect();
                bracketed(("(", ")"), &pair, depth)
            }
            item => self.value(schema, item, depth),
        }
    }

    fn list(&self, schema: &Value, items: &[Value], depth: usize) -> String {
        let each = |k: usize, item: &Value| {
            let of = schema.get("prefixItems").and_then(|of| of.get(k)).or_else(|| schema.get("items"));
            self.value(of.unwrap_or(&Value::Null), item, depth + 1)
        };
        let items: Vec<String> = items.iter().enumerate().map(|(k, item)| each(k, item)).collect();
        bracketed(if is_tuple(schema) { ("(", ")") } else { ("[", "]") }, &items, depth)
    }

    /// Prints fields; those that are null are left out.
    fn fields(&self, schema: &Value, fields: &Map<String, Value>, depth: usize) -> Vec<String> {
        let given = fields.iter().filter(|(_, value)| !value.is_null());
        let of = |name: &str| schema.get("properties").and_then(|fields| fields.get(name)).unwrap_or(&Value::Null);
        given.map(|(name, value)| format!("{name}: {}", self.value(of(name), value, depth + 1))).collect()
    }

    /// Follows references and options.
    fn resolved<'v>(&'v self, schema: &'v Value) -> &'v Value {
        schema::referenced(self.root, schema).map_or(schema, |inner| self.resolved(inner))
    }
}

/// Returns `true` if a string in the place of this schema is a name, a number or a distribution.
fn takes_names(schema: &Value) -> bool {
    let is_text = schema.get("type").is_some_and(|of| *of == "string" || of.get(0) == Some(&"string".into()));
    let names = schema.get("oneOf").is_some() || schema.get("enum").is_some();
    names || schema.get(KIND).is_some() && !is_text
}

/// Returns `true` if a variant of this name has named fields. Those of a struct in a variant are behind a reference.
fn has_fields(schema: &Value, name: &str) -> bool {
    name.starts_with(char::is_uppercase)
        && schema.get("properties").is_none()
        && schema::within(schema, name).is_some_and(|of| of.get("properties").is_some() && of.get("$ref").is_none())
}

/// Returns `true` for the schema of a tuple or an array, which have a fixed number of items.
fn is_tuple(schema: &Value) -> bool {
    let size = |key: &str| schema.get(key).and_then(Value::as_u64);
    schema.get("prefixItems").is_some()
        || size("minItems").is_some_and(|n| n.to_usize() > 0 && size("maxItems") == Some(n))
}

/// Returns `true` if a text is one value of RON, which cannot change what is around it.
fn is_ron(text: &str) -> bool {
    RonFile::of(text).is_value()
}

/// Joins items in brackets: on one line if it is short enough, otherwise on one line each.
fn bracketed((open, close): (&str, &str), items: &[String], depth: usize) -> String {
    let length = 4 * depth + open.len() + items.iter().map(|item| item.len() + 2).sum::<usize>();
    if items.is_empty() || length <= WIDTH && items.iter().all(|item| !item.contains('\n')) && depth > 0 {
        return format!("{open}{}{close}", items.join(", "));
    }
    let (outer, inner) = ("    ".repeat(depth), "    ".repeat(depth + 1));
    let separator = format!(",\n{inner}");
    format!("{open}\n{inner}{},\n{outer}{close}", items.join(&separator))
}

#[cfg(test)]
mod tests {
    use super::super::{Pick, Positive, Vary};
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Page {
        lens: Lens,
        heights: Vec<Vary<Positive<1000>>>,
        pair: (u32, String),
        kind: Kind,
        #[serde(default)]
        names: Vec<Kind>,
        text: Pick<String>,
        #[serde(default)]
        inner: Option<Box<Page>>,
    }

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    #[serde(deny_unknown_fields)]
    enum Lens {
        Wide {
            size: [u32; 2],
        },
        Tall {
            #[serde(default)]
            size: Option<u32>,
        },
        Spectrum((f64, f64)),
        Named(String),
        OneOf(Vec<Vec<Kind>>),
    }

    #[derive(Debug, Deserialize, JsonSchema, PartialEq)]
    enum Kind {
        Loess,
        Loam,
    }

    const TEXT: &str = r#"// A page.
        Page(
            lens: Wide(size: (4, 3)), heights: [.5, Uniform(1, 2), Normal(mean: 3, sd: 1), Choice([1, 2]), Weighted([(1, 2), (3, 4)])],
            pair: (1, "a \"b\""), kind: Loess, names: [Loam, Loess], text: Choice(["x", "y"]),
            inner: (lens: OneOf([[Loam], [Loess]]), heights: [], pair: (2, ""), kind: Loam, text: "Loam"),
        )"#;

    /// Expected: the values of the text, read again from its JSON.
    #[test]
    fn json_and_back_is_the_same_file() {
        let json = to_json(TEXT);
        let value: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(value["lens"], serde_json::json!({"type": "Wide", "size": [4, 3]}));
        assert_eq!(value["heights"][1], serde_json::json!({"Uniform": [1, 2]}));
        assert_eq!((&value["kind"], &value["pair"][1]), (&"Loess".into(), &"a \"b\"".into()));
        assert!(json.find("lens") < json.find("heights"), "{json}");
        let text = from_json::<Page>("Page", &value);
        let read = |text: &str| RonFile::of(text).parse::<Page>().unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(read(&text), read(TEXT));
        for lens in ["Spectrum(1, 2)", "Named(\"x\")", "OneOf([[]])"] {
            let other = TEXT.replace("Wide(size: (4, 3))", lens);
            let text = from_json::<Page>("Page", &serde_json::from_str(&to_json(&other)).unwrap());
            assert_eq!(read(&text), read(&other), "{lens}");
        }
    }

    /// Expected: fields as the value of a name, and a name alone, mean the same as the usual form.
    #[test]
    fn other_forms_of_names_are_accepted() {
        for (usual, other) in [
            (r#"{"type": "Wide", "size": [4, 3]}"#, r#"{"Wide": {"size": [4, 3]}}"#),
            (r#"{"type": "Tall"}"#, r#"{"Tall": {}}"#),
            (r#"{"type": "Tall"}"#, r#""Tall""#),
        ] {
            let [usual, other] = [usual, other].map(|lens| {
                let mut page: Map<String, Value> = serde_json::from_str(&to_json(TEXT)).unwrap();
                page.insert("lens".into(), serde_json::from_str(lens).unwrap());
                page.insert(
                    "heights".into(),
                    serde_json::json!([{"Normal": {"mean": 3, "sd": 1}}, {"Uniform": [1, 2]}]),
                );
                RonFile::of(&from_json::<Page>("Page", &Value::Object(page))).parse::<Page>().unwrap()
            });
            assert_eq!(usual, other);
        }
    }

    /// Expected: what the type does not have is reported by the reader; a string cannot close the brackets around it.
    #[test]
    fn what_is_wrong_is_written_for_the_reader() {
        for (key, value, words) in [
            ("lenses", "1", "unknown field `lenses`"),
            ("kind", "\"Loes\"", "did you mean `Loess`"),
            ("kind", "\"Loess), text: (\"", "a name"),
            ("lens", r#"{"type": "Wide", "sise": 3}"#, "did you mean `size`"),
            ("lens", r#"{"type": "Wild"}"#, "did you mean `Wide`"),
            ("heights", "[\"Unifrm(1, 2)\"]", "did you mean `Uniform`"),
        ] {
            let mut page: Map<String, Value> = serde_json::from_str(&to_json(TEXT)).unwrap();
            page.insert(key.to_owned(), serde_json::from_str(value).unwrap());
            let text = from_json::<Page>("Page", &Value::Object(page));
            let message = RonFile::of(&text).parse_all::<Page>().unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
