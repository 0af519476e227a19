//! Comma-separated values: a row of heads, then rows of text, quoted where they must be. Source: RFC 4180.

use csv::{Terminator, WriterBuilder};

/// How lines end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// LF, as Unix tools expect.
    Lf,
    /// CR LF, as RFC 4180 has it.
    CrLf,
}

/// The text of a table with one field for each head in every row.
///
/// # Panics
///
/// If a row has more or fewer fields than there are heads.
pub fn csv<S: AsRef<str>>(heads: &[S], rows: impl IntoIterator<Item = Vec<String>>, lines: Lines) -> String {
    let terminator = match lines {
        Lines::Lf => Terminator::Any(b'\n'),
        Lines::CrLf => Terminator::CRLF,
    };
    let mut out = WriterBuilder::new().terminator(terminator).from_writer(Vec::new());
    out.write_record(heads.iter().map(|head| head.as_ref().as_bytes())).expect("memory takes every row");
    for row in rows {
        out.write_record(&row).expect("as many fields as heads");
    }
    String::from_utf8(out.into_inner().expect("memory takes every row")).expect("fields are text")
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
