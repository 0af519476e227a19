//! Assignments: values that replace or add those of a RON text, given by their paths on the command line.

use super::file::RonFile;
use super::place::{Step, find, members, path_at, place};
use super::schema;
use super::spliced::Spliced;
use crate::{Error, Result};
use schemars::JsonSchema;
use std::fmt;
use std::ops::Range;

/// A value and the path of fields and items that it is assigned to, such as `camera.pose.height_m=1.2`.
///
/// Errors about it are shown in its text, as in a file of the name `--set`.
#[derive(Clone, Debug)]
pub struct Assignment {
    page: RonFile,
    /// Byte range of each step of the path: a field name, or an index with its brackets.
    steps: Vec<Range<usize>>,
    /// Byte range of the value.
    value: Range<usize>,
}

impl Assignment {
    /// Splits `PATH=VALUE`. The value is not read yet.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || "write PATH=VALUE, such as camera.height_m=1.2 or crops[0].species=maize".to_owned();
        let (path, value) = text.split_once('=').ok_or_else(wrong)?;
        let steps = steps(path).filter(|steps| !steps.is_empty()).ok_or_else(wrong)?;
        let start = path.len() + 1 + (value.len() - value.trim_start().len());
        let value = start..start + value.trim().len();
        if value.is_empty() {
            return Err(wrong());
        }
        Ok(Self { page: RonFile { path: "--set".into(), text: text.to_owned() }, steps, value })
    }

    /// Returns the path, in the form that [`Quantity::path`](super::Quantity) has.
    pub fn path(&self) -> &str {
        let end = self.steps.last().map_or(0, |step| step.end);
        self.page.text[..end].trim_start()
    }

    /// Returns the text with the value at the path. A field that the text does not have is added, with the structs
    /// around it. `T` is the type of the text: where it has a string, the quotes around the value may be left out.
    pub fn apply<T: JsonSchema>(&self, text: &Spliced) -> Result<Spliced> {
        let mut at = place(&text.page.text, &[]);
        for (k, step) in self.steps.iter().enumerate() {
            match within(&text.page.text, &at, self.step(step)) {
                Some(inner) => at = inner,
                None => return self.add::<T>(text, &at, &self.steps[k..]),
            }
        }
        self.replace::<T>(text, at, &[], &[])
    }

    /// Adds a field to the value at `whole`: the first of the steps, with a struct for each further one.
    fn add<T: JsonSchema>(&self, text: &Spliced, whole: &Range<usize>, steps: &[Range<usize>]) -> Result<Spliced> {
        let inside = members(&text.page.text, whole);
        let value = &text.page.text[whole.clone()];
        let open = value.find(['(', '[', '{']).filter(|open| !value[*open..].starts_with('['));
        let Some(open) = open.filter(|_| inside.iter().all(|(key, _)| key.is_some())) else {
            return Err(self.absent(&steps[0], value, inside.len()));
        };
        if let Some(item) = steps.iter().find(|step| matches!(self.step(step), Step::Item(_))) {
            return Err(self.absent(item, "", 0));
        }
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for (depth, step) in steps.iter().enumerate() {
            if depth > 0 {
                before.push(("(".to_owned(), step.clone()));
                after.push((")".to_owned(), step.clone()));
            }
            let name = &self.page.text[step.clone()];
            let key = if depth == 0 && value[open..].starts_with('{') { format!("{name:?}") } else { name.to_owned() };
            before.extend([(key, step.clone()), (": ".to_owned(), step.clone())]);
        }
        if !inside.is_empty() {
            after.push((", ".to_owned(), self.value.clone()));
        }
        let at = whole.start + open + 1;
        self.replace::<T>(text, at..at, &before, &after)
    }

    /// Returns the error about a step that leads nowhere in `value`, which has `items` members.
    fn absent(&self, step: &Range<usize>, value: &str, items: usize) -> Error {
        let name = &self.page.text[step.clone()];
        let about = |what: String, help: String| self.page.about_bytes(step.clone(), what, help);
        match self.step(step) {
            Step::Item(_) if items == 0 => {
                about(format!("there is no list for {name}"), "give the whole list: […]".into())
            }
            Step::Item(_) => about(format!("there is no item {name}"), format!("there are {items}, counted from [0]")),
            Step::Field(_) if value.starts_with('[') => {
                about(format!("there is a list, which has no field `{name}`"), "name one of its items: [0]".into())
            }
            Step::Field(_) => {
                let value: String = value.chars().take(40).collect();
                about(
                    format!("`{value}` has no field `{name}`"),
                    "leave this step out, and give the whole value".into(),
                )
            }
        }
    }

    /// Replaces the bytes `at` by the value, between generated parts with their byte ranges in the assignment.
    fn replace<T: JsonSchema>(
        &self,
        text: &Spliced,
        at: Range<usize>,
        before: &[(String, Range<usize>)],
        after: &[(String, Range<usize>)],
    ) -> Result<Spliced> {
        let with = |value: String| {
            let parts = before.iter().cloned().chain([(value, self.value.clone())]).chain(after.iter().cloned());
            let parts: Vec<_> = parts.map(|(text, from)| (text, &self.page, from)).collect();
            text.with(at.clone(), &parts)
        };
        let value = &self.page.text[self.value.clone()];
        if !value.contains(['(', '[', '{', '"']) {
            let start = at.start + before.iter().map(|(text, _)| text.len()).sum::<usize>();
            // The names on the path to any word show which type the schema has there.
            if schema::is_text::<T>(&path_at(&with("word".into()).page.text, start)) {
                return Ok(with(ron::ser::to_string(value).unwrap_or_else(|_| format!("{value:?}"))));
            }
        }
        if !RonFile::of(value).is_value() {
            let help = "write it as in a scene file; shells need quotes around brackets: --set 'camera.size=(64, 48)'";
            return Err(self.page.about_bytes(self.value.clone(), "this is not one value", help));
        }
        Ok(with(value.to_owned()))
    }

    fn step(&self, at: &Range<usize>) -> Step<'_> {
        let word = &self.page.text[at.clone()];
        let number = word.strip_prefix('[').and_then(|word| word.strip_suffix(']')?.parse().ok());
        number.map_or(Step::Field(word), Step::Item)
    }
}

