//! Numbers of a scene file as sliders: previews of the field with other values, and writing a value into the file.

use furrow_base::ron_file::{Assignment, Distribution, Limits, Quantity, Value, limits, quantities};
use furrow_base::{Error, Result};
use furrow_field::desc::FieldDesc;
use furrow_job::SceneFile;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Number of steps of a slider over a continuous range.
const STEPS: f64 = 200.0;
/// Range of a slider for a normal distribution, in standard deviations from its centre.
const BELL: f64 = 3.0;

/// Largest ratio of a number's limits to twice its value with which its slider has the range of the limits. Wider limits,
/// such as those of lengths, would leave the usual values on a few pixels of it.
const WIDEST: f64 = 100.0;

/// One number of the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Slider {
    /// Path of fields and items that leads to it.
    path: String,
    /// Its text in the file.
    says: String,
    /// Line in the file, from 1.
    line: usize,
    /// `true` if it is a distribution, sampled for every field.
    drawn: bool,
    /// Range of the slider.
    low: f64,
    high: f64,
    step: f64,
    /// Initial position.
    at: f64,
    /// Allowed values, for a choice; empty for a continuous range.
    values: Vec<f64>,
}

/// Returns the sliders of a text, those of distributions first. Numbers that the command line assigns have none.
pub(super) fn sliders(text: &str, assigned: &[Assignment]) -> Vec<Slider> {
    let within = |path: &str, outer: &str| {
        path.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    let free = |q: &Quantity| assigned.iter().all(|value| !within(&q.path, value.path()));
    let numbers = quantities(text);
    let limits = limits::<FieldDesc>(&numbers);
    let free = numbers.iter().zip(limits).filter(|(quantity, _)| free(quantity));
    let mut all: Vec<Slider> = free.filter_map(|(quantity, limits)| slider(text, quantity, limits)).collect();
    all.sort_by_key(|slider| !slider.drawn);
    all
}

/// Returns the slider of a number with these limits.
fn slider(text: &str, quantity: &Quantity, limits: Option<Limits>) -> Option<Slider> {
    let says = text[quantity.at.clone()].to_owned();
    let line = text[..quantity.at.start].matches('\n').count() + 1;
    // Whole numbers, if written without a decimal point.
    let whole = !says.contains('.');
    let mut values = Vec::new();
    let (drawn, low, high, at) = match &quantity.value {
        // The seed has its own control in the page.
        Value::Fixed { .. } if quantity.path == "seed" => return None,
        Value::Fixed { number, whole } => {
            let [low, high] = range(quantity, *number, *whole, limits);
            (false, low, high, *number)
        }
        Value::Drawn(Distribution::Uniform(low, high)) => (true, *low, *high, f64::midpoint(*low, *high)),
        Value::Drawn(Distribution::Normal { mean, sd, min, max }) => {
            (true, (mean - BELL * sd).max(*min), (mean + BELL * sd).min(*max), mean.max(*min).min(*max))
        }
        Value::Drawn(Distribution::LogNormal { median, sigma, min, max }) => {
            let reach = (BELL * sigma).exp();
            (true, (median / reach).max(*min), (median * reach).min(*max), median.max(*min).min(*max))
        }
        Value::Drawn(Distribution::Choice(of)) => {
            values.clone_from(of);
            (true, 0.0, 0.0, *of.first()?)
        }
        Value::Drawn(Distribution::Weighted(of)) => {
            values = of.iter().map(|(value, _)| *value).collect();
            (true, 0.0, 0.0, *values.first()?)
        }
    };
    if !(low.is_finite() && high.is_finite() && low <= high) {
        return None;
    }
    let step = if whole && high - low >= 2.0 { 1.0 } else { ((high - low) / STEPS).max(1e-9) };
    let at = if step == 1.0 { at.round() } else { at };
    Some(Slider { path: quantity.path.clone(), says, line, drawn, low, high, step, at, values })
}

/// Returns the range of the slider of a fixed number: its limits, or within them up to twice the number if they are much
/// wider.
fn range(quantity: &Quantity, number: f64, whole: bool, limits: Option<Limits>) -> [f64; 2] {
    let far = if number == 0.0 { 1.0 } else { 2.0 * number.abs() };
    let far = if whole { far.max(10.0) } else { far };
    let usual = [if number < 0.0 { -far } else { 0.0 }, far];
    let Some(Limits { min, max, above_min }) = limits else { return usual };
    // All values of an angle are usual.
    let all = quantity.path.ends_with("_deg") || max - min <= WIDEST * far;
    let least = if min < 0.0 { -far } else { usual[0] };
    let [low, high] = if all { [min, max] } else { [least.max(min), far.min(max)] };
    [if above_min && low <= min { low + (high - low) / STEPS } else { low }, high]
}

/// Returns an error about the first of these values that has no slider, so that nothing is shown that is not rendered.
pub(super) fn check_paths(sliders: &[Slider], values: &BTreeMap<String, f64>) -> Result<()> {
    match values.keys().find(|path| !has(sliders, path)) {
        Some(path) => Err(Error::misuse(format!("the scene file has no number `{path}`"))
            .help("the page lists all numbers of the file; reload it after the file has changed")),
        None => Ok(()),
    }
}

/// Returns `true` if one of the sliders is that of this path.
pub(super) fn has(sliders: &[Slider], path: &str) -> bool {
    sliders.iter().any(|slider| slider.path == path)
}

/// Replaces the values at these paths in the text. Paths that do not exist are ignored.
pub(super) fn with(text: &str, values: &BTreeMap<String, f64>) -> String {
    let mut new = text.to_owned();
    // From the end, so that earlier byte offsets stay valid.
    for Quantity { path, at, .. } in quantities(text).into_iter().rev() {
        if let Some(value) = values.get(&path) {
            new.replace_range(at, &value.to_string());
        }
    }
    new
}

/// Replaces one value in the scene file and changes no other byte. `seen` is the text that the user saw; if the file
/// has changed since, it is not written.
pub(super) fn write(file: &Path, path: &str, value: f64, seen: &str) -> Result<String> {
    // Resolve links, so that the link itself is kept.
    let file = &file.canonicalize().map_err(Error::reading(file))?;
    let mark = unchanged(file, seen)?;
    let new = with(seen, &BTreeMap::from([(path.to_owned(), value)]));
    if !quantities(seen).iter().any(|q| q.path == path) {
        return Err(Error::input(format!("the file has no number `{path}`; nothing was written")).in_file(file));
    }
    check(file, &new)?;
    let permissions = fs::metadata(file).map_err(Error::reading(file))?.permissions();
    let mut whole = furrow_output::FileSet::default();
    whole.add(file, &[mark.as_slice(), new.as_bytes()].concat())?;
    // Check again as late as possible, because an editor may have saved meanwhile.
    unchanged(file, seen)?;
    if whole.finish()?.is_none() {
        return Err(Error::failed("the temporary file was removed; nothing was written").in_file(file));
    }
    fs::set_permissions(file, permissions).map_err(Error::io(file))?;
    Ok(new)
}

/// Returns an error if the new text is invalid, for example because a number is out of range, while the present one is
/// valid.
fn check(file: &Path, new: &str) -> Result<()> {
    let Ok(scene) = SceneFile::open(file) else { return Ok(()) };
    let refused = scene.reread(Some(new)).err();
    refused.map_or(Ok(()), |e| Err(Error::input(format!("{}; nothing was written", e.message())).in_file(file)))
}

/// Returns the byte order mark of the file if its text is unchanged; an error otherwise.
fn unchanged(file: &Path, seen: &str) -> Result<Vec<u8>> {
    let bytes = fs::read(file).map_err(Error::reading(file))?;
    let mark: &[u8] = b"\xef\xbb\xbf";
    let (mark, text) = bytes.strip_prefix(mark).map_or((&mark[..0], &bytes[..]), |rest| (mark, rest));
    if text == seen.as_bytes() {
        return Ok(mark.to_vec());
    }
    Err(Error::input("the file has changed since; nothing was written").in_file(file))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "Field( // a field\r\n  seed: 7,\r\n  camera: JaiAd130(height_m: Normal(mean: 0.9, sd: 0.1, min: 0.7), yaw_deg: -4),\r\n  crops: [(growth: Bbch(Choice([12, 14])), n: Uniform(1, 9))], // end\r\n)";

    #[test]
    fn sliders_reach_what_may_be_drawn() {
        let all = sliders(TEXT, &[]);
        let paths: Vec<&str> = all.iter().map(|s| s.path.as_str()).collect();
        assert_eq!(paths, ["camera.height_m", "crops[0].growth.Bbch", "crops[0].n", "camera.yaw_deg"]);
        let [height, stage, n, yaw] = all.as_slice() else { panic!("{all:?}") };
        assert_eq!((height.low, height.line), (0.7, 3));
        assert!((height.high - 1.2).abs() < 1e-9 && height.step < 0.01);
        assert_eq!(stage.values, [12.0, 14.0]);
        assert_eq!((n.low, n.high, n.step, n.at), (1.0, 9.0, 1.0, 5.0));
        assert!(!yaw.drawn && yaw.low <= -180.0 && yaw.high >= 180.0, "{yaw:?}");
        let assigned = [Assignment::parse("crops[0]=()").unwrap(), Assignment::parse("camera.yaw_deg=1").unwrap()];
        let paths: Vec<String> = sliders(TEXT, &assigned).into_iter().map(|s| s.path).collect();
        assert_eq!(paths, ["camera.height_m"]);
    }

    /// Rationale: a slider up to twice the value offers fractions above 1, which are refused, and hides most angles. Expected:
    /// fractions and angles have the range of their type; a camera's height, which may be a kilometre, up to twice its value,
    /// without the height 0 that is not allowed.
    #[test]
    fn fixed_numbers_reach_the_limits_of_their_type() {
        let text = "Field(camera: Pinhole(size: (64, 48), intrinsics: FieldOfView(horizontal_deg: 60), \
                    pose: Nadir(height_m: 0.85, yaw_deg: 1.5)), soil: (moisture: (mean: 0.8)))";
        let all = sliders(text, &[]);
        let of = |path: &str| all.iter().find(|s| s.path == path).unwrap_or_else(|| panic!("{path}: {all:?}"));
        let moisture = of("soil.moisture.mean");
        assert_eq!((moisture.low, moisture.high), (0.0, 1.0));
        assert!(of("camera.pose.yaw_deg").high >= 180.0);
        let height = of("camera.pose.height_m");
        assert!(height.low > 0.0 && height.low < 0.02 && height.high == 1.7, "{height:?}");
        let size = of("camera.size[1]");
        assert_eq!((size.low, size.high, size.step), (1.0, 96.0, 1.0));
        // Each number of a tuple has its own limits.
        let lidar = "Field(lidar: (position_m: (2, -3, 1.5)))";
        let lows: Vec<f64> = sliders(lidar, &[]).into_iter().map(|s| s.low).collect();
        assert!(lows[0] < 0.0 && lows[1] < 0.0 && lows[2] > 0.0 && lows[2] < 0.1, "{lows:?}");
    }

    /// Expected: a value of a number in the file is accepted, one of a misspelt path or of an assigned number is an error
    /// that names it.
    #[test]
    fn only_numbers_of_the_file_take_values() {
        let all = sliders(TEXT, &[Assignment::parse("camera.yaw_deg=1").unwrap()]);
        let check = |path: &str| check_paths(&all, &BTreeMap::from([(path.to_owned(), 1.0)]));
        assert!(check("crops[0].n").is_ok() && check_paths(&all, &BTreeMap::new()).is_ok());
        for path in ["crops[1].n", "camera.yaw_deg", "camera.hieght_m"] {
            let shown = check(path).unwrap_err().to_string();
            assert!(shown.contains(&format!("no number `{path}`")), "{shown}");
        }
    }

    /// Expected: distributions with empty bounds have no slider; they are reported when the file is read as a scene.
    #[test]
    fn bounds_that_hold_nothing_have_no_slider() {
        let normal =
            "Field(a: Normal(mean: 3, sd: 1, min: 9, max: 2), b: LogNormal(median: 3, sigma: 1, min: 9, max: 2), c: 2)";
        let paths: Vec<String> = sliders(normal, &[]).into_iter().map(|slider| slider.path).collect();
        assert_eq!(paths, ["c"]);
    }

    /// Expected: only the bytes of one value change; comments, line endings, byte order mark and permissions are kept.
    #[test]
    fn a_value_is_written_and_nothing_else() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("field.ron");
        fs::write(&file, format!("\u{feff}{TEXT}")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        write(&file, "crops[0].n", 3.5, TEXT).unwrap();
        let expected = format!("\u{feff}{}", TEXT.replace("Uniform(1, 9)", "3.5"));
        assert_eq!(fs::read_to_string(&file).unwrap(), expected);
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        // The file has changed meanwhile.
        assert!(write(&file, "crops[0].n", 4.0, TEXT).is_err());
        assert!(write(&file, "nothing", 4.0, &expected[3..]).is_err());
        assert_eq!(fs::read_to_string(&file).unwrap(), expected);
    }
}
