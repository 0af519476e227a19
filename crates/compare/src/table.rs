//! Measures as JSON and CSV for programs, and as text tables.

use super::comparison::Comparison;
use super::figures::{Band, Region, RegionFigures};
use super::summary::{Mean, Summary};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_report::{Cell, Lines, Table, count, number};
use serde::Serialize;
use std::fmt::Write;

/// Column headings of the measures.
pub(super) const MEASURES: [&str; 5] = ["MSE", "PSNR, dB", "SSIM", "FLIP", "ΔE₀₀"];

#[derive(Serialize)]
struct Document<'a> {
    furrow: &'static str,
    reference: &'a str,
    test: &'a str,
    pixels_per_degree: f32,
    only_reference: &'a [String],
    only_test: &'a [String],
    means: Vec<Means>,
    pairs: Vec<PairRow<'a>>,
}

#[derive(Serialize)]
struct Means {
    band: Band,
    region: Region,
    pairs: u64,
    mse: MeanInterval,
    psnr_db: Option<MeanInterval>,
    ssim: Option<MeanInterval>,
    flip: Option<MeanInterval>,
    ciede2000: Option<MeanInterval>,
}

#[derive(Serialize)]
struct MeanInterval {
    mean: f64,
    low: Option<f64>,
    high: Option<f64>,
}

#[derive(Serialize)]
struct PairRow<'a> {
    name: &'a str,
    width: u32,
    height: u32,
    figures: Vec<Values>,
}

#[derive(Serialize)]
struct Values {
    band: Band,
    region: Region,
    pixels: u64,
    mse: f64,
    psnr_db: Option<f64>,
    ssim: Option<f64>,
    flip: Option<f64>,
    ciede2000: Option<f64>,
}

/// Returns all results as JSON; `null` is a missing value, or an infinite PSNR.
pub(super) fn json(of: &Comparison) -> Result<String> {
    let bounded =
        |m: Mean| MeanInterval { mean: m.mean, low: m.interval.map(|i| i.low), high: m.interval.map(|i| i.high) };
    let means = of.means.iter().map(|s| Means {
        band: s.band,
        region: s.region,
        pairs: s.pairs,
        mse: bounded(s.mse),
        psnr_db: s.psnr_db().map(bounded),
        ssim: s.ssim.map(bounded),
        flip: s.flip.map(bounded),
        ciede2000: s.ciede2000.map(bounded),
    });
    let values = |row: &RegionFigures| Values {
        band: row.band,
        region: row.region,
        pixels: row.pixels,
        mse: row.mse,
        psnr_db: row.psnr_db(),
        ssim: row.ssim,
        flip: row.flip,
        ciede2000: row.ciede2000,
    };
    let pairs = of.pairs.iter().map(|pair| PairRow {
        name: &pair.name,
        width: pair.width,
        height: pair.height,
        figures: pair.figures.rows.iter().map(values).collect(),
    });
    let document = Document {
        furrow: env!("CARGO_PKG_VERSION"),
        reference: &of.found.a,
        test: &of.found.b,
        pixels_per_degree: of.pixels_per_degree,
        only_reference: &of.found.only_a,
        only_test: &of.found.only_b,
        means: means.collect(),
        pairs: pairs.collect(),
    };
    let text = serde_json::to_string_pretty(&document);
    text.map(|text| text + "\n").map_err(|e| Error::failed(format!("cannot write figures as JSON: {e}")))
}

/// Returns one CSV row for each pair, band and region.
pub(super) fn csv(of: &Comparison) -> String {
    let value = |v: Option<f64>| v.map(|v| v.to_string()).unwrap_or_default();
    let fields = |name: &str, row: &RegionFigures| -> Vec<String> {
        let words = [name, row.band.name(), row.region.name()].map(str::to_owned);
        let psnr = row.psnr_db().unwrap_or(f64::INFINITY);
        let [ssim, flip, color] = [row.ssim, row.flip, row.ciede2000].map(value);
        let numbers = [row.pixels.to_string(), row.mse.to_string(), psnr.to_string(), ssim, flip, color];
        words.into_iter().chain(numbers).collect()
    };
    let rows = of.pairs.iter().flat_map(|pair| pair.figures.rows.iter().map(move |row| (pair, row)));
    let rows = rows.map(|(pair, row)| fields(&pair.name, row));
    let heads = ["name", "band", "region", "pixels", "mse", "psnr_db", "ssim", "flip", "ciede2000"];
    furrow_report::csv(&heads, rows, Lines::Lf)
}

