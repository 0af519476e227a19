//! Fits and evaluates baselines on images of datasets, resized to the input size of the networks.

use super::{Baseline, Cut, Example, Kind};
use crate::data::{self, Band, Pick, Selection, Shape, Store};
use crate::measure::{Evaluation, Prediction, Report};
use furrow_base::{Error, Result};
use furrow_dataset::model::classes::Classes;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Returns the input shape of a baseline: RGB at the size of a network's input.
fn shape(like: &Shape) -> Shape {
    Shape { bands: Band::RGB.to_vec(), ..like.clone() }
}

fn open(selections: &[Selection], otherwise: Pick, seed: u64, like: &Shape, with_plants: bool) -> Result<Store> {
    Store::open(selections, otherwise, seed, &Classes::default(), &shape(like), with_plants, 0)
}

fn colours(example: &data::Example) -> Vec<[u8; 3]> {
    let [red, green, blue] = [0, 1, 2].map(|band| &example.planes[band]);
    red.iter().zip(green).zip(blue).map(|((r, g), b)| [*r, *g, *b]).collect()
}

/// Fits a baseline to selected images; a selection without a pick takes all images of its dataset. The images are resized to the width and
/// height of `like`, whose bands are ignored.
pub fn fit(kind: Kind, from: &[Selection], seed: u64, like: &Shape, stop: &AtomicBool) -> Result<Baseline> {
    let store = open(from, Pick::All, seed, like, false)?;
    let (width, height) = (like.width, like.height);
    let image = |place| {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        let example = store.get(place)?;
        Ok(Example { width, height, rgb: colours(&example), truth: example.labels.clone() })
    };
    Baseline::fit(kind, Cut::Fitted, || (0..store.len()).map(image))
}

/// Evaluates a baseline on selected images of a dataset. `seen` is called with each image and its prediction.
pub fn evaluate(
    baseline: &Baseline,
    on: &Selection,
    like: &Shape,
    stop: &AtomicBool,
    seen: &mut dyn FnMut(&data::Example, &[u8]) -> Result<()>,
) -> Result<Report> {
    let store = open(std::slice::from_ref(on), Pick::All, 0, like, true)?;
    let (width, height) = (like.width, like.height);
    let mut evaluation = Evaluation::new(Classes::default().names());
    for place in 0..store.len() {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        let example = store.get(place)?;
        let rgb = colours(&example);
        let begun = Instant::now();
        let predicted = baseline.predict(width, height, &rgb);
        let seconds = Some(begun.elapsed().as_secs_f64());
        let plants = example.plants.iter().any(|p| *p > 0).then_some(example.plants.as_slice());
        let (name, truth) = (example.name.as_str(), example.labels.as_slice());
        evaluation.add(&Prediction {
            name,
            width,
            height,
            truth,
            predicted: &predicted,
            plants,
            separated: None,
            seconds,
        })?;
        seen(&example, &predicted)?;
    }
    Ok(evaluation.finish())
}
