//! Text of USD layers (`.usda`): prims, attributes and values.
//!
//! Numbers are the shortest decimals that give the same bits when they are read, also by way of double precision, as
//! OpenUSD reads them. Names are ASCII, which all versions read; OpenUSD before 24.03 refuses others.

use furrow_base::math::DMat4;
use std::collections::BTreeSet;
use std::fmt::{Display, Write};

/// Width of one level of indentation.
const INDENT: usize = 4;

/// Part of a layer under construction.
pub(super) struct Text {
    out: String,
    depth: usize,
}

impl Text {
    /// Begins a layer with these lines of metadata.
    pub(super) fn layer(metadata: &[String]) -> Self {
        let mut text = Self { out: "#usda 1.0\n".into(), depth: 0 };
        text.line("(");
        text.depth += 1;
        for line in metadata {
            text.line(line);
        }
        text.depth -= 1;
        text.line(")");
        text
    }

    /// Begins prims that are `depth` levels below the root of their layer.
    pub(super) fn at(depth: usize) -> Self {
        Self { out: String::new(), depth }
    }

    /// Returns the end of a prim that is `depth` levels below the root of its layer.
    pub(super) fn end(depth: usize) -> Self {
        let mut text = Self::at(depth);
        text.line("}");
        text
    }

    /// Begins a prim with a type, a name and metadata.
    pub(super) fn open(&mut self, kind: &str, name: &str, metadata: &[String]) {
        self.line_with(format_args!("def {kind} {}", quoted(name)), metadata);
        self.line("{");
        self.depth += 1;
    }

    /// Ends the prim that was begun last.
    pub(super) fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    /// Adds an attribute or a relationship: type and name, and the value.
    pub(super) fn set(&mut self, what: &str, value: impl Display) {
        self.line(format_args!("{what} = {value}"));
    }

    /// Adds an attribute with one value for each vertex.
    pub(super) fn set_vertices(&mut self, what: &str, value: impl Display, metadata: &[&str]) {
        let more = metadata.iter().map(ToString::to_string);
        let metadata: Vec<String> = ["interpolation = \"vertex\"".to_owned()].into_iter().chain(more).collect();
        self.line_with(format_args!("{what} = {value}"), &metadata);
    }

    /// Adds a line.
    pub(super) fn line(&mut self, line: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.out, "{:width$}{line}", "", width = self.depth * INDENT);
    }

    /// Adds text that was begun at this depth.
    pub(super) fn append(&mut self, other: &Self) {
        self.out += &other.out;
    }

    /// Returns the text.
    pub(super) fn bytes(&self) -> &[u8] {
        self.out.as_bytes()
    }

    /// Adds a line with metadata, which begin on it: OpenUSD does not read them from the next line.
    fn line_with(&mut self, line: impl Display, metadata: &[String]) {
        if metadata.is_empty() {
            return self.line(line);
        }
        self.line(format_args!("{line} ("));
        self.depth += 1;
        for line in metadata {
            self.line(line);
        }
        self.depth -= 1;
        self.line(")");
    }
}

/// Returns a string or token in quotes.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out += "\\\"",
            '\\' => out += "\\\\",
            '\n' => out += "\\n",
            '\r' => out += "\\r",
            '\t' => out += "\\t",
            c if c.is_ascii_control() => {
                // Writing to a string cannot fail.
                let _ = write!(out, "\\x{:02x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out + "\""
}

/// Returns a list of strings or tokens.
pub(super) fn quoted_list<'a>(of: impl IntoIterator<Item = &'a str>) -> String {
    format!("[{}]", of.into_iter().map(quoted).collect::<Vec<_>>().join(", "))
}

/// Returns the name of a prim or joint: letters, digits and underscores, not beginning with a digit.
pub(super) fn identifier(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| !c.is_ascii_digit()) { plain } else { format!("_{plain}") }
}

/// Names below one prim or joint, each used once.
#[derive(Default)]
pub(super) struct Names {
    used: BTreeSet<String>,
}

