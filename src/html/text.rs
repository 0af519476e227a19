//! Text and numbers as a page shows them.

/// Text that a page shows as it is.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// A whole number, its thousands apart.
pub fn whole(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // Narrow, and no line breaks at it.
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// A number to three digits, without an exponent.
pub fn number(x: f64) -> String {
    if x.abs() >= 999.5 {
        let sign = if x < 0.0 { "−" } else { "" };
        return format!("{sign}{}", whole(x.abs().round() as u64));
    }
    if x == 0.0 || x.abs() < 5e-7 {
        return "0".into();
    }
    let digits = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// A share in percent.
pub fn percent(share: f64) -> String {
    format!("{}\u{202f}%", number(100.0 * share))
}

/// One thing or many.
pub fn count(n: u64, one: &str, many: &str) -> String {
    format!("{} {}", whole(n), if n == 1 { one } else { many })
}

/// A number that the page's readers find by its key.
pub fn keyed(key: &str, value: impl std::fmt::Display, shown: &str) -> String {
    format!("<span data-key=\"{key}\" data-value=\"{value}\">{shown}</span>")
}

/// A table of what is what: `<dl>` with a row for each pair of a name and HTML.
pub fn pairs(rows: &[(&str, String)]) -> String {
    let row = |(name, value): &(&str, String)| format!("<dt>{}</dt><dd>{value}</dd>", escape(name));
    format!("<dl class=\"pairs\">{}</dl>", rows.iter().map(row).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_exact_enough() {
        let shown = [0.0, 0.12345, 1.0, 12.34, 123.4, 1234.0, 0.000012, -3.5, 999.7].map(number);
        let expected = ["0", "0.123", "1", "12.3", "123", "1\u{202f}234", "0.000012", "−3.5", "1\u{202f}000"];
        assert_eq!(shown, expected);
        assert_eq!(whole(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(0.5), "50\u{202f}%");
        assert_eq!(escape("<a href='x'>&\"</a>"), "&lt;a href=&#39;x&#39;&gt;&amp;&quot;&lt;/a&gt;");
    }
}
