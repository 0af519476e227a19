//! Comma-separated values: a header row, then rows of text, quoted where necessary. Source: RFC 4180.

use csv::{Terminator, WriterBuilder};

/// Line ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// LF, as Unix tools expect.
    Lf,
    /// CR LF, as in RFC 4180.
    CrLf,
}

/// Formats a table. Every row has one field for each entry of `heads`.
///
/// # Panics
///
/// If a row has a different number of fields than `heads`.
pub fn csv<S: AsRef<str>>(heads: &[S], rows: impl IntoIterator<Item = Vec<String>>, lines: Lines) -> String {
    let terminator = match lines {
        Lines::Lf => Terminator::Any(b'\n'),
        Lines::CrLf => Terminator::CRLF,
    };
    let mut out = WriterBuilder::new().terminator(terminator).from_writer(Vec::new());
    out.write_record(heads.iter().map(|head| head.as_ref().as_bytes())).expect("writing to memory cannot fail");
    for row in rows {
        out.write_record(&row).expect("a row has one field per header");
    }
    String::from_utf8(out.into_inner().expect("writing to memory cannot fail"))
        .expect("fields are strings, so their bytes are UTF-8")
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
