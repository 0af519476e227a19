//! Effect of each training set compared with a reference training set, seed by seed.
//!
//! Two training runs of one network with one seed start from the same weights and take images in the same order. The difference of
//! their scores is due to the training sets with their hyper-parameters, and to chance. The table reports its mean over seeds, its
//! standard deviation (n − 1), and whether the mean exceeds the standard deviation: otherwise the difference may be chance.
//!
//! The table also has the rendering cost, and the image distance from the reference set, which is measured once and stored in `distance/`.

use super::experiment::{Experiment, TrainSet};
use super::seen::{PERCENT, Seen, mean, scale, spread};
use super::sets::BoundExperiment;
use crate::data::Pick;
use crate::figure::{Plot, Thumbnail};
use crate::measure::Report;
use crate::run;
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_compare::{Band, Comparison, Options, Pairs, Region};
use furrow_dataset::Set;
use furrow_dataset::make::timing_log;
use furrow_dataset::model::recipe::{FILE, Rendering};
use furrow_report::chart::Effect;
use furrow_report::{Cell, Table};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Maximum width and height of the part of an image that the report shows, pixels.
const SHOWN: (u32, u32) = (240, 180);

/// Gap between the two images of a pair, pixels.
const GAP: u32 = 4;

/// Maximum number of images per dataset whose distance is measured: the means over them are accurate to a few per cent.
const MEASURED: usize = 20;

/// Introduction of the report page of an experiment with a reference training set.
pub(super) const LEAD: &str = "Effect of each change of the training set: the mean difference over seeds, and the standard deviation of \
                               that difference. A mean within its standard deviation may be chance. Images show the unchanged field on the \
                               left and the changed one on the right.";

/// Returns the indices of the reference training set and of the others; `None` without a reference, or if it was left out.
fn others(experiment: &Experiment) -> Option<(usize, Vec<usize>)> {
    let name = experiment.against.as_ref()?;
    let base = experiment.train.iter().position(|t| t.name == *name)?;
    Some((base, (0..experiment.train.len()).filter(|i| *i != base).collect()))
}

/// Builds the table; returns `None` if the experiment has no reference training set.
pub(super) fn table(bound: &BoundExperiment, seen: &[Seen], out: &Path) -> Result<Option<Table>> {
    let experiment = &bound.experiment;
    let Some((base, others)) = others(experiment) else { return Ok(None) };
    let classes = experiment.plan.classes.names();
    let scores: Vec<(&str, Option<usize>)> = classes
        .iter()
        .enumerate()
        .skip(1)
        .map(|(k, name)| (name.as_str(), Some(k)))
        .chain([("vegetation", None)])
        .collect();
    let name = &experiment.train[base].name;
    let fixed = ["network", "trained on", "core seconds an image"].map(str::to_owned).into_iter();
    let fixed = fixed.chain([format!("times {name}"), "FLIP".into(), "CIEDE2000".into(), "seeds".into()]);
    let heads = experiment.test.iter().flat_map(|test| {
        let three = |name: &str| ["", " ±", " beyond"].map(|what| format!("{} {name}{what}", test.name));
        scores.iter().flat_map(move |(name, _)| three(name))
    });
    let title = format!("Change of I/U against {name} ({})", scale(experiment));
    let mut table = Table::new(title, fixed.chain(heads));
    let costs = experiment.train.iter().map(|train| cost(bound, train)).collect::<Result<Vec<_>>>()?;
    let distances =
        (0..experiment.train.len()).map(|train| known(bound, out, base, train)).collect::<Result<Vec<_>>>()?;
    let mut names: Vec<&str> = seen.iter().map(|s| s.row.learner.name()).collect();
    names.dedup();
    for name in names {
        for &train in &others {
            let pairs: Vec<(&Seen, &Seen)> = seen
                .iter()
                .filter(|s| s.row.train == train && s.row.learner.name() == name)
                .filter_map(|s| Some((s, seen.iter().find(|o| o.row.train == base && o.row.learner == s.row.learner)?)))
                .collect();
            let ratio = costs[train].zip(costs[base]).map(|(cost, base)| cost / base);
            let evaluated = |(a, b): &&(&Seen, &Seen)| a.reports.iter().chain(&b.reports).all(Option::is_some);
            let begin = [
                Cell::text(name),
                Cell::text(&experiment.train[train].name),
                Cell::number(costs[train], 2),
                Cell::number(ratio, 2),
                Cell::number(distances[train].as_ref().map(|d| d.flip), 3),
                Cell::number(distances[train].as_ref().map(|d| d.ciede2000), 2),
                Cell::Count(pairs.iter().filter(evaluated).count().to_u64()),
            ];
            let cells = (0..experiment.test.len()).flat_map(|test| {
                let pairs = &pairs;
                scores.iter().flat_map(move |(_, class)| change(pairs, test, *class))
            });
            table.push(begin.into_iter().chain(cells));
        }
    }
    Ok(Some(table))
}

