//! Suggestions for misspelt names, and lists of the valid ones, for help texts of errors.

/// Builds the help "fields are a, b, c", preceded by "did you mean …" if one of the names is close to `found`.
pub fn choose(what: &str, expected: &[&str], found: &str) -> String {
    let near = nearest(expected, found);
    if expected.is_empty() {
        return format!("there are no {what}");
    }
    let all = expected.join(", ");
    match near {
        Some(e) => format!("did you mean `{e}`? {what} are {all}"),
        None => format!("{what} are {all}"),
    }
}

/// Returns the known name closest to `found`; `None` if none is similar.
pub fn nearest<'a, S: AsRef<str>>(known: &'a [S], found: &str) -> Option<&'a str> {
    // Among equally close names prefer one with the same initial: `weeds`, not `seed`, for `weed`.
    let unlike = |known: &str| known.chars().next() != found.chars().next();
    let most = |known: &str| 1 + known.len() / 4;
    // The distance is at least the difference in length, and takes time proportional to the product of the lengths.
    let letters = found.chars().count();
    let comparable = known.iter().map(AsRef::as_ref).filter(|k| letters.abs_diff(k.chars().count()) <= most(k));
    let near = comparable.map(|k| (strsim::levenshtein(k, found), unlike(k), k)).min();
    near.filter(|(d, _, k)| *d <= most(k)).map(|(_, _, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_nearly_right_is_found_and_no_other() {
        assert_eq!(nearest(&["elevation_deg", "azimuth_deg"], "azimut_deg"), Some("azimuth_deg"));
        assert_eq!(nearest(&["kitten"], "sitting"), None);
        assert_eq!(nearest(&["seed", "weeds"], "weed"), Some("weeds"));
        assert_eq!(choose("sizes", &["small", "large"], "smal"), "did you mean `small`? sizes are small, large");
        assert_eq!(choose("sizes", &[], "smal"), "there are no sizes");
    }

    /// Expected: a text of the size of a file is compared in no time; the full distances would take minutes.
    #[test]
    fn a_long_name_is_not_compared() {
        let known: Vec<String> = (0..1000).map(|i| format!("name_of_a_field_{i}")).collect();
        let begin = std::time::Instant::now();
        assert_eq!(nearest(&known, &"x".repeat(1_000_000)), None);
        assert!(begin.elapsed() < std::time::Duration::from_secs(10), "{:?}", begin.elapsed());
    }
}
