//! Reads a value's JSON schema: resolves references, and lists fields or variants.

use furrow_base::math::ToInt;
use serde_json::{Map, Value};

/// Schema key with an example in RON, for fields where an example generated from the type would be poor.
pub(super) const EXAMPLE: &str = "x-example";

/// Schema key with a path step. Examples of values below that step also include this field, because they refer to it.
pub(super) const BESIDE: &str = "x-beside";

/// Schema key of a list, with a path step and an item in RON. Examples of values below that step put this item first in the list.
pub(super) const FIRST: &str = "x-first";

/// A JSON schema object.
pub(super) type Object = Map<String, Value>;

/// A root schema with its type definitions.
#[derive(Clone, Debug)]
pub(super) struct Types(pub(super) Value);

/// Resolved type of a value: its schema behind references and options, and the name of the type.
pub(super) struct Node<'a> {
    pub(super) schema: &'a Object,
    pub(super) name: Option<&'a str>,
}

impl Types {
    /// Resolves references and options of a schema.
    pub(super) fn resolve<'a>(&'a self, schema: &'a Value) -> Option<Node<'a>> {
        let mut node = Node { schema: schema.as_object()?, name: None };
        loop {
            if let Some(name) = node.schema.get("$ref").and_then(Value::as_str).and_then(|r| r.strip_prefix("#/$defs/"))
            {
                node = Node { schema: self.0.get("$defs")?.get(name)?.as_object()?, name: Some(name) };
                continue;
            }
            let options = node.schema.get("anyOf").and_then(Value::as_array);
            let some = options.and_then(|of| of.iter().find(|s| s.get("type") != Some(&"null".into())));
            match some.and_then(Value::as_object) {
                Some(inner) => node = Node { schema: inner, name: None },
                None => return Some(node),
            }
        }
    }

    /// Returns the value type inside lists and tables, with a prefix that describes the container.
    pub(super) fn inner<'a>(&'a self, schema: &'a Value) -> Option<(Node<'a>, &'static str)> {
        let node = self.resolve(schema)?;
        if let Some(items) = node.schema.get("items").filter(|_| tuple(node.schema).is_none()) {
            return self.inner(items).map(|(inner, _)| (inner, "list of "));
        }
        if let Some(values) = node.schema.get("additionalProperties").filter(|v| v.is_object()) {
            return self.inner(values).map(|(inner, _)| (inner, "table by name of "));
        }
        Some((node, ""))
    }
}

/// Returns the schemas of a tuple's items; `None` for a list.
pub(super) fn tuple(schema: &Object) -> Option<Vec<&Value>> {
    if let Some(items) = schema.get("prefixItems").and_then(Value::as_array) {
        return Some(items.iter().collect());
    }
    let count = schema.get("minItems").filter(|n| schema.get("maxItems") == Some(n))?.as_u64()?;
    let item = schema.get("items")?;
    Some(vec![item; count.to_usize()])
}

/// A field of a struct, or a variant.
pub(super) struct Member<'a> {
    pub(super) name: &'a str,
    /// Schema of the field's value or of the variant's content; null for a unit variant.
    pub(super) schema: &'a Value,
    /// Whether the field is required; `None` for a variant.
    pub(super) required: Option<bool>,
    /// Text of its doc comment.
    pub(super) words: Option<&'a str>,
    /// Example of a variant's content, if an example generated from the types would be poor.
    pub(super) example: Option<&'a str>,
}

/// Returns the fields of a struct, required ones first, or the variants of an enum.
pub(super) fn parts(schema: &Object) -> Vec<Member<'_>> {
    fn words(of: &Value) -> Option<&str> {
        of.get("description").and_then(Value::as_str)
    }
    if let Some(fields) = schema.get("properties").and_then(Value::as_object) {
        let required: Vec<&str> =
            schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect();
        let field = |name: &str| fields.get_key_value(name);
        let first = required.iter().filter_map(|name| field(name));
        let rest = fields.iter().filter(|(name, _)| !required.contains(&name.as_str()));
        return first
            .chain(rest)
            .map(|(name, schema)| Member {
                name,
                schema,
                required: Some(required.contains(&name.as_str())),
                words: words(schema),
                example: None,
            })
            .collect();
    }
    let bare = |name| Member { name, schema: &Value::Null, required: None, words: None, example: None };
    if let Some(names) = schema.get("enum").and_then(Value::as_array) {
        return names.iter().filter_map(Value::as_str).map(bare).collect();
    }
    let mut all = Vec::new();
    for variant in schema.get("oneOf").and_then(Value::as_array).into_iter().flatten() {
        let words = words(variant);
        if let Some(name) = variant.get("const").and_then(Value::as_str) {
            all.push(Member { words, ..bare(name) });
        } else if let Some(names) = variant.get("enum").and_then(Value::as_array) {
            all.extend(names.iter().filter_map(Value::as_str).map(|name| Member { words, ..bare(name) }));
        } else if let Some(inside) = variant.get("properties").and_then(Value::as_object) {
            let example = variant.get(EXAMPLE).and_then(Value::as_str);
            all.extend(inside.iter().map(|(name, schema)| Member { name, schema, required: None, words, example }));
        }
    }
    all
}