/// Returns the table as forest plots: one plot per network, test set and class, with the effect of each training set.
pub(super) fn plots(table: &Table) -> Vec<Plot> {
    let word = |cell: &Cell| cell.shown();
    let number = |cell: &Cell| if let Cell::Number(value, _) = cell { *value } else { None };
    let mut networks: Vec<String> = table.rows.iter().map(|row| word(&row[0])).collect();
    networks.dedup();
    let spread_behind = |head: &usize| table.columns.get(head + 1).is_some_and(|next| next.ends_with(" ±"));
    let heads: Vec<usize> = (0..table.columns.len()).filter(spread_behind).collect();
    let mut plots = Vec::new();
    for network in &networks {
        for &head in &heads {
            let rows = table.rows.iter().filter(|row| word(&row[0]) == *network);
            let effect = |row: &Vec<Cell>| {
                Some(Effect { name: word(&row[1]), mean: number(&row[head])?, spread: number(&row[head + 1]) })
            };
            let title = format!("{network}: {}", table.columns[head]);
            plots.push(Plot { title, effects: rows.filter_map(effect).collect() });
        }
    }
    plots
}

/// Returns three cells for a class (or vegetation, if `None`) on a test set: the mean change of I/U over seeds, its standard deviation, and
/// whether the mean exceeds it.
fn change(pairs: &[(&Seen, &Seen)], test: usize, class: Option<usize>) -> [Cell; 3] {
    let iou = |seen: &Seen| {
        let Report { scores, .. } = seen.reports[test].as_ref()?;
        match class {
            Some(class) => scores.classes.get(class)?.iou,
            None => scores.vegetation.iou,
        }
    };
    let all: Vec<f64> = pairs.iter().filter_map(|(changed, base)| Some(iou(changed)? - iou(base)?)).collect();
    let (mean, spread) = (mean(&all), spread(&all));
    let beyond = mean.zip(spread).map_or("–", |(mean, spread)| if mean.abs() > spread { "yes" } else { "no" });
    [Cell::percent(mean, PERCENT), Cell::percent(spread, PERCENT), Cell::text(beyond)]
}

/// Returns the mean core seconds per image of a rendered training set, from its timing log: wall time of the image times its number of
/// threads. Returns `None` if no image was rendered.
fn cost(bound: &BoundExperiment, train: &TrainSet) -> Result<Option<f64>> {
    let Some(part) = train.from.first() else { return Ok(None) };
    let mut last: BTreeMap<u64, f64> = BTreeMap::new();
    for row in timing_log::rows(bound.folder(part.set))?.into_iter().filter(|row| row.draw_s > 0.0) {
        last.insert(row.index, row.seconds * row.threads.to_f64() / row.at_once.max(1).to_f64());
    }
    Ok(mean(&last.into_values().collect::<Vec<_>>()))
}

/// Image distance of a training set from the reference training set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Distance {
    /// Fingerprints of both datasets: reference, then changed.
    of: [String; 2],
    /// Number of image pairs measured.
    images: u64,
    /// Mean FLIP, 0 to 1.
    flip: f64,
    /// Mean CIEDE2000 colour difference ΔE₀₀.
    ciede2000: f64,
}

/// Two rendered datasets of the same fields.
struct DatasetPair {
    folders: [PathBuf; 2],
    prints: [String; 2],
    images: usize,
}

impl DatasetPair {
    /// Opens the first datasets of two training sets. Returns `None` unless both exist and are rendered from the same scene file
    /// with the same seed and size.
    fn of(bound: &BoundExperiment, base: usize, train: usize) -> Result<Option<Self>> {
        let first = |train: usize| bound.experiment.train[train].from.first().map(|part| bound.folder(part.set));
        let (Some(a), Some(b)) = (first(base), first(train)) else { return Ok(None) };
        if a == b || !a.join(FILE).is_file() || !b.join(FILE).is_file() {
            return Ok(None);
        }
        let sets = [Set::open(a)?, Set::open(b)?];
        let [Ok(x), Ok(y)] = [sets[0].recipe.rendering(), sets[1].recipe.rendering()] else { return Ok(None) };
        let same = |r: &Rendering| (r.scene_sha256.clone(), r.seed, r.width, r.height);
        if same(x) != same(y) {
            return Ok(None);
        }
        let images = sets[0].recipe.count.min(sets[1].recipe.count).to_usize();
        let prints = [sets[0].recipe.fingerprint()?, sets[1].recipe.fingerprint()?];
        Ok(Some(Self { folders: [a.into(), b.into()], prints, images: images.min(MEASURED) }))
    }
}

