//! Text of other people in Markdown: read as it is written, whatever it holds. Source: CommonMark 0.31, §2.4 and §6.1.

/// Text in a line or in a cell of a table.
pub fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            c if c.is_control() => out.push(' '),
            '\\' | '`' | '*' | '_' | '[' | ']' | '<' | '>' | '|' | '&' | '~' | '$' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

/// Text as code in a line.
pub fn code(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let longest = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest + 1);
    // A space keeps ticks of the text apart from those around it.
    let space = if text.starts_with('`') || text.ends_with('`') { " " } else { "" };
    format!("{fence}{space}{text}{space}{fence}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_markdown_would_misread_is_escaped() {
        assert_eq!(plain("sugar beet, CC-BY-4.0"), "sugar beet, CC-BY-4.0");
        assert_eq!(plain("a | b\n<img src=x> [y](z) `c`"), r"a \| b \<img src=x\> \[y\](z) \`c\`");
        assert_eq!(code("scene/a.ron"), "`scene/a.ron`");
        assert_eq!(code("a``b\n`"), "``` a``b ` ```");
    }
}
