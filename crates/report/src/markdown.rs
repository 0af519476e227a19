//! Escaping of foreign text in Markdown, so that it renders literally. Source: CommonMark 0.31, §2.4 and §6.1.

/// Escapes text for a line or a table cell.
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

/// Formats text as an inline code span.
pub fn code(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let longest = text.split(|c| c != '`').map(str::len).max().unwrap_or(0);
    let fence = "`".repeat(longest + 1);
    // A space separates backticks of the text from those of the fence.
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
