//! Distances as JSON and CSV for programs, and as text tables.

use super::advice::{Advice, FieldChange};
use super::feature::Pool;
use super::frequency;
use super::sets::{Distance, Gap, Set};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_report::{Cell, Lines, Table, count, number};
use serde::Serialize;
use std::fmt::Write;

#[derive(Serialize)]
struct Document<'a> {
    furrow: &'static str,
    real: SetSummary<'a>,
    synthetic: SetSummary<'a>,
    /// Centre frequencies of the bands of `spectrum`, cycles per pixel.
    frequencies: Vec<f64>,
    distances: Vec<DistanceRow>,
    advice: &'a [Advice],
    warnings: &'a [String],
}

#[derive(Serialize)]
struct SetSummary<'a> {
    name: &'a str,
    images: usize,
    labelled: usize,
    near_infrared: usize,
    /// Ground size of a pixel in millimetres, before sets are downscaled to the same size.
    pixel_mm: Option<f64>,
}

#[derive(Serialize)]
struct DistanceRow {
    key: String,
    unit: &'static str,
    distance: f64,
    halves: Option<f64>,
    /// Also `null` if it is infinite because halves do not differ at all.
    ratio: Option<f64>,
    large: bool,
    real_mean: Vec<f64>,
    synthetic_mean: Vec<f64>,
}

impl<'a> SetSummary<'a> {
    fn of(set: &'a Set, pixel_mm: Option<f64>) -> Self {
        Self {
            name: &set.name,
            images: set.photos.len(),
            labelled: set.photos.iter().filter(|photo| photo.has_labels()).count(),
            near_infrared: set.photos.iter().filter(|photo| photo.has_nir()).count(),
            pixel_mm,
        }
    }
}

fn rows(of: &Gap) -> Vec<DistanceRow> {
    let row = |distance: &Distance| DistanceRow {
        key: distance.feature.key(),
        unit: distance.feature.unit(),
        distance: distance.distance,
        halves: distance.halves,
        ratio: distance.ratio().filter(|ratio| ratio.is_finite()),
        large: distance.is_large(),
        real_mean: means(&of.real, distance),
        synthetic_mean: means(&of.synthetic, distance),
    };
    of.distances.iter().map(row).collect()
}

fn means(set: &Set, distance: &Distance) -> Vec<f64> {
    set.pools.get(&distance.feature).map(Pool::means).unwrap_or_default()
}

/// Returns all results as JSON; missing values are `null`.
pub(super) fn json(of: &Gap) -> Result<String> {
    let document = Document {
        furrow: env!("CARGO_PKG_VERSION"),
        real: SetSummary::of(&of.real, of.pixels.real_mm),
        synthetic: SetSummary::of(&of.synthetic, of.pixels.synthetic_mm),
        frequencies: of.tile.map(frequency::frequencies).unwrap_or_default(),
        distances: rows(of),
        advice: &of.advice(),
        warnings: &of.warnings,
    };
    let text = serde_json::to_string_pretty(&document);
    text.map(|text| text + "\n").map_err(|e| Error::failed(format!("cannot write figures as JSON: {e}")))
}

/// Returns one CSV row for each distance; means of several channels are separated by spaces.
pub(super) fn csv(of: &Gap) -> String {
    let value = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let advice = of.advice();
    let turned = |key: &String| {
        let about = advice.iter().filter(|one| one.features.contains(key));
        about.flat_map(|one| &one.turns).map(FieldChange::words).collect::<Vec<_>>().join("; ")
    };
    let rows = rows(of).into_iter().zip(&of.distances).map(|(row, distance)| {
        let turn = turned(&row.key);
        let (halves, ratio) = (value(row.halves), value(distance.ratio()));
        let (real, synthetic) = (list(&row.real_mean), list(&row.synthetic_mean));
        let [distance, large] = [row.distance.to_string(), row.large.to_string()];
        vec![row.key, row.unit.to_owned(), distance, halves, ratio, large, real, synthetic, turn]
    });
    let heads = ["feature", "unit", "distance", "halves", "ratio", "large", "real_mean", "synthetic_mean", "turn"];
    furrow_report::csv(&heads, rows, Lines::Lf)
}

/// Returns the table, followed by the large distances and the advice.
pub(super) fn text(of: &Gap) -> String {
    let mut table = Table::new("", ["", "distance", "halves", "ratio", "real", "synthetic"]);
    for distance in &of.distances {
        let name = Cell::text(named(distance));
        table.push([name].into_iter().chain(cells(of, distance).into_iter().map(Cell::Shown)));
    }
    let advice = of.advice();
    let mut text = table.markdown() + "\n" + &verdict(of) + "\n";
    if !advice.is_empty() {
        let _ = writeln!(text, "\n{ORDER}");
    }
    for (k, one) in advice.iter().enumerate() {
        let _ = writeln!(text, "{}. {}", k + 1, one.words);
        for turn in &one.turns {
            let _ = writeln!(text, "   {}", turn.words());
        }
    }
    text
}

/// Introduction to the advice.
pub(super) const ORDER: &str = "Fields of the scene file to change, in this order; render and compare again after each, because earlier changes affect later ones:";

/// Returns feature and unit.
pub(super) fn named(distance: &Distance) -> String {
    let (name, unit) = (distance.feature.name(), distance.feature.unit());
    if unit.is_empty() { name } else { format!("{name} [{unit}]") }
}

/// Returns the distance, that of halves, their ratio, and the means of both sets, formatted for display.
pub(super) fn cells(of: &Gap, distance: &Distance) -> Vec<String> {
    let ratio = distance.ratio().map(|ratio| if ratio.is_finite() { number(ratio) } else { "∞".into() });
    let shown = |set: &Set| match set.pools.get(&distance.feature) {
        Some(Pool::Power(_)) | None => "–".into(),
        Some(pool) => pool.means().into_iter().map(tenths).collect::<Vec<_>>().join(" "),
    };
    let halves = distance.halves.map(number);
    let missing = || "–".to_owned();
    vec![
        number(distance.distance),
        halves.unwrap_or_else(missing),
        ratio.unwrap_or_else(missing),
        shown(&of.real),
        shown(&of.synthetic),
    ]
}

/// Formats a mean, with one decimal for large values.
fn tenths(value: f64) -> String {
    let text = if value.abs() < 10.0 { format!("{value:.2}") } else { format!("{value:.1}") };
    text.replace('-', "−")
}

/// Returns a sentence that lists the large distances.
pub(super) fn verdict(of: &Gap) -> String {
    let compared = of.distances.iter().filter(|distance| distance.ratio().is_some()).count().to_u64();
    let mut large: Vec<&Distance> = of.distances.iter().filter(|distance| distance.is_large()).collect();
    large.sort_by(|a, b| b.ratio().unwrap_or(0.0).total_cmp(&a.ratio().unwrap_or(0.0)));
    let names: Vec<String> = large.iter().map(|distance| distance.feature.name()).collect();
    let all = count(compared, "distance", "distances");
    match names.len() {
        0 => format!("None of {all} is more than twice that of two halves of the real set."),
        1 => format!("1 of {all} is more than twice that of two halves of the real set: {}.", names[0]),
        n => format!(
            "{n} of {all} are more than twice those of two halves of the real set, the largest first: {}.",
            names.join("; ")
        ),
    }
}
