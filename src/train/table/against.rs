//! What changes do: every training set against one of them, seed by seed.
//!
//! Two trainings of one network with one seed begin with the same weights and meet images in the same order, so the difference of
//! their scores is of what they learnt from, and of chance. The table tells its mean over seeds, its standard deviation (n − 1), and
//! whether the mean is beyond that: a change that is not may be chance.

use super::experiment::{Experiment, TrainSet};
use super::print::{PERCENT, Seen, mean, scale, spread};
use super::sets::Bound;
use crate::Result;
use crate::dataset::recipe::Rendering;
use crate::dataset::{Set, ledger, native};
use crate::train::data::Pick;
use crate::train::figure::Shot;
use crate::train::measure::{Cell, Report, Table};
use std::collections::BTreeMap;
use std::path::Path;

/// Most pixels across and down that a page shows of an image.
const SHOWN: (u32, u32) = (240, 180);

/// Columns between the two halves of a picture.
const GAP: u32 = 4;

/// What the page says of it all.
pub(super) const LEAD: &str = "What each change of what is learnt from does: the mean difference over seeds, and the standard deviation of \
                               that difference. A change that is not beyond it may be chance. Pictures show the unchanged field on the left \
                               and the changed one on the right.";

/// Both training sets, where the page names one to compare with and it was not left out.
fn others(experiment: &Experiment) -> Option<(usize, Vec<usize>)> {
    let name = experiment.against.as_ref()?;
    let base = experiment.train.iter().position(|t| t.name == *name)?;
    Some((base, (0..experiment.train.len()).filter(|i| *i != base).collect()))
}

/// The table; none where the page does not ask for it.
pub(super) fn table(bound: &Bound, seen: &[Seen]) -> Result<Option<Table>> {
    let experiment = &bound.experiment;
    let Some((base, others)) = others(experiment) else { return Ok(None) };
    let classes = experiment.learn.classes.names();
    let scores: Vec<(&str, Option<usize>)> = classes
        .iter()
        .enumerate()
        .skip(1)
        .map(|(k, name)| (name.as_str(), Some(k)))
        .chain([("vegetation", None)])
        .collect();
    let fixed = ["network", "trained on", "core seconds an image", "of the other's", "seeds"].map(str::to_owned);
    let heads = experiment.test.iter().flat_map(|test| {
        let three = |name: &str| ["", " ±", " beyond"].map(|what| format!("{} {name}{what}", test.name));
        scores.iter().flat_map(move |(name, _)| three(name))
    });
    let title = format!("Change of I/U against {} ({})", experiment.train[base].name, scale(experiment));
    let mut table = Table::new(title, fixed.into_iter().chain(heads));
    let costs = experiment.train.iter().map(|train| cost(bound, train)).collect::<Result<Vec<_>>>()?;
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
            let judged = |(a, b): &&(&Seen, &Seen)| a.reports.iter().chain(&b.reports).all(Option::is_some);
            let begin = [
                Cell::text(name),
                Cell::text(&experiment.train[train].name),
                Cell::number(costs[train], 2),
                Cell::number(ratio, 2),
                Cell::Count(pairs.iter().filter(judged).count() as u64),
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

/// Mean change of I/U of a class, or of vegetation, on a test set; its spread; whether it is beyond that.
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

/// Core seconds that the program took for an image of a rendered training set, by its ledger: wall time of the image, times the
/// threads that it had.
fn cost(bound: &Bound, train: &TrainSet) -> Result<Option<f64>> {
    let Some(part) = train.from.first() else { return Ok(None) };
    let mut last: BTreeMap<u64, f64> = BTreeMap::new();
    for row in ledger::rows(bound.folder(part.set))?.into_iter().filter(|row| row.draw_s > 0.0) {
        last.insert(row.index, row.seconds * row.threads as f64 / row.at_once.max(1) as f64);
    }
    Ok(mean(&last.into_values().collect::<Vec<_>>()))
}

/// The middle of one field as each training set has it, beside the same of the one that they are compared with, and the labels of both.
pub(super) fn shots(bound: &Bound) -> Result<Vec<Shot>> {
    let experiment = &bound.experiment;
    let Some((base, others)) = others(experiment) else { return Ok(Vec::new()) };
    let first = |train: usize| -> Result<Option<(Set, u64)>> {
        let Some(part) = experiment.train[train].from.first() else { return Ok(None) };
        let (set, numbers) = bound.selection(part).open(Pick::All, 0)?;
        Ok(numbers.first().map(|n| (set, *n)))
    };
    let Some((set, number)) = first(base)? else { return Ok(Vec::new()) };
    let left = Middle::of(&set.folder, number)?;
    let mut shots = Vec::new();
    for train in others {
        let Some((set, _)) = first(train)? else { continue };
        if number >= set.recipe.count {
            continue;
        }
        let right = Middle::of(&set.folder, number)?;
        let edit = set.recipe.rendering().ok().map(Rendering::edit).transpose()?;
        if (left.width, left.height) == (right.width, right.height) {
            let about = edit.map(|edit| format!(": {}", edit.about)).unwrap_or_default();
            shots.push(left.beside(&right, format!("{}{about}", experiment.train[train].name)));
        }
    }
    Ok(shots)
}

/// The middle of an image.
struct Middle {
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
    labels: Vec<u8>,
}

impl Middle {
    fn of(dataset: &Path, number: u64) -> Result<Self> {
        let sample = native::read(dataset, &Set::name(number))?;
        let (w, h) = sample.size();
        let (width, height) = (w.min(SHOWN.0), h.min(SHOWN.1));
        let (left, top) = ((w - width) / 2, (h - height) / 2);
        let places = (top..top + height).flat_map(|y| (left..left + width).map(move |x| (y * w + x) as usize));
        let (rgb, labels) = places.map(|i| (sample.rgb[i], sample.semantics[i])).unzip();
        Ok(Self { width, height, rgb, labels })
    }

    /// Both in one picture.
    fn beside(&self, right: &Self, name: String) -> Shot {
        Shot {
            name,
            width: 2 * self.width + GAP,
            height: self.height,
            rgb: joined(&self.rgb, &right.rgb, self.width as usize, [255; 3]),
            truth: Vec::new(),
            predictions: vec![joined(&self.labels, &right.labels, self.width as usize, u8::MAX)],
        }
    }
}

/// Two maps side by side.
fn joined<T: Copy>(left: &[T], right: &[T], width: usize, between: T) -> Vec<T> {
    let rows = left.chunks(width).zip(right.chunks(width));
    rows.flat_map(|(l, r)| [l, &[between; GAP as usize], r].concat()).collect()
}
