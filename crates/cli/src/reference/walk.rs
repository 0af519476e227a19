//! Builds the sections of a reference from a JSON schema, and finds sections by path.

use super::node::{Member, Node, Object, Types, parts, tuple};
use super::ron;
use super::sample;
use super::section::{Entry, Section, prose, unit};
use furrow_base::ron_file::{self, DEFAULT, DISTRIBUTION_WORDS, KIND, RANGE};
use schemars::JsonSchema;
use serde_json::Value;
use std::collections::BTreeMap;

/// Reference of one kind of file.
#[derive(Clone, Debug)]
pub struct Reference {
    /// First step of paths if there are several kinds of files: `scene`, `species`.
    pub root: &'static str,
    /// Name at the start of the file, before its bracket; empty if there are several.
    pub opening: &'static str,
    /// Title of the documentation page.
    pub title: &'static str,
    /// Sections: the whole file first, then the others in depth-first order.
    pub sections: Vec<Section>,
    pub(super) types: Types,
}

impl Reference {
    /// Builds the reference of a type from its schema.
    pub(super) fn of<T: JsonSchema>(root: &'static str, opening: &'static str, title: &'static str) -> Self {
        let schema = schemars::SchemaGenerator::default().into_root_schema_for::<T>().to_value();
        let mut reference = Self { root, opening, title, sections: Vec::new(), types: Types(schema) };
        let mut met = BTreeMap::new();
        let mut sections = Vec::new();
        if let Some(whole) = reference.types.0.as_object() {
            reference.collect(&Node { schema: whole, name: None }, None, "", &mut met, &mut sections);
        }
        reference.sections = sections;
        reference
    }

    /// Finds the section of a path and, if the path ends in a plain field or variant, the entry. List indices and struct names in the
    /// path are skipped. The name of a variant may be left out before one of its fields; the first variant with such a field is used.
    pub fn find(&self, path: &str) -> Option<(&Section, Option<&Entry>)> {
        let mut at = self.sections.first()?;
        let mut entry = None;
        let steps: Vec<&str> =
            path.split(['.', '[', ']']).filter(|step| !step.is_empty() && step.parse::<usize>().is_err()).collect();
        for (k, step) in steps.iter().enumerate() {
            let found = at.entry(step).map(|e| (at, e)).or_else(|| self.within_variants(at, step));
            match found {
                Some((section, e)) => {
                    at = e.section.as_deref().and_then(|path| self.section(path)).unwrap_or(section);
                    entry = Some((section, e));
                    if e.section.is_none() {
                        // The remaining steps may only be a distribution and its parameters.
                        let drawn = e.kind.contains("distribution");
                        let inside = |step: &&str| drawn && DISTRIBUTION_WORDS.contains(step);
                        if !steps[k + 1..].iter().all(inside) {
                            return None;
                        }
                        break;
                    }
                }
                // A struct name before its fields, as in `materials.Leaf` or `sensor.Phone`.
                None if step.starts_with(char::is_uppercase) && steps.len() > 1 && !at.has_variants() => {}
                None => return None,
            }
        }
        match entry {
            // A number, a text or a unit variant is an entry of its parent's section; a struct has its own section.
            Some((section, e)) if e.section.is_none() => Some((section, Some(e))),
            _ => Some((at, None)),
        }
    }

    /// Returns the paths of all sections and entries with this last name.
    pub fn named(&self, name: &str) -> Vec<String> {
        let mut all = Vec::new();
        for section in &self.sections {
            for entry in section.entries.iter().filter(|entry| entry.name == name) {
                all.push(entry.section.clone().unwrap_or_else(|| joined(&section.path, &entry.name)));
            }
        }
        all.dedup();
        all
    }

    /// Returns a minimal file that contains the example of a path (names of fields and variants, separated by dots).
    pub fn file_with(&self, path: &str) -> String {
        let steps: Vec<&str> = path.split('.').filter(|step| !step.is_empty()).collect();
        format!("{}{}", self.opening, sample::value(&self.types, &self.types.0, &steps))
    }

    /// Returns all paths.
    pub fn paths(&self) -> Vec<String> {
        let each = |section: &Section| -> Vec<String> {
            section.entries.iter().map(|entry| joined(&section.path, &entry.name)).collect()
        };
        self.sections.iter().flat_map(each).collect()
    }

    /// Returns the section with this path.
    pub fn section(&self, path: &str) -> Option<&Section> {
        self.sections.iter().find(|section| section.path == path)
    }

    fn within_variants(&self, section: &Section, step: &str) -> Option<(&Section, &Entry)> {
        let mut inside =
            section.entries.iter().filter(|e| e.variant).filter_map(|e| self.section(e.section.as_deref()?));
        inside.find_map(|s| s.entry(step).map(|e| (s, e)))
    }

