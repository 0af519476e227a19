//! Answers of `explain` to a path.

use super::walk::{Reference, joined};
use furrow_base::ron_file::nearest;
use furrow_base::{Error, Result};

/// Answer to a path.
pub struct Answer {
    /// The section or entry, or a list of paths.
    pub text: String,
    /// Whether several paths end in the name.
    pub is_ambiguous: bool,
}

/// Returns the section or entry of a path; for an empty path, the tree of all paths. A path starts with a kind of file, such as `species`;
/// otherwise the first kind is used. A single name, or the end of a path, is found anywhere; if it is ambiguous, all matches are listed.
pub fn answer(path: &str, references: &[Reference], program: &str) -> Result<Answer> {
    let one = |text: String| Answer { text, is_ambiguous: false };
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let chosen = references.iter().find(|of| of.root == first);
    let Some(default) = chosen.or(references.first()) else { return Ok(one(String::new())) };
    let inside = if chosen.is_some() { rest } else { path };
    if path.is_empty() || chosen.is_some() && rest.is_empty() {
        let others: Vec<&str> = references.iter().map(|of| of.root).filter(|root| *root != default.root).collect();
        let more = match others.as_slice() {
            [] => String::new(),
            of => format!("\nOther files: {program} explain {}\n", of.join(&format!(", {program} explain "))),
        };
        return Ok(one(format!(
            "{}\n\n{}\nDetails of one path: {program} explain PATH\n{more}",
            default.title,
            default.tree()
        )));
    }
    if let Some((section, entry)) = default.find(inside) {
        return Ok(one(default.explain(section, entry)));
    }
    let name = inside.rsplit('.').next().unwrap_or(inside);
    let candidates = if chosen.is_some() { std::slice::from_ref(default) } else { references };
    let found: Vec<(&Reference, String)> =
        candidates.iter().flat_map(|of| of.named(name).into_iter().map(move |path| (of, path))).collect();
    // All steps of the path must match.
    let matches = |path: &str| path == inside || path.ends_with(&format!(".{inside}"));
    let found: Vec<(&Reference, String)> = found.into_iter().filter(|(_, path)| matches(path)).collect();
    match found.as_slice() {
        [(of, path)] => match of.find(path) {
            Some((section, entry)) => Ok(one(of.explain(section, entry))),
            None => Err(unknown(path, "", program)),
        },
        [] => {
            let near = similar(candidates, inside).map(|near| format!("did you mean `{near}`? "));
            Err(unknown(path, &near.unwrap_or_default(), program))
        }
        several => {
            let paths: Vec<String> = several
                .iter()
                .map(|(of, path)| if of.root == default.root { path.clone() } else { joined(of.root, path) })
                .collect();
            let text = format!("{name} occurs in several places:\n  {}\n", paths.join("\n  "));
            Ok(Answer { text, is_ambiguous: true })
        }
    }
}

/// Returns the path that is most similar to `wanted`, or whose last step is most similar to that of `wanted`.
fn similar(candidates: &[Reference], wanted: &str) -> Option<String> {
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let paths: Vec<String> = candidates.iter().flat_map(Reference::paths).collect();
    let steps: Vec<String> = paths.iter().map(|path| last(path)).collect();
    nearest(&paths, wanted).map(str::to_owned).or_else(|| {
        let near = nearest(&steps, &last(wanted))?;
        steps.iter().position(|step| step == near).map(|i| paths[i].clone())
    })
}

fn unknown(path: &str, near: &str, program: &str) -> Error {
    Error::misuse(format!("there is no `{path}`")).help(format!("{near}`{program} explain` lists all paths"))
}
