//! Formats default values as RON, from the JSON of a schema.

use super::node::{Types, parts, tuple};
use furrow_base::math::ToFloat;
use furrow_base::ron_file::KIND;
use serde_json::{Map, Value};

/// Formats a value with this schema as RON.
pub(super) fn ron(types: &Types, schema: &Value, value: &Value) -> String {
    let Some(node) = types.resolve(schema) else { return plain(value) };
    let each = |items: &[Value], schemas: &[&Value]| -> String {
        let all = items.iter().zip(schemas).map(|(item, schema)| ron(types, schema, item));
        all.collect::<Vec<_>>().join(", ")
    };
    if node.schema.contains_key(KIND) {
        return plain(value);
    }
    match (value, tuple(node.schema), node.schema.get("items")) {
        (Value::Array(items), Some(schemas), _) => return format!("({})", each(items, &schemas)),
        (Value::Array(items), None, Some(schema)) => return format!("[{}]", each(items, &vec![schema; items.len()])),
        _ => {}
    }
    let all = parts(node.schema);
    let named = |name: &str| all.iter().find(|part| part.name == name);
    match value {
        Value::String(name) if named(name).is_some_and(|part| part.required.is_none()) => name.clone(),
        Value::Object(fields) if node.schema.contains_key("properties") => {
            let given = fields.iter().filter(|(_, value)| !value.is_null());
            let pair =
                |(name, value): (&String, &Value)| Some(format!("{name}: {}", ron(types, named(name)?.schema, value)));
            format!("({})", given.filter_map(pair).collect::<Vec<_>>().join(", "))
        }
        Value::Object(fields) => match fields.iter().next().and_then(|(name, inside)| Some((named(name)?, inside))) {
            Some((part, inside)) => {
                let inside = ron(types, part.schema, inside);
                // A struct or a tuple already has brackets.
                if inside.starts_with('(') {
                    format!("{}{inside}", part.name)
                } else {
                    format!("{}({inside})", part.name)
                }
            }
            None => plain(value),
        },
        _ => plain(value),
    }
}

/// Formats a number, a text, a Boolean or a distribution.
fn plain(value: &Value) -> String {
    match value {
        Value::Null => "()".into(),
        Value::Bool(yes) => yes.to_string(),
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), self::number),
        Value::String(text) => format!("{text:?}"),
        Value::Array(items) => format!("[{}]", items.iter().map(plain).collect::<Vec<_>>().join(", ")),
        Value::Object(fields) => match fields.iter().next() {
            Some((name, Value::Array(items))) if name == "Uniform" => {
                format!("{name}({})", items.iter().map(plain).collect::<Vec<_>>().join(", "))
            }
            Some((name, Value::Object(fields))) => format!("{name}({})", pairs(fields)),
            Some((name, inside)) => format!("{name}({})", plain(inside)),
            None => "()".into(),
        },
    }
}

/// Formats the parameters of a normal or log-normal distribution, centre first.
fn pairs(fields: &Map<String, Value>) -> String {
    let order = ["mean", "sd", "median", "sigma", "min", "max"];
    let shown = order.iter().filter_map(|name| Some(format!("{name}: {}", plain(fields.get(*name)?))));
    shown.collect::<Vec<_>>().join(", ")
}

/// Formats a number with the fewest digits; in single precision if the value is exactly a single-precision number.
fn number(x: f64) -> String {
    let single = x.to_f32();
    if f64::from(single) == x { single.to_string() } else { x.to_string() }
}