/// Returns the path of the stored distance of a training set.
fn place(bound: &BoundExperiment, out: &Path, train: usize) -> PathBuf {
    out.join("distance").join(format!("{}.json", bound.experiment.train[train].slug))
}

/// Reads the stored distance of a training set; `None` if there is none or it was measured on other datasets.
fn known(bound: &BoundExperiment, out: &Path, base: usize, train: usize) -> Result<Option<Distance>> {
    let path = place(bound, out, train);
    let Some(both) = DatasetPair::of(bound, base, train)?.filter(|_| path.is_file()) else { return Ok(None) };
    let found = run::read_json::<Distance>(&path).ok();
    Ok(found.filter(|d| d.of == both.prints && d.images == both.images.to_u64()))
}

/// Measures and stores the distances that are missing.
pub(super) fn measure(bound: &BoundExperiment, out: &Path) -> Result<()> {
    let Some((base, others)) = others(&bound.experiment) else { return Ok(()) };
    for train in others {
        let Some(both) = DatasetPair::of(bound, base, train)? else { continue };
        if known(bound, out, base, train)?.is_some() {
            continue;
        }
        let [a, b] = &both.folders;
        let mut found = Pairs::find(a, b, None)?;
        found.pairs.truncate(both.images);
        let images = found.pairs.len().to_u64();
        let compared = Comparison::of(found, &Options { shown: 0, ..Options::default() }, &|| ())?;
        let whole = compared.means.iter().find(|m| (m.band, m.region) == (Band::Rgb, Region::All));
        let Some((flip, color)) = whole.and_then(|m| Some((m.flip.as_ref()?.mean, m.ciede2000.as_ref()?.mean))) else {
            continue;
        };
        let distance = Distance { of: both.prints, images, flip, ciede2000: color };
        run::write_json(&place(bound, out, train), &distance)?;
    }
    Ok(())
}

/// Returns, for each training set, the centre of its first image beside that of the reference training set, with the labels of both.
pub(super) fn thumbnails(bound: &BoundExperiment) -> Result<Vec<Thumbnail>> {
    let experiment = &bound.experiment;
    let Some((base, others)) = others(experiment) else { return Ok(Vec::new()) };
    let first = |train: usize| -> Result<Option<(Set, u64)>> {
        let Some(part) = experiment.train[train].from.first() else { return Ok(None) };
        let (set, numbers) = bound.selection(part).open(Pick::All, 0)?;
        Ok(numbers.first().map(|n| (set, *n)))
    };
    let Some((set, number)) = first(base)? else { return Ok(Vec::new()) };
    let left = CentreCrop::of(&set, number)?;
    let mut thumbnails = Vec::new();
    for train in others {
        let Some((set, _)) = first(train)? else { continue };
        if number >= set.recipe.count {
            continue;
        }
        let right = CentreCrop::of(&set, number)?;
        let edit = set.recipe.rendering().ok().map(Rendering::edit).transpose()?;
        if (left.width, left.height) == (right.width, right.height) {
            let about = edit.map(|edit| format!(": {}", edit.about)).unwrap_or_default();
            thumbnails.push(left.beside(&right, format!("{}{about}", experiment.train[train].name)));
        }
    }
    Ok(thumbnails)
}

/// Centre crop of an image, at most [`SHOWN`] pixels.
struct CentreCrop {
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
    labels: Vec<u8>,
}

impl CentreCrop {
    fn of(set: &Set, number: u64) -> Result<Self> {
        let sample = set.sample(number)?;
        let (w, h) = sample.size();
        let (width, height) = (w.min(SHOWN.0), h.min(SHOWN.1));
        let (left, top) = ((w - width) / 2, (h - height) / 2);
        let places = (top..top + height).flat_map(|y| (left..left + width).map(move |x| (y * w + x).to_usize()));
        let (rgb, labels) = places.map(|i| (sample.rgb[i], sample.semantics[i])).unzip();
        Ok(Self { width, height, rgb, labels })
    }

    /// Joins two crops side by side.
    fn beside(&self, right: &Self, name: String) -> Thumbnail {
        Thumbnail {
            name,
            width: 2 * self.width + GAP,
            height: self.height,
            rgb: joined(&self.rgb, &right.rgb, self.width.to_usize(), [255; 3]),
            truth: Vec::new(),
            predictions: vec![joined(&self.labels, &right.labels, self.width.to_usize(), u8::MAX)],
        }
    }
}

/// Joins two maps of the same size side by side, with [`GAP`] columns of `between`.
fn joined<T: Copy>(left: &[T], right: &[T], width: usize, between: T) -> Vec<T> {
    let rows = left.chunks(width).zip(right.chunks(width));
    rows.flat_map(|(l, r)| [l, &[between; GAP as usize], r].concat()).collect()
}
