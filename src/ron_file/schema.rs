//! What numbers of a file say about themselves in a JSON schema: their bound in words, and whether a distribution may stand there.

use super::bound::Bound;
use super::num::Num;
use super::vary::{Pick, Vary};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::Value;
use std::borrow::Cow;

/// Key of a schema that holds what kind of value it is: [`FIXED`], [`DRAWN`] or [`PICKED`].
pub const KIND: &str = "x-kind";

/// Key of a schema that holds a number's bound in words, as [`Bound::WORDS`] has it.
pub const RANGE: &str = "x-range";

/// A number that is the same in every field.
pub const FIXED: &str = "number";

/// A number, or a distribution that every field draws from.
pub const DRAWN: &str = "number or distribution";

/// A value, or one of several.
pub const PICKED: &str = "value or choice";

/// Names of the fields that a struct or variant of `T`'s file must have: that of this name which has the field `missing`.
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
    let schema = SchemaGenerator::default().into_root_schema_for::<T>().to_value();
    look(&schema, None, name, missing).unwrap_or_default()
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
                json_schema!({ "type": "number", "x-kind": $kind, "x-range": B::WORDS })
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