/// The text as it was given.
impl fmt::Display for Assignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.page.text.trim())
    }
}

/// Returns the value one step into the value at `whole`. The name of a variant is a step into its only value, and may
/// stand before its fields.
fn within(text: &str, whole: &Range<usize>, step: Step<'_>) -> Option<Range<usize>> {
    if let Some(value) = find(text, whole, step) {
        return Some(value);
    }
    let own = text[whole.clone()].split(['(', '[', '{']).next().map(str::trim);
    match (step, members(text, whole).as_slice()) {
        (Step::Field(name), [(None, value)]) if own == Some(name) => Some(value.clone()),
        (Step::Field(name), _) if own == Some(name) => Some(whole.clone()),
        _ => None,
    }
}

/// Returns the byte ranges of the steps of a path such as `crops[0].rows`; `None` if it is not a path.
fn steps(path: &str) -> Option<Vec<Range<usize>>> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let end = path.trim_end().len();
    let mut at = path.len() - path.trim_start().len();
    let mut all = Vec::new();
    while at < end {
        let rest = &path[at..end];
        let length = if rest.starts_with('[') {
            let close = rest.find(']')?;
            rest[1..close].parse::<usize>().ok()?;
            close + 1
        } else {
            at += usize::from(!all.is_empty() && rest.starts_with('.'));
            path[at..end].find(|c| !is_name(c)).unwrap_or(end - at)
        };
        if length == 0 {
            return None;
        }
        all.push(at..at + length);
        at += length;
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Page {
        camera: Lens,
        crops: Vec<Crop>,
        #[serde(default)]
        soil: Option<Soil>,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    enum Lens {
        Wide { height_m: f64, size: (u32, u32) },
        Named(String),
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Crop {
        species: String,
        #[serde(default)]
        growth: Option<Growth>,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[allow(dead_code)]
    enum Growth {
        Bbch(f64),
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Soil {
        clods: Option<Clods>,
    }

    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Clods {
        min_mm: f64,
    }

    const TEXT: &str = "Page(\n  camera: Wide(height_m: 1, size: (4, 3)), // a lens\n  crops: [(species: \"beet\", growth: Bbch(12))],\n)";

    fn set(assignment: &str) -> Result<String> {
        let text = Spliced::of(RonFile { path: "page.ron".into(), text: TEXT.to_owned() });
        let all = Assignment::parse(assignment).unwrap().apply::<Page>(&text)?;
        all.page.parse_all::<Page>().map_err(|error| all.locate(error))?;
        Ok(all.page.text)
    }

    /// Expected: only the bytes of the value change; what is missing is added; a text needs no quotes.
    #[test]
    fn a_value_is_replaced_or_added() {
        for (assignment, from, to) in [
            ("camera.height_m=1.5", "height_m: 1,", "height_m: 1.5,"),
            ("camera.Wide.height_m = 1.5", "height_m: 1,", "height_m: 1.5,"),
            ("camera.size[1]=5", "(4, 3)", "(4, 5)"),
            ("camera=Named(\"x\")", "Wide(height_m: 1, size: (4, 3))", "Named(\"x\")"),
            ("crops[0].species=sugar beet", "\"beet\"", "\"sugar beet\""),
            ("crops[0].species=\"a=b\"", "\"beet\"", "\"a=b\""),
            ("crops[0].growth.Bbch=14", "Bbch(12)", "Bbch(14)"),
            ("soil.clods.min_mm=4", "Page(", "Page(soil: (clods: (min_mm: 4)), "),
        ] {
            assert_eq!(set(assignment).unwrap(), TEXT.replace(from, to), "{assignment}");
        }
    }

    /// Expected: the caret is under the step or the value at fault, or in the file where that is at fault.
    #[test]
    fn an_error_is_shown_in_the_assignment() {
        for (assignment, begin, help) in [
            ("camera.hight_m=2", "--set:1:8: ", "did you mean `height_m`?"),
            ("crops[0].specis=maize", "--set:1:10: unknown field `specis`", "did you mean `species`?"),
            ("crops[1].species=maize", "--set:1:6: there is no item [1]", "there are 1, counted from [0]"),
            ("crops.species=maize", "--set:1:7: there is a list", "[0]"),
            ("camera.height_m.mean=2", "--set:1:17: `1` has no field `mean`", "whole value"),
            ("soil.clods.min_mm=small", "--set:1:19: ", "a number"),
            ("camera.height_m=1), (", "--set:1:17: this is not one value", "quotes"),
            ("camera.height_m=1 // no", "--set:1:17: this is not one value", "quotes"),
            ("camera.size=(1, \"a)", "--set:1:13: this is not one value", "quotes"),
            ("soil.clods[0]=1", "--set:1:11: there is no list for [0]", "whole list"),
        ] {
            let message = set(assignment).unwrap_err().to_string();
            assert!(message.starts_with(begin) && message.contains(help), "{assignment}: {message}");
        }
    }

    #[test]
    fn what_is_no_path_is_refused() {
        for wrong in ["", "camera", "=1", "a.=1", "a..b=1", "a[x]=1", "a[0=1", ".a=1", "a-b=1", "a="] {
            assert!(Assignment::parse(wrong).is_err(), "{wrong}");
        }
        assert_eq!(Assignment::parse(" a[0].b = 1").unwrap().path(), "a[0].b");
    }
}