impl Names {
    /// Returns the identifier of a name; later ones of the same name get a number, from 2.
    pub(super) fn unique(&mut self, name: &str) -> String {
        let plain = identifier(name);
        let numbered = (2..).map(|k| format!("{plain}_{k}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|name| !self.used.contains(name));
        let name = free.unwrap_or(plain);
        self.used.insert(name.clone());
        name
    }
}

/// Returns a number.
pub(super) fn number(value: f32) -> String {
    let mut out = String::new();
    push_number(&mut out, value);
    out
}

/// Returns a vector.
pub(super) fn tuple(of: &[f32]) -> String {
    let mut out = String::new();
    push_tuple(&mut out, of);
    out
}

/// Returns an array of vectors.
pub(super) fn tuples<const N: usize>(of: impl IntoIterator<Item = [f32; N]>) -> String {
    array(of, |out, tuple| push_tuple(out, &tuple))
}

/// Returns an array of numbers.
pub(super) fn numbers(of: impl IntoIterator<Item = f32>) -> String {
    array(of, push_number)
}

/// Returns an array of whole numbers.
pub(super) fn integers(of: impl IntoIterator<Item = u32>) -> String {
    array(of, |out, value| {
        let _ = write!(out, "{value}");
    })
}

/// Returns a matrix. Its rows are the columns here: USD multiplies row vectors.
pub(super) fn matrix(of: &DMat4) -> String {
    let rows = of.to_cols_array_2d().map(|[x, y, z, w]| format!("({x}, {y}, {z}, {w})"));
    format!("( {} )", rows.join(", "))
}

/// Returns an array of matrices.
pub(super) fn matrices(of: impl IntoIterator<Item = DMat4>) -> String {
    array(of, |out, value| *out += &matrix(&value))
}

/// Returns an array without spaces, which would be a tenth of a field's files.
fn array<T>(of: impl IntoIterator<Item = T>, mut push: impl FnMut(&mut String, T)) -> String {
    let mut out = String::from("[");
    for (k, item) in of.into_iter().enumerate() {
        if k > 0 {
            out.push(',');
        }
        push(&mut out, item);
    }
    out.push(']');
    out
}

fn push_tuple(out: &mut String, of: &[f32]) {
    for (k, value) in of.iter().enumerate() {
        out.push(if k == 0 { '(' } else { ',' });
        push_number(out, *value);
    }
    out.push(')');
}

/// Appends the shortest decimal of a finite number. Negative zero keeps its sign only with a decimal point.
fn push_number(out: &mut String, value: f32) {
    let size = value.abs();
    let _ = if value == 0.0 && value.is_sign_negative() {
        write!(out, "-0.0")
    } else if value == 0.0 || (1e-4..1e6).contains(&size) {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Expected: every finite number of any magnitude keeps its bits. OpenUSD reads double precision and rounds.
        #[test]
        fn numbers_keep_their_bits(bits in any::<u32>()) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            let text = number(value);
            let read: f64 = text.parse().unwrap();
            #[expect(clippy::cast_possible_truncation, reason = "as OpenUSD does")]
            let rounded = read as f32;
            prop_assert_eq!(rounded.to_bits(), bits, "{}", text);
            prop_assert!(text.len() <= 16, "{}", text);
        }

        /// Expected: identifiers match [A-Za-z_][A-Za-z0-9_]*, whatever the name.
        #[test]
        fn every_name_becomes_an_identifier(name in ".*") {
            let plain = identifier(&name);
            prop_assert!(plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'));
            prop_assert!(plain.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'));
        }
    }

    #[test]
    fn special_numbers_are_short() {
        let of = [0.0, -0.0, 1.0, -3.0, 0.1, 1e-7, 1.5e30, f32::MIN_POSITIVE, 16_777_216.0];
        let expected = ["0", "-0.0", "1", "-3", "0.1", "1e-7", "1.5e30", "1.1754944e-38", "1.6777216e7"];
        assert_eq!(of.map(number), expected);
        assert_eq!(tuples([[1.0, 0.5], [-0.0, 2.0]]), "[(1,0.5),(-0.0,2)]");
        assert_eq!(integers([]), "[]");
    }

    #[test]
    fn names_are_made_valid_and_distinct() {
        assert_eq!(["stem 2.1", "3 leaf", "", "Rübe"].map(identifier), ["stem_2_1", "_3_leaf", "_", "R_be"]);
        let mut names = Names::default();
        let of = ["stone", "stone", "stone 2", "stone"].map(|name| names.unique(name));
        assert_eq!(of, ["stone", "stone_2", "stone_2_2", "stone_3"]);
    }

    #[test]
    fn strings_are_escaped() {
        assert_eq!(quoted("a \"b\" \\ c\nd\te\u{1}é"), "\"a \\\"b\\\" \\\\ c\\nd\\te\\x01é\"");
        assert_eq!(quoted_list(["a", "b\""]), "[\"a\", \"b\\\"\"]");
    }

    #[test]
    fn prims_are_nested() {
        let mut text = Text::layer(&["upAxis = \"Z\"".into()]);
        text.open("Xform", "field", &[]);
        let mut inner = Text::at(1);
        inner.open("Mesh", "leaf_1", &["kind = \"component\"".into()]);
        inner.set("int a", 1);
        inner.close();
        text.append(&inner);
        text.close();
        let expected = "#usda 1.0\n(\n    upAxis = \"Z\"\n)\ndef Xform \"field\"\n{\n    def Mesh \"leaf_1\" (\n        \
                        kind = \"component\"\n    )\n    {\n        int a = 1\n    }\n}\n";
        assert_eq!(text.out, expected);
        assert_eq!(Text::end(1).bytes(), b"    }\n");
    }
}
