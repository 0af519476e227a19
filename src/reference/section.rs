//! One type of value, as readers see it: its words, and its fields or variants.

/// A field, or a variant of a value that has several forms.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its name in files.
    pub name: String,
    /// What may stand there: `number or distribution`, `text`, `list of …`; empty for a variant that is its name alone.
    pub kind: String,
    /// Path of the section that says more, where there is one.
    pub section: Option<String>,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// What a number must be, after "must be"; empty for what is no number.
    pub range: String,
    /// Its default as it would be written; `None` where it must be given.
    pub default: Option<String>,
    /// What it means.
    pub words: String,
    /// How it may be written.
    pub example: String,
    /// Whether it is a variant.
    pub variant: bool,
}

/// A type of value with fields or variants, named by the path where it is met first.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// The path, such as `soil.clods`; empty for the whole file.
    pub path: String,
    /// Other paths that lead to the same type.
    pub also: Vec<String>,
    /// What it is, in paragraphs.
    pub words: String,
    /// Its fields or variants.
    pub entries: Vec<Entry>,
}

impl Section {
    /// Whether it is a value that has one of several forms.
    pub fn has_variants(&self) -> bool {
        self.entries.iter().any(|entry| entry.variant)
    }

    /// An entry by its name.
    pub fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }
}

/// The unit that a field's name tells: by its end where the table has a `_` before it, else by the whole name.
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

/// Doc comments as readers see them: no code, no links, one line a paragraph.
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

/// `` [`name`] `` and `` [`name`](target) `` as `` `name` ``.
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
