//! Elements of an XML document, written with indents and escapes.

use std::fmt::Write;

/// An element with its attributes and what stands in it.
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

#[expect(clippy::needless_pass_by_value, reason = "numbers and texts alike, as they come")]
impl Element {
    /// An empty element.
    pub(super) fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), children: Vec::new() }
    }

    /// A plugin: `<tag type="kind">`.
    pub(super) fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).with("type", kind)
    }

    /// A property: `<tag name="…" value="…"/>`.
    pub(super) fn property(tag: &'static str, name: &str, value: impl ToString) -> Self {
        Self::new(tag).with("name", name).with("value", value)
    }

    /// With an attribute.
    #[must_use]
    pub(super) fn with(mut self, name: &'static str, value: impl ToString) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// With elements inside, behind those that are there.
    #[must_use]
    pub(super) fn inside(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children.into_iter().map(Node::Element));
        self
    }

    /// With a float property.
    #[must_use]
    pub(super) fn float(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("float", name, value)])
    }

    /// With an integer property.
    #[must_use]
    pub(super) fn integer(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("integer", name, value)])
    }

    /// With a truth value.
    #[must_use]
    pub(super) fn boolean(self, name: &str, value: bool) -> Self {
        self.inside([Self::property("boolean", name, value)])
    }

    /// With a text property.
    #[must_use]
    pub(super) fn string(self, name: &str, value: impl ToString) -> Self {
        self.inside([Self::property("string", name, value)])
    }

    /// With a comment, behind what is there.
    #[must_use]
    pub(super) fn comment(mut self, text: &str) -> Self {
        // Two hyphens end a comment.
        self.children.push(Node::Comment(text.replace("--", "- -")));
        self
    }

    /// The document.
    pub(super) fn document(&self) -> String {
        let mut out = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
        self.write(&mut out, 0);
        out
    }

    fn write(&self, out: &mut String, depth: usize) {
        let indent = "    ".repeat(depth);
        let _ = write!(out, "{indent}<{}", self.tag);
        for (name, value) in &self.attributes {
            let _ = write!(out, " {name}=\"{}\"", escape(value));
        }
        if self.children.is_empty() {
            out.push_str("/>\n");
            return;
        }
        out.push_str(">\n");
        for child in &self.children {
            match child {
                Node::Element(e) => e.write(out, depth + 1),
                Node::Comment(text) => {
                    let inner = "    ".repeat(depth + 1);
                    let text = text.lines().collect::<Vec<_>>().join(&format!("\n{inner}     "));
                    let _ = writeln!(out, "{inner}<!-- {text} -->");
                }
            }
        }
        let _ = writeln!(out, "{indent}</{}>", self.tag);
    }
}

/// Text as an attribute's value holds it.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
