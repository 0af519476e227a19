//! Formatting of numbers for pages.

use furrow_base::math::{RoundTo, ToInt};

/// Formats a whole number with narrow spaces between groups of three digits.
pub fn whole(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // Narrow no-break space.
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Formats a number with three significant digits, without an exponent.
pub fn number(x: f64) -> String {
    if x.abs() >= 999.5 {
        let sign = if x < 0.0 { "−" } else { "" };
        return format!("{sign}{}", whole(x.abs().round_to::<u64>()));
    }
    if x == 0.0 || x.abs() < 5e-7 {
        return "0".into();
    }
    let digits = (2 - x.abs().log10().floor_to::<i32>()).clamp(0, 6).to_usize();
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// Formats a fraction as a percentage.
pub fn percent(share: f64) -> String {
    format!("{}\u{202f}%", number(100.0 * share))
}

/// Formats a count with its noun: `1 image`, `2 images`.
pub fn count(n: u64, one: &str, many: &str) -> String {
    format!("{} {}", whole(n), if n == 1 { one } else { many })
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
    }
}
