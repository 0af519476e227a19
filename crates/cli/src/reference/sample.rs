//! Generates examples: a value in RON, and a whole file that contains it.

use super::node::{BESIDE, EXAMPLE, FIRST, Member, Types, parts, tuple};
use super::ron;
use furrow_base::ron_file::{DRAWN, KIND, RANGE};
use serde_json::Value;

/// Key of the entry in every example table, so that references in examples resolve.
const KEY: &str = "leaf";

/// Returns an example of a field with a value, or of a variant.
pub(super) fn entry(types: &Types, part: &Member<'_>) -> String {
    if part.required.is_none() {
        return variant(types, part, &[]);
    }
    format!("{}: {}", part.name, value(types, part.schema, &[]))
}

/// Returns an example value in RON. `path` names the field or variant that it must contain.
pub(super) fn value(types: &Types, schema: &Value, path: &[&str]) -> String {
    if let Some(example) = schema.get(EXAMPLE).and_then(Value::as_str).filter(|_| path.is_empty()) {
        return example.into();
    }
    let Some(node) = types.resolve(schema) else { return "()".into() };
    if path.is_empty() {
        match schema.get("default") {
            None | Some(Value::Null) => {}
            Some(Value::Array(items)) if items.is_empty() => {}
            Some(Value::String(text)) if text.is_empty() => {}
            Some(Value::Object(_)) if node.schema.contains_key("properties") => {}
            Some(given) => return ron::ron(types, schema, given),
        }
        if let Some(example) = node.schema.get(EXAMPLE).and_then(Value::as_str) {
            return example.into();
        }
    }
    if let Some(items) = tuple(node.schema) {
        let items: Vec<String> = items.into_iter().map(|item| value(types, item, path)).collect();
        return format!("({})", items.join(", "));
    }
    if let Some(items) = node.schema.get("items") {
        let first = schema
            .get(FIRST)
            .and_then(Value::as_array)
            .map(|pair| [0, 1].map(|i| pair[i].as_str().unwrap_or_default()));
        let first =
            first.filter(|[step, _]| path.contains(step)).map_or(String::new(), |[_, item]| format!("{item}, "));
        return format!("[{first}{}]", value(types, items, path));
    }
    if let Some(values) = node.schema.get("additionalProperties").filter(|v| v.is_object()) {
        return format!("{{\"{KEY}\": {}}}", value(types, values, path));
    }
    let all = parts(node.schema);
    if node.schema.contains_key("properties") {
        let fields: Vec<String> = all
            .iter()
            .filter(|part| {
                let beside = part.schema.get(BESIDE).and_then(Value::as_str);
                part.required == Some(true)
                    || path.first() == Some(&part.name)
                    || beside.is_some_and(|step| path.contains(&step))
            })
            .map(|part| {
                let rest = if path.first() == Some(&part.name) { &path[1..] } else { &[] };
                format!("{}: {}", part.name, value(types, part.schema, rest))
            })
            .collect();
        return format!("({})", fields.join(", "));
    }
    let wanted = path.first().and_then(|name| all.iter().find(|part| part.name == *name));
    if let Some(part) = wanted.or(all.first()) {
        return variant(types, part, if wanted.is_some() { &path[1..] } else { &[] });
    }
    plain(node.schema)
}

fn variant(types: &Types, part: &Member<'_>, path: &[&str]) -> String {
    if let Some(example) = part.example.filter(|_| path.is_empty()) {
        return format!("{}{example}", part.name);
    }
    if part.schema.is_null() {
        return part.name.into();
    }
    let inside = value(types, part.schema, path);
    // A struct or a tuple already has brackets.
    if inside.starts_with('(') { format!("{}{inside}", part.name) } else { format!("{}({inside})", part.name) }
}

/// Returns an example of a number, text or Boolean.
fn plain(schema: &serde_json::Map<String, Value>) -> String {
    let range = schema.get(RANGE).and_then(Value::as_str).unwrap_or_default();
    let drawn = schema.get(KIND).and_then(Value::as_str) == Some(DRAWN);
    let one = |fixed: &str, draw: &str| if drawn { draw.to_owned() } else { fixed.to_owned() };
    match schema.get("type").and_then(Value::as_str).or_else(|| {
        schema
            .get("type")
            .and_then(Value::as_array)
            .and_then(|of| of.iter().filter_map(Value::as_str).find(|t| *t != "null"))
    }) {
        Some("boolean") => "true".into(),
        Some("string") => "\"name\"".into(),
        Some("integer") => "1".into(),
        _ if range.starts_with("a whole number") => one("2", "Choice([2, 3])"),
        _ if range == "between 0 and 1" => one("0.5", "Uniform(0.2, 0.5)"),
        _ if range.starts_with("between 0 and") && range.contains("degrees") => one("45", "Uniform(30, 60)"),
        _ if range.starts_with("above") || range.starts_with("between 0 and") => one("1", "Uniform(1, 2)"),
        _ if range.starts_with("between 1.7") => one("3", "Uniform(2, 5)"),
        _ => one("1.5", "Uniform(1.4, 1.6)"),
    }
}
