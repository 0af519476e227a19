//! XML elements, written with indentation and escapes.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesStart, BytesText, Event};

/// Spaces per indentation level.
const INDENT: usize = 4;

/// Element with its attributes and children.
#[derive(Clone, Debug)]
pub(super) struct Element {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Node>,
}

#[derive(Clone, Debug)]
enum Node {
    Element(Element),
    Comment(String),
}

#[expect(clippy::needless_pass_by_value, reason = "accepts numbers and texts by value")]
impl Element {
    /// Creates an empty element.
    pub(super) fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), children: Vec::new() }
    }

    /// Creates a plugin: `<tag type="kind">`.
    pub(super) fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).with("type", kind)
    }

    /// Creates a property: `<tag name="…" value="…"/>`.
    pub(super) fn property(tag: &'static str, name: &str, value: impl ToString) -> Self {
        Self::new(tag).with("name", name).with("value", value)
    }

    /// Adds an attribute.
    #[must_use]
    pub(super) fn with(mut self, name: &'static str, value: impl ToString) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// Appends child elements.
    #[must_use]
    pub(super) fn inside(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children.into_iter().map(Node::Element));
        self
    }

    /// Adds a float property.
    #[must_use]
    pub(super) fn float(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("float", name, value)])
    }

    /// Adds an integer property.
    #[must_use]
    pub(super) fn integer(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("integer", name, value)])
    }

    /// Adds a boolean property.
    #[must_use]
    pub(super) fn boolean(self, name: &str, value: bool) -> Self {
        self.inside([Self::property("boolean", name, value)])
    }

    /// Adds a string property.
    #[must_use]
    pub(super) fn string(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("string", name, value)])
    }

    /// Appends a comment.
    #[must_use]
    pub(super) fn comment(mut self, text: &str) -> Self {
        // Two hyphens are not allowed in a comment.
        self.children.push(Node::Comment(text.replace("--", "- -")));
        self
    }

    /// Returns the document.
    pub(super) fn document(&self) -> String {
        let mut out = Writer::new_with_indent(Vec::new(), b' ', INDENT);
        let declaration = Event::Decl(BytesDecl::new("1.0", Some("utf-8"), None));
        out.write_event(declaration).and_then(|()| self.write(&mut out, 0)).expect("writing to memory succeeds");
        String::from_utf8(out.into_inner()).expect("tags, names and values are strings, so their bytes are UTF-8")
            + "\n"
    }

    fn write(&self, out: &mut Writer<Vec<u8>>, depth: usize) -> std::io::Result<()> {
        let attributes = self.attributes.iter().map(|(name, value)| (*name, value.as_str()));
        let start = BytesStart::new(self.tag).with_attributes(attributes);
        if self.children.is_empty() {
            return out.write_event(Event::Empty(start));
        }
        let end = start.to_end().into_owned();
        out.write_event(Event::Start(start))?;
        for child in &self.children {
            match child {
                Node::Element(e) => e.write(out, depth + 1)?,
                Node::Comment(text) => {
                    let indent = " ".repeat(INDENT * (depth + 1));
                    let text = text.lines().collect::<Vec<_>>().join(&format!("\n{indent}     "));
                    out.write_event(Event::Comment(BytesText::from_escaped(format!(" {text} "))))?;
                }
            }
        }
        out.write_event(Event::End(end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_would_misread_is_escaped() {
        let e = Element::plugin("scene", "a<b & \"c\"").comment("one -- two\nthree").float("x", 0.5);
        let expected = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<scene type=\"a&lt;b &amp; &quot;c&quot;\">\n    \
                        <!-- one - - two\n         three -->\n    <float name=\"x\" value=\"0.5\"/>\n</scene>\n";
        assert_eq!(e.document(), expected);
    }
}