/// Returns the means, and each pair if there are several.
pub(super) fn markdown(of: &Comparison) -> String {
    let name = |name: &str| name.replace('|', "\\|").replace(char::is_control, "·");
    let mut out = format!("# {} against {}\n\n{}\n\n{}", name(&of.found.b), name(&of.found.a), lead(of), means(of));
    if of.pairs.len() > 1 {
        let _ = write!(out, "\nEach pair, all pixels in colour:\n\n{}", each(of).markdown());
    }
    for warning in of.found.warnings() {
        let _ = write!(out, "\nNot compared: {}.\n", name(&warning));
    }
    out
}

/// Returns the measures of every pair for all pixels in colour.
pub(super) fn each(of: &Comparison) -> Table {
    let mut table = Table::new("", ["pair"].into_iter().chain(MEASURES));
    for pair in &of.pairs {
        let name = Cell::text(pair.name.replace(char::is_control, "·"));
        table.push([name].into_iter().chain(cells(pair.figures.all()).into_iter().map(Cell::Shown)));
    }
    table
}

/// Returns a sentence that describes the comparison.
pub(super) fn lead(of: &Comparison) -> String {
    let pairs = count(of.pairs.len().to_u64(), "pair of images", "pairs of images");
    let around = if of.pairs.len() > 1 { "; means over pairs, with 95 % bootstrap intervals" } else { "" };
    format!("{pairs}{around}. FLIP at {} pixels per degree.", number(f64::from(of.pixels_per_degree)))
}

/// Returns the means over pairs as Markdown, with a row for each band and region.
pub(super) fn means(of: &Comparison) -> String {
    let mut table = Table::new("", [""].into_iter().chain(MEASURES));
    for s in &of.means {
        let name = Cell::text(label(s.band, s.region));
        table.push([name].into_iter().chain(mean_cells(s).into_iter().map(Cell::Shown)));
    }
    table.markdown()
}

/// Returns the label of a row.
pub(super) fn label(band: Band, region: Region) -> String {
    match band {
        Band::Rgb => region.name().to_owned(),
        Band::Nir => format!("{}, near infrared", region.name()),
    }
}

/// Returns the formatted measures of a pair, in the order of [`MEASURES`].
pub(super) fn cells(row: &RegionFigures) -> Vec<String> {
    let shown = |(k, value): (usize, Option<f64>)| value.map_or_else(|| missing(k), |v| digits(k, v));
    [Some(row.mse), row.psnr_db(), row.ssim, row.flip, row.ciede2000].into_iter().enumerate().map(shown).collect()
}

/// Returns the formatted means with their intervals.
fn mean_cells(s: &Summary) -> Vec<String> {
    mean_parts(s)
        .into_iter()
        .map(|(mean, bounds)| bounds.map_or_else(|| mean.clone(), |bounds| format!("{mean} ({bounds})")))
        .collect()
}

/// Returns the formatted means and the bounds of their intervals, in the order of [`MEASURES`].
pub(super) fn mean_parts(s: &Summary) -> Vec<(String, Option<String>)> {
    let part = |(k, mean): (usize, Option<Mean>)| match mean {
        Some(m) => (digits(k, m.mean), m.interval.map(|i| format!("{} to {}", digits(k, i.low), digits(k, i.high)))),
        None => (missing(k), None),
    };
    [Some(s.mse), s.psnr_db(), s.ssim, s.flip, s.ciede2000].into_iter().enumerate().map(part).collect()
}

/// Formats a value of the measure number `k` with its meaningful digits.
fn digits(k: usize, value: f64) -> String {
    match k {
        0 => format!("{value:.6}"),
        1 | 4 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}

/// Returns the text for a missing value: for PSNR it is infinite, for other measures it does not exist.
fn missing(k: usize) -> String {
    if k == 1 { "∞".into() } else { "–".into() }
}
