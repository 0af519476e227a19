//! Section of a reference: the description of one type, with its fields or variants.

/// A field of a struct, or a variant of an enum.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name in files.
    pub name: String,
    /// Kind of value: `number or distribution`, `text`, `list of …`; empty for a unit variant.
    pub kind: String,
    /// Path of the section that describes the value's type, if there is one.
    pub section: Option<String>,
    /// Unit; empty if there is none.
    pub unit: &'static str,
    /// Range of a number, worded to follow "must be"; empty if the value is not a number.
    pub range: String,
    /// Default in RON; `None` if the field is required.
    pub default: Option<String>,
    /// Description.
    pub words: String,
    /// Example in RON.
    pub example: String,
    /// Whether the entry is a variant.
    pub variant: bool,
}

/// A type with fields or variants, named by the first path that leads to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Path, such as `soil.clods`; empty for the whole file.
    pub path: String,
    /// Other paths that lead to the same type.
    pub also: Vec<String>,
    /// Description, in paragraphs.
    pub words: String,
    /// Fields or variants.
    pub entries: Vec<Entry>,
}

impl Section {
    /// Returns `true` if the type is an enum.
    pub fn has_variants(&self) -> bool {
        self.entries.iter().any(|entry| entry.variant)
    }

    /// Returns the entry with this name.
    pub fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }
}

/// Returns the unit that a field's name implies. Table entries that start with `_` match the end of the name, others the whole name.
pub(super) fn unit(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 18] = [
        ("_m_s", "m/s"),
        ("_per_m2", "m⁻²"),
        ("per_m2", "m⁻²"),
        ("_m", "m"),
        ("_mm", "mm"),
        ("_um", "µm"),
        ("_deg", "°"),
        ("_px", "px"),
        ("_ms", "ms"),
        ("_h", "h"),
        ("_klx", "klx"),
        ("days", "days"),
        ("AgeDays", "days"),
        ("chlorophyll", "µg/cm²"),
        ("carotenoid", "µg/cm²"),
        ("anthocyanin", "µg/cm²"),
        ("water", "cm"),
        ("dry_matter", "g/cm²"),
    ];
    let is = |of: &str| if of.starts_with('_') { name.ends_with(of) } else { name == of };
    UNITS.iter().find(|(of, _)| is(of)).map_or("", |(_, unit)| unit)
}

/// Converts a doc comment to plain text: without code blocks and links, one line per paragraph.
pub(super) fn prose(description: &str) -> String {
    let mut code = false;
    let mut paragraphs = vec![String::new()];
    for line in description.lines().map(str::trim) {
        if line.starts_with("```") {
            code = !code;
        } else if !code && line.is_empty() {
            paragraphs.push(String::new());
        } else if let Some(paragraph) = paragraphs.last_mut().filter(|_| !code) {
            if !paragraph.is_empty() {
                paragraph.push(' ');
            }
            paragraph.push_str(line);
        }
    }
    paragraphs.retain(|p| !p.is_empty());
    unlinked(&paragraphs.join("\n\n"))
}

/// Replaces `` [`name`] `` and `` [`name`](target) `` by `` `name` ``.
fn unlinked(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("[`") {
        let Some(end) = rest[at..].find("`]").map(|i| at + i) else { break };
        out.push_str(&rest[..at]);
        let name = &rest[at + 2..end];
        out.push('`');
        out.push_str(name.rsplit("::").next().unwrap_or(name));
        out.push('`');
        rest = &rest[end + 2..];
        if rest.starts_with('(') {
            rest = rest.find(')').map_or("", |i| &rest[i + 1..]);
        }
    }
    out + rest
}
