//! Comma-separated values: a row of heads, then rows of text, quoted where they must be. Source: RFC 4180.

/// How lines end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// LF, as Unix tools expect.
    Lf,
    /// CR LF, as RFC 4180 has it.
    CrLf,
}

/// The text of a table with one field for each head in every row.
pub fn csv<S: AsRef<str>>(heads: &[S], rows: impl IntoIterator<Item = Vec<String>>, lines: Lines) -> String {
    let end = if lines == Lines::Lf { "\n" } else { "\r\n" };
    let line = |fields: Vec<String>| fields.join(",") + end;
    let head = line(heads.iter().map(|head| field(head.as_ref())).collect());
    rows.into_iter().fold(head, |out, row| out + &line(row.iter().map(|text| field(text)).collect()))
}

/// A field, in quotes where it must be.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\r', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        let rows = [vec!["a,b".to_owned(), "say \"x\"".into()], vec![String::new(), "1".into()]];
        assert_eq!(csv(&["p", "q"], rows, Lines::Lf), "p,q\n\"a,b\",\"say \"\"x\"\"\"\n,1\n");
    }
}