    /// Adds the section of the value at `path`, and recursively those of the values in it.
    fn collect<'a>(
        &'a self,
        node: &Node<'a>,
        words: Option<&str>,
        path: &str,
        met: &mut BTreeMap<&'a str, usize>,
        sections: &mut Vec<Section>,
    ) {
        let words = words.or_else(|| description(node.schema)).map(prose).unwrap_or_default();
        let at = sections.len();
        if let Some(name) = node.name {
            met.insert(name, at);
        }
        sections.push(Section { path: path.into(), also: Vec::new(), words, entries: Vec::new() });
        let mut entries = Vec::new();
        for part in parts(node.schema) {
            let section = self.enter(&joined(path, part.name), &part, met, sections);
            entries.push(self.entry(&part, section));
        }
        sections[at].entries = entries;
    }

    /// Adds the section of a value, unless its type already has one. Returns the path of the section; `None` for a value without fields or
    /// variants.
    fn enter<'a>(
        &'a self,
        path: &str,
        part: &Member<'a>,
        met: &mut BTreeMap<&'a str, usize>,
        sections: &mut Vec<Section>,
    ) -> Option<String> {
        let (node, _) = self.types.inner(part.schema)?;
        if parts(node.schema).is_empty() {
            return None;
        }
        if let Some(at) = node.name.and_then(|name| met.get(name)) {
            let section = &mut sections[*at];
            section.also.push(path.to_owned());
            return Some(section.path.clone());
        }
        // The doc comment of a variant describes its content; that of a field describes only the field.
        let words = part.words.filter(|_| part.required.is_none());
        self.collect(&node, words, path, met, sections);
        Some(path.to_owned())
    }

    fn entry(&self, part: &Member<'_>, section: Option<String>) -> Entry {
        let inner = self.types.inner(part.schema).map(|(node, _)| node.schema);
        let words = part.words.or_else(|| inner.and_then(description)).map(prose).unwrap_or_default();
        let schema_default = || part.schema.get(DEFAULT).and_then(Value::as_str).map(str::to_owned);
        let given = self.default(part.schema, section.is_some()).or_else(schema_default);
        let default = match part.required {
            Some(true) => None,
            None => Some(String::new()),
            Some(false) => Some(given.unwrap_or_else(|| "none".into())),
        };
        let range = inner.and_then(|schema| schema.get(RANGE)).and_then(Value::as_str);
        Entry {
            name: part.name.into(),
            kind: self.kind(part.schema),
            unit: unit(part.name),
            range: range.unwrap_or_default().into(),
            default,
            words,
            example: sample::entry(&self.types, part),
            section,
            variant: part.required.is_none(),
        }
    }

    /// Formats a default as RON. For a struct with its own section, refers to the defaults of its fields.
    fn default(&self, schema: &Value, deep: bool) -> Option<String> {
        let given = schema.get("default").filter(|value| !value.is_null() && **value != "")?;
        let node = self.types.resolve(schema)?;
        if deep && given.is_object() && node.schema.contains_key("properties") {
            return Some("those of its fields".into());
        }
        Some(ron::ron(&self.types, schema, given))
    }

    /// Describes the kind of a value in words.
    fn kind(&self, schema: &Value) -> String {
        let Some((node, outer)) = self.types.inner(schema) else { return String::new() };
        let own = node.schema.get(KIND).and_then(Value::as_str);
        let kind = match own {
            Some(ron_file::PICKED) => "text, or Choice of texts".into(),
            Some(kind) => kind.to_owned(),
            None if node.schema.contains_key("oneOf") || node.schema.contains_key("enum") => "one of".into(),
            None if node.schema.contains_key("properties") => "fields".into(),
            None => match tuple(node.schema) {
                Some(items) => {
                    let kinds: Vec<String> = items.iter().map(|item| self.kind(item)).collect();
                    if kinds.windows(2).all(|pair| pair[0] == pair[1]) {
                        format!("{} × ({})", kinds.len(), kinds.first().map_or("", String::as_str))
                    } else {
                        format!("({})", kinds.join(", "))
                    }
                }
                None => basic(node.schema).into(),
            },
        };
        format!("{outer}{kind}")
    }
}

fn description(schema: &Object) -> Option<&str> {
    schema.get("description").and_then(Value::as_str)
}

/// Describes a plain JSON type in words.
fn basic(schema: &Object) -> &'static str {
    let named = |name: &str| match schema.get("type") {
        Some(Value::String(one)) => one == name,
        Some(Value::Array(all)) => all.iter().any(|t| t == name),
        _ => false,
    };
    match () {
        () if named("boolean") => "true or false",
        () if named("integer") => "whole number",
        () if named("number") => "number",
        () if named("string") => "text",
        () => "",
    }
}

/// Appends a step to a path.
pub(super) fn joined(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") }
}
